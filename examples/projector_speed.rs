//! The side of `scripts/compare_projectors.py` that times this program: makes a volume the size of a
//! pelvis, projects it, and projects it again whenever it is asked to.
//!
//! `cargo run --release --example projector_speed -- FOLDER [PIXELS]` writes `volume.nii.gz` (Hounsfield units),
//! `views.csv` and one image (32-bit floats, row after row) for each view and projector, and the integral
//! by double-precision samples every 0.125 mm. Then, for each
//! line on its input, it prints one line with the milliseconds a DRR, in the order of `views.csv` and in
//! it of the projectors: processor time of this one thread.

use nalgebra::UnitQuaternion;
use pao_sim::geometry::{Point, Rigid, Vector};
use pao_sim::simd::SimdLevel;
use pao_sim::volume::nifti::write_nifti;
use pao_sim::volume::{Grid, Volume};
use pao_sim::xray::{
    AttenuationParameters, BoneVolume, Camera, PixelRect, ProjectorParameters, reference,
};
use std::error::Error;
use std::fmt::Write as _;
use std::io::{BufRead, Write as _};
use std::path::PathBuf;

/// Turns about x, y and z in degrees, after the supine AP view.
const VIEWS: [(&str, [f64; 3]); 2] = [("ap", [0.0; 3]), ("oblique", [10.0, 25.0, 8.0])];
const SLICE: ProjectorParameters = ProjectorParameters::Slice { pitch_px: 1.0 };
/// With how many poses are projected at once, as those of a population: the first is the view's.
const PROJECTORS: [(&str, ProjectorParameters, usize); 3] = [
    ("ray_cast", ProjectorParameters::RayCast { step_mm: 1.0 }, 8),
    ("slice", SLICE, 8),
    ("slice_one", SLICE, 1),
];
/// Half axes and centres (mm) of ellipsoids whose shells are bone.
const SHELLS: [[f64; 6]; 6] = [
    [62.0, 70.0, 78.0, -78.0, 10.0, 20.0],
    [62.0, 70.0, 78.0, 78.0, 10.0, 20.0],
    [48.0, 26.0, 52.0, 0.0, 78.0, 20.0],
    [27.0, 27.0, 27.0, -88.0, 0.0, -55.0],
    [27.0, 27.0, 27.0, 88.0, 0.0, -55.0],
    [58.0, 16.0, 16.0, 0.0, -50.0, -80.0],
];
const SHELL_MM: f64 = 5.0;

/// Hounsfield units of a made-up pelvis: 7 % of the voxels are bone of 0.04 to 0.06 per mm.
fn volume() -> Volume<i16> {
    let grid = Grid::axis_aligned([300, 250, 220], 1.0, Point::new(-149.5, -124.5, -109.5));
    let mut volume = Volume::filled(grid.clone(), -1000i16);
    for (offset, value) in volume.data.iter_mut().enumerate() {
        let p = grid.center(grid.voxel(offset));
        let shell = SHELLS.iter().any(|[a, b, c, x, y, z]| {
            let r = Vector::new((p.x - x) / a, (p.y - y) / b, (p.z - z) / c).norm();
            (r - 1.0).abs() * a.min(*b).min(*c) < SHELL_MM / 2.0
        });
        if shell {
            let texture = (0.31 * p.x).sin() * (0.23 * p.y + 0.17 * p.z).cos();
            *value = (1733.0 + 370.0 * texture) as i16;
        }
    }
    volume
}

fn pose(angles: [f64; 3]) -> Rigid {
    let ap = UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::FRAC_PI_2);
    let [x, y, z] = angles.map(f64::to_radians);
    let rotation = UnitQuaternion::from_euler_angles(x, y, z) * ap;
    Rigid::from_parts(Vector::new(0.0, 0.0, -816.0).into(), rotation)
}

/// Poses within a degree or two.
fn about(pose: &Rigid, count: usize) -> Vec<Rigid> {
    let turn = |n: usize| {
        let angle = |k: usize| ((n * k) as f64).sin() * 0.02;
        UnitQuaternion::from_scaled_axis(Vector::new(angle(1), angle(2), angle(3)))
    };
    (0..count)
        .map(|n| Rigid::from_parts(pose.translation, turn(n) * pose.rotation))
        .collect()
}

/// Processor time of this thread.
fn thread_seconds() -> f64 {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the call writes to the structure that it is given.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    assert_eq!(
        status, 0,
        "the system has no clock of a thread's processor time"
    );
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(
        std::env::args()
            .nth(1)
            .ok_or("expected a folder to write to")?,
    );
    std::fs::create_dir_all(&folder)?;
    let ct = volume();
    write_nifti(&ct, &folder.join("volume.nii.gz"))?;
    let units = AttenuationParameters::default();
    let bone = BoneVolume::from_attenuation(&ct.map(|hu| units.mu(f32::from(hu))))
        .ok_or("the volume holds bone")?;
    let size = std::env::args()
        .nth(2)
        .map_or(Ok(192), |text| text.parse())?;
    let camera = Camera::centered(size, 1.552, 1020.0);
    let pixels = camera.width * camera.height;

    let mut views = String::from("view,projector,level,camera_from_volume\n");
    let mut cases = Vec::new();
    for (view, angles) in VIEWS {
        let exact = reference::line_integrals(bone.attenuation(), &camera, &pose(angles), 0.125);
        let bytes: Vec<u8> = (exact.data.iter())
            .flat_map(|&v| (v as f32).to_le_bytes())
            .collect();
        std::fs::write(folder.join(format!("{view}-exact.f32")), bytes)?;
        for (name, parameters, batch) in PROJECTORS {
            for level in [SimdLevel::Avx2, SimdLevel::Avx512] {
                if level > SimdLevel::detect() {
                    continue;
                }
                let bone = bone.clone().with_simd(level);
                let poses = about(&pose(angles), batch);
                let numbers = poses[0].to_homogeneous();
                let numbers = (0..12).map(|n| numbers[(n / 4, n % 4)].to_string());
                let numbers = numbers.collect::<Vec<_>>().join(" ");
                writeln!(views, "{view},{name},{},{numbers}", level.name())?;
                let mut projector = parameters.projector();
                let mut images = vec![0.0f32; batch * pixels];
                let mut touched = vec![PixelRect::EMPTY; batch];
                projector.project_add(&bone, &camera, &poses, None, &mut images, &mut touched);
                let bytes: Vec<u8> = images[..pixels]
                    .iter()
                    .flat_map(|v| v.to_le_bytes())
                    .collect();
                std::fs::write(
                    folder.join(format!("{view}-{name}-{}.f32", level.name())),
                    bytes,
                )?;
                cases.push((bone, poses, projector, images, touched));
            }
        }
    }
    std::fs::write(folder.join("views.csv"), views)?;
    println!("ready");
    for line in std::io::stdin().lock().lines() {
        line?;
        let mut times = Vec::new();
        for (bone, poses, projector, images, touched) in &mut cases {
            let start = thread_seconds();
            projector.project_add(bone, &camera, poses, None, images, touched);
            times.push(format!(
                "{:.4}",
                (thread_seconds() - start) * 1e3 / poses.len() as f64
            ));
        }
        println!("{}", times.join(" "));
        std::io::stdout().flush()?;
    }
    Ok(())
}
