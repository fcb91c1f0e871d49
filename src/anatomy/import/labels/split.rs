//! From a label map's values to the five bones.

use super::halves::midsagittal;
use super::table::LabelTable;
use crate::anatomy::import::{CtImportError, LabelMeaning, Note};
use crate::anatomy::structure::largest;
use crate::anatomy::{Side, Structure, StructureLabels};
use crate::geometry::{Point, Vector};
use crate::volume::Volume;
use crate::volume::components::{Components, components};

/// Two pieces are a pair when the smaller has at least this part of the larger one's voxels.
const PAIR: f64 = 0.5;

/// A piece of at least this part of the largest one's voxels is a bone, not noise: a sacrum has a
/// third to two thirds of a hip bone's.
const BONE: f64 = 0.15;

/// The bones of a label map. Where one value stands for several:
///
/// - *femora* are told apart as separate pieces, by LPS x;
/// - *hips* likewise or, where they are one piece, cut at the midsagittal plane;
/// - *pelvis* falls into three pieces, or a sacrum and both hip bones in one, which are cut as above. A
///   sacrum that is joined to them is refused.
///
/// # Errors
/// When the values cannot be told apart so.
pub fn structures_of_labels(
    map: &Volume<u8>,
    table: &LabelTable,
) -> Result<(StructureLabels, Vec<Note>), CtImportError> {
    let mut bones = map.map(|_| 0u8);
    let mut notes = Vec::new();
    let mut of: [Option<LabelMeaning>; 256] = [None; 256];
    for (value, meaning) in table.iter() {
        of[usize::from(value)] = Some(meaning);
        if !map.data.contains(&value) {
            notes.push(Note::Reader(format!(
                "the label map has no voxel of value {value} ({})",
                meaning.name()
            )));
        }
    }
    for (bone, &value) in bones.data.iter_mut().zip(&map.data) {
        if let Some(LabelMeaning::One(structure)) = of[usize::from(value)] {
            *bone = structure.value();
        }
    }
    for meaning in [
        LabelMeaning::Femora,
        LabelMeaning::Hips,
        LabelMeaning::Pelvis,
    ] {
        let part = map.map(|v| of[usize::from(v)] == Some(meaning));
        let Some((min, max)) = part.bounds(|v| v) else {
            continue;
        };
        let pieces = Pieces::new(part.cropped(min, max));
        let split = match meaning {
            LabelMeaning::Femora => pieces.femora(),
            LabelMeaning::Hips => pieces.hips(&mut notes),
            _ => pieces.pelvis(&mut notes),
        }
        .map_err(CtImportError::Labels)?;
        for (offset, &value) in split.data.iter().enumerate() {
            if value != 0 {
                let [i, j, k] = split.grid.voxel(offset);
                let at = bones.grid.offset(i + min[0], j + min[1], k + min[2]);
                bones.data[at] = value;
            }
        }
    }
    Ok((StructureLabels::new(bones), notes))
}

/// The pieces of one value.
struct Pieces {
    found: Components,
    /// Of piece `n` at `n - 1`, in the world.
    centroids: Vec<Point>,
    /// Those large enough for a bone, largest first: (number, voxels, centroid in the world).
    bones: Vec<(u32, usize, Point)>,
}

impl Pieces {
    fn new(mask: Volume<bool>) -> Self {
        let found = components(&mask);
        let centroids = centroids(&found);
        let order = largest(&found, 4);
        let most = found.sizes[order[0] as usize - 1] as f64;
        let size = |n: u32| found.sizes[n as usize - 1];
        let bones = order
            .into_iter()
            .filter(|&n| size(n) as f64 >= BONE * most)
            .map(|n| (n, size(n), centroids[n as usize - 1]))
            .collect();
        Self {
            found,
            centroids,
            bones,
        }
    }

    /// The two largest pieces as (left, right), if they are a pair.
    fn pair(&self) -> Option<[(u32, Point); 2]> {
        let (&(a, more, at_a), &(b, less, at_b)) = (self.bones.first()?, self.bones.get(1)?);
        let alike = less as f64 >= PAIR * more as f64;
        alike.then(|| match at_a.x > at_b.x {
            true => [(a, at_a), (b, at_b)],
            false => [(b, at_b), (a, at_a)],
        })
    }

    /// Every piece to the nearest of some main ones.
    fn assigned(&self, mains: &[(Point, Structure)]) -> Volume<u8> {
        let nearest = |at: &Point| {
            let distance = |main: &&(Point, Structure)| (main.0 - at).norm();
            mains
                .iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .map_or(0, |main| main.1.value())
        };
        let mut values = vec![0u8];
        values.extend(self.centroids.iter().map(nearest));
        self.found.labels.map(|n| values[n as usize])
    }

    fn femora(&self) -> Result<Volume<u8>, String> {
        let [(_, left), (_, right)] = self.pair().ok_or(
            "femora: expected two separate pieces of like size; they touch each other, or one is not in \
             the map. Give each femur a value of its own",
        )?;
        Ok(self.assigned(&[
            (left, Structure::Femur(Side::Left)),
            (right, Structure::Femur(Side::Right)),
        ]))
    }

    fn hips(&self, notes: &mut Vec<Note>) -> Result<Volume<u8>, String> {
        if let Some([(_, left), (_, right)]) = self.pair() {
            return Ok(self.assigned(&[
                (left, Structure::Hip(Side::Left)),
                (right, Structure::Hip(Side::Right)),
            ]));
        }
        let halves = self.halves(|_| true, "hips")?;
        notes.push(Note::Reader(
            "hips: both hip bones are one piece and were told apart at the midsagittal plane"
                .into(),
        ));
        Ok(halves)
    }

    fn pelvis(&self, notes: &mut Vec<Note>) -> Result<Volume<u8>, String> {
        let mut across = self.bones.clone();
        across.truncate(3);
        across.sort_by(|a, b| a.2.x.total_cmp(&b.2.x));
        if let [right, middle, left] = across[..] {
            let smaller = right.1.min(left.1) as f64;
            if smaller < PAIR * right.1.max(left.1) as f64 {
                return Err(
                    "pelvis: of its three largest pieces the outer two are not of like size; give sacrum \
                     and hip bones values of their own"
                        .into(),
                );
            }
            return Ok(self.assigned(&[
                (middle.2, Structure::Sacrum),
                (left.2, Structure::Hip(Side::Left)),
                (right.2, Structure::Hip(Side::Right)),
            ]));
        }
        // Both hip bones joined at the symphysis, the sacrum by itself behind their middle.
        if let [hips, sacrum] = self.bones[..]
            && (sacrum.1 as f64) < PAIR * hips.1 as f64
            && sacrum.2.y > hips.2.y
        {
            let mut halves = self.halves(|n| n == hips.0, "pelvis")?;
            for (value, &n) in halves.data.iter_mut().zip(&self.found.labels.data) {
                if n == sacrum.0 {
                    *value = Structure::Sacrum.value();
                }
            }
            notes.push(Note::Reader(
                "pelvis: both hip bones are one piece and were told apart at the midsagittal plane"
                    .into(),
            ));
            return Ok(halves);
        }
        // A half with its half of the sacrum was tried on six people: the ischial spine is then not found, and
        // the greater sciatic notch lies elsewhere.
        Err(
            "pelvis: the sacrum is joined to the hip bones, whose landmarks cannot be found so; give the \
             sacrum a value of its own"
                .into(),
        )
    }

    /// The pieces for which `which` is true, cut at their midsagittal plane.
    fn halves(&self, which: impl Fn(u32) -> bool, what: &str) -> Result<Volume<u8>, String> {
        let mask = self.found.labels.map(|n| n != 0 && which(n));
        let (at, normal) = midsagittal(&mask, Vector::x()).ok_or_else(|| {
            format!(
                "{what}: one piece whose left and right halves are not of like size; is a bone missing? Give \
                 the bones values of their own"
            )
        })?;
        let mut halves = mask.map(|_| 0u8);
        for offset in 0..mask.data.len() {
            if mask.data[offset] {
                let p = mask.grid.center(mask.grid.voxel(offset));
                let side = match (p - at).dot(&normal) > 0.0 {
                    true => Side::Left,
                    false => Side::Right,
                };
                halves.data[offset] = Structure::Hip(side).value();
            }
        }
        Ok(halves)
    }
}

/// The centroid of each component, in the world.
fn centroids(found: &Components) -> Vec<Point> {
    let grid = &found.labels.grid;
    let mut sums = vec![Vector::zeros(); found.sizes.len()];
    for (offset, &n) in found.labels.data.iter().enumerate() {
        if n != 0 {
            let [i, j, k] = grid.voxel(offset);
            sums[n as usize - 1] += Vector::new(i as f64, j as f64, k as f64);
        }
    }
    let means = sums
        .iter()
        .zip(&found.sizes)
        .map(|(sum, &n)| sum / n as f64);
    means.map(|m| grid.point(m.x, m.y, m.z)).collect()
}
