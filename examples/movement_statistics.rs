//! Statistics of random movements: means, rejections by cause and by size, where fragments collide,
//! sensitivity to the contact tolerance, and pictures of moved fragments. It prints the tables of
//! docs/movements.md.
//!
//! `cargo run --release --example movement_statistics -- 1 2 --fragments 15 --movements 20`
//!
//! A specimen is the number of a phantom or a folder that `pao-sim specimen import` wrote.

use clap::Parser;
use pao_sim::anatomy::disk::read_specimen;
use pao_sim::anatomy::phantom::{PhantomParameters, phantom};
use pao_sim::anatomy::{Hip, Label, Side};
use pao_sim::geometry::{Point, PoseError, Rigid};
use pao_sim::random::{Purpose, Stream, stream};
use pao_sim::simulation::{Movement, MovementParameters, MovementRejections, sample_movement};
use pao_sim::surgery::collision::Pair;
use pao_sim::surgery::{
    CollisionModel, Cut, FragmentParameters, FragmentSamplingParameters, NominalCutParameters,
    SurgeryMap, cut_fragment, nominal_cuts, sample_fragment,
};
use pao_sim::volume::Volume;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

#[derive(Parser)]
struct Arguments {
    /// Phantom numbers or specimen folders.
    #[arg(required = true)]
    specimens: Vec<String>,
    /// Random fragments a hip; 0 takes the nominal one.
    #[arg(long, default_value_t = 0)]
    fragments: usize,
    /// Movements a fragment.
    #[arg(long, default_value_t = 20)]
    movements: usize,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for pictures of each hip's first fragment.
    #[arg(long)]
    pictures: Option<PathBuf>,
}

/// One surgery.
struct Body {
    hip: Hip,
    /// `phantom-1/left/f00`.
    key: String,
    model: CollisionModel,
    map: SurgeryMap,
}

/// Tolerances in mm whose effect is shown.
const TOLERANCES_MM: [f64; 4] = [0.0, 0.5, 1.0, 2.0];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut bodies = Vec::new();
    for name in &arguments.specimens {
        let specimen = Arc::new(match name.parse() {
            Ok(number) => phantom(number, &PhantomParameters::default()),
            Err(_) => read_specimen(Path::new(name))?,
        });
        for side in Side::BOTH {
            let hip = Hip::new(specimen.clone(), side)?;
            bodies.extend(surgeries(&hip, &arguments)?);
            if let Some(folder) = &arguments.pictures {
                std::fs::create_dir_all(folder)?;
                let first = bodies.len() - arguments.fragments.max(1);
                draw(&bodies[first], folder, arguments.seed)?;
            }
        }
    }
    println!("\n## All draws\n");
    pair_table(&bodies, &arguments);
    println!("\n## Where rejected fragments overlap the pelvis\n");
    place_table(&bodies, &arguments);
    println!("\n## Accepted movements, by axis\n");
    axis_table(&bodies, &arguments)?;
    println!("\n## Accepted movements\n");
    println!(
        "| fragments | tolerance mm | rotation deg | translation mm | accepted | fragment-pelvis \
         | joined femur-pelvis | femur-pelvis | femur-fragment | containment | ms a draw |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for hip in bodies.chunk_by(|a, b| a.hip.key() == b.hip.key()) {
        accepted_row(&hip[0].hip.key(), hip, 0.5, &arguments)?;
    }
    for tolerance in TOLERANCES_MM {
        accepted_row("all", &bodies, tolerance, &arguments)?;
    }
    Ok(())
}

/// The nominal surgery of a hip, or random ones.
fn surgeries(hip: &Hip, arguments: &Arguments) -> Result<Vec<Body>, Box<dyn Error>> {
    let cuts = nominal_cuts(hip, &NominalCutParameters::default())?;
    let mut bodies = Vec::new();
    for f in 0..arguments.fragments.max(1) {
        let key = format!("{}/f{f:02}", hip.key());
        let map = if arguments.fragments == 0 {
            cut_fragment(hip, &cuts, &FragmentParameters::default())?
        } else {
            let parameters = FragmentSamplingParameters::default();
            sample_fragment(hip, &cuts, &parameters, arguments.seed, &key)?.0
        };
        let start = Instant::now();
        let model = CollisionModel::new(hip, &map.labels, &Default::default())?;
        eprintln!(
            "{key}: fragment of {:.1} cm^3, collision model in {:.1} s",
            map.fragment_cm3(),
            start.elapsed().as_secs_f64()
        );
        bodies.push(Body {
            hip: hip.clone(),
            key,
            model,
            map,
        });
    }
    Ok(bodies)
}

/// How often each pair overlaps, by the rotation angle of the draw, at the default tolerance.
fn pair_table(bodies: &[Body], arguments: &Arguments) {
    println!(
        "| rotation deg | draws | free | fragment-pelvis | joined femur-pelvis | femur-pelvis | femur-fragment |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut bins = [[0usize; 6]; 7];
    for Body {
        hip, key, model, ..
    } in bodies
    {
        let mut stream = draws_of(key, arguments.seed);
        for _ in 0..arguments.movements {
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
    arguments: &Arguments,
) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let (mut rotations, mut translations) = (Vec::new(), Vec::new());
    let mut counts = MovementRejections::default();
    for Body {
        hip, key, model, ..
    } in bodies
    {
        let model = model.with_tolerance(tolerance_mm);
        for m in 0..arguments.movements {
            let key = format!("{key}/m{m:02}");
            let mut stream = stream(arguments.seed, Purpose::Movement, &key);
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
fn place_table(bodies: &[Body], arguments: &Arguments) {
    let mut counts = [0usize; 4];
    for Body {
        hip,
        key,
        model,
        map,
    } in bodies
    {
        let app_from_volume = hip.app_from_volume;
        let grid = &map.labels.grid;
        let fragment: Vec<Point> = (0..map.labels.data.len())
            .filter(|&o| map.labels.data[o] == Label::Fragment.value())
            .map(|o| app_from_volume * grid.center(grid.voxel(o)))
            .collect();
        let mut stream = draws_of(key, arguments.seed);
        for _ in 0..arguments.movements {
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
fn axis_table(bodies: &[Body], arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let (mut accepted, mut drawn) = (vec![Vec::new(); 6], vec![Vec::new(); 6]);
    for Body {
        hip, key, model, ..
    } in bodies
    {
        let s = hip.side.lateral_sign();
        let components = |m: &Movement| {
            let e = PoseError::of(&m.fragment);
            let (r, t) = (e.rotation_axes_deg, e.translation_axes_mm);
            [r.x, s * r.y, -s * r.z, -s * t.x, t.y, t.z]
        };
        let parameters = MovementParameters::default();
        for m in 0..arguments.movements {
            let key = format!("{key}/m{m:02}");
            let mut draws = stream(arguments.seed, Purpose::Movement, &key);
            let (free, _) = sample_movement(model, hip, &parameters, &mut draws)?;
            let any = parameters.draw(
                hip.side,
                &mut stream(arguments.seed, Purpose::Movement, &key),
            );
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
fn draw(body: &Body, folder: &Path, seed: u64) -> Result<(), Box<dyn Error>> {
    let Body {
        hip, model, map, ..
    } = body;
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

fn draws_of(key: &str, seed: u64) -> Stream {
    stream(seed, Purpose::Movement, &format!("{key}/draws"))
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
