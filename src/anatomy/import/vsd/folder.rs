//! The files of a subject.

use crate::anatomy::import::CtImportError;
use std::path::{Path, PathBuf};

const SEGMENTATION_END: &str = "_reconstruction.seg.nrrd";
const UPSIDE_DOWN: &str = "Transform-Upside-Down.h5";
const VOLUME_ENDS: [&str; 3] = [".nrrd", ".nii", ".nii.gz"];

/// The files of a subject.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VsdFiles {
    pub ct: PathBuf,
    pub segmentation: PathBuf,
    /// `male`, `female` or `unknown`, as the scan's JSON file says.
    pub sex: String,
}

/// Finds CT and segmentation of pelvis and thighs in a subject's folder, or in that of its scan.
///
/// # Errors
/// When they are not there, or several might be meant, or the subject lies upside down.
pub fn find_vsd(dir: &Path) -> Result<VsdFiles, CtImportError> {
    let problem = |reason: String| CtImportError::File {
        path: dir.into(),
        reason,
    };
    let mut files = listed(dir)?;
    for folder in files.clone().iter().filter(|path| path.is_dir()) {
        files.extend(listed(folder)?);
    }
    let mut segmentations: Vec<&PathBuf> = files
        .iter()
        .filter(|path| lower(path).ends_with(SEGMENTATION_END))
        .collect();
    if segmentations.len() > 1 {
        segmentations.retain(|path| lower(path).contains("pelvis"));
    }
    let &[segmentation] = segmentations.as_slice() else {
        return Err(problem(format!(
            "holds {} files ...Pelvis-Thighs_Reconstruction.seg.nrrd; expected one. Name CT and \
             segmentation themselves",
            segmentations.len()
        )));
    };
    let folder = segmentation.parent().unwrap_or(dir);
    if folder.join(UPSIDE_DOWN).exists() {
        return Err(problem(format!(
            "holds {UPSIDE_DOWN}: this subject lies upside down in its CT. Open its scene in 3D Slicer, \
             harden that transform on CT and segmentation, save both, and name the files themselves"
        )));
    }
    let name = lower(segmentation);
    let stem = name.strip_suffix(SEGMENTATION_END).unwrap_or_default();
    let is_ct = |path: &&PathBuf| {
        let end = lower(path);
        let end = end.strip_prefix(stem).unwrap_or_default().to_owned();
        path.parent() == Some(folder) && VOLUME_ENDS.contains(&end.as_str())
    };
    let cts: Vec<&PathBuf> = files.iter().filter(is_ct).collect();
    let &[ct] = cts.as_slice() else {
        return Err(problem(format!(
            "holds {} CTs (.nrrd, .nii, .nii.gz) beside {}; expected one of its name. Name CT and \
             segmentation themselves",
            cts.len(),
            segmentation.display()
        )));
    };
    Ok(VsdFiles {
        ct: ct.clone(),
        segmentation: segmentation.clone(),
        sex: sex(&files).unwrap_or("unknown").to_owned(),
    })
}

fn listed(dir: &Path) -> Result<Vec<PathBuf>, CtImportError> {
    let entries = std::fs::read_dir(dir).map_err(|source| CtImportError::Io {
        path: dir.into(),
        source,
    })?;
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.sort();
    Ok(files)
}

fn lower(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().to_lowercase()
}

/// `subjectSnapshot.gender.name` of the first file that has it.
fn sex(files: &[PathBuf]) -> Option<&'static str> {
    let jsons = files.iter().filter(|path| {
        let name = lower(path);
        name.ends_with(".json") && !name.ends_with(".mrk.json")
    });
    jsons
        .filter_map(|path| std::fs::read(path).ok())
        .find_map(|bytes| {
            let json: serde_json::Value = serde_json::from_slice(&bytes).ok()?;
            let name = json["subjectSnapshot"]["gender"]["name"].as_str()?;
            match name.to_lowercase().as_str() {
                "m" | "male" => Some("male"),
                "f" | "female" => Some("female"),
                _ => None,
            }
        })
}
