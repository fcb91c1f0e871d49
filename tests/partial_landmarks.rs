//! Bones of which one thing is destroyed: everything else is found as on whole ones, and an import wants
//! only what is missing.

mod data;

use pao_sim::anatomy::detect::{BoneSurfaces, Detected, Given, detect, detect_with};
use pao_sim::anatomy::import::labels::{read_label_table, structures_of_labels};
use pao_sim::anatomy::import::{
    CtImport, CtImportError, CtImportParameters, CtOrigin, Imported, specimen_from_ct,
};
use pao_sim::anatomy::surfaces::{
    ImportError, SurfacesOrigin, SurfacesParameters, specimen_from_surfaces_with,
};
use pao_sim::anatomy::{
    Found, Landmark, Landmarks, PhantomParameters, Side, Specimen, Structure, StructureLabels,
    phantom_structures, read_specimen,
};
use pao_sim::geometry::{Point, Vector};
use pao_sim::volume::{Volume, read_volume, write_nifti};
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

static BODY: LazyLock<(Specimen, StructureLabels)> = LazyLock::new(|| {
    let parameters = PhantomParameters {
        voxel_mm: 2.0,
        ..Default::default()
    };
    phantom_structures(3, &parameters)
});

static WHOLE: LazyLock<Detected> = LazyLock::new(|| {
    let found = detect(&surfaces(&BODY.1)).unwrap();
    assert!(found.missing.is_empty());
    found
});

fn surfaces(structures: &StructureLabels) -> BoneSurfaces {
    structures.surfaces(&Default::default())
}

fn landmark(landmark: Landmark) -> Point {
    BODY.0.landmarks.get(landmark, Side::Left).unwrap()
}

/// The body's bones with each voxel's structure as `change` has it.
fn changed(change: impl Fn(u8, &Point) -> u8) -> StructureLabels {
    let mut volume = BODY.1.volume().clone();
    for offset in 0..volume.data.len() {
        let at = volume.grid.center(volume.grid.voxel(offset));
        volume.data[offset] = change(volume.data[offset], &at);
    }
    StructureLabels::new(volume)
}

const LEFT_HIP: u8 = Structure::Hip(Side::Left).value();
const LEFT_FEMUR: u8 = Structure::Femur(Side::Left).value();

/// The left hip bone without what lies behind the socket, along a slope on which nothing stands out: no
/// ischial spine.
fn without_spine() -> StructureLabels {
    let head = landmark(Landmark::Fh);
    changed(|value, at| {
        let d = at - head;
        let behind = d.y > (27.0 + 0.3 * d.z).max(25.0) && d.norm() > 34.0;
        match value == LEFT_HIP && d.z.abs() < 34.0 && behind {
            true => 0,
            false => value,
        }
    })
}

/// The pelvic frame settles to this (mm, from another start).
const SAME_MM: f64 = 1e-6;

/// Names of what is missing; all else must be as on the whole bones, but for the changed hip bone's
/// foramen and rim: its shadow is drawn from another pixel, and its surface is smoothed.
fn missing(found: &Detected) -> Vec<String> {
    for (landmark, side, point) in found.landmarks.iter() {
        let name = landmark.key(side);
        let before = WHOLE.landmarks.get(landmark, side).unwrap();
        if ["MOF_l", "IOF_l"].contains(&&*name) {
            assert!(
                (point - before).norm() < 1.0,
                "{name}: {point} from {before}"
            );
            continue;
        }
        assert!(
            (point - before).norm() < SAME_MM,
            "{name}: {point} from {before}"
        );
        let uncertainty = |of: &Detected| {
            let from = of.landmarks.provenance(landmark, side).unwrap();
            from.uncertainty_mm.unwrap()
        };
        let (now, then) = (uncertainty(found), uncertainty(&WHOLE));
        assert!((now - then).abs() < 1e-4, "{name}: {now} from {then} mm");
    }
    let [left, right] = &found.rims;
    let [whole, other] = &WHOLE.rims;
    if let (Some(right), Some(other)) = (right, other) {
        assert_eq!(right.len(), other.len());
        for (p, q) in right.iter().zip(other.iter()) {
            assert!((p - q).norm() < SAME_MM, "right rim: {p} from {q}");
        }
    }
    if let (Some(left), Some(whole)) = (left, whole) {
        let nearest = |p: &Point| {
            whole
                .iter()
                .map(|q| (q - p).norm())
                .fold(f64::MAX, f64::min)
        };
        let apart = left.iter().map(nearest).fold(0.0, f64::max);
        // Half a step of its points.
        assert!(apart < 1.25, "left rim: {apart} mm");
    }
    let names: Vec<String> = found.missing.iter().map(|m| m.name()).collect();
    let count = found.landmarks.iter().count() + found.rims.iter().flatten().count();
    assert_eq!(count + names.len(), 18, "{names:?}");
    names
}

#[test]
fn without_an_ischial_spine_only_the_notch_is_missing() {
    let found = detect(&surfaces(&without_spine())).unwrap();
    assert_eq!(missing(&found), ["GSN_l"]);
    assert!(found.ischial_spines[0].is_none() && found.ischial_spines[1].is_some());
    let reason = found.missing[0].error.to_string();
    assert!(
        reason.contains("rests on what is missing: the left ischial spine"),
        "{reason}"
    );
}

#[test]
fn with_a_filled_foramen_only_its_corners_are_missing() {
    let (medial, inferior) = (landmark(Landmark::Mof), landmark(Landmark::Iof));
    let depth = (medial.y + inferior.y) / 2.0;
    let head = landmark(Landmark::Fh);
    let filled = changed(|value, at| {
        let across = at.x > medial.x - 3.0 && at.x < medial.x + 60.0;
        let along = at.z > inferior.z - 3.0 && at.z < inferior.z + 50.0;
        let beside_socket = (at - head).norm() > 37.0;
        match value == 0 && across && along && beside_socket && (at.y - depth).abs() < 4.0 {
            true => LEFT_HIP,
            false => value,
        }
    });
    let found = detect(&surfaces(&filled)).unwrap();
    assert_eq!(missing(&found), ["MOF_l", "IOF_l"]);
    let reason = found.missing[0].error.to_string();
    assert!(reason.contains("shows no hole"), "{reason}");
}

#[test]
fn with_a_gap_in_the_socket_only_its_rim_is_missing() {
    let head = landmark(Landmark::Fh);
    let radius_mm = WHOLE.heads[0].unwrap().radius_mm;
    let rim = BODY.0.rim(Side::Left);
    let middle = rim.iter().map(|p| p.coords).sum::<Vector>() / rim.len() as f64;
    let axis = (head.coords - middle).normalize();
    let back = (Vector::y() - axis * axis.y).normalize();
    let broken = changed(|value, at| {
        let d = at - head;
        let beside = d - axis * d.dot(&axis);
        let wedge = beside.dot(&back) > 0.8 * beside.norm() && beside.norm() > 0.15 * d.norm();
        match value == LEFT_HIP && wedge && d.norm() < radius_mm + 13.0 {
            true => 0,
            false => value,
        }
    });
    let found = detect(&surfaces(&broken)).unwrap();
    assert_eq!(missing(&found), ["left rim"]);
}

/// Without a head its centre may be given: what rests on it is found then.
#[test]
fn a_given_head_carries_what_rests_on_it() {
    let head = WHOLE.landmarks.get(Landmark::Fh, Side::Left).unwrap();
    let cut = changed(
        |value, at| match value == LEFT_FEMUR && at.z > head.z - 30.0 {
            true => 0,
            false => value,
        },
    );
    let cut = surfaces(&cut);
    let found = detect(&cut).unwrap();
    let expected = [
        "ASIS_l", "AIIS_l", "FH_l", "MOF_l", "MOF_r", "IOF_l", "IOF_r", "GSN_l", "left rim",
    ];
    assert_eq!(missing(&found), expected);
    let reason = |name: &str| {
        let of = found.missing.iter().find(|m| m.name() == name).unwrap();
        of.error.to_string()
    };
    assert!(reason("GSN_l").contains("femoral head (FH_l)"));
    assert!(reason("MOF_r").contains("ASIS_l of the AP view"));

    let mut given = Landmarks::default();
    given.set(Landmark::Fh, Side::Left, head);
    let found = detect_with(&cut, &given).unwrap();
    let names: Vec<String> = found.missing.iter().map(|m| m.name()).collect();
    assert_eq!(names, ["FH_l"]);
    // The other head's size stands for this one's.
    let [left, right] = found.heads.map(|head| head.unwrap());
    assert_eq!(left.center, head);
    assert_eq!(left.radius_mm, right.radius_mm);
    for landmark in [Landmark::Asis, Landmark::Mof, Landmark::Iof] {
        let at = |of: &Detected| of.landmarks.get(landmark, Side::Left);
        let apart = (at(&found).unwrap() - at(&WHOLE).unwrap()).norm();
        assert!(apart < SAME_MM, "{landmark:?}: {apart} mm");
    }
    // A given ASIS alone carries the foramina.
    let mut given = Landmarks::default();
    let asis = WHOLE.landmarks.get(Landmark::Asis, Side::Left).unwrap();
    given.set(Landmark::Asis, Side::Left, asis);
    let found = detect_with(&cut, &given).unwrap();
    assert_eq!(
        missing(&found),
        ["ASIS_l", "AIIS_l", "FH_l", "GSN_l", "left rim"]
    );
}

/// Body and density need heads, of the bones or of people.
#[test]
fn surfaces_without_a_head_take_a_given_one() {
    let head = |side| WHOLE.landmarks.get(Landmark::Fh, side).unwrap();
    let cut = |sides: &[Side]| {
        let values: Vec<u8> = sides.iter().map(|s| Structure::Femur(*s).value()).collect();
        let low = head(Side::Left).z.min(head(Side::Right).z) - 30.0;
        surfaces(&changed(|value, at| {
            match values.contains(&value) && at.z > low {
                true => 0,
                false => value,
            }
        }))
    };
    let origin = SurfacesOrigin::of_folder(Path::new("nowhere"), "body").unwrap();
    let parameters = SurfacesParameters {
        voxel_mm: 2.0,
        ..Default::default()
    };
    let made = |bones: &BoneSurfaces, given: &Given| {
        specimen_from_surfaces_with(bones, &origin, &parameters, given)
    };
    let one = cut(&[Side::Left]);
    let mut given = Given::default();
    match made(&one, &given).unwrap_err() {
        ImportError::Landmarks(unfound) => assert_eq!(unfound.missing.len(), 9),
        other => panic!("{other}"),
    }
    given
        .landmarks
        .set(Landmark::Fh, Side::Left, head(Side::Left));
    let body = made(&one, &given).unwrap();
    let from = |side| body.specimen.landmarks.provenance(Landmark::Fh, side);
    let found = Side::BOTH.map(|side| from(side).unwrap().found.unwrap());
    assert_eq!(found, [Found::Given, Found::Detected]);
    assert_eq!(body.notes.len(), 2, "{:?}", body.notes);

    let all = Given {
        landmarks: WHOLE.landmarks.clone(),
        rims: WHOLE.rims.clone().map(|rim| rim.map(|rim| rim.to_vec())),
    };
    let error = made(&cut(&Side::BOTH), &all).unwrap_err();
    let message = error.to_string();
    assert!(matches!(error, ImportError::Heads(_)), "{message}");
    assert!(message.contains("left femoral head") && message.contains("right"));
}

/// As a user does: refused, completed in Slicer, taken.
#[test]
fn a_draft_is_completed_and_imported() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_nifti(&BODY.0.ct, &at("ct.nii.gz")).unwrap();
    write_nifti(without_spine().volume(), &at("map.nii.gz")).unwrap();
    let rows = "value,structure\n1,sacrum\n2,hip_left\n3,hip_right\n4,femur_left\n5,femur_right\n";
    std::fs::write(at("table.csv"), rows).unwrap();
    let import = |flags: &[(&str, &Path)]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_pao-sim"));
        command.args(["specimen", "import", "labels"]);
        command.args([at("ct.nii.gz"), at("map.nii.gz")]);
        command.arg("--table").arg(at("table.csv"));
        command
            .arg("--out")
            .arg(at("made"))
            .args(["--voxel-mm", "2"]);
        for (flag, value) in flags {
            command.arg(flag).arg(value);
        }
        let output = command.output().unwrap();
        let text = [output.stdout, output.stderr].concat();
        let text = String::from_utf8(text).unwrap();
        (output.status.code().unwrap(), text)
    };
    let draft = at("draft.mrk.json");
    let (code, _) = import(&[("--draft-landmarks", &at("draft.csv"))]);
    assert_eq!(code, 2, "no name for Slicer");
    let (code, told) = import(&[("--draft-landmarks", &draft)]);
    assert_eq!(code, 1, "{told}");
    assert!(
        told.contains("- GSN_l: the left greater sciatic notch"),
        "{told}"
    );
    assert!(
        !told.contains("IOF") && told.contains("--landmarks"),
        "{told}"
    );
    assert!(
        told.contains("holds landmarks and rims; to be placed: GSN_l\n"),
        "{told}"
    );
    assert!(!at("made").exists());
    let (code, told) = import(&[("--draft-landmarks", &draft)]);
    assert!(code == 1 && told.contains("exists"), "{told}");
    // Unfinished, it misses what it missed before.
    let (code, told) = import(&[("--landmarks", &draft)]);
    assert!(code == 1 && told.contains("- GSN_l: "), "{told}");

    let mut file: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&draft).unwrap()).unwrap();
    let points = file["markups"][0]["controlPoints"].as_array_mut().unwrap();
    let notch = points.iter_mut().find(|p| p["label"] == "GSN_l").unwrap();
    let placed = landmark(Landmark::Gsn);
    notch["position"] = serde_json::json!([placed.x, placed.y, placed.z]);
    notch["positionStatus"] = "defined".into();
    std::fs::write(&draft, file.to_string()).unwrap();
    let (code, told) = import(&[("--landmarks", &draft)]);
    // Bone of which so much is gone is no specimen to operate on, and the import says so.
    assert!(code == 1 && told.contains("- WRONG: "), "{told}");
    assert!(
        told.contains("taken from the landmark file: GSN_l\n"),
        "{told}"
    );
    assert!(
        told.contains("not found by rule: GSN_l (the left greater"),
        "{told}"
    );
    let made = read_specimen(&at("made")).unwrap();
    for (landmark, side, point) in made.landmarks.iter() {
        let from = made.landmarks.provenance(landmark, side).unwrap().found;
        match landmark.key(side) == "GSN_l" {
            true => {
                assert_eq!(from, Some(Found::Given));
                assert!((point - placed).norm() < 1e-9);
            }
            false => assert_eq!(from, Some(Found::Detected), "{landmark:?} {side}"),
        }
    }
    assert!(
        made.rims
            .iter()
            .all(|rim| rim.provenance.found == Some(Found::Detected))
    );
}

/// What docs/formats.md says of two people's label maps.
#[test]
#[ignore = "a minute"]
fn label_maps_without_a_ct() {
    let Some(data) = data::pelvic_labels() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("table.csv");
    std::fs::write(&table, "value,structure\n1,hips\n2,femora\n3,sacrum\n").unwrap();
    let table = read_label_table(&table).unwrap();
    for name in ["Pelvic-Ref-001", "Pelvic-Ref-002"] {
        let map = read_volume(&data.join(name).join("label.mhd")).unwrap();
        let (structures, _) = structures_of_labels(&map, &table).unwrap();
        let import = CtImport {
            ct: Volume::filled(structures.volume().grid.clone(), 0i16),
            structures,
            given: Given::default(),
            origin: CtOrigin {
                kind: "labels",
                name: "body".into(),
                sex: "unknown".into(),
                licence: "none".into(),
                from: "a test".into(),
            },
            notes: vec![],
        };
        match specimen_from_ct(import, &CtImportParameters::default()) {
            Ok(Imported { specimen, .. }) => {
                println!("{name}: all are found");
                let landmarks = &specimen.landmarks;
                for (landmark, side, _) in landmarks.iter() {
                    let from = landmarks.provenance(landmark, side).unwrap();
                    println!(
                        "{} {:.1} mm",
                        landmark.key(side),
                        from.uncertainty_mm.unwrap()
                    );
                }
                for (side, rim) in Side::BOTH.into_iter().zip(&specimen.rims) {
                    let mm = rim.provenance.uncertainty_mm.unwrap();
                    let head = landmarks.get(Landmark::Fh, side).unwrap();
                    let center = rim.iter().map(|p| p - head).sum::<Vector>() / rim.len() as f64;
                    println!(
                        "{side} rim {mm:.1} mm, centre {:.1} mm off the head's",
                        center.norm()
                    );
                }
            }
            Err(CtImportError::Landmarks(unfound)) => println!("{name}:\n{unfound}"),
            Err(error) => panic!("{name}: {error}"),
        }
    }
}
