//! The real work: simulates cases, registers them, compares with the truth.

use super::preparation::{Preparation, PreparedFragment};
use super::record;
use super::{CaseKey, Config, Failure, RegistrationKey, Scenario, StrategyParameters, Worker};
use crate::random::{Purpose, stream};
use crate::registration::paper::{Paper, PaperSlice};
use crate::registration::{Outcome, Shape, Strategy};
use crate::simulation::case::{Case, CaseParameters};
use crate::simulation::{Pick, sample_movement};
use crate::store::Row;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Simulates and registers as a configuration says.
#[derive(Debug)]
pub struct CaseWorker {
    config: Arc<Config>,
    preparation: Preparation,
    strategies: BTreeMap<String, Box<dyn Strategy + Send>>,
    parameters: CaseParameters,
}

/// A simulated case, with what its fragment and hip share.
#[derive(Debug)]
pub struct SimulatedCase {
    pub fragment: Arc<PreparedFragment>,
    pub case: Case,
    /// Movements that collided before this one.
    pub movement_rejections: u32,
}

impl CaseWorker {
    /// A worker of a configuration. Nothing is read or made before the first case.
    pub fn new(config: &Config) -> Self {
        let config = Arc::new(config.clone());
        let strategies = config.registration.iter();
        let strategies = strategies.map(|(name, parameters)| (name.clone(), strategy(parameters)));
        let xray = &config.xray;
        Self {
            preparation: Preparation::new(config.clone()),
            strategies: strategies.collect(),
            parameters: CaseParameters {
                camera: xray.c_arm.camera(),
                orbit: xray.c_arm.orbit(),
                attenuation: xray.attenuation.clone(),
                views: xray.views.clone(),
                warp: xray.warp.clone(),
                wire_insertion: xray.wire_insertion.clone(),
                fluoroscopy: xray.fluoroscopy.clone(),
                annotation: xray.annotation.clone(),
            },
            config,
        }
    }

    /// The noisy pick of a registration's initialization.
    pub fn pick(&self, case: &SimulatedCase, key: &RegistrationKey) -> Pick {
        let parameters = &self.config.xray.pick;
        case.case.pick(parameters, &key.initialization_key())
    }

    /// What the registration's strategy makes of the case.
    ///
    /// # Errors
    /// When the scenario's models cannot be made or the strategy comes to no result.
    pub fn estimate(
        &self,
        case: &SimulatedCase,
        key: &RegistrationKey,
        pick: &Pick,
    ) -> Result<Outcome, Failure> {
        let shape = self.shape(case, key.scenario)?;
        let name = key.initialization_key();
        let observation = case.case.observation(pick, shape, name);
        let strategy = self.strategies.get(&key.strategy).ok_or_else(|| {
            Failure::new(
                "strategy",
                format!("the study has no strategy {}", key.strategy),
            )
        })?;
        strategy
            .register(&observation)
            .map_err(|error| Failure::new(error.phase, error.cause))
    }

    /// What a scenario gives a registration to know of the fragment's shape.
    fn shape(&self, case: &SimulatedCase, scenario: Scenario) -> Result<Shape, Failure> {
        let (fragment, hip) = (&case.fragment, &case.fragment.hip);
        if scenario != Scenario::IliumPubisEstimated {
            return Ok(Shape::Given(fragment.models(scenario)?));
        }
        Ok(Shape::Estimated {
            full_pelvis: hip.full_pelvis()?,
            femur: hip.femur()?,
            pelvis_surface: hip.pelvis_surface.clone(),
            nominal: hip.nominal,
            annotations: case.case.annotations().clone(),
            recipe: hip.recipe.clone(),
        })
    }
}

fn strategy(parameters: &StrategyParameters) -> Box<dyn Strategy + Send> {
    match parameters {
        StrategyParameters::Paper(parameters) => Box::new(Paper {
            parameters: parameters.clone(),
        }),
        StrategyParameters::PaperSlice(parameters) => Box::new(PaperSlice {
            parameters: parameters.clone(),
        }),
    }
}

impl Worker for CaseWorker {
    type Case = SimulatedCase;

    fn simulate(&self, key: &CaseKey) -> Result<SimulatedCase, Failure> {
        let fragment = self.preparation.fragment(&key.fragment)?;
        let (seed, name) = (self.config.study.seed, key.to_string());
        let (movement, rejections) = sample_movement(
            &fragment.collision,
            &fragment.hip.hip,
            &self.config.movement.sampling,
            &mut stream(seed, Purpose::Movement, &name),
        )
        .map_err(|cause| Failure::new("movement", cause))?;
        let case = Case::simulate(
            &fragment.operation,
            &movement,
            &self.parameters,
            seed,
            &name,
        )
        .map_err(|cause| Failure::new("simulation", cause))?;
        Ok(SimulatedCase {
            fragment,
            case,
            movement_rejections: rejections.total(),
        })
    }

    fn register(
        &self,
        case: &SimulatedCase,
        key: &RegistrationKey,
        row: &mut Row,
    ) -> Result<(), Failure> {
        #[cfg(feature = "fail-points")]
        crate::fail_point::abort_at(&key.to_string());
        let apex = self.config.movement.lce_apex;
        record::truth(case, apex, row)?;
        let pick = self.pick(case, key);
        record::pick(case, &pick, row);
        let outcome = self.estimate(case, key, &pick)?;
        record::outcome(case, key.scenario, &outcome, apex, row)
    }
}
