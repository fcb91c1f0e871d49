//! ChaCha8 streams keyed by (seed, purpose, key) (DESIGN section 4.1).
//!
//! A stream depends on nothing else, so a new purpose or another order of drawing shifts no
//! other stream. `StdRng` is not used: its values may change between releases.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The generator behind every random draw.
pub type Stream = ChaCha8Rng;

/// What a stream is drawn for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Purpose {
    /// Shape of a phantom body. Key: its number.
    PhantomShape,
    /// Texture of a phantom's tissues. Key: its number.
    PhantomTexture,
    /// Perturbation of the nominal cuts. Key: hip and fragment.
    Cuts,
    /// Movement of fragment and femur. Key: hip, fragment and movement.
    Movement,
    /// Muscle intensities in vacated voxels. Key: case.
    MuscleFill,
    /// K-wires. Key: case.
    Wires,
    /// The three views' geometry. Key: case.
    Views,
    /// Photon noise. Key: case and view.
    Noise,
    /// The landmark pick in 2D and 3D. Key: case and initialization.
    Pick,
    /// Simulated cut annotations. Key: case and view.
    Annotation,
    /// RANSAC plane fits. Key: registration without its scenario.
    Ransac,
    /// CMA-ES populations. Key: registration without its scenario, and stage.
    Optimizer,
    /// Bootstrap resampling in reports. Key: the statistic's name.
    Bootstrap,
    /// Hounsfield values assigned to a specimen made from surfaces. Key: specimen.
    AssignedDensity,
}

impl Purpose {
    fn name(self) -> &'static str {
        match self {
            Self::PhantomShape => "phantom-shape",
            Self::PhantomTexture => "phantom-texture",
            Self::Cuts => "cuts",
            Self::Movement => "movement",
            Self::MuscleFill => "muscle-fill",
            Self::Wires => "wires",
            Self::Views => "views",
            Self::Noise => "noise",
            Self::Pick => "pick",
            Self::Annotation => "annotation",
            Self::Ransac => "ransac",
            Self::Optimizer => "optimizer",
            Self::Bootstrap => "bootstrap",
            Self::AssignedDensity => "assigned-density",
        }
    }
}

/// The stream of `seed` for one purpose and the key of the thing drawn
/// (`phantom-1/left/f03/m07`, for instance).
pub fn stream(seed: u64, purpose: Purpose, key: &str) -> Stream {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&seed.to_le_bytes());
    hasher.update(purpose.name().as_bytes());
    hasher.update(&[0]);
    hasher.update(key.as_bytes());
    ChaCha8Rng::from_seed(*hasher.finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn streams_are_repeatable_and_distinct() {
        let first = |purpose, key: &str| stream(1, purpose, key).next_u64();
        assert_eq!(
            first(Purpose::Cuts, "a/left/f00"),
            first(Purpose::Cuts, "a/left/f00")
        );
        assert_ne!(
            first(Purpose::Cuts, "a/left/f00"),
            first(Purpose::Cuts, "a/left/f01")
        );
        assert_ne!(
            first(Purpose::Cuts, "a/left/f00"),
            first(Purpose::Movement, "a/left/f00")
        );
    }

    /// A change of these values changes every study; a new purpose adds a line and changes none.
    #[test]
    fn the_first_value_of_every_purpose_is_pinned() {
        let purposes = [
            Purpose::PhantomShape,
            Purpose::PhantomTexture,
            Purpose::Cuts,
            Purpose::Movement,
            Purpose::MuscleFill,
            Purpose::Wires,
            Purpose::Views,
            Purpose::Noise,
            Purpose::Pick,
            Purpose::Annotation,
            Purpose::Ransac,
            Purpose::Optimizer,
            Purpose::Bootstrap,
            Purpose::AssignedDensity,
        ];
        let lines: Vec<String> = purposes
            .iter()
            .map(|&purpose| {
                let first = stream(20190506, purpose, "key").next_u64();
                format!("{} {first:016x}", purpose.name())
            })
            .collect();
        insta::assert_snapshot!(lines.join("\n"), @r"
        phantom-shape 6440628e3fe10299
        phantom-texture f0f0172827a81b6e
        cuts a5f7eab3755a9253
        movement baabb72922b9ce52
        muscle-fill 831499dee72896ad
        wires c46426c72861a6be
        views 83783fd91be417cc
        noise da7e2074ce670767
        pick 98b00d531dabee2d
        annotation e0009e1df5a489d5
        ransac 7ecadf5d1cfd7145
        optimizer c55adee757ecbcd8
        bootstrap c4b527152d1d97af
        assigned-density 1f248961d9da7204
        ");
    }

    #[test]
    fn values_are_pinned() {
        let mut s = stream(20190506, Purpose::Movement, "phantom-1/left/f00/m00");
        insta::assert_snapshot!(format!("{:016x} {:016x}", s.next_u64(), s.next_u64()), @"541c93effb71e12b 62397d372453404e");
    }
}
