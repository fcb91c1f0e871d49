//! Volumes that other programs wrote: values and places are theirs.

mod data;

use pao_sim::geometry::{Point, Vector};
use pao_sim::volume::{
    Volume, VolumeFileError, Voxel, read_metaimage, read_nifti, read_nrrd, read_volume,
};
use std::path::{Path, PathBuf};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes")
}

/// The files of the fixtures whose names start so, without what is no volume by itself.
fn files(start: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(fixtures())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            let name = path.file_name().unwrap().to_string_lossy();
            let volume = [".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz"];
            name.starts_with(start) && volume.iter().any(|end| name.ends_with(end))
        })
        .collect();
    found.sort();
    found
}

/// The format's own reader, by the file's name.
fn read<T: Voxel>(path: &Path) -> Result<Volume<T>, VolumeFileError> {
    let name = path.to_string_lossy();
    if name.contains(".nii") {
        read_nifti(path)
    } else if name.ends_with(".nrrd") || name.ends_with(".nhdr") {
        read_nrrd(path)
    } else {
        read_metaimage(path)
    }
}

/// Every voxel with its value and its place (LPS, mm).
fn listed(place: &str) -> Vec<([usize; 3], i16, Point)> {
    let mut reader = csv::Reader::from_path(fixtures().join(format!("{place}.csv"))).unwrap();
    let rows = reader.deserialize::<(usize, usize, usize, i16, f64, f64, f64)>();
    rows.map(|row| {
        let (i, j, k, hu, x, y, z) = row.unwrap();
        ([i, j, k], hu, Point::new(x, y, z))
    })
    .collect()
}

#[test]
fn every_voxel_of_every_file_is_and_lies_as_its_writer_says() {
    for place in ["oblique", "permuted"] {
        let listed = listed(place);
        assert_eq!(listed.len(), 5 * 6 * 7);
        let files = files(&format!("{place}_"));
        assert!(files.len() >= 20, "{place}: {files:?}");
        for path in files {
            let volume = read::<i16>(&path).unwrap();
            assert_eq!(volume.grid.dims, [5, 6, 7], "{}", path.display());
            // NIfTI's header has 32-bit floats.
            let nifti = path.to_string_lossy().contains(".nii");
            let tolerance_mm = if nifti { 1e-4 } else { 1e-6 };
            for (offset, &(voxel, hu, point)) in listed.iter().enumerate() {
                assert_eq!(volume.grid.voxel(offset), voxel);
                assert_eq!(volume.data[offset], hu, "{voxel:?} of {}", path.display());
                let apart = (volume.grid.center(voxel) - point).norm();
                assert!(
                    apart < tolerance_mm,
                    "{voxel:?} of {} lies {apart} mm off",
                    path.display()
                );
            }
            let by_content = read_volume::<i16>(&path).unwrap();
            assert_eq!(by_content, volume, "{}", path.display());
        }
    }
}

#[test]
fn numbers_of_every_type_are_read() {
    let text = std::fs::read_to_string(fixtures().join("type.csv")).unwrap();
    let values: Vec<u8> = text.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(values.len(), 210);
    let files = files("type_");
    assert_eq!(files.len(), 20, "{files:?}");
    for path in files {
        let labels = read::<u8>(&path).unwrap();
        assert_eq!(labels.data, values, "{}", path.display());
        let hu = read::<i16>(&path).unwrap();
        assert_eq!(hu, labels.map(i16::from), "{}", path.display());
    }
}

/// What SimpleITK 2.5.7 finds in a person's label map and body mask.
struct Person {
    name: &'static str,
    slices: usize,
    /// Voxels of pelvis, femora, sacrum.
    bones: [usize; 3],
    body: usize,
    /// LPS mm.
    first_voxel: [f64; 3],
    pelvis_center: [f64; 3],
}

const PEOPLE: [Person; 2] = [
    Person {
        name: "Pelvic-Ref-001",
        slices: 153,
        bones: [262363, 154463, 88164],
        body: 9205937,
        first_voxel: [-255.63183593749997, -361.3681640625, 135.5],
        pelvis_center: [3.1725381548, -30.7892219098, 357.3299798371],
    },
    Person {
        name: "Pelvic-Ref-002",
        slices: 163,
        bones: [222196, 177052, 84073],
        body: 11072581,
        first_voxel: [-256.0859375, -142.3859405517578, 60.59997558593751],
        pelvis_center: [15.1936759944, 136.0197328177, 320.1395217524],
    },
];

#[test]
fn real_label_maps_hold_what_simpleitk_finds() {
    let Some(folder) = data::pelvic_labels() else {
        return;
    };
    for person in PEOPLE {
        let name = person.name;
        let path = folder.join(name).join("label.mhd");
        let labels: Volume<u8> = read_volume(&path).unwrap();
        assert_eq!(labels.grid.dims, [512, 512, person.slices], "{name}");
        assert_eq!(labels.grid.spacing, [1.0, 1.0, 3.0], "{name}");
        let first = labels.grid.center([0; 3]);
        assert_eq!(first, Point::from(person.first_voxel), "{name}");
        let labels = &labels;
        let of = |label: u8| (0..labels.data.len()).filter(move |&n| labels.data[n] == label);
        assert_eq!([1, 2, 3].map(|l| of(l).count()), person.bones, "{name}");
        let sum = of(1).fold(Vector::zeros(), |sum, n| {
            sum + labels.grid.center(labels.grid.voxel(n)).coords
        });
        let apart = sum / person.bones[0] as f64 - Vector::from(person.pelvis_center);
        assert!(apart.norm() < 1e-6, "{name}: {apart}");

        let mask: Volume<u8> = read_volume(&path.with_file_name("mask.mhd")).unwrap();
        assert_eq!(mask.grid, labels.grid, "{name}");
        let inside = mask.data.iter().filter(|&&m| m == 1).count();
        assert_eq!(inside, person.body, "{name}");
    }
}
