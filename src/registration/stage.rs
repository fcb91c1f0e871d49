//! One stage of a strategy: an optimizer over the poses of one or more objects.

use super::outcome::StageRecord;
use super::pose_space::PoseSpace;
use super::strategy::RegistrationCause;
use crate::geometry::Rigid;
use crate::objective::{Regularization, Scorer};
use crate::optimize::{BoxSearch, CmaEs, CmaEsParameters, CmaEsStop, minimize_in_box};
use crate::random::Stream;
use std::time::Instant;

/// The poses that a stage ends with, one for each moving object, and its record.
#[derive(Debug)]
pub struct StageResult {
    pub poses: Vec<Rigid>,
    pub record: StageRecord,
}

/// A CMA-ES stage over one object.
#[derive(Debug)]
pub struct CmaEsStage<'a> {
    pub name: &'static str,
    pub space: &'a PoseSpace,
    /// Initial standard deviations of the twist (rad, mm).
    pub sd: [f64; 6],
    pub regularization: &'a Regularization,
    /// Weight of the similarity; the regularization has the rest.
    pub similarity_weight: f64,
    pub parameters: CmaEsParameters,
}

impl CmaEsStage<'_> {
    /// Searches from twist zero; the result is the distribution's mean (facts 2.7).
    pub fn run(
        &self,
        scorer: &mut dyn Scorer,
        stream: Stream,
    ) -> Result<StageResult, RegistrationCause> {
        let clock = Instant::now();
        let mut search = CmaEs::new(&[0.0; 6], &self.sd, self.parameters.clone(), stream);
        let mut evaluations = 0;
        let mut costs = vec![0.0; self.parameters.population];
        let mut poses = Vec::with_capacity(costs.len());
        while search.stop().is_none() {
            let twists = search.ask();
            poses.clear();
            poses.extend(twists.chunks_exact(6).map(|twist| self.space.pose(twist)));
            scorer.similarities(&poses, &mut costs);
            for (cost, twist) in costs.iter_mut().zip(twists.chunks_exact(6)) {
                *cost = self.cost(*cost, twist);
            }
            evaluations += costs.len() as u64;
            if costs.iter().all(|cost| !cost.is_finite()) {
                return Err(RegistrationCause::NoFiniteCost);
            }
            search.tell(&costs);
        }
        let mean = search.mean();
        let pose = self.space.pose(&mean);
        let mut similarity = [0.0];
        scorer.similarities(&[pose], &mut similarity);
        Ok(StageResult {
            poses: vec![pose],
            record: StageRecord {
                stage: self.name,
                cost: self.cost(similarity[0], &mean),
                evaluations: evaluations + 1,
                capped: search.stop() != Some(CmaEsStop::Converged),
                seconds: clock.elapsed().as_secs_f64(),
            },
        })
    }

    fn cost(&self, similarity: f64, twist: &[f64]) -> f64 {
        let penalty = self.regularization.cost(&self.space.motion(twist));
        self.similarity_weight * similarity + (1.0 - self.similarity_weight) * penalty
    }
}

/// A BOBYQA stage over one or more objects; no regularization, box bounds only (facts 2.1).
#[derive(Debug)]
pub struct BobyqaStage<'a> {
    pub name: &'static str,
    /// One space for each moving object of the scorer.
    pub spaces: &'a [PoseSpace],
    /// Six half widths (rad, mm) for each object.
    pub search: BoxSearch,
}

impl BobyqaStage<'_> {
    /// Searches from twist zero; the result is the best candidate seen.
    pub fn run(&self, scorer: &mut dyn Scorer) -> Result<StageResult, RegistrationCause> {
        let clock = Instant::now();
        let poses_of = |twists: &[f64], poses: &mut Vec<Rigid>| {
            poses.clear();
            let pairs = self.spaces.iter().zip(twists.chunks_exact(6));
            poses.extend(pairs.map(|(space, twist)| space.pose(twist)));
        };
        let mut poses = Vec::with_capacity(self.spaces.len());
        let mut cost = [0.0];
        let outcome = minimize_in_box(&self.search, |twists| {
            poses_of(twists, &mut poses);
            scorer.similarities(&poses, &mut cost);
            cost[0]
        })?;
        if !outcome.cost.is_finite() {
            return Err(RegistrationCause::NoFiniteCost);
        }
        poses_of(&outcome.offset, &mut poses);
        Ok(StageResult {
            poses,
            record: StageRecord {
                stage: self.name,
                cost: outcome.cost,
                evaluations: outcome.evaluations as u64,
                capped: outcome.capped,
                seconds: clock.elapsed().as_secs_f64(),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Vector, se3};
    use crate::random::{Purpose, stream};

    /// A bowl about known poses: what a perfect similarity would look like.
    struct Bowl {
        targets: Vec<Rigid>,
    }

    impl Scorer for Bowl {
        fn moving_objects(&self) -> usize {
            self.targets.len()
        }

        fn similarities(&mut self, poses: &[Rigid], costs: &mut [f64]) {
            let candidates = poses.chunks_exact(self.targets.len());
            assert_eq!(candidates.len(), costs.len());
            for (cost, candidate) in costs.iter_mut().zip(candidates) {
                let distance: f64 = candidate
                    .iter()
                    .zip(&self.targets)
                    .map(|(pose, target)| se3::log(&(target.inverse() * pose)))
                    .map(|t| {
                        (t.fixed_rows::<3>(0) * 50.0).norm_squared()
                            + t.fixed_rows::<3>(3).norm_squared()
                    })
                    .sum();
                *cost = 1.0 - (-distance / 2000.0).exp();
            }
        }
    }

    fn camera_space() -> PoseSpace {
        let start = Rigid::new(Vector::new(5.0, -10.0, -820.0), Vector::new(0.1, 3.0, 0.2));
        PoseSpace::CameraAligned {
            start,
            center: start * Point::new(80.0, 1.0, 2.0),
        }
    }

    #[test]
    fn cmaes_finds_a_pose_against_a_weak_penalty() {
        let space = camera_space();
        let target = space.pose(&[0.1, -0.08, 0.15, 9.0, -12.0, 25.0]);
        let mut scorer = Bowl {
            targets: vec![target],
        };
        let stage = CmaEsStage {
            name: "test",
            space: &space,
            sd: [0.26, 0.26, 0.52, 50.0, 50.0, 100.0],
            regularization: &Regularization::Components {
                rotation_sd: Vector::repeat(100.0),
                translation_sd: Vector::repeat(1e5),
            },
            similarity_weight: 0.9,
            parameters: CmaEsParameters {
                population: 100,
                cost_tolerance: 1e-9,
                max_generations: 700,
            },
        };
        let draws = || stream(3, Purpose::Optimizer, "stage");
        let result = stage.run(&mut scorer, draws()).unwrap();
        let miss = se3::log(&(target.inverse() * result.poses[0]));
        assert!(miss.norm() < 0.05, "{miss}");
        assert_eq!(result.record.evaluations % 100, 1);
        let again = stage.run(&mut scorer, draws()).unwrap();
        assert_eq!(result.poses, again.poses);
    }

    #[test]
    fn a_strong_penalty_keeps_the_start() {
        let space = camera_space();
        let mut scorer = Bowl {
            targets: vec![space.pose(&[0.1, 0.0, 0.0, 0.0, 0.0, 0.0])],
        };
        let stage = CmaEsStage {
            name: "test",
            space: &space,
            sd: [0.1, 0.1, 0.1, 5.0, 5.0, 5.0],
            regularization: &Regularization::Components {
                rotation_sd: Vector::repeat(1e-3),
                translation_sd: Vector::repeat(1e-2),
            },
            similarity_weight: 0.9,
            parameters: CmaEsParameters {
                population: 20,
                cost_tolerance: 1e-9,
                max_generations: 700,
            },
        };
        let result = stage
            .run(&mut scorer, stream(3, Purpose::Optimizer, "penalty"))
            .unwrap();
        let motion = se3::log(&(result.poses[0] * space.pose(&[0.0; 6]).inverse()));
        assert!(se3::rotation_angle(&se3::exp(&motion).rotation) < 2e-4);
    }

    #[test]
    fn bobyqa_finds_three_poses_at_once() {
        let app_from_volume = Rigid::new(Vector::new(-80.0, 3.0, 4.0), Vector::new(1.5, 0.0, 0.1));
        let spaces: Vec<PoseSpace> = (0..3)
            .map(|k| PoseSpace::Anatomical {
                start: Rigid::translation(k as f64, 0.0, 0.0),
                app_from_volume,
            })
            .collect();
        let twist = [0.01, -0.02, 0.015, 2.0, -3.0, 1.0];
        let targets: Vec<Rigid> = spaces.iter().map(|space| space.pose(&twist)).collect();
        let half_widths: Vec<f64> = (0..18)
            .map(|i| if i % 6 < 3 { 0.044 } else { 10.0 })
            .collect();
        let result = BobyqaStage {
            name: "test",
            spaces: &spaces,
            search: BoxSearch {
                half_widths,
                tolerance: 1e-7,
                max_evaluations: 5000,
            },
        }
        .run(&mut Bowl {
            targets: targets.clone(),
        })
        .unwrap();
        for (pose, target) in result.poses.iter().zip(&targets) {
            let miss = se3::log(&(target.inverse() * pose));
            assert!(
                miss.fixed_rows::<3>(3).norm() < 0.2 && miss.fixed_rows::<3>(0).norm() < 4e-3,
                "{miss}"
            );
        }
    }

    #[test]
    fn costs_that_are_never_finite_are_an_error() {
        struct Broken;
        impl Scorer for Broken {
            fn moving_objects(&self) -> usize {
                1
            }
            fn similarities(&mut self, _: &[Rigid], costs: &mut [f64]) {
                costs.fill(f64::NAN);
            }
        }
        let space = camera_space();
        let stage = BobyqaStage {
            name: "test",
            spaces: &[space],
            search: BoxSearch {
                half_widths: vec![0.1, 0.1, 0.1, 5.0, 5.0, 5.0],
                tolerance: 1e-3,
                max_evaluations: 200,
            },
        };
        assert!(matches!(
            stage.run(&mut Broken),
            Err(RegistrationCause::NoFiniteCost)
        ));
    }
}
