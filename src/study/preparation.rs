//! What the cases of a specimen, a hip or a fragment share.

use super::shared::Shared;
use super::{Config, Failure, FragmentKey, Scenario, SpecimenSource};
use crate::anatomy::disk::read_specimen;
use crate::anatomy::phantom::phantom;
use crate::anatomy::surfaces::{SurfacesOrigin, read_bone_surfaces, specimen_from_surfaces};
use crate::anatomy::{Hip, Side, Specimen};
use crate::registration::{BoneModels, ModelRecipe};
use crate::simulation::case::{Operation, pelvis_surface};
use crate::surgery::{CollisionModel, Cut, CutPlanes, nominal_cuts, sample_fragment};
use crate::volume::Surface;
use crate::xray::BoneVolume;
use std::sync::{Arc, OnceLock};

/// How many specimens, hips and fragments are kept. Cases come in the order of the plan, so two of
/// each bridge the passage from one to the next.
const KEPT: usize = 2;

/// Everything that cases share, made when it is first needed.
#[derive(Debug)]
pub struct Preparation {
    config: Arc<Config>,
    specimens: Shared<String, PreparedSpecimen>,
    hips: Shared<(String, Side), PreparedHip>,
    fragments: Shared<FragmentKey, PreparedFragment>,
}

/// A specimen and the surface of its whole pelvis.
#[derive(Debug)]
struct PreparedSpecimen {
    specimen: Arc<Specimen>,
    pelvis_surface: OnceLock<Arc<Surface>>,
}

/// A hip with its plan.
#[derive(Debug)]
pub struct PreparedHip {
    pub hip: Arc<Hip>,
    pub pelvis_surface: Arc<Surface>,
    /// The planned cuts.
    pub nominal: CutPlanes,
    pub recipe: Arc<ModelRecipe>,
    femur: OnceLock<Result<Arc<BoneVolume>, Failure>>,
    full_pelvis: OnceLock<Result<Arc<BoneVolume>, Failure>>,
    nominal_models: OnceLock<Result<BoneModels, Failure>>,
}

/// A fragment: the true cuts of a hip and what follows from them.
#[derive(Debug)]
pub struct PreparedFragment {
    pub hip: Arc<PreparedHip>,
    pub operation: Operation,
    pub collision: CollisionModel,
    /// Random cuts that were rejected before these.
    pub rejections: usize,
    true_models: OnceLock<Result<BoneModels, Failure>>,
    mixed_models: OnceLock<Result<BoneModels, Failure>>,
}

impl Preparation {
    /// Nothing is made yet.
    pub fn new(config: Arc<Config>) -> Self {
        Self {
            config,
            specimens: Shared::new(KEPT),
            hips: Shared::new(KEPT),
            fragments: Shared::new(KEPT),
        }
    }

    /// A fragment and all below it.
    ///
    /// # Errors
    /// When the specimen cannot be read or made, or the hip has no plausible cuts.
    pub fn fragment(&self, key: &FragmentKey) -> Result<Arc<PreparedFragment>, Failure> {
        self.fragments.get(key, || self.make_fragment(key))
    }

    /// A hip and its plan.
    ///
    /// # Errors
    /// When the specimen cannot be read or made, or no cuts can be planned.
    pub fn hip(&self, specimen: &str, side: Side) -> Result<Arc<PreparedHip>, Failure> {
        let key = (specimen.to_owned(), side);
        self.hips.get(&key, || self.make_hip(specimen, side))
    }

    fn specimen(&self, name: &str) -> Result<Arc<PreparedSpecimen>, Failure> {
        self.specimens.get(&name.to_owned(), || {
            let sources = self.config.population.sources();
            let source = sources.into_iter().find(|source| source.name() == name);
            let source = source.ok_or_else(|| {
                Failure::new("specimen", format!("the study has no specimen {name}"))
            })?;
            let specimen = match source {
                SpecimenSource::Phantom(number) => phantom(number, &self.config.population.phantom),
                SpecimenSource::Folder(path) => {
                    read_specimen(&path).map_err(|cause| Failure::new("specimen", cause))?
                }
                SpecimenSource::Surfaces(path) => {
                    let parameters = &self.config.population.surface_bodies;
                    SurfacesOrigin::of_folder(&path, name)
                        .and_then(|origin| {
                            let bones = read_bone_surfaces(&path)?;
                            specimen_from_surfaces(&bones, &origin, parameters)
                        })
                        .map_err(|cause| Failure::new("specimen", cause))?
                }
            };
            Ok(PreparedSpecimen {
                specimen: Arc::new(specimen),
                pelvis_surface: OnceLock::new(),
            })
        })
    }

    fn make_hip(&self, name: &str, side: Side) -> Result<PreparedHip, Failure> {
        let specimen = self.specimen(name)?;
        let hip = Hip::new(specimen.specimen.clone(), side)
            .map_err(|cause| Failure::new("specimen", cause))?;
        let surgery = &self.config.surgery;
        let nominal = nominal_cuts(&hip, &surgery.nominal)
            .map_err(|cause| Failure::new("nominal_cuts", cause))?;
        let surface = specimen
            .pelvis_surface
            .get_or_init(|| Arc::new(pelvis_surface(&hip)));
        Ok(PreparedHip {
            pelvis_surface: surface.clone(),
            hip: Arc::new(hip),
            nominal,
            recipe: Arc::new(ModelRecipe {
                attenuation: self.config.xray.attenuation.clone(),
                fragment: surgery.fragment.clone(),
                plausibility: surgery.plausibility.clone(),
            }),
            femur: OnceLock::new(),
            full_pelvis: OnceLock::new(),
            nominal_models: OnceLock::new(),
        })
    }

    fn make_fragment(&self, key: &FragmentKey) -> Result<PreparedFragment, Failure> {
        let hip = self.hip(&key.specimen, key.side)?;
        let surgery = &self.config.surgery;
        let sampling = surgery.sampling();
        let seed = self.config.study.seed;
        let (map, rejections) =
            sample_fragment(&hip.hip, &hip.nominal, &sampling, seed, &key.to_string())
                .map_err(|cause| Failure::new("cuts", cause))?;
        let collision = CollisionModel::new(&hip.hip, &map.labels, &self.config.movement.collision)
            .map_err(|cause| Failure::new("movement", cause))?;
        let wires = &self.config.xray.wires;
        let operation = Operation::new(hip.hip.clone(), hip.pelvis_surface.clone(), map, wires)
            .map_err(|cause| Failure::new("wires", cause))?;
        Ok(PreparedFragment {
            hip,
            operation,
            collision,
            rejections: rejections.total(),
            true_models: OnceLock::new(),
            mixed_models: OnceLock::new(),
        })
    }
}

impl PreparedHip {
    /// The model of the ipsilateral femur.
    ///
    /// # Errors
    /// When it is empty.
    pub fn femur(&self) -> Result<Arc<BoneVolume>, Failure> {
        let make = || self.recipe.femur(&self.hip).map_err(model_failure);
        self.femur.get_or_init(make).clone()
    }

    /// The model of the whole pelvis.
    ///
    /// # Errors
    /// When it is empty.
    pub fn full_pelvis(&self) -> Result<Arc<BoneVolume>, Failure> {
        let make = || self.recipe.full_pelvis(&self.hip).map_err(model_failure);
        self.full_pelvis.get_or_init(make).clone()
    }

    /// The bone models of given cuts.
    ///
    /// # Errors
    /// When these cuts free no fragment.
    pub fn models(&self, cuts: &CutPlanes) -> Result<BoneModels, Failure> {
        let femur = self.femur()?;
        let models = self.recipe.models(&self.hip, &femur, cuts);
        models.map_err(model_failure)
    }
}

impl PreparedFragment {
    /// The cuts that were made.
    pub fn true_cuts(&self) -> &CutPlanes {
        &self.operation.map().cuts
    }

    /// The cuts that a scenario takes for the true ones before any estimation.
    pub fn assumed_cuts(&self, scenario: Scenario) -> CutPlanes {
        let (truth, nominal) = (self.true_cuts(), self.hip.nominal);
        match scenario {
            Scenario::AllCutsKnown => *truth,
            Scenario::NoCutsKnown | Scenario::IliumPubisEstimated => nominal,
            Scenario::IliumPubisKnown => [Cut::Ilium, Cut::Pubis]
                .into_iter()
                .fold(nominal, |cuts, cut| cuts.with(cut, *truth.get(cut))),
        }
    }

    /// The bone models of the assumed cuts.
    ///
    /// # Errors
    /// When these cuts free no fragment.
    pub fn models(&self, scenario: Scenario) -> Result<BoneModels, Failure> {
        let cell = match scenario {
            Scenario::AllCutsKnown => &self.true_models,
            Scenario::IliumPubisKnown => &self.mixed_models,
            Scenario::NoCutsKnown | Scenario::IliumPubisEstimated => &self.hip.nominal_models,
        };
        let cuts = self.assumed_cuts(scenario);
        cell.get_or_init(|| self.hip.models(&cuts)).clone()
    }
}

fn model_failure(cause: impl std::fmt::Display) -> Failure {
    Failure::new("models", cause)
}
