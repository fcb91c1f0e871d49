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
use pao_sim::volume::{nrrd_segment_names, read_metaimage, read_nifti, read_nrrd, read_volume};
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
    let any = [&nifti[..], &nrrd, &metaimage].concat();
    let reader = Reader::new;
    vec![
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
    ]
}

#[test]
fn damaged_files_are_read_or_refused() {
    fuzz(readers());
}
