//! How near the femur lies to the ischium, and where the two meet when the femur turns with the fragment.

use pao_sim::anatomy::{Hip, Label};
use pao_sim::geometry::{Point, Vector};
use pao_sim::random::{Purpose, stream};
use pao_sim::simulation::MovementParameters;
use pao_sim::surgery::collision::{CollisionModel, CollisionParameters, Pair};
use pao_sim::surgery::{FragmentParameters, NominalCutParameters, cut_fragment, nominal_cuts};
use pao_sim::volume::{Surface, SurfaceParameters, morphology};
use std::error::Error;

/// Femur below this height is looked at, in mm above the head's centre: trochanters and shaft.
const BELOW_MM: f64 = -30.0;
/// Draws that are made, and joined overlaps that are enough.
const DRAWS: usize = 400;
const ENOUGH: usize = 12;

/// One row: the gap at rest between the opened bones, and, for draws in which only the femur
/// overlaps, the mean place of the overlap on the pelvis and on the femur (lateral, up, forward of the
/// head in mm). The cuts are the nominal ones.
pub fn row(
    hip: &Hip,
    collision: &CollisionParameters,
    seed: u64,
) -> Result<String, Box<dyn Error>> {
    let cuts = nominal_cuts(hip, &NominalCutParameters::default())?;
    let map = cut_fragment(hip, &cuts, &FragmentParameters::default())?;
    let model = CollisionModel::new(hip, &map.labels, collision)?;
    let opened = |label: Label| {
        let mask = map.labels.map(|v| v == label.value());
        morphology::open(&mask, collision.opening_radius_mm)
    };
    let (pelvis, femur) = (opened(Label::Pelvis), opened(Label::femur(hip.side)));
    let surface = |mask| {
        let surface = Surface::from_mask(mask, |v| v, &SurfaceParameters::default());
        surface.transformed(&hip.app_from_volume)
    };
    let pelvis_surface = surface(&pelvis);
    let gap_mm = surface(&femur)
        .vertices()
        .iter()
        .filter(|p| p.y < BELOW_MM)
        .filter_map(|p| Some((pelvis_surface.closest_point(p)?.0 - p).norm()))
        .fold(f64::INFINITY, f64::min);

    let grid = &map.labels.grid;
    let pelvis: Vec<Point> = (0..grid.len())
        .filter(|&o| pelvis.data[o])
        .map(|o| hip.app_from_volume * grid.center(grid.voxel(o)))
        .collect();
    let volume_from_app = hip.app_from_volume.inverse();
    let mut stream = stream(seed, Purpose::Movement, &format!("{}/femur", hip.key()));
    let (mut draws, mut found) = (0, 0);
    let (mut on_pelvis, mut on_femur) = (Vector::zeros(), Vector::zeros());
    while draws < DRAWS && found < ENOUGH {
        draws += 1;
        let m = MovementParameters::default().draw(hip.side, &mut stream);
        let overlaps = |pair| model.contact(pair, &m.fragment, &m.femur).is_some();
        if overlaps(Pair::FragmentPelvis) || !overlaps(Pair::JoinedFemurPelvis) {
            continue;
        }
        let back = m.fragment.inverse();
        let inside: Vec<&Point> = pelvis
            .iter()
            .filter(|p| femur.nearest(&(volume_from_app * (back * *p))) == Some(true))
            .collect();
        if inside.is_empty() {
            continue;
        }
        found += 1;
        let n = inside.len() as f64;
        on_pelvis += inside.iter().map(|p| p.coords).sum::<Vector>() / n;
        on_femur += inside.iter().map(|p| (back * *p).coords).sum::<Vector>() / n;
    }
    let place = |sum: Vector| {
        let p = sum / found as f64;
        let lateral = p.x * hip.side.lateral_sign();
        format!("{lateral:.0}, {:.0}, {:.0}", p.y, p.z)
    };
    let places = match found {
        0 => format!("none in {draws} draws | "),
        _ => format!("{} | {}", place(on_pelvis), place(on_femur)),
    };
    Ok(format!("| {} | {gap_mm:.1} | {places} |", hip.key()))
}
