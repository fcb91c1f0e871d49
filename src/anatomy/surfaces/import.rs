//! Bone surfaces to a specimen.

use super::body::Body;
use super::bone_density::{BoneTissue, DepthProfile, smooth_step};
use super::error::ImportError;
use super::near_surface::near_surface;
use super::noise::GaussianField;
use super::origin::SurfacesOrigin;
use super::parameters::SurfacesParameters;
use super::soft_tissue::soft_tissue;
use super::voxelize::for_each_inside;
use crate::anatomy::detect::{BoneSurfaces, Given, Head, Place, by_rule_but, detect_with};
use crate::anatomy::import::{Imported, told};
use crate::anatomy::{Label, Landmark, Side, Source, Specimen, Structure, StructureLabels};
use crate::geometry::{Point, Vector};
use crate::random::{Purpose, Stream, stream};
use crate::volume::distance::squared_distance;
use crate::volume::{Grid, Surface, Volume};
use rand::RngExt;
use rand_distr::StandardNormal;
use rayon::prelude::*;

/// Scales of the trabecular texture (mm), in equal parts; fitted to the correlation of the
/// Visible Human Male's.
const TEXTURE_MM: [f64; 2] = [1.1, 4.0];

/// Scale over which the cortical shell grows thicker or thinner (mm).
const SHELL_MM: f64 = 10.0;

/// Below the head's centre, the femur passes from spongy bone to a tube between these (mm).
const SHAFT_MM: (f64, f64) = (55.0, 110.0);

/// Depths below the surface are exact down to this; deeper, where a bone's value hardly depends on
/// its depth, voxels are counted (mm).
const NEAR_MM: f64 = 4.0;

/// A bone of the import: its surface and which it is.
struct Bone<'a> {
    surface: &'a Surface,
    kind: Structure,
}

/// Makes a specimen from bone surfaces: voxels of [`SurfacesParameters::voxel_mm`] from
/// `below_heads_mm` below the femoral heads to above the iliac crests, with landmarks and rims by
/// [`crate::anatomy::detect`] and assigned densities. The same surfaces, parameters and name give the same
/// specimen, to the last bit.
///
/// # Errors
/// When a landmark or rim cannot be found.
///
/// # Panics
/// When a parameter is out of its range ([`SurfacesParameters::problems`]).
pub fn specimen_from_surfaces(
    bones: &BoneSurfaces,
    origin: &SurfacesOrigin,
    parameters: &SurfacesParameters,
) -> Result<Specimen, ImportError> {
    let made = specimen_from_surfaces_with(bones, origin, parameters, &Given::default())?;
    Ok(made.specimen)
}

/// As [`specimen_from_surfaces`], with landmarks and rims that people placed in place of those found.
///
/// # Errors
/// When something is neither found nor given ([`ImportError::Landmarks`] has the rest), or the bones have
/// no pelvic frame or no femoral head of known size: body and density are made around the heads.
///
/// # Panics
/// As [`specimen_from_surfaces`].
pub fn specimen_from_surfaces_with(
    bones: &BoneSurfaces,
    origin: &SurfacesOrigin,
    parameters: &SurfacesParameters,
    given: &Given,
) -> Result<Imported, ImportError> {
    assert_eq!(parameters.problems(), vec![], "parameters in range");
    let marks = detect_with(bones, &given.landmarks)?.completed(given)?;
    let [Some(left), Some(right)] = marks.heads else {
        let heads = marks.not_found.iter();
        let heads = heads.filter(|missing| missing.place == Place::Landmark(Landmark::Fh));
        let reasons: Vec<String> = heads.map(|missing| missing.error.to_string()).collect();
        return Err(ImportError::Heads(reasons.join("; ")));
    };
    let heads = [left, right];
    let centers = heads.map(|head| head.center);
    let body = Body::around(bones, centers, parameters);
    let grid = grid(bones, &body, centers, parameters);
    let list = bone_list(bones);
    let which = bone_numbers(&list, &grid);
    let labels = which.map(|n| match n {
        0 => Label::Background.value(),
        n => list[usize::from(n) - 1].kind.label().value(),
    });
    let mut stream = stream(parameters.seed, Purpose::AssignedDensity, &origin.name);
    let ct = assigned_ct(&list, &which, &body, &heads, parameters, &mut stream);
    let notes = told(&marks);
    let specimen = Specimen {
        name: origin.name.clone(),
        source: surfaces_source(origin, parameters, &marks.given),
        ct,
        labels,
        landmarks: marks.landmarks,
        rims: marks.rims,
    };
    Ok(Imported { specimen, notes })
}

impl<'a> Bone<'a> {
    fn new(surface: &'a Surface, kind: Structure) -> Self {
        Self { surface, kind }
    }
}

/// What a specimen from surfaces is, for people. `given` are the names of landmarks and rims that were not found
/// by rule.
pub fn surfaces_source(
    origin: &SurfacesOrigin,
    p: &SurfacesParameters,
    given: &[String],
) -> Source {
    Source {
        kind: "surfaces".into(),
        description: format!(
            "Bone surfaces from {}. Only sacrum, hip bones and femora were there: no spine. \
             Hounsfield values are assigned by depth below the surfaces and the body around the \
             bones is made up (seed {}, cortical bone {} HU, {} mm). Landmarks and rims: {}.",
            origin.from,
            p.seed,
            p.cortical_hu,
            p.cortical_mm,
            by_rule_but(given)
        ),
        licence: origin.licence.clone(),
        sex: origin.sex.clone(),
        assigned_density: true,
    }
}

/// The grid of the CT: the body between its ends, and air around it.
fn grid(bones: &BoneSurfaces, body: &Body, heads: [Point; 2], p: &SurfacesParameters) -> Grid {
    let low_z = (heads[0].z + heads[1].z) / 2.0 - p.below_heads_mm;
    let pelvis = bones.hips.iter().chain([&bones.sacrum]);
    let high_z = pelvis
        .flat_map(|s| s.vertices())
        .map(|v| v.z)
        .fold(f64::MIN, f64::max)
        + p.above_bones_mm;
    let (low, high) = body.bounds(low_z, high_z);
    let air = Vector::new(p.air_mm, p.air_mm, 0.0);
    let (low, high) = (low - air, high + air);
    let dims = std::array::from_fn(|a| ((high[a] - low[a]) / p.voxel_mm).ceil() as usize + 1);
    Grid::axis_aligned(dims, p.voxel_mm, low)
}

/// The bones' voxels on an axis-aligned grid, as the import from surfaces labels them: a segmentation
/// of these bones.
pub fn structures_from_surfaces(bones: &BoneSurfaces, grid: &Grid) -> StructureLabels {
    let list = bone_list(bones);
    StructureLabels::new(bone_numbers(&list, grid).map(|n| match n {
        0 => 0,
        n => list[usize::from(n) - 1].kind.value(),
    }))
}

/// The bones in the order in which they have voxels that several claim.
fn bone_list(bones: &BoneSurfaces) -> [Bone<'_>; 5] {
    [
        Bone::new(&bones.hips[0], Structure::Hip(Side::Left)),
        Bone::new(&bones.hips[1], Structure::Hip(Side::Right)),
        Bone::new(&bones.sacrum, Structure::Sacrum),
        Bone::new(&bones.femurs[0], Structure::Femur(Side::Left)),
        Bone::new(&bones.femurs[1], Structure::Femur(Side::Right)),
    ]
}

/// 1 + the number in `list` of the bone at each voxel, or 0. Bones that overlap, as segmented
/// bones may by a fraction of a voxel, keep the one that is named first.
fn bone_numbers(list: &[Bone], grid: &Grid) -> Volume<u8> {
    let mut which = Volume::filled(grid.clone(), 0u8);
    for (n, bone) in list.iter().enumerate() {
        for_each_inside(bone.surface, grid, |offset| {
            if which.data[offset] == 0 {
                which.data[offset] = n as u8 + 1;
            }
        });
    }
    which
}

fn assigned_ct(
    list: &[Bone],
    which: &Volume<u8>,
    body: &Body,
    heads: &[Head; 2],
    p: &SurfacesParameters,
    stream: &mut Stream,
) -> Volume<i16> {
    let grid = &which.grid;
    let bones = which.map(|n| n != 0);
    let pelvis = which.map(|n| (1..=3).contains(&n));
    let mut hu = soft_tissue(body, &bones, &pelvis, p, stream);

    let (low, high) = bone_box(&bones);
    let mut field = |sigma_mm| GaussianField::new(stream, &low, &high, sigma_mm, p.voxel_mm);
    let texture = [field(TEXTURE_MM[0]), field(TEXTURE_MM[1])];
    let shell = field(SHELL_MM);
    let profile = DepthProfile::new(p);
    // Centres of voxels lie half a voxel farther from each other than from the surface between.
    let deep = squared_distance(&bones.map(|b| !b));
    let deep_mm = |offset: usize| f64::from(deep.data[offset]).sqrt() - p.voxel_mm / 2.0;
    for (n, bone) in list.iter().enumerate() {
        let near = near_surface(bone.surface, grid, NEAR_MM.max(profile.reach_mm()));
        let changes: Vec<(usize, f32)> = near
            .voxels()
            .filter_map(|([i, j, k], distance)| {
                let offset = grid.offset(i, j, k);
                let inside = usize::from(which.data[offset]) == n + 1;
                let distance = f64::from(distance);
                let depth_mm = match (inside, distance.is_finite()) {
                    (true, true) => distance,
                    (true, false) => deep_mm(offset).max(NEAR_MM),
                    (false, _) if distance < profile.reach_mm() => -distance,
                    (false, _) => return None,
                };
                let at = grid.center([i, j, k]);
                let fine = f64::from(texture[0].at(&at) + texture[1].at(&at));
                let local = Local {
                    texture: fine * std::f64::consts::FRAC_1_SQRT_2,
                    shell: f64::from(shell.at(&at)),
                };
                let tissue = bone.tissue(&at, heads, &local, p);
                Some((offset, profile.excess_hu(depth_mm, &tissue) as f32))
            })
            .collect();
        for (offset, excess) in changes {
            hu.data[offset] += excess;
        }
    }
    // Each of these is as large as the CT itself.
    drop((deep, texture, shell, bones, pelvis));
    let noisy = |value: f32| {
        let noise = stream.sample::<f32, _>(StandardNormal);
        (value + noise * p.noise_hu as f32)
            .round()
            .clamp(-1024.0, 3071.0) as i16
    };
    let data = hu.data.into_iter().map(noisy).collect();
    Volume::new(grid.clone(), data)
}

/// Random values at one place, of variance 1.
struct Local {
    texture: f64,
    shell: f64,
}

impl Bone<'_> {
    fn tissue(
        &self,
        at: &Point,
        heads: &[Head; 2],
        local: &Local,
        p: &SurfacesParameters,
    ) -> BoneTissue {
        let spread = (p.cortical_spread * local.shell).exp();
        let texture = p.trabecular_texture_hu * local.texture;
        let spongy = |cortical_mm: f64, inner_hu: f64| BoneTissue {
            cortical_hu: p.cortical_hu,
            cortical_mm: cortical_mm * spread,
            inner_hu: (inner_hu + texture).max(p.fat_hu),
        };
        match self.kind {
            Structure::Sacrum => spongy(p.cortical_mm * 2.0 / 3.0, p.trabecular_hu * 0.6),
            Structure::Hip(side) => {
                // Bone carries the joint's load: its shell and sponge are denser there.
                let head = &heads[side.index()];
                let beyond = (at - head.center).norm() - head.radius_mm;
                let joint = 1.0 - smooth_step(5.0, 18.0, beyond);
                spongy(
                    p.cortical_mm * (1.0 + 0.5 * joint),
                    p.trabecular_hu * (1.0 + 0.5 * joint),
                )
            }
            Structure::Femur(side) => {
                let head = &heads[side.index()];
                let from_head = (at - head.center).norm() / head.radius_mm;
                let in_head = 1.0 - smooth_step(0.8, 1.3, from_head);
                let upper = spongy(p.cortical_mm, p.trabecular_hu * (0.7 + 1.1 * in_head));
                let tube = smooth_step(SHAFT_MM.0, SHAFT_MM.1, head.center.z - at.z);
                let mix = |a: f64, b: f64| a + (b - a) * tube;
                BoneTissue {
                    cortical_hu: mix(upper.cortical_hu, p.shaft_hu),
                    cortical_mm: mix(upper.cortical_mm, p.shaft_mm),
                    inner_hu: mix(upper.inner_hu, p.marrow_hu + 0.15 * texture),
                }
            }
        }
    }
}

/// Opposite corners of the box around all bones, with the blur's reach.
fn bone_box(bones: &Volume<bool>) -> (Point, Point) {
    let grid = &bones.grid;
    let (min, max) = bones
        .bounds(|b| b)
        .unwrap_or(([0; 3], grid.dims.map(|n| n - 1)));
    let margin = Vector::repeat(4.0 * grid.spacing[0]);
    (grid.center(min) - margin, grid.center(max) + margin)
}
