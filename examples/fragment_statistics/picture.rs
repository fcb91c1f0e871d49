//! Pictures of a hip's fragment: shaded surfaces seen from four directions.

use pao_sim::anatomy::{Hip, Label};
use pao_sim::geometry::{Point, Vector};
use pao_sim::surgery::SurgeryMap;
use pao_sim::volume::{Surface, SurfaceParameters};
use std::error::Error;
use std::path::Path;

/// Half the edge of a panel in mm, and pixels per mm.
const HALF_MM: f64 = 110.0;
const PIXELS_PER_MM: f64 = 2.5;
/// Where the panels' centre lies, in mm above the femoral head.
const UP_MM: f64 = 20.0;

/// Writes `<hip>-<what>.png`: from the front, from lateral, from medial and from behind. Bone
/// beyond the midline is left out, as are the femora.
pub fn draw(hip: &Hip, map: &SurgeryMap, folder: &Path, what: &str) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let bodies = [
        (Label::Pelvis, [205.0, 200.0, 185.0]),
        (Label::Fragment, [90.0, 150.0, 240.0]),
    ];
    let surfaces = bodies.map(|(label, color)| {
        let parameters = SurfaceParameters::default();
        let surface = Surface::from_mask(&map.labels, |v| v == label.value(), &parameters);
        (surface.transformed(&hip.app_from_volume), color)
    });
    let lateral = hip.lateral();
    // (towards the viewer, to the right of the picture)
    let views = [
        (Vector::z(), Vector::x()),
        (lateral, -lateral.cross(&Vector::y())),
        (-lateral, lateral.cross(&Vector::y())),
        (-Vector::z(), -Vector::x()),
    ];
    let n = (2.0 * HALF_MM * PIXELS_PER_MM) as usize;
    let mut pixels = vec![0u8; views.len() * n * n * 3];
    for (panel, (viewer, right)) in views.iter().enumerate() {
        let mut depth = vec![f64::NEG_INFINITY; n * n];
        for (surface, color) in &surfaces {
            for triangle in 0..surface.triangles().len() {
                let corners = surface.corners(triangle);
                if corners[0].coords.dot(&lateral) < -85.0 {
                    continue;
                }
                let light = surface.triangle_normal(triangle).dot(viewer);
                if light <= 0.0 {
                    continue;
                }
                let flat = corners.map(|p| to_panel(&p, right, viewer));
                let shade = color.map(|c: f64| (c * (0.25 + 0.75 * light)) as u8);
                fill(&flat, n, &mut depth, |x, y| {
                    let at = (y * views.len() * n + panel * n + x) * 3;
                    pixels[at..at + 3].copy_from_slice(&shade);
                });
            }
        }
    }
    let name = format!("{}-{what}.png", hip.key().replace('/', "-"));
    let file = std::io::BufWriter::new(std::fs::File::create(folder.join(name))?);
    let mut encoder = png::Encoder::new(file, (views.len() * n) as u32, n as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(())
}

/// Column, row and nearness to the viewer.
fn to_panel(p: &Point, right: &Vector, viewer: &Vector) -> Vector {
    let column = (p.coords.dot(right) + HALF_MM) * PIXELS_PER_MM;
    let row = (HALF_MM - (p.y - UP_MM)) * PIXELS_PER_MM;
    Vector::new(column, row, p.coords.dot(viewer))
}

/// Calls `paint(column, row)` for the pixels of a triangle that are nearer than what is there.
fn fill(corners: &[Vector; 3], n: usize, depth: &mut [f64], mut paint: impl FnMut(usize, usize)) {
    let [a, b, c] = corners;
    let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if area == 0.0 {
        return;
    }
    let range = |axis: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
        let high = a[axis].max(b[axis]).max(c[axis]).ceil();
        low..(high.clamp(-1.0, n as f64 - 1.0) + 1.0) as usize
    };
    for y in range(1) {
        for x in range(0) {
            let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
            let u = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) / area;
            let v = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) / area;
            let w = 1.0 - u - v;
            let near = u * a.z + v * b.z + w * c.z;
            if u >= 0.0 && v >= 0.0 && w >= 0.0 && near > depth[y * n + x] {
                depth[y * n + x] = near;
                paint(x, y);
            }
        }
    }
}
