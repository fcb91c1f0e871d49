//! One case: a movement with its K-wires, views, fluoroscopy and annotations.

use super::annotate::{AnnotationParameters, CutLines};
use super::fluoroscopy::{FluoroscopyParameters, fluoroscopy};
use super::movement::Movement;
use super::pick::{Pick, PickParameters};
use super::views::{ViewParameters, Views};
use super::warp::{WarpParameters, moved_attenuation};
use super::wires::{WireInsertionParameters, insert_wires};
use crate::anatomy::{Hip, Label, Landmark, frame::FrameError};
use crate::geometry::{Pixel, Point};
use crate::image::Image;
use crate::random::{Purpose, stream};
use crate::registration::{Observation, ObservedView, Shape};
use crate::shape_estimation::CutAnnotation;
use crate::surgery::{
    CutPlanes, KWire, KWireError, KWireModel, KWireParameters, SurgeryMap, place_kwires,
};
use crate::volume::{Surface, SurfaceParameters};
use crate::xray::{AttenuationParameters, BodyVolume, Camera, Orbit};
use std::sync::Arc;

/// What the cases of one fragment share: the true surgery on one hip.
#[derive(Clone, Debug)]
pub struct Operation {
    hip: Arc<Hip>,
    pelvis: Arc<Surface>,
    map: SurgeryMap,
    wires: KWireModel,
}

/// The surface of a hip's whole preoperative pelvis in its world: what annotations are drawn on and
/// what shape estimation meets with its rays. One serves all cases of a specimen.
pub fn pelvis_surface(hip: &Hip) -> Surface {
    let is_pelvis = |label| label == Label::Pelvis.value();
    Surface::from_mask(
        &hip.specimen.labels,
        is_pelvis,
        &SurfaceParameters::default(),
    )
}

impl Operation {
    /// `pelvis` is the hip's [`pelvis_surface`], `map` what the true cuts made of its label map.
    ///
    /// # Errors
    /// When the map has no fragment or no place for wires.
    pub fn new(
        hip: Arc<Hip>,
        pelvis: Arc<Surface>,
        map: SurgeryMap,
        wires: &KWireParameters,
    ) -> Result<Self, KWireError> {
        let wires = KWireModel::new(&hip, &map.labels, wires)?;
        Ok(Self {
            hip,
            pelvis,
            map,
            wires,
        })
    }

    /// The surgery's label map and true cuts.
    pub fn map(&self) -> &SurgeryMap {
        &self.map
    }
}

/// How cases are simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseParameters {
    /// Intrinsics of the full, uncropped images.
    pub camera: Camera,
    pub orbit: Orbit,
    /// Hounsfield units to attenuation.
    pub attenuation: AttenuationParameters,
    pub views: ViewParameters,
    pub warp: WarpParameters,
    pub wire_insertion: WireInsertionParameters,
    pub fluoroscopy: FluoroscopyParameters,
    pub annotation: AnnotationParameters,
}

impl Default for CaseParameters {
    fn default() -> Self {
        Self {
            camera: Camera::cios_fusion(),
            orbit: Orbit::cios_fusion(),
            attenuation: AttenuationParameters::default(),
            views: ViewParameters::default(),
            warp: WarpParameters::default(),
            wire_insertion: WireInsertionParameters::default(),
            fluoroscopy: FluoroscopyParameters::default(),
            annotation: AnnotationParameters::default(),
        }
    }
}

/// What no registration may see.
#[derive(Clone, Debug)]
pub struct CaseTruth {
    pub cuts: CutPlanes,
    pub movement: Movement,
    pub views: Views,
    pub wires: [KWire; 2],
    /// Mean intensity of the muscle that fills vacated voxels (HU).
    pub muscle_mean_hu: f64,
    /// Voxels where moved bone fell on bone that stays; see [`super::warp::MovedAnatomy`].
    pub overlap_voxels: usize,
    /// The landmark (ipsilateral MOF) in the specimen's world, and where view 1 shows it.
    pub landmark: Point,
    pub landmark_pixel: Pixel,
}

/// A simulated case: the truth, and what a surgeon would have before him.
#[derive(Clone, Debug)]
pub struct Case {
    pub truth: CaseTruth,
    hip: Arc<Hip>,
    camera: Camera,
    orbit: Orbit,
    counts: [Arc<Image<u16>>; 3],
    annotations: Arc<Vec<CutAnnotation>>,
    seed: u64,
}

/// Why a case cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaseError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(transparent)]
    Wires(#[from] KWireError),
    #[error(
        "the landmark {name} of {key} projects to column {x:.0}, row {y:.0} of the first view, outside of its {width} x {height} pixels; lower the views' offsets and perturbations or enlarge the detector"
    )]
    LandmarkOutside {
        key: String,
        name: String,
        x: f64,
        y: f64,
        width: usize,
        height: usize,
    },
}

impl Case {
    /// Simulates the case `key` (`phantom-1/left/f03/m07`, for instance) of the study's `seed`: draws
    /// wires and views, warps the CT, burns in the wires, images it three times, and draws the
    /// annotations. At most two copies of the volume live meanwhile.
    ///
    /// # Errors
    /// When a wire finds no place, a landmark is missing, or the landmark is not in the first view.
    pub fn simulate(
        operation: &Operation,
        movement: &Movement,
        parameters: &CaseParameters,
        seed: u64,
        key: &str,
    ) -> Result<Self, CaseError> {
        let hip = &operation.hip;
        let camera = &parameters.camera;
        let draws = |purpose: Purpose| stream(seed, purpose, key);
        let views = Views::sample(
            hip,
            camera,
            &parameters.orbit,
            &parameters.views,
            &mut draws(Purpose::Views),
        );
        let landmark = hip.landmark(Landmark::Mof)?;
        let landmark_pixel = camera.project(&(views.camera_from_volume[0] * landmark));
        if !camera_shows(camera, &landmark_pixel) {
            return Err(CaseError::LandmarkOutside {
                key: key.to_owned(),
                name: Landmark::Mof.key(hip.side),
                x: landmark_pixel.x,
                y: landmark_pixel.y,
                width: camera.width,
                height: camera.height,
            });
        }
        let wires = place_kwires(
            &operation.wires,
            &movement.fragment,
            &movement.femur,
            &mut draws(Purpose::Wires),
        )?;
        let moved = moved_attenuation(
            hip,
            &operation.map.labels,
            &movement.fragment,
            &movement.femur,
            &parameters.warp,
            &parameters.attenuation,
            &mut draws(Purpose::MuscleFill),
        );
        let body = BodyVolume::new(&insert_wires(
            moved.attenuation,
            &wires,
            &parameters.wire_insertion,
            &parameters.attenuation,
        ));
        let of_view =
            |purpose: Purpose, view: usize| stream(seed, purpose, &format!("{key}/{view}"));
        let counts = std::array::from_fn(|view| {
            Arc::new(fluoroscopy(
                &body,
                camera,
                &views.camera_from_volume[view],
                &parameters.fluoroscopy,
                &of_view(Purpose::Noise, view),
            ))
        });
        let lines = CutLines::new(hip, &operation.pelvis, &operation.map);
        let annotations = (0..3)
            .flat_map(|view| {
                lines.annotate(
                    view,
                    camera,
                    &views.camera_from_volume[view],
                    &parameters.annotation,
                    &mut of_view(Purpose::Annotation, view),
                )
            })
            .collect();
        Ok(Self {
            truth: CaseTruth {
                cuts: operation.map.cuts,
                movement: *movement,
                views,
                wires,
                muscle_mean_hu: moved.muscle_mean_hu,
                overlap_voxels: moved.overlap_voxels,
                landmark,
                landmark_pixel,
            },
            hip: Arc::clone(hip),
            camera: *camera,
            orbit: parameters.orbit,
            counts,
            annotations: Arc::new(annotations),
            seed,
        })
    }

    /// Photon counts of the three views.
    pub fn counts(&self) -> &[Arc<Image<u16>>; 3] {
        &self.counts
    }

    /// The annotations of the ilium and pubis cuts in all views, for [`Shape::Estimated`].
    pub fn annotations(&self) -> &Arc<Vec<CutAnnotation>> {
        &self.annotations
    }

    /// The noisy pick of one initialization, `key` (`phantom-1/left/f03/m07/i2`, for instance).
    pub fn pick(&self, parameters: &PickParameters, key: &str) -> Pick {
        let mut draws = stream(self.seed, Purpose::Pick, key);
        let truth = &self.truth;
        Pick::sample(
            &truth.landmark,
            &truth.landmark_pixel,
            parameters,
            &mut draws,
        )
    }

    /// What a registration of this case may know. `stream_key` keys the method's own random streams:
    /// the initialization's key.
    pub fn observation(&self, pick: &Pick, shape: Shape, stream_key: String) -> Observation {
        Observation {
            views: std::array::from_fn(|view| ObservedView {
                camera: self.camera,
                counts: Arc::clone(&self.counts[view]),
            }),
            orbit: self.orbit,
            hip: Arc::clone(&self.hip),
            picked_point: pick.point,
            picked_pixel: pick.pixel,
            shape,
            seed: self.seed,
            stream_key,
        }
    }
}

/// True for a position on a pixel of the camera's image.
fn camera_shows(camera: &Camera, pixel: &Pixel) -> bool {
    (-0.5..camera.width as f64 - 0.5).contains(&pixel.x)
        && (-0.5..camera.height as f64 - 0.5).contains(&pixel.y)
}
