//! Damaged files of every format: each is read or refused. No reader panics, hangs, or takes more memory than
//! a small multiple of what the file honestly holds.
//!
//! `PAO_SIM_FUZZ_SECONDS=300 cargo test --release --features fail-points --test readers_fuzz -- --nocapture`
//! takes so long in all (4 seconds by default); `PAO_SIM_FUZZ_SEED` draws other damage. What was found is written
//! to the build folder's `tmp/readers_fuzz`, and the message names it.
//!
//! A format is added by a line of the table.

mod fuzzing;

use fuzzing::{CountingAllocator, Reader, Seed, fuzz};
use pao_sim::anatomy::PatientFrame;
use pao_sim::anatomy::import::deepfluoro::read_deepfluoro;
use pao_sim::anatomy::import::labels::read_label_table;
use pao_sim::anatomy::import::totalseg::read_totalseg;
use pao_sim::anatomy::import::vsd::read_segmentation;
use pao_sim::anatomy::landmark_files::read_landmark_overrides;
use pao_sim::anatomy::surfaces::read_closed_surface;
use pao_sim::volume::nifti::read_nifti_extensions;
use pao_sim::volume::{
    nrrd_segment_names, read_dicom_series, read_metaimage, read_nifti, read_nrrd, read_volume,
};
use std::path::Path;

#[global_allocator]
static MEMORY: CountingAllocator = CountingAllocator;

/// Name, valid files to start from, and what reads one of them (the first file of a seed).
fn readers() -> Vec<Reader> {
    let volumes = Path::new("tests/data/volumes");
    let of = |names: &[&str]| -> Vec<Seed> {
        let paths = |names: &str| names.split(' ').map(|name| volumes.join(name)).collect();
        names
            .iter()
            .map(|names| Seed::files(paths(names)))
            .collect()
    };
    let nifti = of(&[
        "oblique_sform.nii.gz",
        "permuted_qform.nii",
        "oblique_itk.nii.gz",
    ]);
    let nrrd = of(&[
        "oblique_gzip.nrrd",
        "permuted_RAS.nrrd",
        "oblique_text.nrrd",
        "oblique_big.nhdr oblique_big.raw",
        "oblique_byteskip.nhdr oblique_byteskip.raw",
        "type_float64.nrrd",
        "layers.seg.nrrd",
    ]);
    let metaimage = of(&[
        "oblique_raw.mha",
        "permuted_zlib.mha",
        "oblique_zlib.mhd oblique_zlib.zraw",
        "oblique_text.mhd oblique_text.raw",
        "oblique_last.mhd oblique_last.raw",
        "type_float64.mha",
    ]);
    let segments = of(&["layers.seg.nrrd"]);
    let file = |name: &str| Seed::files(vec![Path::new("tests/data").join(name)]);
    let segmentations = ["SMIR.Pelvis-Thighs_Reconstruction", "layers"]
        .map(|name| file(&format!("vsd/SMIR.Body.076Y.M.CT.1/{name}.seg.nrrd")));
    let tables = files("label_tables", "", &[]);
    let named = nifti.clone();
    let any = [&nifti[..], &nrrd, &metaimage].concat();
    let reader = Reader::new;
    let mut all = vec![
        reader("nifti", nifti, |path| {
            fuzzing::said(read_nifti::<i16>(path))
        }),
        reader("nrrd", nrrd, |path| fuzzing::said(read_nrrd::<i16>(path))),
        reader("nrrd-segments", segments, |path| {
            fuzzing::said(nrrd_segment_names(path))
        }),
        reader("metaimage", metaimage, |path| {
            fuzzing::said(read_metaimage::<i16>(path))
        }),
        reader("any-volume", any, |path| {
            fuzzing::said(read_volume::<i16>(path))
        }),
        reader("nifti-extensions", named, |path| {
            fuzzing::said(read_nifti_extensions(path))
        }),
        reader("deepfluoro", vec![file("deepfluoro.h5")], |path| {
            fuzzing::said(read_deepfluoro(path, Some("17-1882")))
        })
        .memory(64, 16 << 20),
        reader("vsd-segmentation", segmentations.to_vec(), |path| {
            fuzzing::said(read_segmentation(path))
        }),
        reader("label-table", tables, |path| {
            fuzzing::said(read_label_table(path))
        }),
        reader("totalseg", vec![file("totalseg.nii.gz")], |path| {
            fuzzing::said(read_totalseg(path, None))
        })
        .memory(16, 1 << 20),
        // Run lengths and Huffman codes grow a few dozen times.
        reader("dicom", dicom_slices(), |path| {
            fuzzing::said(read_dicom_series(path))
        })
        .memory(300, 8 << 20),
    ];
    for ending in [".ply", ".stl", ".vtk", ".obj"] {
        let seeds = files("surfaces", ending, &["unstructured.vtk"]);
        let surfaces = reader(ending, seeds, |path| {
            fuzzing::said(read_closed_surface(path, PatientFrame::Ras))
        });
        all.push(surfaces.memory(200, 1 << 20));
    }
    for ending in [".fcsv", ".mrk.json", ".csv"] {
        let points = reader(ending, files("points", ending, &[]), |path| {
            fuzzing::said(read_landmark_overrides(path))
        });
        all.push(points.memory(200, 1 << 20));
    }
    all
}

/// The files of a folder with an ending, each a seed, without some.
fn files(folder: &str, ending: &str, without: &[&str]) -> Vec<Seed> {
    let entries = std::fs::read_dir(Path::new("tests/data").join(folder)).expect("it is there");
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("it can be listed").path())
        .filter(|path| {
            let name = path
                .file_name()
                .expect("a file has a name")
                .to_string_lossy();
            name.ends_with(ending) && !without.contains(&&*name)
        })
        .collect();
    paths.sort();
    paths
        .into_iter()
        .map(|path| Seed::files(vec![path]))
        .collect()
}

/// A slice in each encoding beside a second one of its series, so that pixels are decoded.
fn dicom_slices() -> Vec<Seed> {
    let folder = Path::new("tests/data/dicom/encodings");
    let encodings = [
        "explicit",
        "implicit",
        "big_endian",
        "deflated",
        "rle",
        "jpeg_lossless",
        "jpeg_lossless_p14",
    ];
    let pair = |name| {
        let paths = [name, "second"].map(|name| folder.join(format!("{name}.dcm")));
        Seed::files(paths.to_vec())
    };
    encodings.into_iter().map(pair).collect()
}

#[test]
fn damaged_files_are_read_or_refused() {
    fuzz(readers());
}
