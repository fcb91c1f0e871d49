//! Hounsfield units of bone: a cortex of varying thickness over textured trabecular bone.

use super::distance::smooth_step;
use super::noise::Noise;
use super::skeleton::{Bone, Skeleton, sided};
use crate::geometry::Point;
use crate::random::Stream;

#[derive(Debug)]
pub(super) struct BoneDensity {
    fine: Noise,
    coarse: Noise,
    shell: Noise,
}

impl BoneDensity {
    pub fn new(stream: &mut Stream) -> Self {
        Self {
            fine: Noise::new(stream),
            coarse: Noise::new(stream),
            shell: Noise::new(stream),
        }
    }

    /// HU at a place `depth` mm inside a bone, blurred over `blur` mm as a scanner does.
    pub fn hu(&self, s: &Skeleton, bone: Bone, p: &Point, depth: f64, blur: f64) -> f64 {
        let spongy = self.fine.at(p, 2.2) * 75.0 + self.coarse.at(p, 7.0) * 70.0;
        let uneven = 1.0 + 0.6 * self.shell.at(p, 18.0);
        let (cortex, hard, soft) = match bone {
            Bone::Hip(side) => {
                let q = sided(p, side);
                let cup = &s.hips[side.index()].acetabulum;
                let to = q - cup.center;
                let roof = 1.0 - smooth_step(0.0, 20.0, to.norm() - cup.radius);
                let roof = roof * smooth_step(-8.0, 12.0, to.z);
                let buttress = 1.0
                    - smooth_step(
                        6.0,
                        24.0,
                        ((q.y - 22.0).powi(2) + (q.z - 42.0).powi(2)).sqrt(),
                    );
                (
                    (0.35 + 0.1 * roof + 0.5 * buttress) * uneven,
                    1160.0,
                    140.0 + 180.0 * roof,
                )
            }
            Bone::Femur(side) => {
                let femur = &s.femora[side.index()];
                let q = sided(p, side);
                let head = 1.0
                    - smooth_step(
                        femur.head_radius * 0.8,
                        femur.head_radius * 1.35,
                        (q - femur.head).norm(),
                    );
                let axis = femur.shaft_axis[1] - femur.shaft_axis[0];
                let along = (q - femur.shaft_axis[0]).dot(&axis) / axis.norm();
                let shaft = smooth_step(-25.0, 35.0, along);
                let medial = 1.0 - smooth_step(-6.0, 6.0, q.x - femur.shaft_axis[0].x + 14.0);
                let calcar = medial * smooth_step(-55.0, -30.0, along) * (1.0 - head);
                (
                    (0.45 + 4.6 * shaft + 1.6 * calcar * (1.0 - shaft)) * (0.6 + 0.4 * uneven),
                    1060.0 + 520.0 * shaft,
                    120.0 + 80.0 * head - 130.0 * shaft,
                )
            }
            Bone::Sacrum => (0.5 * uneven, 900.0, 125.0),
            Bone::Spine => (0.5 * uneven, 880.0, 150.0),
        };
        let cortex = (cortex * s.build.cortex).clamp(0.3, 6.5);
        // Beneath the cortex bone thins out gradually.
        let inner = smooth_step(cortex - blur, cortex + 3.2 * blur, depth);
        let soft = soft * s.build.density + spongy;
        let hard = hard + self.shell.at(p, 9.0) * 420.0;
        hard + (soft - hard) * inner
    }
}
