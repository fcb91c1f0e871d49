//! The built binary on specimens: what it makes, shows, proves and refuses.

use assert_cmd::Command;
use pao_sim::anatomy::landmark_files::read_landmark_overrides;
use pao_sim::anatomy::surfaces::BONES;
use pao_sim::anatomy::{
    Landmark, PhantomParameters, Side, Specimen, phantom, phantom_structures, read_specimen,
    write_specimen,
};
use pao_sim::geometry::Vector;
use pao_sim::volume::write_nifti;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

mod rows;
use rows::promised;

/// The phantom of `configs/smoke.toml`.
const VOXEL_MM: f64 = 3.0;

static BODY: LazyLock<Specimen> = LazyLock::new(|| {
    let parameters = PhantomParameters {
        voxel_mm: VOXEL_MM,
        ..Default::default()
    };
    phantom(1, &parameters)
});

/// A folder with the body in `phantom-1`.
fn written() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("phantom-1");
    write_specimen(&BODY, &body).unwrap();
    (folder, body)
}

fn pao_sim() -> Command {
    Command::cargo_bin("pao-sim").expect("cargo builds the binary for its tests")
}

/// What a command prints that must end with an exit code: standard output, standard error.
fn said(command: &mut Command, code: i32) -> (String, String) {
    let assert = command.assert().code(code);
    let output = assert.get_output();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

fn check(specimen: &Path, code: i32) -> (String, String) {
    said(pao_sim().args(["specimen", "check"]).arg(specimen), code)
}

/// A closed box as PLY, `mm` long, without its last `open` faces.
fn cuboid(mm: f64, open: usize) -> String {
    let faces = [
        "0 2 3 1", "4 5 7 6", "0 1 5 4", "2 6 7 3", "0 4 6 2", "1 3 7 5",
    ];
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        faces.len() - open
    );
    for n in 0..8u8 {
        let at = |bit: u8| f64::from(n >> bit & 1) * mm;
        text += &format!("{} {} {}\n", at(0), at(1), at(2));
    }
    for face in &faces[..faces.len() - open] {
        text += &format!("4 {face}\n");
    }
    text
}

/// A folder of boxes instead of bones.
fn boxes(mm: f64) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for bone in BONES {
        std::fs::write(folder.path().join(format!("{bone}.ply")), cuboid(mm, 0)).unwrap();
    }
    folder
}

/// Imports surfaces in vain; gives what is said, having seen that nothing was written.
fn refused_import(surfaces: &Path) -> String {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("made");
    let (_, said) = said(
        pao_sim()
            .args(["specimen", "import", "surfaces"])
            .arg(surfaces)
            .arg("--out")
            .arg(&out),
        1,
    );
    assert_eq!(
        std::fs::read_dir(place.path()).unwrap().count(),
        0,
        "{said}"
    );
    said
}

/// From the header: eight bytes of signature, then the length and name of the first chunk.
fn size_of_png(bytes: &[u8]) -> (u32, u32) {
    assert_eq!(bytes[1..4], *b"PNG");
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn advice_follows_the_table_for_what_is_not_ok_and_nothing_else() {
    let (_folder, path) = written();
    let (table, _) = check(&path, 0);
    // Voxels of 3 mm are coarse.
    assert!(
        table.contains("largest edge of a voxel (doubtful): DRRs and cuts"),
        "{table}"
    );
    assert!(!table.contains("(ok)"), "{table}");
    let (lines, _) = said(
        pao_sim().args(["specimen", "check", "--json"]).arg(&path),
        0,
    );
    for line in lines.lines() {
        let check: serde_json::Value = serde_json::from_str(line).unwrap();
        let advice = check["advice"].as_str();
        assert_eq!(advice.is_some(), check["verdict"] != "ok", "{line}");
        assert!(advice.is_none_or(|advice| !advice.is_empty()), "{line}");
    }
}

#[test]
fn a_written_body_is_read_again_as_it_was() {
    let (_folder, path) = written();
    let again = read_specimen(&path).unwrap();
    assert_eq!(again.ct.grid, BODY.ct.grid);
    assert!(again.ct.data == BODY.ct.data && again.labels.data == BODY.labels.data);
    assert_eq!(again.landmarks, BODY.landmarks);
    assert_eq!(again.rims, BODY.rims);
    assert_eq!((&again.name, &again.source), (&BODY.name, &BODY.source));
}

#[test]
fn a_sound_body_is_proved_and_drawn() {
    let (folder, path) = written();
    let (table, _) = check(&path, 0);
    for line in [
        "APP axes orthonormal",
        "left MOF from bone",
        "right LCE angle",
        "0 wrong",
    ] {
        assert!(table.contains(line), "expected '{line}' in {table}");
    }
    let sheet = folder.path().join("sheet.png");
    let (told, _) = said(
        pao_sim()
            .args(["specimen", "check"])
            .arg(&path)
            .arg("--sheet")
            .arg(&sheet),
        0,
    );
    assert!(told.contains("sheet.png"), "{told}");
    let (width, height) = size_of_png(&std::fs::read(&sheet).unwrap());
    assert!(width > 2000 && height > 1000, "{width} x {height}");
    let pictures = folder.path().join("pictures");
    let (_, errors) = said(
        pao_sim()
            .args(["specimen", "show"])
            .arg(&path)
            .arg("--out")
            .arg(&pictures),
        0,
    );
    assert_eq!(errors, "");
    for picture in ["ap.png", "left_hip.png", "right_hip.png"] {
        let bytes = std::fs::read(pictures.join(picture)).unwrap();
        assert!(
            bytes.starts_with(b"\x89PNG") && bytes.len() > 50_000,
            "{picture}"
        );
    }
}

#[test]
fn landmarks_go_to_slicer_and_come_back() {
    let (folder, path) = written();
    let landmarks = |file: &str, code: i32| {
        let out = folder.path().join(file);
        let mut command = pao_sim();
        command.args(["specimen", "landmarks"]).arg(&path);
        (said(command.arg("--out").arg(&out), code), out)
    };
    let ((line, _), file) = landmarks("body.mrk.json", 0);
    assert!(line.contains("16 landmarks and both rims"), "{line}");
    let back = read_landmark_overrides(&file).unwrap();
    assert_eq!(back.landmarks, BODY.landmarks);
    assert_eq!(back.rims, BODY.rims.clone().map(|rim| Some(rim.to_vec())));
    let ((_, errors), _) = landmarks("body.mrk.json", 1);
    assert!(errors.contains("exists already"), "{errors}");
    let ((_, errors), _) = landmarks("body.fcsv", 2);
    assert!(errors.contains(".mrk.json"), "{errors}");
}

#[test]
fn phantoms_need_no_folder() {
    let place = tempfile::tempdir().unwrap();
    let config = place.path().join("coarse.toml");
    std::fs::write(&config, "[population.phantom]\nvoxel_mm = 3.0\n").unwrap();
    let (lines, _) = said(
        pao_sim()
            .args(["--json", "specimen", "check", "phantom-3", "--config"])
            .arg(&config),
        0,
    );
    let first: serde_json::Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    assert_eq!(first["specimen"], "phantom-3");
    assert_eq!(first["verdict"], "ok");
}

#[test]
fn a_body_with_left_for_right_is_refused() {
    let mut body = BODY.clone();
    body.labels = BODY.labels.map(|label| [0, 1, 3, 2][usize::from(label)]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("swapped");
    write_specimen(&body, &path).unwrap();
    let (table, _) = check(&path, 1);
    let line = table
        .lines()
        .find(|l| l.starts_with("label of the left femur"))
        .unwrap();
    assert!(line.ends_with("WRONG"), "{table}");
}

#[test]
fn every_mistake_of_a_folder_is_named() {
    let (_folder, path) = written();
    std::fs::remove_file(path.join("rims.csv")).unwrap();
    std::fs::write(path.join("ct.nii.gz"), "no volume").unwrap();
    let (_, errors) = check(&path, 1);
    assert!(errors.contains("rims.csv is missing"), "{errors}");
    assert!(
        errors.contains("ct.nii.gz is not a NIfTI-1 file"),
        "{errors}"
    );
}

#[test]
fn an_absent_label_and_a_landmark_outside_are_named() {
    let (_folder, path) = written();
    let landmarks = std::fs::read_to_string(path.join("landmarks.csv")).unwrap();
    let outside = |line: &str| match line.strip_prefix("MOF_l,") {
        Some(_) => "MOF_l,1,2,9000\n".to_owned(),
        None => format!("{line}\n"),
    };
    let landmarks: String = landmarks.lines().map(outside).collect();
    std::fs::write(path.join("landmarks.csv"), landmarks).unwrap();
    let labels = BODY.labels.map(|label| if label == 3 { 0 } else { label });
    std::fs::remove_file(path.join("labels.nii.gz")).unwrap();
    pao_sim::volume::write_nifti(&labels, &path.join("labels.nii.gz")).unwrap();
    let (_, errors) = check(&path, 1);
    assert!(
        errors.contains("no voxel has label 3 (right femur)"),
        "{errors}"
    );
    assert!(
        errors.contains("landmark MOF_l (1.0, 2.0, 9000.0) lies outside"),
        "{errors}"
    );
}

#[test]
fn open_surfaces_missing_ones_and_wrong_units_are_named() {
    let surfaces = boxes(200.0);
    let at = |file: &str| surfaces.path().join(file);
    std::fs::write(at("Hip_L.ply"), cuboid(200.0, 1)).unwrap();
    std::fs::write(at("Femur_R.ply"), "solid femur").unwrap();
    // Two mistakes in two files are told together.
    let message = refused_import(surfaces.path());
    assert!(
        message.contains("Hip_L.ply is not closed: 4 edges"),
        "{message}"
    );
    assert!(
        message.contains("Femur_R.ply is not a readable PLY"),
        "{message}"
    );
    std::fs::remove_file(at("Sacrum.ply")).unwrap();
    std::fs::remove_file(at("Femur_L.ply")).unwrap();
    let message = refused_import(surfaces.path());
    assert!(message.contains("lacks Sacrum, Femur_L;"), "{message}");

    let message = refused_import(boxes(0.2).path());
    assert!(message.contains("Sacrum.ply is 0.200 mm long"), "{message}");
    assert!(message.contains("another unit"), "{message}");
    // Boxes are no bones.
    let message = refused_import(boxes(200.0).path());
    assert!(message.contains("cannot find the landmarks"), "{message}");
}

#[test]
fn an_existing_folder_is_not_touched() {
    let (_folder, path) = written();
    let surfaces = boxes(200.0);
    let (_, errors) = said(
        pao_sim()
            .args(["specimen", "import", "surfaces"])
            .arg(surfaces.path())
            .arg("--out")
            .arg(&path),
        1,
    );
    assert!(errors.contains("exists already"), "{errors}");
    read_specimen(&path).unwrap();
}

/// A study of one registration on the body, from the phantom's number or from a folder.
fn study(name: &str, population: &str) -> String {
    let smoke = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/smoke.toml");
    let smoke = std::fs::read_to_string(smoke).unwrap();
    for part in ["name = \"smoke\"", "phantoms = 1", "initializations = 2"] {
        assert!(smoke.contains(part), "{part}");
    }
    smoke
        .replace("name = \"smoke\"", &format!("name = \"{name}\""))
        .replace("phantoms = 1", population)
        .replace(
            "initializations = 2",
            "initializations = 1\nscenarios = [\"ilium_pubis_estimated\"]",
        )
}

fn run(folder: &Path, config: &Path) -> Command {
    let mut command = pao_sim();
    command
        .arg("--results")
        .arg(folder)
        .arg("run")
        .arg(config)
        .args(["--threads", "1"]);
    command
}

#[test]
fn a_study_gives_the_same_rows_from_the_folder_and_refuses_other_data() {
    let (folder, path) = written();
    let results = folder.path().join("results");
    let direct = folder.path().join("direct.toml");
    std::fs::write(&direct, study("direct", "phantoms = 1")).unwrap();
    run(&results, &direct).assert().success();
    // A relative path starts at the configuration, not where the command is given.
    let from_folder = folder.path().join("folder.toml");
    let population = "phantoms = 0\nspecimens = [\"phantom-1\"]";
    std::fs::write(&from_folder, study("folder", population)).unwrap();
    run(&results, &from_folder).assert().success();
    let rows = |study: &str| promised(&results.join(study).join("registrations.parquet"));
    assert_eq!(rows("folder"), rows("direct"));

    let landmarks = path.join("landmarks.csv");
    let text = std::fs::read_to_string(&landmarks).unwrap();
    std::fs::write(&landmarks, text.clone() + "# looked at again\n").unwrap();
    let (_, errors) = said(&mut run(&results, &from_folder), 2);
    assert!(errors.contains("specimen.phantom-1: was"), "{errors}");
    assert!(errors.contains("--accept specimen.phantom-1"), "{errors}");
    let mut accepted = run(&results, &from_folder);
    accepted
        .args(["--accept", "specimen.phantom-1"])
        .assert()
        .success();
    run(&results, &from_folder).assert().success();
    std::fs::remove_file(&landmarks).unwrap();
    let (_, errors) = said(&mut run(&results, &from_folder), 1);
    assert!(errors.contains("landmarks.csv"), "{errors}");
}

#[test]
fn three_mistakes_of_a_configuration_are_named_with_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("bad.toml");
    let text = "[population]\nphantoms = 0\nspecimen = [\"a\"]\nsides = [\"up\"]\n[study]\ninitializations = 0\n";
    std::fs::write(&config, text).unwrap();
    let (_, errors) = said(&mut run(&folder.path().join("results"), &config), 2);
    for part in [
        "bad.toml:3: population.specimen is no key",
        "bad.toml:4: ",
        "bad.toml:6: ",
    ] {
        assert!(errors.contains(part), "expected '{part}' in {errors}");
    }
    assert!(!folder.path().join("results").exists());
}

/// One real subject, coarse: everything from surfaces to pictures.
#[test]
fn a_real_subject_is_imported_and_proved() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/vsd/z042");
    if !data.is_dir() {
        assert!(std::env::var_os("PAO_SIM_REQUIRE_DATA").is_none());
        println!("SKIPPED: no bones at {}", data.display());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("coarse.toml");
    std::fs::write(&config, "[population.surface_bodies]\nvoxel_mm = 2.0\n").unwrap();
    let out = folder.path().join("made");
    said(
        pao_sim()
            .args(["specimen", "import", "surfaces"])
            .arg(&data)
            .arg("--out")
            .arg(&out)
            .args([
                "--name",
                "somebody",
                "--sex",
                "female",
                "--licence",
                "CC BY-NC-SA 4.0",
            ])
            .arg("--config")
            .arg(&config),
        0,
    );
    let made = read_specimen(&out).unwrap();
    assert_eq!((&*made.name, &*made.source.sex), ("somebody", "female"));
    assert_eq!(made.source.licence, "CC BY-NC-SA 4.0");
    let (table, _) = check(&out, 0);
    assert!(table.contains("0 wrong"), "{table}");

    // What a person placed goes before what is found by rule.
    let asis = |specimen: &Specimen| specimen.landmarks.get(Landmark::Asis, Side::Left).unwrap();
    let picked = asis(&made) + Vector::new(0.0, 1.5, 0.0);
    let points = folder.path().join("points.csv");
    let (x, y, z) = (picked.x, picked.y, picked.z);
    let rows = format!("name,x_lps_mm,y_lps_mm,z_lps_mm\nASIS-L,{x},{y},{z}\n");
    std::fs::write(&points, rows).unwrap();
    let corrected = folder.path().join("corrected");
    let mut command = pao_sim();
    command.args(["specimen", "import", "surfaces"]).arg(&data);
    command.arg("--out").arg(&corrected);
    command.arg("--config").arg(&config);
    let (told, _) = said(command.arg("--landmarks").arg(&points), 0);
    assert!(
        told.contains("taken from the landmark file: ASIS_l"),
        "{told}"
    );
    let corrected = read_specimen(&corrected).unwrap();
    assert!((asis(&corrected) - picked).norm() < 1e-9);
    assert_eq!(corrected.rims[0].to_vec(), made.rims[0].to_vec());
}

/// A CT and a label map in which both femora have one value.
#[test]
fn a_ct_with_a_label_map_is_imported_and_proved() {
    let parameters = PhantomParameters {
        voxel_mm: 2.0,
        ..Default::default()
    };
    let (body, bones) = phantom_structures(1, &parameters);
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_nifti(&body.ct, &at("ct.nii.gz")).unwrap();
    write_nifti(&bones.volume().map(|v| v.min(4)), &at("map.nii.gz")).unwrap();
    let rows = "value,structure\n1,sacrum\n2,hip_left\n3,hip_right\n4,femora\n";
    std::fs::write(at("table.csv"), rows).unwrap();
    // One landmark from a person, in the other frame.
    let picked =
        body.landmarks.get(Landmark::Asis, Side::Left).unwrap() + Vector::new(1.5, 0.0, 0.0);
    let (x, y, z) = (-picked.x, -picked.y, picked.z);
    let points = format!("name,x_ras_mm,y_ras_mm,z_ras_mm\nleft ASIS,{x},{y},{z}\nnavel,0,0,0\n");
    std::fs::write(at("points.csv"), points).unwrap();
    let import = |voxel_mm: &str, code: i32| {
        let mut command = pao_sim();
        command.args(["specimen", "import", "labels"]);
        command.args([at("ct.nii.gz"), at("map.nii.gz")]);
        command.arg("--table").arg(at("table.csv"));
        command.arg("--landmarks").arg(at("points.csv"));
        command.arg("--out").arg(at("made"));
        command.args(["--voxel-mm", voxel_mm, "--sex", "male", "--json"]);
        said(&mut command, code)
    };
    let (_, refused) = import("9", 1);
    assert!(refused.contains("voxel_mm is 9"), "{refused}");
    let mut command = pao_sim();
    command.args(["specimen", "import", "labels"]);
    command.args([at("ct.nii.gz"), at("map.nii.gz")]);
    let (_, misnamed) = said(command.arg("--out").arg(at("my_body")), 2);
    assert!(
        misnamed.contains("'my_body'; expected letters"),
        "{misnamed}"
    );
    assert!(!at("made").exists(), "nothing is half-written");
    let (told, _) = import("2", 0);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["specimen"], "made");
    assert_eq!(told["voxel_mm"], 2.0);
    let notes = told["notes"].to_string();
    assert!(told["checks"].as_u64().unwrap() > 80);
    let findings = told["findings"].as_array().unwrap();
    let coarse = findings
        .iter()
        .any(|f| f["check"] == "largest edge of a voxel");
    assert!(
        coarse && findings.iter().all(|f| f["verdict"] == "doubtful"),
        "{told}"
    );
    assert!(
        notes.contains("taken from the landmark file: ASIS_l"),
        "{notes}"
    );
    assert!(notes.contains("navel"), "{notes}");
    let made = read_specimen(&at("made")).unwrap();
    let asis = made.landmarks.get(Landmark::Asis, Side::Left).unwrap();
    assert!((asis - picked).norm() < 1e-9, "{asis}");
    assert_eq!(made.source.kind, "labels");
    assert_eq!(made.source.sex, "male");
    assert!(!made.source.assigned_density);
    assert!(made.ct == body.ct);
    check(&at("made"), 0);
    let (_, refused) = import("2", 1);
    assert!(refused.contains("exists already"), "{refused}");
    // Values that are no Hounsfield units, as programs for learning scale them.
    write_nifti(&body.ct.map(|v| v + 1024), &at("ct.nii.gz")).unwrap();
    std::fs::rename(at("made"), at("before")).unwrap();
    let (told, _) = import("2", 1);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    let wrong = told["findings"].as_array().unwrap().iter();
    let wrong: Vec<_> = wrong.filter(|f| f["verdict"] == "WRONG").collect();
    assert!(
        wrong.iter().any(|f| f["check"].to_string().contains("air")),
        "{wrong:?}"
    );
    assert!(at("made").is_dir());
    let mut command = pao_sim();
    command.args(["specimen", "import", "labels"]);
    command.args([at("ct.nii.gz"), at("map.nii.gz")]);
    let (_, refused) = said(command.arg("--out").arg(at("without")), 1);
    assert!(refused.contains("does not name its values"), "{refused}");
    assert!(refused.contains("give a table"), "{refused}");
}
