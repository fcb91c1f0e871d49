//! Draws one figure as SVG and as PNG, with the same letters on every machine.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use std::path::Path;
use std::sync::Once;

/// A figure that cannot be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    #[error("cannot draw {figure}: {message}")]
    Draw { figure: String, message: String },
    #[error("cannot write {figure}: {source}")]
    Write {
        figure: String,
        source: std::io::Error,
    },
    #[error("cannot encode {figure}: {source}")]
    Encode {
        figure: String,
        source: png::EncodingError,
    },
}

/// A drawing area of either backend.
pub type Area<'a, B> = DrawingArea<B, Shift>;

/// What can be drawn on both backends.
pub trait Figure {
    /// File stem.
    fn name(&self) -> String;

    /// Width and height in pixels.
    fn size(&self) -> (u32, u32);

    /// Draws it.
    fn draw<B: DrawingBackend>(&self, area: &Area<'_, B>) -> Result<(), String>;
}

/// Writes `<name>.svg` and `<name>.png` into a folder.
///
/// # Errors
/// When drawing or writing fails.
pub fn write(figure: &impl Figure, folder: &Path) -> Result<(), FigureError> {
    register_letters();
    let name = figure.name();
    let drawn = |result: Result<(), String>| {
        result.map_err(|message| FigureError::Draw {
            figure: name.clone(),
            message,
        })
    };
    let written = |result: std::io::Result<()>| {
        result.map_err(|source| FigureError::Write {
            figure: name.clone(),
            source,
        })
    };
    let (width, height) = figure.size();

    let mut svg = String::new();
    drawn(draw_on(
        SVGBackend::with_string(&mut svg, (width, height)),
        figure,
    ))?;
    written(std::fs::write(folder.join(format!("{name}.svg")), svg))?;

    let mut pixels = vec![255; (width * height * 3) as usize];
    drawn(draw_on(
        BitMapBackend::with_buffer(&mut pixels, (width, height)),
        figure,
    ))?;
    let file = std::fs::File::create(folder.join(format!("{name}.png")));
    let file = file.map_err(|source| FigureError::Write {
        figure: name.clone(),
        source,
    })?;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width, height);
    encoder.set_color(png::ColorType::Rgb);
    (encoder.write_header())
        .and_then(|mut writer| writer.write_image_data(&pixels))
        .map_err(|source| FigureError::Encode {
            figure: name.clone(),
            source,
        })
}

fn draw_on<B: DrawingBackend>(backend: B, figure: &impl Figure) -> Result<(), String> {
    let area = backend.into_drawing_area();
    area.fill(&WHITE).map_err(|e| e.to_string())?;
    figure.draw(&area)?;
    area.present().map_err(|e| e.to_string())
}

/// Makes the letters known that every figure uses.
pub(super) fn register_letters() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Refused only when the bytes are no font, which these are.
        let _ = register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular());
    });
}
