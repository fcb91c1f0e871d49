//! Writes what `scripts/check_projector.py` and `scripts/check_similarity.py` compare with other
//! implementations: a bone, its DRRs, a fluoroscopy, its reduced images and similarities.
//!
//! `cargo run --release --example cross_check -- FOLDER [CT.nii.gz]`
//!
//! Without a CT it takes the pelvis of a phantom; of a CT, all above 200 HU is bone.

use pao_sim::anatomy::Label;
use pao_sim::anatomy::phantom::{PhantomParameters, phantom};
use pao_sim::geometry::{Rigid, Vector};
use pao_sim::image::{Image, PixelRect};
use pao_sim::objective::{FixedView, SimilarityParameters};
use pao_sim::random::{Purpose, stream};
use pao_sim::simulation::{FluoroscopyParameters, fluoroscopy};
use pao_sim::volume::Volume;
use pao_sim::volume::nifti::{read_nifti, write_nifti};
use pao_sim::xray::{AttenuationParameters, BodyVolume, BoneVolume, Camera, pyramid};
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Views of the bone's centre at 80 % of the way to the detector: columns and rows of the image along
/// the world's axes, then turned by Euler angles (deg).
const VIEWS: [(&str, [f64; 3]); 3] = [
    ("ap", [90.0, 0.0, 0.0]),
    ("oblique", [78.0, -4.0, 35.0]),
    ("lateral", [95.0, 3.0, -88.0]),
];

/// Errors of the pose for which similarities are written (mm and deg about each axis).
const ERRORS: [(&str, f64, f64); 3] = [("true", 0.0, 0.0), ("near", 1.5, 1.0), ("far", 12.0, 6.0)];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("expected a folder to write to")?);
    std::fs::create_dir_all(&folder)?;
    let (ct, bone_mask) = match arguments.next() {
        Some(path) => {
            let ct: Volume<i16> = read_nifti(Path::new(&path))?;
            let mask = ct.map(|hu| u8::from(hu > 200));
            (ct, mask)
        }
        None => {
            let body = phantom(1, &PhantomParameters::default());
            let mask = body.labels.map(|l| u8::from(l == Label::Pelvis.value()));
            (body.ct, mask)
        }
    };
    let units = AttenuationParameters::default();
    let bone = BoneVolume::from_labels(&ct, &bone_mask, |l| l == 1, &units)
        .ok_or("the CT holds no bone")?;
    let body = BodyVolume::new(&ct.map(|hu| units.mu(f32::from(hu))));
    let masked = std::iter::zip(&ct.data, &bone_mask.data);
    let masked = masked.map(|(&hu, &mask)| if mask == 1 { hu } else { -1000 });
    let masked = Volume::new(ct.grid.clone(), masked.collect());
    write_nifti(&masked, &folder.join("bone.nii.gz"))?;
    write_nifti(&ct, &folder.join("ct.nii.gz"))?;

    let full = Camera::cios_fusion();
    let mut views = String::from(
        "view,factor,width,height,pixel_mm,source_detector_mm,principal_x,principal_y,camera_from_volume\n",
    );
    let mut similarities =
        String::from("view,factor,error,patch_px,gaussian_px,gaussian_sigma_px,similarity\n");
    for (name, angles) in VIEWS {
        let pose = pose(&bone, angles);
        let draws = stream(1, Purpose::Noise, name);
        let counts = fluoroscopy(
            &body,
            &full,
            &pose,
            &FluoroscopyParameters::default(),
            &draws,
        );
        let lines = body.line_integrals(&full, &pose, 1.0);
        write_npy(&folder.join(format!("lines-{name}.npy")), &lines)?;
        let as_f32 = Image::new(
            counts.width,
            counts.height,
            counts.data.iter().map(|&c| f32::from(c)).collect(),
        );
        write_npy(&folder.join(format!("counts-{name}.npy")), &as_f32)?;
        for (scale, factor) in [(8, 0.125), (4, 0.25)] {
            let (fixed, camera) = pyramid::level(&counts, &full, factor, &Default::default())?;
            write_npy(&folder.join(format!("fixed-{name}-{scale}.npy")), &fixed)?;
            let numbers = pose.to_homogeneous();
            let numbers: Vec<String> = (0..12)
                .map(|n| numbers[(n / 4, n % 4)].to_string())
                .collect();
            writeln!(
                views,
                "{name},{factor},{},{},{},{},{},{},{}",
                camera.width,
                camera.height,
                camera.pixel_mm,
                camera.source_detector_mm,
                camera.principal.x,
                camera.principal.y,
                numbers.join(" ")
            )?;
            let parameters = SimilarityParameters::default();
            let fixed = FixedView::with_parameters(fixed, camera, factor, &parameters)?;
            for (error, mm, deg) in ERRORS {
                let wrong = Rigid::new(Vector::repeat(mm), Vector::repeat(deg.to_radians()));
                let center = pose * bone_center(&bone);
                let about = Rigid::translation(center.x, center.y, center.z);
                let moving = drr(&bone, &camera, &(about * wrong * about.inverse() * pose));
                write_npy(
                    &folder.join(format!("drr-{name}-{scale}-{error}.npy")),
                    &moving,
                )?;
                writeln!(
                    similarities,
                    "{name},{factor},{error},{},{},{},{:.17}",
                    fixed.patch_diameter_px(),
                    parameters.gaussian_width_px,
                    parameters.gaussian_sigma_px,
                    fixed.similarity(&moving)
                )?;
            }
        }
    }
    std::fs::write(folder.join("views.csv"), views)?;
    std::fs::write(folder.join("similarities.csv"), similarities)?;
    Ok(())
}

fn bone_center(bone: &BoneVolume) -> pao_sim::geometry::Point {
    let grid = &bone.attenuation().grid;
    let middle = grid.dims.map(|n| (n as f64 - 1.0) / 2.0);
    grid.point(middle[0], middle[1], middle[2])
}

fn pose(bone: &BoneVolume, angles: [f64; 3]) -> Rigid {
    let [x, y, z] = angles.map(f64::to_radians);
    let turn = |axis, angle| nalgebra::UnitQuaternion::from_axis_angle(&axis, angle);
    let rotation =
        turn(Vector::x_axis(), x) * turn(Vector::y_axis(), y) * turn(Vector::z_axis(), z);
    let target = Vector::new(4.0, -6.0, -0.8 * 1020.0);
    let center = rotation * bone_center(bone).coords;
    Rigid::from_parts((target - center).into(), rotation)
}

fn drr(bone: &BoneVolume, camera: &Camera, pose: &Rigid) -> Image<f32> {
    let mut image = Image::filled(camera.width, camera.height, 0.0);
    bone.project_add(camera, pose, 1.0, PixelRect::full(camera), &mut image.data);
    image
}

/// An image as NumPy's own file, rows first.
fn write_npy(path: &Path, image: &Image<f32>) -> std::io::Result<()> {
    let shape = format!("({}, {})", image.height, image.width);
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version, header's length; values begin at a multiple of 64.
    let length = (header.len() + 1 + 10).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    bytes.extend(image.data.iter().flat_map(|v| v.to_le_bytes()));
    std::fs::write(path, bytes)
}
