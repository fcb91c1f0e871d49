//! A CT and its segmentation to a specimen.

use super::clean::clean;
use super::error::CtImportError;
use super::grid::{Lattice, around_bones, check_overlap, same_grid};
use super::note::Note;
use super::origin::CtOrigin;
use super::parameters::CtImportParameters;
use crate::anatomy::detect::{
    BoneSurfaces, Detected, Given, Marks, by_reason, by_rule_but, detect_with,
};
use crate::anatomy::{Landmark, Landmarks, Side, Source, Specimen, Structure, StructureLabels};
use crate::geometry::Vector;
use crate::volume::resample::resample_labels;
use crate::volume::{Grid, Volume};

/// Room around the bones for the surfaces on which landmarks are sought (mm).
const SURFACE_MARGIN_MM: f64 = 5.0;

/// A femur that ends nearer below its head is worth a word (mm): heads differ in height by less than
/// what is missing from 150 mm here.
const FEMUR_MM: f64 = 145.0;

/// Thicker slices than this blur thin bone (mm): what `specimen check` takes for a specimen's voxels.
const THICK_MM: f64 = 1.5;

/// What a specimen is made of.
#[derive(Clone, Debug)]
pub struct CtImport {
    /// Hounsfield units.
    pub ct: Volume<i16>,
    /// The bones, on any grid of the same world.
    pub structures: StructureLabels,
    /// Of a landmark file, or of the data; they replace what is found by rule.
    pub given: Given,
    pub origin: CtOrigin,
    /// What the reader met.
    pub notes: Vec<Note>,
}

/// A specimen, and what a user should know about its making.
#[derive(Clone, Debug)]
pub struct Imported {
    pub specimen: Specimen,
    pub notes: Vec<Note>,
}

/// Makes a specimen. In this order:
///
/// 1. Of each bone the largest piece is kept and what it encloses is filled.
/// 2. The CT's lattice is the specimen's if its voxels have the wanted size and lie along the world's
///    axes; values then stay as they are. Otherwise it is a new one over the whole CT.
/// 3. Landmarks and rims are found on the bones' surfaces on that lattice; the given ones replace them.
/// 4. The CT is cropped above and below to what a study needs; its width and depth stay. Intensities
///    and labels get onto the lattice by [`crate::volume::resample`].
///
/// # Errors
/// When a bone is absent, CT and labels do not overlap, sides are swapped, or landmarks or rims are neither
/// found nor given ([`CtImportError::Landmarks`] has those that are).
pub fn specimen_from_ct(
    import: CtImport,
    parameters: &CtImportParameters,
) -> Result<Imported, CtImportError> {
    let voxel_mm = parameters.voxel_mm;
    if !(0.4..=3.0).contains(&voxel_mm) {
        return Err(CtImportError::VoxelSize(voxel_mm));
    }
    check_present(&import.structures)?;
    check_sides(&import.structures)?;
    let mut notes = import.notes;
    notes.extend(check_overlap(&import.ct.grid, &import.structures)?);
    let (structures, cleaned) = clean(&import.structures);
    notes.extend(cleaned);

    let lattice = Lattice::of(&import.ct.grid, voxel_mm);
    if let Lattice::New { .. } = lattice {
        notes.push(Note::Resampled {
            from: spacing(&import.ct.grid),
            voxel_mm,
            thick: import.ct.grid.spacing.iter().any(|mm| *mm > THICK_MM),
        });
    }
    // Values on the lattice already are read there without arithmetic, whatever a header rounded.
    let structures = match same_grid(&structures.volume().grid, &import.ct.grid) {
        true => Volume::new(import.ct.grid.clone(), structures.volume().data.clone()),
        false => structures.volume().clone(),
    };
    let structures = StructureLabels::new(structures);

    let (min, max) = around_bones(&structures, lattice.grid(), SURFACE_MARGIN_MM);
    let near = lattice.grid().cropped(min, max);
    let bones = StructureLabels::new(resample_labels(structures.volume(), &near));
    check_present(&bones)?;
    let surfaces = bones.surfaces(&parameters.surface);
    let marks = marks(&surfaces, &import.given)?;
    notes.extend(told(&marks));

    let (min, max) = ends(lattice.grid(), &surfaces, &marks.landmarks, parameters);
    let ct = lattice.ct(&import.ct, min, max);
    let labels = resample_labels(&structures.labels(), &ct.grid);
    notes.extend(short_femora(&surfaces, &marks.landmarks));
    let specimen = Specimen {
        name: import.origin.name.clone(),
        source: source(
            &import.ct.grid,
            &import.origin,
            &marks,
            &lattice,
            parameters,
        ),
        ct,
        labels,
        landmarks: marks.landmarks,
        rims: marks.rims,
    };
    Ok(Imported { specimen, notes })
}

fn check_present(structures: &StructureLabels) -> Result<(), CtImportError> {
    match structures.absent() {
        absent if absent.is_empty() => Ok(()),
        absent => Err(CtImportError::Absent(absent)),
    }
}

/// Left bones lie on the patient's left.
fn check_sides(structures: &StructureLabels) -> Result<(), CtImportError> {
    let grid = &structures.volume().grid;
    let mut sums = [Vector::zeros(); 6];
    let mut counts = [0.0f64; 6];
    for (offset, &value) in structures.volume().data.iter().enumerate() {
        if value != 0 {
            let [i, j, k] = grid.voxel(offset);
            sums[usize::from(value)] += Vector::new(i as f64, j as f64, k as f64);
            counts[usize::from(value)] += 1.0;
        }
    }
    let x = |structure: Structure| {
        let n = usize::from(structure.value());
        let mean = sums[n] / counts[n].max(1.0);
        grid.point(mean.x, mean.y, mean.z).x
    };
    for (what, left, right) in [
        (
            "hip bone",
            Structure::Hip(Side::Left),
            Structure::Hip(Side::Right),
        ),
        (
            "femur",
            Structure::Femur(Side::Left),
            Structure::Femur(Side::Right),
        ),
    ] {
        let apart_mm = x(right) - x(left);
        if apart_mm >= 0.0 {
            return Err(CtImportError::SidesSwapped { what, apart_mm });
        }
    }
    Ok(())
}

/// Landmarks and rims: found by rule, and the given ones in their place.
fn marks(surfaces: &BoneSurfaces, given: &Given) -> Result<Marks, CtImportError> {
    let found = detect_with(surfaces, &given.landmarks);
    let found = found.unwrap_or_else(|error| Detected::nothing(&error));
    Ok(found.completed(given)?)
}

/// What was given, and why that had to be.
pub(in crate::anatomy) fn told(marks: &Marks) -> Vec<Note> {
    let mut notes = Vec::new();
    if !marks.given.is_empty() {
        notes.push(Note::Overridden(marks.given.join(", ")));
    }
    let not_found = by_reason(&marks.not_found).into_iter();
    notes.extend(not_found.map(|(names, reason)| Note::NotDetected { names, reason }));
    notes
}

/// The lattice's voxels that a study needs, both ends included: all of the width and depth.
fn ends(
    lattice: &Grid,
    surfaces: &BoneSurfaces,
    landmarks: &Landmarks,
    parameters: &CtImportParameters,
) -> ([usize; 3], [usize; 3]) {
    let head = Side::BOTH
        .iter()
        .filter_map(|&side| landmarks.get(Landmark::Fh, side))
        .map(|p| p.z)
        .fold(f64::MAX, f64::min);
    let top = surfaces
        .hips
        .iter()
        .chain([&surfaces.sacrum])
        .flat_map(|s| s.vertices())
        .map(|p| p.z)
        .fold(f64::MIN, f64::max);
    let index = |z: f64| (z - lattice.origin.z) / lattice.spacing[2];
    let last = lattice.dims[2] - 1;
    let low = index(head - parameters.below_heads_mm).floor().max(0.0) as usize;
    let high = index(top + parameters.above_bones_mm).ceil().max(0.0) as usize;
    let high = high.min(last);
    (
        [0, 0, low.min(high)],
        [lattice.dims[0] - 1, lattice.dims[1] - 1, high],
    )
}

fn short_femora(surfaces: &BoneSurfaces, landmarks: &Landmarks) -> Vec<Note> {
    let mut notes = Vec::new();
    for side in Side::BOTH {
        let lowest = surfaces.femur(side).vertices().iter().map(|p| p.z);
        let end = lowest.fold(f64::MAX, f64::min);
        let below = landmarks.get(Landmark::Fh, side).map(|p| p.z - end);
        if let Some(found_mm) = below.filter(|&mm| mm < FEMUR_MM) {
            let structure = Structure::Femur(side);
            notes.push(Note::ShortFemur {
                structure,
                found_mm,
            });
        }
    }
    notes
}

/// A grid's voxels, for people.
fn spacing(grid: &Grid) -> String {
    let [i, j, k] = grid.spacing.map(|mm| (mm * 1000.0).round() / 1000.0);
    format!("{i} x {j} x {k} mm")
}

fn source(
    ct: &Grid,
    origin: &CtOrigin,
    marks: &Marks,
    lattice: &Lattice,
    parameters: &CtImportParameters,
) -> Source {
    let voxels = match lattice {
        Lattice::Kept { .. } => "as they were".to_owned(),
        Lattice::New { .. } => format!("resampled from {}", spacing(ct)),
    };
    let landmarks = by_rule_but(&marks.given);
    Source {
        kind: origin.kind.to_owned(),
        description: format!(
            "CT and segmentation from {}. Voxels of {} mm, {voxels}. Landmarks and rims: {landmarks}.",
            origin.from, parameters.voxel_mm
        ),
        licence: origin.licence.clone(),
        sex: origin.sex.clone(),
        assigned_density: false,
    }
}
