//! Fluoroscopy with what people look for drawn into it.

use crate::geometry::{Pixel, Rigid};
use crate::image::Image;
use crate::xray::{BoneVolume, Camera};
use std::path::Path;

/// Red, green and blue.
pub type Colour = [u8; 3];

/// A radiograph in grey with coloured drawings. Positions are those of the full image.
#[derive(Clone, Debug)]
pub struct Picture {
    width: usize,
    height: usize,
    /// Camera of the picture's pixels.
    camera: Camera,
    /// Pixels of the full image a picture's pixel stands for.
    reduction: usize,
    rgb: Vec<Colour>,
}

/// The least line integral that counts as bone in an outline: less than a millimetre of it.
const THINNEST: f32 = 0.02;

/// The position in a picture of a position in the full image, where each pixel of the picture is
/// the mean of a block.
fn reduced(position: f64, reduction: usize) -> f64 {
    (position + 0.5) / reduction as f64 - 0.5
}

/// A picture that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the picture {}: {cause}", path.display())]
pub struct PictureError {
    path: std::path::PathBuf,
    #[source]
    cause: png::EncodingError,
}

impl Picture {
    /// Photon counts as a radiograph: dense is bright, from the brightest to the darkest 0.5 %.
    /// Each pixel is the mean of `reduction` x `reduction` counts.
    ///
    /// # Panics
    /// When `reduction` is 0.
    pub fn of_counts(counts: &Image<u16>, camera: &Camera, reduction: usize) -> Self {
        let (width, height) = (counts.width / reduction, counts.height / reduction);
        let mut lines = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sum = 0.0;
                for row in 0..reduction {
                    let first = x * reduction;
                    let row = &counts.row(y * reduction + row)[first..first + reduction];
                    sum += row.iter().map(|&count| f64::from(count)).sum::<f64>();
                }
                let mean = sum / (reduction * reduction) as f64;
                lines.push(-mean.max(0.5).ln());
            }
        }
        let mut sorted = lines.clone();
        sorted.sort_by(f64::total_cmp);
        let cut = sorted.len() / 200;
        let (low, high) = (sorted[cut], sorted[sorted.len() - 1 - cut]);
        let grey =
            |line: f64| (255.0 * ((line - low) / (high - low).max(1e-9)).clamp(0.0, 1.0)) as u8;
        Self {
            width,
            height,
            camera: Camera {
                width,
                height,
                pixel_mm: camera.pixel_mm * reduction as f64,
                principal: camera.principal.map(|v| reduced(v, reduction)),
                ..*camera
            },
            reduction,
            rgb: lines.into_iter().map(|line| [grey(line); 3]).collect(),
        }
    }

    /// Draws the silhouette of a bone: the border of the pixels whose ray meets it.
    pub fn outline(&mut self, bone: &BoneVolume, camera_from_volume: &Rigid, colour: Colour) {
        let Some(rect) = bone.footprint(&self.camera, camera_from_volume) else {
            return;
        };
        let (width, height) = (self.width, self.height);
        let mut lines = vec![0.0; width * height];
        bone.project_add(&self.camera, camera_from_volume, 1.0, rect, &mut lines);
        let met = |x: usize, y: usize| lines[y * width + x] > THINNEST;
        for y in rect.y0.max(1)..rect.y1.min(height - 1) {
            for x in rect.x0.max(1)..rect.x1.min(width - 1) {
                let inside = met(x - 1, y) && met(x + 1, y) && met(x, y - 1) && met(x, y + 1);
                if met(x, y) && !inside {
                    self.set(x as i64, y as i64, colour);
                }
            }
        }
    }

    /// Draws a cross, its arms `arm` pixels of the picture long.
    pub fn cross(&mut self, at: &Pixel, arm: i64, colour: Colour) {
        let (x, y) = self.place(at);
        for step in -arm..=arm {
            self.set(x + step, y, colour);
            self.set(x, y + step, colour);
        }
    }

    /// Draws one pixel.
    pub fn dot(&mut self, at: &Pixel, colour: Colour) {
        let (x, y) = self.place(at);
        self.set(x, y, colour);
    }

    /// The same picture turned by 180 degrees.
    pub fn turned(mut self) -> Self {
        self.rgb.reverse();
        self
    }

    /// Writes it as PNG.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), PictureError> {
        write_png(path, self.width, self.height, &self.rgb)
    }

    fn place(&self, at: &Pixel) -> (i64, i64) {
        let scaled = at.map(|v| reduced(v, self.reduction).round() as i64);
        (scaled.x, scaled.y)
    }

    fn set(&mut self, x: i64, y: i64, colour: Colour) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            self.rgb[y as usize * self.width + x as usize] = colour;
        }
    }
}

/// Writes pixels, row by row, as PNG.
pub(super) fn write_png(
    path: &Path,
    width: usize,
    height: usize,
    rgb: &[Colour],
) -> Result<(), PictureError> {
    let write = || -> Result<(), png::EncodingError> {
        let file = std::io::BufWriter::new(std::fs::File::create(path)?);
        let mut encoder = png::Encoder::new(file, width as u32, height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header()?.write_image_data(rgb.as_flattened())
    };
    write().map_err(|cause| PictureError {
        path: path.to_owned(),
        cause,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::volume::{Grid, Volume};

    /// A ball of bone's outline is the circle that its image must be, in a picture of half size.
    #[test]
    fn outline_and_cross_lie_where_the_camera_puts_them() {
        let camera = Camera::centered(256, 1.2, 1000.0);
        let grid = Grid::axis_aligned([41; 3], 1.0, Point::new(-20.0, -20.0, -20.0));
        let attenuation = |offset: usize| {
            let radius = grid.center(grid.voxel(offset)).coords.norm();
            if radius < 15.0 { 0.05f32 } else { 0.0 }
        };
        let ball = Volume::new(grid.clone(), (0..grid.len()).map(attenuation).collect());
        let bone = BoneVolume::from_attenuation(&ball).unwrap();
        let pose = Rigid::translation(10.0, -25.0, -800.0);
        let counts = Image::filled(256, 256, 1000u16);
        let mut picture = Picture::of_counts(&counts, &camera, 2);
        let red = [255, 0, 0];
        picture.outline(&bone, &pose, red);
        let centre = camera.project(&(pose * Point::origin()));
        let drawn: Vec<Pixel> = (0..128 * 128)
            .filter(|i| picture.rgb[*i] == red)
            .map(|i| Pixel::new((i % 128) as f64, (i / 128) as f64))
            .collect();
        let middle = centre.map(|v| reduced(v, 2));
        // 15 mm at 800 mm of 1000, in pixels of 2.4 mm.
        let radius = 15.0 * 1000.0 / 800.0 / 2.4;
        assert!(drawn.len() > 20);
        for pixel in &drawn {
            let distance = (pixel - middle).norm();
            assert!(
                (distance - radius).abs() < 1.5,
                "{pixel}: {distance} of {radius}"
            );
        }
        picture.cross(&centre, 0, [0, 255, 0]);
        let (x, y) = (middle.x.round() as usize, middle.y.round() as usize);
        assert_eq!(picture.rgb[y * 128 + x], [0, 255, 0]);
        assert_eq!(picture.turned().rgb[(127 - y) * 128 + 127 - x], [0, 255, 0]);
    }
}
