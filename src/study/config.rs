//! The configuration of a study: what `pao-sim run` takes.
//!
//! Every key has the paper's value as its default, so a file says only what differs. The structs
//! of the modules below are nested as they are; [`super::config_file`] reads and checks a file.

use super::key::is_name;
use super::population_folder::specimens_in;
use super::{Scenario, StrategyParameters};
use crate::anatomy::phantom::PhantomParameters;
use crate::anatomy::surfaces::SurfacesParameters;
use crate::anatomy::{LceApex, Side, is_specimen_name};
use crate::geometry::{Point, Vector};
use crate::simulation::{
    AnnotationParameters, FluoroscopyParameters, MovementParameters, PickParameters,
    ViewParameters, WarpParameters, WireInsertionParameters,
};
use crate::surgery::{
    CollisionParameters, FragmentParameters, FragmentSamplingParameters, KWireParameters,
    NominalCutParameters, PlausibilityParameters, RandomCutParameters,
};
use crate::xray::{AttenuationParameters, Camera, Orbit};
use nalgebra::Unit;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A whole study.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Config {
    pub study: StudySection,
    pub population: PopulationSection,
    pub surgery: SurgerySection,
    pub movement: MovementSection,
    pub xray: XraySection,
    /// One entry a strategy, by the name that keys and tables have; `paper` alone by default.
    pub registration: BTreeMap<String, StrategyParameters>,
    pub run: RunSection,
}

/// `[study]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StudySection {
    /// Name of the study and of its folder under `results/`: letters, digits, `-` and `_`. Default:
    /// the configuration file's name.
    pub name: String,
    /// Seed of every random draw; equal seeds give equal results. Default 20190506.
    pub seed: u64,
    /// A sentence for the report's head.
    pub description: String,
    /// Says in which way the study is reduced, where its figures are no results; the report prints
    /// it above every table. Empty (default) for a study that stands for itself.
    pub reduced: String,
    /// Scenarios to register; default all four.
    pub scenarios: Vec<Scenario>,
    /// Noisy picks of each case, each registered in every scenario. Default 5, at most 1000.
    pub initializations: u32,
}

impl Default for StudySection {
    fn default() -> Self {
        Self {
            name: String::new(),
            seed: 20190506,
            description: String::new(),
            reduced: String::new(),
            scenarios: Scenario::ALL.to_vec(),
            initializations: 5,
        }
    }
}

/// `[population]`: whose hips are operated on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PopulationSection {
    /// Phantom bodies: how many (`phantoms = 6`), or their numbers (`phantoms = [1, 4]`; phantom 1
    /// is named `phantom-1`). Default 6.
    #[serde(deserialize_with = "numbers")]
    pub phantoms: Vec<u32>,
    /// Folders of specimens (`pao-sim specimen import` writes them), or folders that hold such, which stand
    /// for each of these by name; relative paths start at the configuration's folder. Default none.
    pub specimens: Vec<PathBuf>,
    /// Folders of closed bone surfaces (PLY, RAS, mm), each made into a specimen when it is first
    /// needed; relative paths as above. They carry no density: it is assigned by rule. Default none.
    pub surfaces: Vec<PathBuf>,
    /// Sides that are operated on. Default both.
    pub sides: Vec<Side>,
    /// What the phantom bodies are like.
    pub phantom: PhantomParameters,
    /// What is assigned to bone surfaces.
    pub surface_bodies: SurfacesParameters,
}

impl Default for PopulationSection {
    fn default() -> Self {
        Self {
            phantoms: (1..=6).collect(),
            specimens: Vec::new(),
            surfaces: Vec::new(),
            surface_bodies: SurfacesParameters::default(),
            sides: Side::BOTH.to_vec(),
            phantom: PhantomParameters::default(),
        }
    }
}

/// Where a specimen comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SpecimenSource {
    /// The phantom body of a number, from 1.
    Phantom(u32),
    /// A specimen's folder.
    Folder(PathBuf),
    /// A folder of closed bone surfaces.
    Surfaces(PathBuf),
}

impl SpecimenSource {
    /// The name in keys and tables: `phantom-1`, or the folder's.
    pub fn name(&self) -> String {
        match self {
            Self::Phantom(number) => format!("phantom-{number}"),
            Self::Folder(path) | Self::Surfaces(path) => {
                let name = path.file_name().map(|name| name.to_string_lossy());
                name.unwrap_or_default().into_owned()
            }
        }
    }
}

impl PopulationSection {
    /// Every specimen, phantoms first.
    pub fn sources(&self) -> Vec<SpecimenSource> {
        let phantoms = self.phantoms.iter().copied().map(SpecimenSource::Phantom);
        let folders = self.specimens.iter().cloned().map(SpecimenSource::Folder);
        let surfaces = self.surfaces.iter().cloned().map(SpecimenSource::Surfaces);
        phantoms.chain(folders).chain(surfaces).collect()
    }

    /// Puts the specimens of a folder in its place; gives what is wrong with folders that hold none.
    pub(super) fn expand_folders(&mut self) -> Vec<String> {
        let mut problems = Vec::new();
        let named = std::mem::take(&mut self.specimens);
        for path in named {
            match specimens_in(&path) {
                Ok(found) => self.specimens.extend(found),
                Err(problem) => problems.push(problem),
            }
        }
        problems
    }

    /// Makes every path absolute; relative ones start at the folder of the configuration `file`.
    pub(super) fn resolve_paths(&mut self, file: &Path) {
        let folder = file.parent().unwrap_or(Path::new(""));
        for path in self.specimens.iter_mut().chain(&mut self.surfaces) {
            let whole = folder.join(&*path);
            // Without a working directory the path stays as it is, and reading it tells.
            *path = std::path::absolute(&whole).unwrap_or(whole);
        }
    }
}

/// Reads a number as 1 to that number, or a list as it stands.
fn numbers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u32>, D::Error> {
    struct Numbers;
    impl<'de> Visitor<'de> for Numbers {
        type Value = Vec<u32>;

        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            f.write_str("how many phantoms (0 to 1000), or a list of their numbers")
        }

        fn visit_i64<E: de::Error>(self, count: i64) -> Result<Vec<u32>, E> {
            match u32::try_from(count) {
                Ok(count @ 0..=1000) => Ok((1..=count).collect()),
                _ => Err(E::invalid_value(de::Unexpected::Signed(count), &self)),
            }
        }

        fn visit_seq<A: de::SeqAccess<'de>>(self, mut list: A) -> Result<Vec<u32>, A::Error> {
            let mut numbers = Vec::new();
            while let Some(number) = list.next_element()? {
                numbers.push(number);
            }
            Ok(numbers)
        }
    }
    deserializer.deserialize_any(Numbers)
}

/// `[surgery]`: the osteotomies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurgerySection {
    /// Random perturbations of the nominal cuts of each hip. Default 15, at most 1000.
    pub fragments: u32,
    /// Where the planned cuts lie.
    pub nominal: NominalCutParameters,
    /// How far random cuts are from the planned ones.
    pub random_cuts: RandomCutParameters,
    /// How cuts become a fragment.
    pub fragment: FragmentParameters,
    /// Which fragments are taken.
    pub plausibility: PlausibilityParameters,
    /// Random cuts after which a fragment is given up. Default 2000.
    pub max_draws: usize,
}

impl Default for SurgerySection {
    fn default() -> Self {
        let sampling = FragmentSamplingParameters::default();
        Self {
            fragments: 15,
            nominal: NominalCutParameters::default(),
            random_cuts: sampling.random_cuts,
            fragment: sampling.fragment,
            plausibility: sampling.plausibility,
            max_draws: sampling.max_draws,
        }
    }
}

impl SurgerySection {
    /// How fragments are drawn.
    pub fn sampling(&self) -> FragmentSamplingParameters {
        FragmentSamplingParameters {
            random_cuts: self.random_cuts.clone(),
            fragment: self.fragment.clone(),
            plausibility: self.plausibility.clone(),
            max_draws: self.max_draws,
        }
    }
}

/// `[movement]`: how fragment and femur are moved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MovementSection {
    /// Collision-free movements of each fragment. Default 20, at most 1000.
    pub movements: u32,
    /// Ranges of the random movements.
    pub sampling: MovementParameters,
    /// What counts as a collision.
    pub collision: CollisionParameters,
    /// Where the LCE angle's apex lies after the operation: `preoperative_head` (default) or
    /// `moved_head`.
    pub lce_apex: LceApex,
}

impl Default for MovementSection {
    fn default() -> Self {
        Self {
            movements: 20,
            sampling: MovementParameters::default(),
            collision: CollisionParameters::default(),
            lce_apex: LceApex::default(),
        }
    }
}

/// `[xray]`: the C-arm, the views and the fluoroscopy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct XraySection {
    pub c_arm: CArmParameters,
    /// Hounsfield units to attenuation, of fluoroscopy and DRRs alike.
    pub attenuation: AttenuationParameters,
    /// Where the C-arm stands.
    pub views: ViewParameters,
    /// The K-wires that hold the fragment.
    pub wires: KWireParameters,
    /// How the wires get into the volume.
    pub wire_insertion: WireInsertionParameters,
    /// What fills the voxels that bone left.
    pub warp: WarpParameters,
    pub fluoroscopy: FluoroscopyParameters,
    /// The noisy pick of the landmark.
    pub pick: PickParameters,
    /// How cut lines are annotated.
    pub annotation: AnnotationParameters,
}

/// The C-arm's geometry; the Siemens CIOS Fusion by default (paper, section on registration; facts
/// 2.11).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CArmParameters {
    /// Columns and rows of the square detector. Default 1536.
    pub detector_px: usize,
    /// Distance of neighbouring pixel centres in mm. Default 0.194.
    pub pixel_mm: f64,
    /// Distance from the source to the detector in mm. Default 1020.
    pub source_detector_mm: f64,
    /// Isocentre of the orbital rotation in the camera frame in mm. Default (-157.6, -2.7, -631.8).
    pub isocenter_mm: [f64; 3],
    /// Axis of the orbital rotation in the camera frame, of any length. Default (0, -1, 0).
    pub orbital_axis: [f64; 3],
}

impl Default for CArmParameters {
    fn default() -> Self {
        let (camera, orbit) = (Camera::cios_fusion(), Orbit::cios_fusion());
        Self {
            detector_px: camera.width,
            pixel_mm: camera.pixel_mm,
            source_detector_mm: camera.source_detector_mm,
            isocenter_mm: orbit.isocenter.coords.into(),
            // Adding zero turns -0 into 0.
            orbital_axis: orbit.axis.into_inner().map(|v| v + 0.0).into(),
        }
    }
}

impl CArmParameters {
    /// The full, uncropped image's camera.
    pub fn camera(&self) -> Camera {
        Camera::centered(self.detector_px, self.pixel_mm, self.source_detector_mm)
    }

    /// The orbit.
    pub fn orbit(&self) -> Orbit {
        Orbit {
            isocenter: Point::from(self.isocenter_mm),
            axis: Unit::new_normalize(Vector::from(self.orbital_axis)),
        }
    }

    fn problems(&self) -> Problems {
        let mut p = Problems::default();
        p.range(
            "detector_px",
            self.detector_px as f64,
            32.0,
            8192.0,
            "pixels",
        );
        p.range("pixel_mm", self.pixel_mm, 0.01, 10.0, "mm");
        p.range(
            "source_detector_mm",
            self.source_detector_mm,
            300.0,
            3000.0,
            "mm",
        );
        for (axis, value) in ["x", "y", "z"].into_iter().zip(self.isocenter_mm) {
            p.range(
                &format!("isocenter_mm[{axis}]"),
                value,
                -3000.0,
                3000.0,
                "mm",
            );
        }
        let length = Vector::from(self.orbital_axis).norm();
        if !(length.is_finite() && length > 1e-6) {
            p.add(
                "orbital_axis",
                format!("is {:?}; expected a direction", self.orbital_axis),
            );
        }
        p
    }
}

/// `[run]`: how the work is done. Nothing here changes a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RunSection {
    /// Threads; 0 (default) takes one a core.
    pub threads: usize,
    /// Simulated cases that may be held at once (about half a gigabyte each at full size); 0
    /// (default) takes as many as keep the threads busy.
    pub cases_in_flight: usize,
}

/// Field names with what is wrong and what is expected.
#[derive(Debug, Default)]
struct Problems(Vec<(String, String)>);

impl Problems {
    fn add(&mut self, field: &str, problem: String) {
        self.0.push((field.to_owned(), problem));
    }

    fn range(&mut self, field: &str, value: f64, low: f64, high: f64, unit: &str) {
        if !(low..=high).contains(&value) {
            self.add(
                field,
                format!("is {value}; expected {low} to {high} {unit}"),
            );
        }
    }

    fn count(&mut self, field: &str, value: u32) {
        self.range(field, f64::from(value), 1.0, 1000.0, "");
    }

    fn distinct<T: PartialEq + std::fmt::Debug>(&mut self, field: &str, values: &[T]) {
        for (place, value) in values.iter().enumerate() {
            if values[..place].contains(value) {
                self.add(field, format!("lists {value:?} twice; name each once"));
            }
        }
    }

    fn nest(&mut self, section: &str, problems: Vec<(String, String)>) {
        for (field, problem) in problems {
            self.0.push((format!("{section}.{field}"), problem));
        }
    }
}

impl Config {
    /// Every value out of range, as (`section.key`, what is wrong and what is expected).
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut p = Problems::default();
        let study = &self.study;
        if !is_name(&study.name) {
            let found = &study.name;
            p.add(
                "study.name",
                format!("is \"{found}\"; expected letters, digits, - and _"),
            );
        }
        if study.seed > i64::MAX as u64 {
            p.add(
                "study.seed",
                format!("is {}; expected at most {}", study.seed, i64::MAX),
            );
        }
        p.count("study.initializations", study.initializations);
        if study.scenarios.is_empty() {
            let names = Scenario::ALL.map(Scenario::name).join(", ");
            p.add(
                "study.scenarios",
                format!("is empty; expected some of {names}"),
            );
        }
        p.distinct("study.scenarios", &study.scenarios);

        let population = &self.population;
        if population.sources().is_empty() {
            p.add(
                "population",
                "names nobody; set phantoms, specimens or surfaces".into(),
            );
        }
        if population.phantoms.contains(&0) {
            p.add(
                "population.phantoms",
                "names phantom 0; they are numbered from 1".into(),
            );
        }
        p.distinct("population.phantoms", &population.phantoms);
        let names: Vec<String> = population
            .sources()
            .iter()
            .map(SpecimenSource::name)
            .collect();
        for (place, name) in names.iter().enumerate().skip(population.phantoms.len()) {
            if !is_specimen_name(name) {
                let expected = "expected a folder named with letters, digits and -";
                p.add(
                    "population",
                    format!("names a specimen \"{name}\"; {expected}"),
                );
            } else if names[..place].contains(name) {
                p.add(
                    "population",
                    format!("names a second specimen {name}; rename one"),
                );
            }
        }
        if population.sides.is_empty() {
            p.add(
                "population.sides",
                "is empty; expected left, right or both".into(),
            );
        }
        p.distinct("population.sides", &population.sides);

        p.nest("population.phantom", population.phantom.problems());
        p.nest(
            "population.surface_bodies",
            population.surface_bodies.problems(),
        );

        p.count("surgery.fragments", self.surgery.fragments);
        p.nest("surgery.nominal", self.surgery.nominal.problems());
        p.nest("surgery", self.surgery.sampling().problems());
        p.count("movement.movements", self.movement.movements);
        p.nest("movement.sampling", self.movement.sampling.problems());
        p.nest("movement.collision", self.movement.collision.problems());

        let xray = &self.xray;
        p.nest("xray.c_arm", xray.c_arm.problems().0);
        p.nest("xray.attenuation", xray.attenuation.problems());
        p.nest("xray.views", xray.views.problems());
        p.nest("xray.wires", xray.wires.problems());
        p.nest("xray.wire_insertion", xray.wire_insertion.problems());
        p.nest("xray.warp", xray.warp.problems());
        p.nest("xray.fluoroscopy", xray.fluoroscopy.problems());
        p.nest("xray.pick", xray.pick.problems());
        p.nest("xray.annotation", xray.annotation.problems());

        for (name, strategy) in &self.registration {
            let section = format!("registration.{name}");
            if !is_name(name) {
                p.add(
                    &section,
                    "has a name with other than letters, digits, - and _".into(),
                );
            }
            p.nest(&section, strategy.problems());
        }
        p.0
    }
}
