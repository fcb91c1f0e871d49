//! 2D images: filters, PNG and drawing.

mod image2d;

pub use image2d::Image;
