//! Pixels, lines and words.

use crate::geometry::Pixel;
use crate::report::canvas::register_letters;
use crate::report::picture::{Colour, PictureError, write_png};
use nalgebra::Vector2;
use plotters::prelude::*;
use std::path::Path;

/// A picture in colours. Positions are (column, row), integers at pixel centres.
#[derive(Clone, Debug)]
pub struct Painting {
    width: usize,
    height: usize,
    rgb: Vec<Colour>,
}

impl Painting {
    /// A black picture.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            rgb: vec![[0; 3]; width * height],
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// One pixel's colour.
    pub fn at(&self, x: usize, y: usize) -> Colour {
        self.rgb[y * self.width + x]
    }

    /// Sets one pixel.
    pub fn set(&mut self, x: usize, y: usize, colour: Colour) {
        self.rgb[y * self.width + x] = colour;
    }

    /// Mixes a colour into one pixel; `share` 0 leaves it, 1 replaces it.
    pub fn tint(&mut self, x: usize, y: usize, colour: Colour, share: f64) {
        let old = self.at(x, y);
        let mix = |n: usize| f64::from(old[n]) * (1.0 - share) + f64::from(colour[n]) * share;
        self.set(x, y, [mix(0) as u8, mix(1) as u8, mix(2) as u8]);
    }

    /// Draws a line through points; what lies outside of the picture is left out.
    pub fn line(&mut self, points: impl IntoIterator<Item = Pixel>, colour: Colour) {
        let points: Vec<Pixel> = points.into_iter().collect();
        for ends in points.windows(2) {
            if let Some(seen) = self.seen(ends[0], ends[1]) {
                let path = seen.map(place).to_vec();
                self.draw(|area| area.draw(&PathElement::new(path, stroke(colour))));
            }
        }
    }

    /// The part of a segment that lies in the picture. (plotters clamps the ends' coordinates one by
    /// one, which turns a line that leaves the picture.)
    fn seen(&self, from: Pixel, to: Pixel) -> Option<[Pixel; 2]> {
        let along = to - from;
        let (mut begin, mut end) = (0.0f64, 1.0f64);
        for (axis, size) in [self.width, self.height].into_iter().enumerate() {
            let last = size as f64 - 1.0;
            if along[axis] == 0.0 {
                if !(0.0..=last).contains(&from[axis]) {
                    return None;
                }
                continue;
            }
            let a = -from[axis] / along[axis];
            let b = (last - from[axis]) / along[axis];
            begin = begin.max(a.min(b));
            end = end.min(a.max(b));
        }
        (begin <= end).then(|| [from + along * begin, from + along * end])
    }

    /// Draws a cross.
    pub fn cross(&mut self, at: &Pixel, arm: i32, colour: Colour) {
        for half in [
            Vector2::new(f64::from(arm), 0.0),
            Vector2::new(0.0, f64::from(arm)),
        ] {
            self.line([at - half, at + half], colour);
        }
    }

    /// Writes words to the right of and below a position, with a black border that sets them off from
    /// what is bright.
    pub fn words(&mut self, at: &Pixel, text: &str, size: u32, colour: Colour) {
        register_letters();
        let (x, y) = place(*at);
        let around = [(-1, 0), (1, 0), (0, -1), (0, 1)].map(|by| (by, [0; 3]));
        for ((right, down), colour) in around.into_iter().chain([((0, 0), colour)]) {
            let style = ("sans-serif", size).into_font().color(&rgb(colour));
            let words = Text::new(text.to_owned(), (x + right, y + down), style);
            self.draw(|area| area.draw(&words));
        }
    }

    /// Copies another picture to where its first pixel lies at (`x`, `y`).
    ///
    /// # Panics
    /// When it does not fit.
    pub fn paste(&mut self, other: &Self, x: usize, y: usize) {
        for row in 0..other.height {
            let to = (y + row) * self.width + x;
            let from = row * other.width;
            self.rgb[to..to + other.width].copy_from_slice(&other.rgb[from..from + other.width]);
        }
    }

    /// Writes it as PNG.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), PictureError> {
        write_png(path, self.width, self.height, &self.rgb)
    }

    /// Draws with plotters into the pixels, which cannot fail.
    fn draw<E: std::fmt::Debug>(
        &mut self,
        element: impl FnOnce(&DrawingArea<BitMapBackend, plotters::coord::Shift>) -> Result<(), E>,
    ) {
        let size = (self.width as u32, self.height as u32);
        let area =
            BitMapBackend::with_buffer(self.rgb.as_flattened_mut(), size).into_drawing_area();
        element(&area).expect("pixels in memory take every drawing");
    }
}

/// Words farther off than this many pixels are not seen anyway, and integers are not exceeded.
const FAR: f64 = 1e5;

fn place(at: Pixel) -> (i32, i32) {
    let near = |v: f64| v.clamp(-FAR, FAR).round() as i32;
    (near(at.x), near(at.y))
}

fn rgb([r, g, b]: Colour) -> RGBColor {
    RGBColor(r, g, b)
}

fn stroke(colour: Colour) -> ShapeStyle {
    rgb(colour).stroke_width(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawings_lie_where_they_are_asked_for() {
        let mut painting = Painting::new(40, 30);
        painting.cross(&Pixel::new(10.0, 20.0), 2, [255, 0, 0]);
        assert_eq!(painting.at(12, 20), [255, 0, 0]);
        assert_eq!(painting.at(10, 18), [255, 0, 0]);
        assert_eq!(painting.at(11, 19), [0, 0, 0]);
        painting.line([Pixel::new(-50.0, 5.0), Pixel::new(1e9, 5.0)], [0, 255, 0]);
        assert_eq!(
            (painting.at(0, 5), painting.at(39, 5)),
            ([0, 255, 0], [0, 255, 0])
        );
        // A line that leaves through two sides keeps its slope.
        painting.line(
            [Pixel::new(-100.0, -45.0), Pixel::new(100.0, 55.0)],
            [9, 9, 9],
        );
        for x in [10, 20, 30] {
            assert_ne!(painting.at(x, 5 + x / 2), [0; 3], "{x}");
            assert_eq!(painting.at(x, 8 + x / 2), [0; 3], "{x}");
        }
        painting.line([Pixel::new(-9.0, 3.0), Pixel::new(-1.0, 3.0)], [7; 3]);
        assert_eq!(painting.at(0, 3), [0, 0, 0]);
        painting.cross(&Pixel::new(-9.0, 26.0), 2, [7; 3]);
        assert_eq!(painting.at(0, 26), [0, 0, 0]);
        let before = painting.rgb.iter().filter(|c| **c == [0; 3]).count();
        painting.words(&Pixel::new(2.0, 8.0), "ASIS", 11, [255; 3]);
        assert!(painting.rgb.iter().filter(|c| **c == [0; 3]).count() < before);
        painting.tint(35, 5, [0, 0, 255], 0.5);
        assert_eq!(painting.at(35, 5), [0, 127, 127]);
    }
}
