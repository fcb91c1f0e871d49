//! Draws of one hip, each with what became of it, as a table on disk.

use crate::voxels::VoxelTest;
use pao_sim::anatomy::{Hip, Label};
use pao_sim::geometry::{Point, PoseError};
use pao_sim::random::{Purpose, stream};
use pao_sim::simulation::{Movement, MovementParameters};
use pao_sim::surgery::collision::{Contact, Pair};
use pao_sim::surgery::{
    CollisionModel, CollisionParameters, Cut, FragmentParameters, FragmentSamplingParameters,
    NominalCutParameters, SurgeryMap, cut_fragment, nominal_cuts, sample_fragment,
};
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::path::Path;

/// One draw of a movement. Components have the signs of Table S-5.
#[derive(Debug, Serialize, Deserialize)]
pub struct Draw {
    pub hip: String,
    pub fragment: usize,
    pub movement: usize,
    pub rotation_deg: f64,
    pub translation_mm: f64,
    pub lr_deg: f64,
    pub is_deg: f64,
    pub ap_deg: f64,
    pub medial_mm: f64,
    pub superior_mm: f64,
    pub anterior_mm: f64,
    /// `free`, or the first pair that overlaps.
    pub outcome: String,
    /// The cut next to which most of the fragment's overlap with the pelvis lies.
    pub cut: String,
    /// Whether the test on voxels finds no overlap; empty when it was not asked.
    pub voxel_free: Option<bool>,
}

impl Draw {
    pub fn is_free(&self) -> bool {
        self.outcome == "free"
    }

    /// The components in the order of [`COMPONENTS`].
    pub fn components(&self) -> [f64; 6] {
        [
            self.lr_deg,
            self.is_deg,
            self.ap_deg,
            self.medial_mm,
            self.superior_mm,
            self.anterior_mm,
        ]
    }
}

/// Names of a draw's components.
pub const COMPONENTS: [&str; 6] = [
    "LR deg",
    "IS deg",
    "AP deg",
    "medial mm",
    "superior mm",
    "anterior mm",
];

/// What is drawn.
pub struct Plan {
    /// Random fragments a hip; 0 takes the nominal one.
    pub fragments: usize,
    pub movements: usize,
    pub seed: u64,
    pub collision: CollisionParameters,
    pub voxel_test: bool,
}

/// The surgeries of a hip.
pub fn surgery(hip: &Hip, plan: &Plan, f: usize) -> Result<SurgeryMap, Box<dyn Error>> {
    let cuts = nominal_cuts(hip, &NominalCutParameters::default())?;
    Ok(if plan.fragments == 0 {
        cut_fragment(hip, &cuts, &FragmentParameters::default())?
    } else {
        let parameters = FragmentSamplingParameters::default();
        let key = format!("{}/f{f:02}", hip.key());
        sample_fragment(hip, &cuts, &parameters, plan.seed, &key)?.0
    })
}

/// All draws of a hip up to the last accepted one, in their order.
pub fn draws_of(hip: &Hip, plan: &Plan) -> Result<Vec<Draw>, Box<dyn Error>> {
    let parameters = MovementParameters::default();
    let mut all = Vec::new();
    for f in 0..plan.fragments.max(1) {
        let map = surgery(hip, plan, f)?;
        let model = CollisionModel::new(hip, &map.labels, &plan.collision)?;
        let voxels = plan
            .voxel_test
            .then(|| VoxelTest::new(hip, &map.labels, plan.collision.opening_radius_mm));
        let places = Places::new(hip, &map);
        for m in 0..plan.movements {
            let key = format!("{}/f{f:02}/m{m:02}", hip.key());
            let mut stream = stream(plan.seed, Purpose::Movement, &key);
            loop {
                let movement = parameters.draw(hip.side, &mut stream);
                let hit = model.first_collision(&movement.fragment, &movement.femur);
                let mut draw = described(hip, &movement, hit.map(outcome));
                (draw.fragment, draw.movement) = (f, m);
                if let Some((Pair::FragmentPelvis, _)) = hit {
                    draw.cut = places.cut_of(hip, &map, &movement).to_owned();
                }
                let free_of_voxels = |test: &VoxelTest| !test.overlaps(hip, &movement.fragment);
                draw.voxel_free = voxels.as_ref().map(free_of_voxels);
                all.push(draw);
                if hit.is_none() {
                    break;
                }
            }
        }
        eprintln!("{}/f{f:02}: {} draws", hip.key(), all.len());
    }
    Ok(all)
}

fn outcome((pair, contact): (Pair, Contact)) -> &'static str {
    match (contact, pair) {
        (Contact::Containment, _) => "containment",
        (_, Pair::FragmentPelvis) => "fragment-pelvis",
        (_, Pair::JoinedFemurPelvis) => "joined femur-pelvis",
        (_, Pair::FemurPelvis) => "femur-pelvis",
        (_, Pair::FemurFragment) => "femur-fragment",
    }
}

fn described(hip: &Hip, movement: &Movement, outcome: Option<&str>) -> Draw {
    let size = PoseError::of(&movement.fragment);
    let (r, t) = (size.rotation_axes_deg, size.translation_axes_mm);
    let s = hip.side.lateral_sign();
    Draw {
        hip: hip.key(),
        fragment: 0,
        movement: 0,
        rotation_deg: size.rotation_deg,
        translation_mm: size.translation_mm,
        lr_deg: r.x,
        is_deg: s * r.y,
        ap_deg: -s * r.z,
        medial_mm: -s * t.x,
        superior_mm: t.y,
        anterior_mm: t.z,
        outcome: outcome.unwrap_or("free").to_owned(),
        cut: String::new(),
        voxel_free: None,
    }
}

/// Points of a fragment, to see where it overlaps.
struct Places {
    points: Vec<Point>,
}

/// Every how many voxels of the fragment one is looked at.
const EVERY: usize = 7;

impl Places {
    fn new(hip: &Hip, map: &SurgeryMap) -> Self {
        let grid = &map.labels.grid;
        let of_fragment = |&o: &usize| map.labels.data[o] == Label::Fragment.value();
        let points = (0..map.labels.data.len())
            .filter(of_fragment)
            .step_by(EVERY)
            .map(|o| hip.app_from_volume * grid.center(grid.voxel(o)))
            .collect();
        Self { points }
    }

    /// The name of the cut next to which most points lie in the pelvis; empty if none does. These are
    /// the labels as they are, not opened.
    fn cut_of(&self, hip: &Hip, map: &SurgeryMap, movement: &Movement) -> &'static str {
        let volume_from_app = hip.app_from_volume.inverse();
        let mut near = [0usize; 4];
        for p in &self.points {
            let moved = volume_from_app * (movement.fragment * p);
            if map.labels.nearest(&moved) == Some(Label::Pelvis.value()) {
                let distance = Cut::ALL.map(|c| map.cuts.get(c).signed_distance(p).abs());
                let closest = (0..4).min_by(|&a, &b| distance[a].total_cmp(&distance[b]));
                near[closest.expect("there are four cuts")] += 1;
            }
        }
        let most = (0..4)
            .max_by_key(|&c| near[c])
            .expect("there are four cuts");
        if near[most] == 0 {
            ""
        } else {
            Cut::ALL[most].name()
        }
    }
}

/// Writes a table whole or not at all.
pub fn write(path: &Path, draws: &[Draw]) -> Result<(), Box<dyn Error>> {
    let partial = path.with_extension("partial");
    let mut writer = csv::Writer::from_path(&partial)?;
    for draw in draws {
        writer.serialize(draw)?;
    }
    writer.flush()?;
    std::fs::rename(partial, path)?;
    Ok(())
}

/// Reads a table.
pub fn read(path: &Path) -> Result<Vec<Draw>, Box<dyn Error>> {
    let rows = csv::Reader::from_path(path)?.into_deserialize();
    Ok(rows.collect::<Result<_, _>>()?)
}
