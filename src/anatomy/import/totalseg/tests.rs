//! Against a file that nibabel wrote (scripts/write_totalseg.py).

use super::*;
use std::path::PathBuf;

fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/totalseg.nii.gz")
}

#[test]
fn a_files_own_label_table_names_its_values() {
    let extensions = crate::volume::nifti::read_nifti_extensions(&fixture()).unwrap();
    let codes: Vec<i32> = extensions.iter().map(|e| e.code).collect();
    assert_eq!(codes, [6, 0, 4]);
    assert!(extensions[0].data.starts_with(b"a comment"));
    for version in [None, Some(TotalsegVersion::V2)] {
        let (read, notes) = read_totalseg(&fixture(), version).unwrap();
        assert_eq!(notes, vec![]);
        let map = read.volume();
        for offset in 0..60 {
            assert_eq!(map.data[offset], [0, 1, 2, 3, 4, 5, 0][offset % 7]);
        }
    }
    let message = read_totalseg(&fixture(), Some(TotalsegVersion::V1));
    let message = message.unwrap_err().to_string();
    assert!(message.contains("not those of version 1"), "{message}");
}
