//! Slices through a hip at rest, moved, and overlapping.

use pao_sim::anatomy::{Hip, Label};
use pao_sim::geometry::{Point, PoseError, Rigid};
use pao_sim::random::{Purpose, stream};
use pao_sim::simulation::{Movement, MovementParameters, sample_movement};
use pao_sim::surgery::collision::Pair;
use pao_sim::surgery::{CollisionModel, SurgeryMap};
use pao_sim::volume::Volume;
use std::error::Error;
use std::path::Path;

/// Coronal, sagittal and axial slices through the head, before a movement, after the first
/// accepted one, and after the first draw in which a pair overlaps, for each pair.
pub fn draw(
    hip: &Hip,
    model: &CollisionModel,
    map: &SurgeryMap,
    folder: &Path,
    seed: u64,
) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let name = hip.key().replace('/', "-");
    let file = |what: &str| folder.join(format!("{name}-{what}.png"));
    picture(hip, &map.labels, &Movement::identity(), &file("rest"))?;
    let parameters = MovementParameters::default();
    let mut draws = stream(seed, Purpose::Movement, &format!("{name}/picture"));
    let (free, _) = sample_movement(model, hip, &parameters, &mut draws)?;
    picture(hip, &map.labels, &free, &file("moved"))?;
    for pair in Pair::ALL {
        for _ in 0..500 {
            let m = parameters.draw(hip.side, &mut draws);
            if model.contact(pair, &m.fragment, &m.femur).is_some() {
                let path = file(&format!("{pair:?}"));
                eprintln!("{}: {:?}", path.display(), PoseError::of(&m.fragment));
                picture(hip, &map.labels, &m, &path)?;
                break;
            }
        }
    }
    Ok(())
}

/// Half the edge of a slice in mm, and pixels per mm.
const HALF_MM: f64 = 100.0;
const PIXELS_PER_MM: f64 = 3.0;

fn picture(
    hip: &Hip,
    labels: &Volume<u8>,
    movement: &Movement,
    path: &Path,
) -> Result<(), Box<dyn Error>> {
    let n = (2.0 * HALF_MM * PIXELS_PER_MM) as usize;
    let volume_from_app = hip.app_from_volume.inverse();
    let fragment_back = movement.fragment.inverse();
    let femur_back = movement.femur.inverse();
    let is = |label: Label, back: &Rigid, p: &Point| {
        labels.nearest(&(volume_from_app * (back * p))) == Some(label.value())
    };
    let slices: [fn(f64, f64) -> Point; 4] = [
        |a, b| Point::new(a, b, 0.0),
        |a, b| Point::new(a, b, -20.0),
        |a, b| Point::new(0.0, b, a),
        |a, b| Point::new(a, 0.0, b),
    ];
    let mut pixels = vec![0u8; 4 * n * n * 3];
    for (s, slice) in slices.iter().enumerate() {
        for row in 0..n {
            for column in 0..n {
                // Patient's left on the viewer's right, superior (or anterior) up.
                let mm = |i: usize| (i as f64 + 0.5) / PIXELS_PER_MM - HALF_MM;
                let p = slice(mm(column), -mm(row));
                let still = Rigid::identity();
                let pelvis = is(Label::Pelvis, &still, &p);
                let fragment = is(Label::Fragment, &fragment_back, &p);
                let femur = is(Label::femur(hip.side), &femur_back, &p);
                let color = match (pelvis, fragment, femur) {
                    (false, false, false) => [0, 0, 0],
                    (true, false, false) => [110, 110, 110],
                    (false, true, false) => [60, 130, 230],
                    (false, false, true) => [70, 160, 80],
                    _ => [255, 60, 40],
                };
                let at = (row * 4 * n + s * n + column) * 3;
                pixels[at..at + 3].copy_from_slice(&color);
            }
        }
    }
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, (4 * n) as u32, n as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(())
}
