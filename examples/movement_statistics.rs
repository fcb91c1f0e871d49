//! Statistics of random movements on phantom hips, with the nominal cuts: means, rejections by
//! cause, sensitivity to the contact tolerance, and pictures of moved fragments.
//!
//! `cargo run --release --example movement_statistics -- [MOVEMENTS] [PHANTOMS] [PICTURE_FOLDER]`
//! prints the tables of docs/movements.md (defaults: 300 movements a hip, 2 phantoms, no picture).

use pao_sim::anatomy::phantom::{PhantomParameters, phantom};
use pao_sim::anatomy::{Hip, Label, Side};
use pao_sim::geometry::{Point, PoseError, Rigid};
use pao_sim::random::{Purpose, stream};
use pao_sim::simulation::{Movement, MovementParameters, MovementRejections, sample_movement};
use pao_sim::surgery::collision::Pair;
use pao_sim::surgery::{
    CollisionModel, Cut, FragmentParameters, NominalCutParameters, SurgeryMap, cut_fragment,
    nominal_cuts,
};
use pao_sim::volume::Volume;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// A hip with its nominal surgery.
struct Body {
    hip: Hip,
    model: CollisionModel,
    map: SurgeryMap,
}

/// Tolerances in mm whose effect is shown; the second is the default.
const TOLERANCES_MM: [f64; 4] = [0.0, 0.5, 1.0, 2.0];
const SEED: u64 = 1;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let movements: usize = arguments.next().map_or(Ok(300), |a| a.parse())?;
    let phantoms: u32 = arguments.next().map_or(Ok(2), |a| a.parse())?;
    let pictures = arguments.next().map(PathBuf::from);

    let mut bodies = Vec::new();
    for number in 1..=phantoms {
        let specimen = Arc::new(phantom(number, &PhantomParameters::default()));
        for side in Side::BOTH {
            let hip = Hip::new(specimen.clone(), side)?;
            let cuts = nominal_cuts(&hip, &NominalCutParameters::default())?;
            let map = cut_fragment(&hip, &cuts, &FragmentParameters::default())?;
            let start = Instant::now();
            let model = CollisionModel::new(&hip, &map.labels, &Default::default())?;
            println!(
                "{}: fragment {:.1} cm^3, collision model in {:.1} s",
                hip.key(),
                map.fragment_cm3(),
                start.elapsed().as_secs_f64()
            );
            if let Some(folder) = &pictures {
                std::fs::create_dir_all(folder)?;
                draw(&hip, &map.labels, &model, folder)?;
            }
            bodies.push(Body { hip, model, map });
        }
    }

    println!("\n## All draws\n");
    pair_table(&bodies, movements);
    println!("\n## Where rejected fragments overlap the pelvis\n");
    place_table(&bodies, movements);
    println!("\n## Accepted movements, by axis\n");
    axis_table(&bodies, movements)?;
    println!("\n## Accepted movements\n");
    println!(
        "| hips | tolerance mm | rotation deg | translation mm | accepted | fragment-pelvis | joined femur-pelvis | femur-pelvis | femur-fragment | containment | ms a draw |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for body in &bodies {
        accepted_row(&body.hip.key(), std::slice::from_ref(body), 0.5, movements)?;
    }
    for tolerance in TOLERANCES_MM {
        accepted_row("all", &bodies, tolerance, movements)?;
    }
    Ok(())
}

/// How often each pair overlaps, by the rotation angle of the draw, at the default tolerance.
fn pair_table(bodies: &[Body], draws: usize) {
    println!(
        "| rotation deg | draws | free | fragment-pelvis | joined femur-pelvis | femur-pelvis | femur-fragment |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut bins = [[0usize; 6]; 7];
    for Body { hip, model, .. } in bodies {
        let mut stream = stream(SEED, Purpose::Movement, &format!("{}/draws", hip.key()));
        for _ in 0..draws {
            let m = MovementParameters::default().draw(hip.side, &mut stream);
            let bin = (PoseError::of(&m.fragment).rotation_deg / 5.0) as usize;
            let hits = Pair::ALL.map(|p| model.contact(p, &m.fragment, &m.femur).is_some());
            bins[bin][0] += 1;
            bins[bin][1] += usize::from(!hits.contains(&true));
            for (count, hit) in bins[bin][2..].iter_mut().zip(hits) {
                *count += usize::from(hit);
            }
        }
    }
    for (i, [n, rest @ ..]) in bins.iter().enumerate() {
        if *n > 0 {
            let share = rest.map(|c| format!("{:.0} %", 100.0 * c as f64 / *n as f64));
            println!("| {}-{} | {n} | {} |", 5 * i, 5 * i + 5, share.join(" | "));
        }
    }
}

fn accepted_row(
    name: &str,
    bodies: &[Body],
    tolerance_mm: f64,
    movements: usize,
) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let (mut rotations, mut translations) = (Vec::new(), Vec::new());
    let mut counts = MovementRejections::default();
    for Body { hip, model, .. } in bodies {
        let model = model.with_tolerance(tolerance_mm);
        for m in 0..movements {
            let mut stream = stream(
                SEED,
                Purpose::Movement,
                &format!("{}/f00/m{m:02}", hip.key()),
            );
            let (movement, rejected) =
                sample_movement(&model, hip, &MovementParameters::default(), &mut stream)?;
            let size = PoseError::of(&movement.fragment);
            rotations.push(size.rotation_deg);
            translations.push(size.translation_mm);
            counts.fragment_pelvis += rejected.fragment_pelvis;
            counts.joined_femur_pelvis += rejected.joined_femur_pelvis;
            counts.femur_pelvis += rejected.femur_pelvis;
            counts.femur_fragment += rejected.femur_fragment;
            counts.containment += rejected.containment;
        }
    }
    let accepted = rotations.len() as f64;
    let draws = accepted + f64::from(counts.total());
    let share = |count: u32| format!("{:.1} %", 100.0 * f64::from(count) / draws);
    println!(
        "| {name} | {tolerance_mm} | {} | {} | {:.1} % | {} | {} | {} | {} | {} | {:.1} |",
        mean_and_sd(&rotations),
        mean_and_sd(&translations),
        100.0 * accepted / draws,
        share(counts.fragment_pelvis),
        share(counts.joined_femur_pelvis),
        share(counts.femur_pelvis),
        share(counts.femur_fragment),
        share(counts.containment),
        1000.0 * start.elapsed().as_secs_f64() / draws,
    );
    Ok(())
}

/// For draws whose fragment overlaps the pelvis: the cut next to which most of its voxels lie in
/// the pelvis. These are the labels as they are, not opened.
fn place_table(bodies: &[Body], draws: usize) {
    let mut counts = [0usize; 4];
    for Body { hip, model, map } in bodies {
        let app_from_volume = hip.app_from_volume;
        let grid = &map.labels.grid;
        let fragment: Vec<Point> = (0..map.labels.data.len())
            .filter(|&o| map.labels.data[o] == Label::Fragment.value())
            .map(|o| app_from_volume * grid.center(grid.voxel(o)))
            .collect();
        let mut stream = stream(SEED, Purpose::Movement, &format!("{}/draws", hip.key()));
        for _ in 0..draws {
            let m = MovementParameters::default().draw(hip.side, &mut stream);
            if model
                .contact(Pair::FragmentPelvis, &m.fragment, &m.femur)
                .is_none()
            {
                continue;
            }
            let mut near = [0usize; 4];
            for p in &fragment {
                let moved = app_from_volume.inverse() * (m.fragment * p);
                if map.labels.nearest(&moved) == Some(Label::Pelvis.value()) {
                    let distance = Cut::ALL.map(|c| map.cuts.get(c).signed_distance(p).abs());
                    let closest = (0..4).min_by(|&a, &b| distance[a].total_cmp(&distance[b]));
                    near[closest.expect("there are four cuts")] += 1;
                }
            }
            let most = (0..4)
                .max_by_key(|&c| near[c])
                .expect("there are four cuts");
            counts[most] += 1;
        }
    }
    let total: usize = counts.iter().sum();
    println!("| cut | share of rejected fragments |");
    println!("|---|---|");
    for (cut, count) in Cut::ALL.iter().zip(counts) {
        println!(
            "| {} | {:.0} % |",
            cut.name(),
            100.0 * count as f64 / total as f64
        );
    }
}

/// Means and SDs of the drawn quantities, all and accepted, with the signs of Table S-5.
fn axis_table(bodies: &[Body], movements: usize) -> Result<(), Box<dyn Error>> {
    let (mut accepted, mut drawn) = (vec![Vec::new(); 6], vec![Vec::new(); 6]);
    for Body { hip, model, .. } in bodies {
        let s = hip.side.lateral_sign();
        let components = |m: &Movement| {
            let e = PoseError::of(&m.fragment);
            let (r, t) = (e.rotation_axes_deg, e.translation_axes_mm);
            [r.x, s * r.y, -s * r.z, -s * t.x, t.y, t.z]
        };
        let parameters = MovementParameters::default();
        for m in 0..movements {
            let key = format!("{}/f00/m{m:02}", hip.key());
            let mut draws = stream(SEED, Purpose::Movement, &key);
            let (free, _) = sample_movement(model, hip, &parameters, &mut draws)?;
            let any = parameters.draw(hip.side, &mut stream(SEED, Purpose::Movement, &key));
            for i in 0..6 {
                accepted[i].push(components(&free)[i]);
                drawn[i].push(components(&any)[i]);
            }
        }
    }
    println!("| quantity | drawn | accepted |");
    println!("|---|---|---|");
    let names = [
        "LR deg",
        "IS deg",
        "AP deg",
        "medial mm",
        "superior mm",
        "anterior mm",
    ];
    for (i, name) in names.iter().enumerate() {
        println!(
            "| {name} | {} | {} |",
            mean_and_sd(&drawn[i]),
            mean_and_sd(&accepted[i])
        );
    }
    Ok(())
}

fn mean_and_sd(values: &[f64]) -> String {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    format!("{mean:.2} ± {:.2}", variance.sqrt())
}

/// Coronal, sagittal and axial slices through the head, before a movement, after the first
/// accepted one, and after the first draw in which a pair overlaps, for each pair.
fn draw(
    hip: &Hip,
    labels: &Volume<u8>,
    model: &CollisionModel,
    folder: &Path,
) -> Result<(), Box<dyn Error>> {
    let name = hip.key().replace('/', "-");
    picture(
        hip,
        labels,
        &Movement::identity(),
        &folder.join(format!("{name}-rest.png")),
    )?;
    let parameters = MovementParameters::default();
    let mut draws = stream(SEED, Purpose::Movement, &format!("{}/picture", hip.key()));
    let (free, _) = sample_movement(model, hip, &parameters, &mut draws)?;
    picture(
        hip,
        labels,
        &free,
        &folder.join(format!("{name}-moved.png")),
    )?;
    for pair in Pair::ALL {
        for _ in 0..500 {
            let m = parameters.draw(hip.side, &mut draws);
            if model.contact(pair, &m.fragment, &m.femur).is_some() {
                let path = folder.join(format!("{name}-{pair:?}.png"));
                println!("{}: {:?}", path.display(), PoseError::of(&m.fragment));
                picture(hip, labels, &m, &path)?;
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
