//! 2D images: filters, PNG and drawing.

pub mod filter;
pub mod gradient;
mod image2d;
mod rect;

pub use image2d::Image;
pub use rect::PixelRect;
