//! What a person marks in an image.

use crate::geometry::Pixel;
use crate::surgery::Cut;

/// Which intersections of an annotated pixel's ray with the pelvis surface lie on the cut. Rays
/// are cast from the detector towards the source (the paper's section on shape estimation).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// The ray meets the cut where it enters the pelvis.
    Entry,
    /// The ray meets the cut where it leaves the pelvis.
    Exit,
    /// The view looks along the cut: both intersections lie on it.
    Both,
}

/// One annotated pixel of a cut line, on the main pelvis' side of the cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutAnnotation {
    /// Index of the view, from 0.
    pub view: usize,
    pub cut: Cut,
    /// Position in the full, uncropped image.
    pub pixel: Pixel,
    pub crossing: Crossing,
}
