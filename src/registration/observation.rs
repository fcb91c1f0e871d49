//! All that a registration may know.

use super::models::ModelRecipe;
use crate::anatomy::Hip;
use crate::geometry::{Pixel, Point};
use crate::image::Image;
use crate::shape_estimation::CutAnnotation;
use crate::surgery::CutPlanes;
use crate::volume::Surface;
use crate::xray::{BoneVolume, Camera, Orbit};
use std::sync::Arc;

/// One fluoroscopic image and the C-arm's intrinsic geometry. Where the C-arm stood is not known.
#[derive(Clone, Debug)]
pub struct ObservedView {
    /// Intrinsics of the full, uncropped image.
    pub camera: Camera,
    /// Photon counts.
    pub counts: Arc<Image<u16>>,
}

/// The bone models of one registration, all in the world of the preoperative CT.
#[derive(Clone, Debug)]
pub struct BoneModels {
    /// The pelvis without the fragment and the cuts.
    pub pelvis: Arc<BoneVolume>,
    /// The ipsilateral femur.
    pub femur: Arc<BoneVolume>,
    pub fragment: Arc<BoneVolume>,
}

/// What is known of the fragment's shape.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The fragment follows from given cuts.
    Given(BoneModels),
    /// The ilium and pubis cuts are estimated from annotations; the others are nominal.
    Estimated {
        /// The whole pelvis, fragment included, for the single views.
        full_pelvis: Arc<BoneVolume>,
        femur: Arc<BoneVolume>,
        /// Surface of the whole pelvis, in the world of the preoperative CT.
        pelvis_surface: Arc<Surface>,
        nominal: CutPlanes,
        annotations: Arc<Vec<CutAnnotation>>,
        /// How the models of the estimated shape are made.
        recipe: Arc<ModelRecipe>,
    },
}

/// All that a registration may know: images, intrinsics, the preoperative CT with its labels and
/// landmarks, the noisy pick, annotations. No simulated pose and no true cut is reachable from it.
#[derive(Clone, Debug)]
pub struct Observation {
    /// The approximate AP view, then the two orbital ones.
    pub views: [ObservedView; 3],
    /// Calibrated orbit of the C-arm.
    pub orbit: Orbit,
    /// Preoperative data and side.
    pub hip: Arc<Hip>,
    /// The landmark (ipsilateral MOF) as picked in the CT, in its world (mm).
    pub picked_point: Point,
    /// The landmark as picked in the first view (full, uncropped image).
    pub picked_pixel: Pixel,
    pub shape: Shape,
    /// Study seed of the random streams of the method itself.
    pub seed: u64,
    /// Key of those streams: the registration's key without its scenario and strategy, so that
    /// paired scenarios share draws.
    pub stream_key: String,
}
