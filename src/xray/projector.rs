//! The two ways from a bone to its DRR, behind one trait.

use super::rays::IndexRays;
use super::slice::{Lattice, Sums, Tables, add_group, add_pixels, groups};
use super::{BoneVolume, Camera, PixelRect};
use crate::geometry::Rigid;
use std::fmt::Debug;

/// Makes DRRs: a batch of poses in, images out. Holds the memory that it works in, so each thread
/// has its own; an image depends on its pose alone, whatever else is in the batch.
pub trait Projector: Debug + Send {
    /// How many poses at once are done fastest.
    fn batch(&self) -> usize;

    /// The axis of the bone's volume along which poses near this one are to be projected, if the
    /// projector distinguishes axes. A stage fixes it at its start, so that the cost has no jump where
    /// another axis becomes the better one.
    fn axis(&self, bone: &BoneVolume, camera: &Camera, camera_from_volume: &Rigid)
    -> Option<usize>;

    /// Adds the bone's line integrals (of attenuation over mm, so without unit) at each pose to the
    /// image of the same number in `images`, row-major images of the camera's size one after the
    /// other, and writes which pixels of each it may have changed. Without `axis` each pose has the
    /// axis that suits it best.
    ///
    /// # Panics
    /// When `images` or `touched` does not fit the number of poses and the camera.
    fn project_add(
        &mut self,
        bone: &BoneVolume,
        camera: &Camera,
        camera_from_volume: &[Rigid],
        axis: Option<usize>,
        images: &mut [f32],
        touched: &mut [PixelRect],
    );
}

/// Which projector, and how it is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProjectorParameters {
    /// [`RayCast`].
    RayCast {
        /// Distance of samples along the principal ray in mm, above 0.
        step_mm: f64,
    },
    /// [`SliceResampling`].
    Slice {
        /// Distance of the lattice's points in pixels, above 0.
        pitch_px: f64,
    },
}

impl ProjectorParameters {
    /// A projector for one thread.
    ///
    /// # Panics
    /// When a value is out of range.
    pub fn projector(&self) -> Box<dyn Projector> {
        match *self {
            Self::RayCast { step_mm } => Box::new(RayCast { step_mm }),
            Self::Slice { pitch_px } => Box::new(SliceResampling::new(pitch_px)),
        }
    }
}

/// The paper's: rays sampled at regular steps, trilinear ([`BoneVolume::project_add`]).
#[derive(Clone, Debug)]
pub struct RayCast {
    /// Distance of samples along the principal ray in mm, above 0.
    pub step_mm: f64,
}

impl Projector for RayCast {
    fn batch(&self) -> usize {
        1
    }

    fn axis(&self, _: &BoneVolume, _: &Camera, _: &Rigid) -> Option<usize> {
        None
    }

    fn project_add(
        &mut self,
        bone: &BoneVolume,
        camera: &Camera,
        camera_from_volume: &[Rigid],
        _axis: Option<usize>,
        images: &mut [f32],
        touched: &mut [PixelRect],
    ) {
        let images = each_image(camera, camera_from_volume, images, touched);
        for ((pose, image), touched) in camera_from_volume.iter().zip(images).zip(touched) {
            *touched = cast(bone, camera, pose, self.step_mm, image);
        }
    }
}

/// Slice resampling: five to ten times as fast as [`RayCast`], and as near to the exact integral as
/// Joseph's projector (`docs/projector.md`).
///
/// Slices of voxels across the axis that the rays follow most are sampled on one lattice of rays and
/// summed, and the sum is warped to the detector. Where that is not possible -- the bone does not lie
/// wholly between source and detector, or the rays spread over more than some 70 degrees from the axis
/// -- the rays are cast with a step of one voxel.
#[derive(Debug)]
pub struct SliceResampling {
    pitch_px: f64,
    jobs: Vec<Job>,
    /// One for each job, and more.
    sums: Vec<Sums>,
    tables: Tables,
}

/// One pose of a batch.
#[derive(Debug)]
struct Job {
    axis: usize,
    lattice: Lattice,
    rays: IndexRays,
    rect: PixelRect,
    image: usize,
}

impl SliceResampling {
    /// Poses of a batch: enough that a group of slices is used many times while it is near the
    /// processor, few enough that their sums are too. The paper's populations are multiples of it.
    const BATCH: usize = 20;
    /// A bone nearer to the source than this part of the way to the detector is cast.
    const NEAREST: f64 = 0.1;

    /// With a lattice of this pitch in pixels. Smaller is sharper and slower; 1 is good.
    ///
    /// # Panics
    /// When the pitch is not positive.
    pub fn new(pitch_px: f64) -> Self {
        assert!(pitch_px > 0.0, "pitch is {pitch_px} px; expected above 0");
        Self {
            pitch_px,
            jobs: Vec::new(),
            sums: Vec::new(),
            tables: Tables::default(),
        }
    }

    /// The pixels that a pose can darken, or nothing.
    fn touched(&self, bone: &BoneVolume, camera: &Camera, pose: &Rigid) -> Option<PixelRect> {
        let shadow = bone.footprint(camera, pose)?;
        // A point of the lattice reaches to the second beyond it.
        let reach = (2.0 * self.pitch_px).ceil() as usize;
        Some(shadow.grown(reach, &PixelRect::full(camera)))
    }

    /// The lattice of a pose, or `None` where slices do not serve.
    fn job(
        &self,
        bone: &BoneVolume,
        camera: &Camera,
        pose: &Rigid,
        axis: Option<usize>,
        rect: PixelRect,
    ) -> Option<Job> {
        let (nearest, farthest) = bone.hull().depths(pose);
        let detector = camera.source_detector_mm;
        if nearest < Self::NEAREST * detector || farthest > detector {
            return None;
        }
        let grid = &bone.attenuation().grid;
        let rays = IndexRays::new(camera, pose, grid);
        let lattice = |axis: usize| {
            let stack = bone.stack(axis);
            let hull = bone.hull().indices();
            Lattice::new(stack, &rays, &grid.spacing, hull, rect, self.pitch_px)
        };
        let best = Lattice::dominant_axis(&rays, &grid.spacing);
        let fixed = axis.unwrap_or(best);
        let (axis, lattice) = (lattice(fixed).map(|lattice| (fixed, lattice)))
            .or_else(|| lattice(best).map(|lattice| (best, lattice)))?;
        Some(Job {
            axis,
            lattice,
            rays,
            rect,
            image: 0,
        })
    }
}

impl Projector for SliceResampling {
    fn batch(&self) -> usize {
        Self::BATCH
    }

    fn axis(
        &self,
        bone: &BoneVolume,
        camera: &Camera,
        camera_from_volume: &Rigid,
    ) -> Option<usize> {
        Some(bone.dominant_axis(camera, camera_from_volume))
    }

    fn project_add(
        &mut self,
        bone: &BoneVolume,
        camera: &Camera,
        camera_from_volume: &[Rigid],
        axis: Option<usize>,
        images: &mut [f32],
        touched: &mut [PixelRect],
    ) {
        let pixels = camera.width * camera.height;
        self.jobs.clear();
        let each = each_image(camera, camera_from_volume, images, touched);
        for (number, ((pose, image), touched)) in
            camera_from_volume.iter().zip(each).zip(touched).enumerate()
        {
            *touched = match self.touched(bone, camera, pose) {
                None => PixelRect::EMPTY,
                Some(rect) => match self.job(bone, camera, pose, axis, rect) {
                    Some(job) => {
                        self.jobs.push(Job {
                            image: number,
                            ..job
                        });
                        rect
                    }
                    None => {
                        let spacing = bone.attenuation().grid.spacing;
                        let step_mm = spacing.into_iter().fold(f64::INFINITY, f64::min);
                        cast(bone, camera, pose, step_mm, image)
                    }
                },
            };
        }
        if self.sums.len() < self.jobs.len() {
            self.sums.resize_with(self.jobs.len(), Sums::default);
        }
        for (job, sums) in self.jobs.iter().zip(&mut self.sums) {
            sums.reset(&job.lattice);
        }
        let level = bone.simd();
        for axis in 0..3 {
            if self.jobs.iter().all(|job| job.axis != axis) {
                continue;
            }
            let stack = bone.stack(axis);
            for group in 0..groups(stack) {
                for (job, sums) in self.jobs.iter().zip(&mut self.sums) {
                    if job.axis == axis {
                        let tables = &mut self.tables;
                        add_group(level, &job.lattice, stack, group, tables, sums);
                    }
                }
            }
        }
        for (job, sums) in self.jobs.iter().zip(&self.sums) {
            let image = &mut images[job.image * pixels..][..pixels];
            let unit = bone.stack(job.axis).unit;
            let (lattice, rays, rect) = (&job.lattice, &job.rays, job.rect);
            add_pixels(level, sums, lattice, rays, unit, rect, camera.width, image);
        }
    }
}

/// Casts the rays of one pose.
fn cast(
    bone: &BoneVolume,
    camera: &Camera,
    pose: &Rigid,
    step_mm: f64,
    image: &mut [f32],
) -> PixelRect {
    let rect = bone.footprint(camera, pose).unwrap_or(PixelRect::EMPTY);
    if !rect.is_empty() {
        bone.project_add(camera, pose, step_mm, rect, image);
    }
    rect
}

/// The images of a batch, which is checked.
fn each_image<'a>(
    camera: &Camera,
    poses: &[Rigid],
    images: &'a mut [f32],
    touched: &[PixelRect],
) -> std::slice::ChunksExactMut<'a, f32> {
    let pixels = camera.width * camera.height;
    assert_eq!(images.len(), poses.len() * pixels, "an image for each pose");
    assert_eq!(touched.len(), poses.len(), "a rectangle for each pose");
    images.chunks_exact_mut(pixels.max(1))
}
