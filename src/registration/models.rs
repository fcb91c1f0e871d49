//! Bone models of a hip for a given shape of the fragment.

use super::observation::BoneModels;
use crate::anatomy::{Hip, Label};
use crate::surgery::fragment::{FragmentError, FragmentParameters, cut_fragment};
use crate::surgery::{Acetabulum, CutPlanes, PlausibilityParameters, plausible_estimate};
use crate::volume::Volume;
use crate::xray::{AttenuationParameters, BoneVolume};
use std::sync::Arc;

/// How bone models are made from a CT and cuts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelRecipe {
    /// Hounsfield units to attenuation in DRRs.
    pub attenuation: AttenuationParameters,
    /// How cuts become a label map.
    pub fragment: FragmentParameters,
    /// Rules for the fragments of estimated cuts.
    pub plausibility: PlausibilityParameters,
}

/// A model that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    #[error(transparent)]
    Fragment(#[from] FragmentError),
    #[error("the label map of {hip} has no voxel of the {object} (label {label}) with attenuation")]
    Empty {
        hip: String,
        object: &'static str,
        label: u8,
    },
}

impl ModelRecipe {
    /// Pelvis and fragment for given cuts, with the ipsilateral femur's model.
    ///
    /// # Errors
    /// When the cuts free no fragment or an object has no voxel.
    pub fn models(
        &self,
        hip: &Hip,
        femur: &Arc<BoneVolume>,
        cuts: &CutPlanes,
    ) -> Result<BoneModels, ModelError> {
        let map = cut_fragment(hip, cuts, &self.fragment)?;
        Ok(BoneModels {
            pelvis: self.bone(hip, &map.labels, Label::Pelvis, "pelvis")?,
            femur: Arc::clone(femur),
            fragment: self.bone(hip, &map.labels, Label::Fragment, "fragment")?,
        })
    }

    /// Whether cuts, of which some are estimated, free a fragment that can be one
    /// ([`plausible_estimate`]), or why not.
    pub fn plausible(&self, hip: &Hip, cuts: &CutPlanes) -> Result<(), String> {
        let acetabulum = Acetabulum::of(hip).map_err(|error| error.to_string())?;
        match plausible_estimate(hip, &acetabulum, cuts, &self.fragment, &self.plausibility) {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(rejection)) => Err(rejection.to_string()),
            Err(error) => Err(error.to_string()),
        }
    }

    /// The ipsilateral femur.
    ///
    /// # Errors
    /// When it has no voxel.
    pub fn femur(&self, hip: &Hip) -> Result<Arc<BoneVolume>, ModelError> {
        self.bone(hip, &hip.specimen.labels, Label::femur(hip.side), "femur")
    }

    /// The whole pelvis, fragment included.
    ///
    /// # Errors
    /// When it has no voxel.
    pub fn full_pelvis(&self, hip: &Hip) -> Result<Arc<BoneVolume>, ModelError> {
        self.bone(hip, &hip.specimen.labels, Label::Pelvis, "pelvis")
    }

    fn bone(
        &self,
        hip: &Hip,
        labels: &Volume<u8>,
        label: Label,
        object: &'static str,
    ) -> Result<Arc<BoneVolume>, ModelError> {
        let keep = |value| value == label.value();
        BoneVolume::from_labels(&hip.specimen.ct, labels, keep, &self.attenuation)
            .map(Arc::new)
            .ok_or_else(|| ModelError::Empty {
                hip: hip.key(),
                object,
                label: label.value(),
            })
    }
}
