//! The AP radiograph of a whole specimen, with landmarks and rims.

use super::SIDES;
use super::painting::Painting;
use crate::anatomy::{Side, Specimen};
use crate::geometry::{Point, Rigid, Vector};
use crate::xray::{AttenuationParameters, BoneVolume, Camera};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

/// A film of usual size at a usual distance.
const COLUMNS: usize = 1100;
const ROWS: usize = 860;
const PIXEL_MM: f64 = 0.5;
const SOURCE_FILM_MM: f64 = 1150.0;
const SOURCE_PATIENT_MM: f64 = 1000.0;

/// Shares of the darkest and brightest pixels that the grey scale leaves out.
const CUT: f64 = 0.002;

/// The patient lies on the back, the source below the table: the film as it is shown to people, the
/// patient's left on the right. Landmarks and rims are drawn by the same camera, left ones green, right
/// ones orange. The patient lies as in the scanner; nothing is turned to the pelvis.
pub fn ap_radiograph(specimen: &Specimen, attenuation: &AttenuationParameters) -> Painting {
    let mut camera = Camera::centered(COLUMNS, PIXEL_MM, SOURCE_FILM_MM);
    camera.height = ROWS;
    camera.principal.y = (ROWS as f64 - 1.0) / 2.0;
    let pose = camera_from_volume(specimen);
    let mu = specimen.ct.map(|hu| attenuation.mu(f32::from(hu)));
    let mut lines = vec![0.0; COLUMNS * ROWS];
    if let Some(body) = BoneVolume::from_attenuation(&mu)
        && let Some(rect) = body.footprint(&camera, &pose)
    {
        body.project_add(&camera, &pose, 1.0, rect, &mut lines);
    }
    let mut painting = grey(&lines);
    for side in Side::BOTH {
        let colour = SIDES[side.index()];
        let rim = specimen.rim(side);
        let closed = rim.iter().chain(rim.first());
        painting.line(closed.map(|p| camera.project(&(pose * p))), colour);
    }
    for (landmark, side, point) in specimen.landmarks.iter() {
        let at = camera.project(&(pose * point));
        let colour = SIDES[side.index()];
        painting.cross(&at, 5, colour);
        // Away from the midline, where left and right landmarks lie beside each other.
        let key = landmark.key(side);
        let beside = match side {
            Side::Left => 6.0,
            Side::Right => -8.5 * key.len() as f64 - 4.0,
        };
        painting.words(
            &(at + nalgebra::Vector2::new(beside, -14.0)),
            &key,
            13,
            colour,
        );
    }
    let corner = |x: f64| crate::geometry::Pixel::new(x, 8.0);
    let source = &specimen.source;
    let density = match source.assigned_density {
        true => "density assigned by rule",
        false => "density of the scanner",
    };
    let title = format!(
        "{} ({}, {}), AP, {density}",
        specimen.name, source.kind, source.sex
    );
    painting.words(&corner(8.0), &title, 15, [255; 3]);
    painting.words(&corner(COLUMNS as f64 - 24.0), "L", 18, [255; 3]);
    painting
}

/// The CT's middle on the central ray, half a metre and more from the source.
fn camera_from_volume(specimen: &Specimen) -> Rigid {
    let grid = &specimen.ct.grid;
    let [i, j, k] = grid.dims.map(|n| (n as f64 - 1.0) / 2.0);
    let middle: Point = grid.point(i, j, k);
    // Rows: to the patient's left, to the feet, to the back.
    let rows = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
    let at = -(rotation * middle.coords) - Vector::z() * SOURCE_PATIENT_MM;
    Rigid::from_parts(Translation3::from(at), rotation)
}

fn grey(lines: &[f32]) -> Painting {
    let mut sorted: Vec<f32> = lines.iter().copied().filter(|v| *v > 0.0).collect();
    sorted.sort_by(f32::total_cmp);
    let cut = (sorted.len() as f64 * CUT) as usize;
    let (low, high) = match sorted.len() {
        0 => (0.0, 1.0),
        n => (sorted[cut], sorted[n - 1 - cut]),
    };
    let mut painting = Painting::new(COLUMNS, ROWS);
    for (n, line) in lines.iter().enumerate() {
        let value = (255.0 * ((line - low) / (high - low).max(1e-6)).clamp(0.0, 1.0)) as u8;
        painting.set(n % COLUMNS, n / COLUMNS, [value; 3]);
    }
    painting
}
