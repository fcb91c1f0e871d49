//! The readers beside files of each format, version and frame (`scripts/make_point_fixtures.py`).

use super::{PointsFileError, read_landmark_overrides, read_points, write_markups};
use crate::anatomy::{Landmark, Landmarks, Side};
use crate::geometry::{Point, Vector};
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/points")
        .join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(fixture(name)).unwrap()
}

/// The landmarks of every file: number n at LPS (10 n + 1/3, -n / 7, 100 + n / 9).
fn expected() -> Landmarks {
    let mut landmarks = Landmarks::default();
    let all = Landmark::ALL
        .into_iter()
        .flat_map(|l| Side::BOTH.map(|s| (l, s)));
    for (n, (landmark, side)) in all.enumerate() {
        let n = n as f64;
        let at = Point::new(10.0 * n + 1.0 / 3.0, 0.0 - n / 7.0, 100.0 + n / 9.0);
        landmarks.set(landmark, side, at);
    }
    landmarks
}

/// A file of this name and text.
fn file(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn refused(name: &str, text: &str) -> String {
    let (_folder, path) = file(name, text);
    let message = read_landmark_overrides(&path).unwrap_err().to_string();
    assert!(message.contains(name), "{message}");
    message
}

#[test]
fn the_same_points_come_from_every_format_version_and_frame() {
    let mut files = 0;
    for entry in std::fs::read_dir(fixture("")).unwrap() {
        let path = entry.unwrap().path();
        files += 1;
        let read = read_landmark_overrides(&path).unwrap();
        // Equal to the last bit, which == of numbers would not see in a zero's sign.
        assert_eq!(
            format!("{:?}", read.landmarks),
            format!("{:?}", expected()),
            "{}",
            path.display()
        );
        assert_eq!(read.rims, [None, None]);
        let status = path.to_str().unwrap().contains("slicer_5");
        assert_eq!(read.ignored.len(), 1 + usize::from(status), "{read:?}");
        assert!(read.ignored[0].contains("'F-1' is neither"), "{read:?}");
        if status {
            assert!(
                read.ignored[1].contains("'PSIS-l' has no position (status 0"),
                "{read:?}"
            );
        }
    }
    assert_eq!(files, 13);
}

#[test]
fn labels_may_be_quoted_and_a_name_is_taken_once() {
    let whole = text("slicer_5_0_lps.fcsv");
    let quoted = whole.replace("F-1", "\"the first, \"\"F-1\"\"\"");
    let (_folder, path) = file("points.fcsv", &quoted);
    let points = read_points(&path).unwrap().points;
    assert_eq!(points.last().unwrap().name, "the first, \"F-1\"");
    assert_eq!(points.last().unwrap().point, Point::new(1.0, 2.0, 3.0));

    let message = refused("points.fcsv", &whole.replace("F-1", "ASIS-l"));
    assert!(message.contains("two points named 'ASIS-l'"), "{message}");
    let message = refused("points.fcsv", &whole.replace("F-1", "left ASIS"));
    assert!(
        message.contains("'ASIS-l' and 'left ASIS' both mean ASIS_l"),
        "{message}"
    );
    let (_folder, path) = file("points.fcsv", &whole.replace("F-1", ""));
    let ignored = read_landmark_overrides(&path).unwrap().ignored;
    assert!(
        ignored[0].contains("a point at LPS (1, 2, 3) has no name"),
        "{ignored:?}"
    );
}

#[test]
fn no_version_and_no_frame_is_guessed() {
    for (file, from, to, reason) in [
        ("slicer_4_6.fcsv", "4.6", "4.2", "version is 4.2"),
        ("slicer_4_6.fcsv", "4.6", "4.14", "version is 4.14"),
        ("slicer_5_0_lps.fcsv", "5.0", "6.0", "version is 6.0"),
        ("slicer_5_0_lps.fcsv", "5.0", "5", "version is 5;"),
        (
            "slicer_4_6.fcsv",
            "# Markups fiducial file version = 4.6\n",
            "",
            "no line '# Markups fiducial file version",
        ),
        (
            "slicer_4_6.fcsv",
            "# CoordinateSystem = 0\n",
            "",
            "no line '# CoordinateSystem",
        ),
        (
            "slicer_4_10.fcsv",
            "System = 0",
            "System = 1",
            "CoordinateSystem is 1; expected 0 (RAS)",
        ),
        (
            "slicer_4_10.fcsv",
            "System = 0",
            "System = LPS",
            "CoordinateSystem is LPS; expected 0 (RAS)",
        ),
        (
            "slicer_5_0_lps.fcsv",
            "System = LPS",
            "System = IJK",
            "CoordinateSystem is IJK",
        ),
        (
            "slicer_5_0_lps.fcsv",
            "# Coor",
            "# CoordinateSystem = RAS\n# Coor",
            "two different lines 'CoordinateSystem'",
        ),
        (
            "slicer_5_0_lps.fcsv",
            "id,x,y,z",
            "id,label,x,y",
            "its columns are",
        ),
        ("slicer_5_0_lps.fcsv", "F-1,,,2,0", "F-1,,,2", "15 columns"),
        (
            "slicer_5_0_lps.fcsv",
            "16,1,2,3",
            "16,1,two,3",
            "line 20: 'two' is no coordinate",
        ),
        (
            "slicer_5_0_lps.fcsv",
            "16,1,2,3",
            "16,1,nan,3",
            "'nan' is no coordinate",
        ),
        (
            "slicer_4_11_lps.mrk.json",
            "\"coordinateSystem\": \"LPS\",",
            "",
            "markup 0 ('') has no coordinateSystem",
        ),
        (
            "slicer_4_11_lps.mrk.json",
            "\"LPS\"",
            "\"LAS\"",
            "coordinateSystem LAS",
        ),
        ("slicer_4_11_lps.mrk.json", "\"LPS\"", "2", "System 2"),
        (
            "slicer_4_11_lps.mrk.json",
            "schema-v1",
            "schema-v2",
            "@schema is",
        ),
        (
            "slicer_4_11_lps.mrk.json",
            "100.0",
            "\"100\"",
            "expected three numbers",
        ),
        ("slicer_4_11_lps.mrk.json", "100.0", "1, 2", "three numbers"),
        ("slicer_4_11_lps.mrk.json", "100.0", "NaN", "line 14"),
        (
            "slicer_4_11_lps.mrk.json",
            "\"controlPoints\"",
            "\"coordinateUnits\": \"um\", \"controlPoints\"",
            "lengths in \"um\"",
        ),
        ("lps.csv", "x_lps_mm", "x", "does not say in which frame"),
        (
            "lps.csv",
            "x_lps_mm,y_lps_mm,z_lps_mm",
            "x,y,z",
            "name them x_lps_mm,y_lps_mm,z_lps_mm",
        ),
        ("lps.csv", "name", "nom", "its columns are 'nom,x_lps_mm"),
        ("lps.csv", "F-1,1,2,3", "F-1,1,2", "line: 18"),
        ("lps.csv", "F-1,1,2,3", "F-1,1,2,", "line 18: ''"),
    ] {
        let whole = text(file);
        assert!(whole.contains(from), "{file}: {from}");
        let ending = file.split_once('.').unwrap().1;
        let message = refused(&format!("points.{ending}"), &whole.replacen(from, to, 1));
        assert!(
            message.contains(reason),
            "expected '{reason}' in: {message}"
        );
    }
    let message = refused(
        "points.csv",
        "name,x_lps_mm,y_lps_mm,z_lps_mm,x_ras_mm,y_ras_mm,z_ras_mm\nFH_l,1,2,3,-1,-2,3\n",
    );
    assert!(message.contains("two frames"), "{message}");
    let message = refused("points.txt", "");
    assert!(message.contains("expected .fcsv, .mrk.json or .csv"));
}

#[test]
fn old_numbers_and_coded_units_of_markups_are_understood() {
    let whole = text("slicer_4_11_lps.mrk.json");
    for (system, units) in [
        ("1", "\"mm\""),
        ("\"1\"", "[\"mm\", \"UCUM\", \"millimeter\"]"),
        ("\"LPS\"", "null"),
    ] {
        let other = whole.replace(
            "\"coordinateSystem\": \"LPS\",",
            &format!("\"coordinateSystem\": {system}, \"coordinateUnits\": {units},"),
        );
        let (_folder, path) = file("a.mrk.json", &other);
        let read = read_landmark_overrides(&path).unwrap();
        assert_eq!(read.landmarks, expected());
    }
    let ras = text("slicer_4_11_ras.mrk.json").replace("\"RAS\"", "0");
    let (_folder, path) = file("a.mrk.json", &ras);
    assert_eq!(
        read_landmark_overrides(&path).unwrap().landmarks,
        expected()
    );
}

#[test]
fn the_table_that_slicer_exports_is_read() {
    let table = "label,l,p,s,defined,selected,visible,locked,description\n\
                 FH-l,1,2,3,1,1,1,0,\nFH-r,0,0,0,0,1,1,0,\n";
    let (_folder, path) = file("points.csv", table);
    let read = read_landmark_overrides(&path).unwrap();
    let head = |side| read.landmarks.get(Landmark::Fh, side);
    assert_eq!(head(Side::Left), Some(Point::new(1.0, 2.0, 3.0)));
    assert_eq!(head(Side::Right), None);
    assert!(read.ignored[0].contains("'FH-r' has no position"));
    let (_folder, path) = file("points.csv", &table.replace("l,p,s", "r,a,s"));
    let read = read_landmark_overrides(&path).unwrap();
    let head = read.landmarks.get(Landmark::Fh, Side::Left);
    assert_eq!(head, Some(Point::new(-1.0, -2.0, 3.0)));
}

#[test]
fn only_defined_positions_of_markups_count() {
    let point = |label: &str, rest: &str| format!("{{\"label\": \"{label}\"{rest}}}");
    let at = ", \"position\": [1.5, 2, -3]";
    let lists = [
        (
            "Fiducial",
            vec![
                point("FH_l", at),
                point(
                    "FH_r",
                    &format!("{at}, \"visibility\": false, \"selected\": false"),
                ),
                point(
                    "MOF_l",
                    ", \"position\": [], \"positionStatus\": \"undefined\"",
                ),
                point("MOF_r", &format!("{at}, \"positionStatus\": \"missing\"")),
                point("IOF_l", &format!("{at}, \"positionStatus\": \"preview\"")),
                point("IOF_r", ""),
            ],
        ),
        (
            "Line",
            vec![point(
                "GSN_l",
                &format!("{at}, \"positionStatus\": \"defined\""),
            )],
        ),
        ("Plane", vec![point("GSN_r", at)]),
    ];
    let markups: Vec<String> = lists
        .iter()
        .map(|(kind, points)| {
            format!(
                "{{\"type\": \"{kind}\", \"coordinateSystem\": \"LPS\", \"controlPoints\": [{}]}}",
                points.join(",")
            )
        })
        .collect();
    let text = format!(
        "{{\"@schema\": \"x/markups-schema-v1.0.0.json#\", \"markups\": [{}]}}",
        markups.join(",")
    );
    let (_folder, path) = file("a.mrk.json", &text);
    let read = read_landmark_overrides(&path).unwrap();
    let found: Vec<String> = read.landmarks.iter().map(|(l, s, _)| l.key(s)).collect();
    assert_eq!(found, ["FH_l", "FH_r", "GSN_l"]);
    let lines = read.ignored.join("\n");
    for part in ["MOF_l", "MOF_r", "(preview)", "IOF_r", "is a Plane"] {
        assert!(lines.contains(part), "expected '{part}' in {lines}");
    }
    assert_eq!(read.ignored.len(), 5, "{lines}");
}

/// A rim of points a few mm apart on a circle.
fn ring(points: usize) -> Vec<Point> {
    (0..points)
        .map(|n| (n as f64 * std::f64::consts::TAU / points as f64).sin_cos())
        .map(|(sin, cos)| Point::new(90.0, 0.0, 0.1) + Vector::new(0.0, sin, cos) * 25.0)
        .collect()
}

#[test]
fn written_markups_come_back_and_are_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("corrected.mrk.json");
    let rims = [ring(40), ring(24)];
    write_markups(&expected(), rims.each_ref().map(Vec::as_slice), &path).unwrap();
    let read = read_landmark_overrides(&path).unwrap();
    assert_eq!(read.landmarks, expected());
    assert_eq!(read.rims, rims.clone().map(Some));
    assert_eq!(read.ignored, [""; 0]);
    let before = std::fs::read(&path).unwrap();
    let error = write_markups(
        &Landmarks::default(),
        rims.each_ref().map(Vec::as_slice),
        &path,
    )
    .unwrap_err();
    assert!(matches!(error, PointsFileError::Exists(_)), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
    // What Slicer's schema asks for.
    let json: serde_json::Value = serde_json::from_slice(&before).unwrap();
    assert!(json["@schema"].as_str().unwrap().ends_with("-v1.0.3.json#"));
    assert_eq!(json["markups"][0]["type"], "Fiducial");
}

#[test]
fn what_is_missing_is_written_without_a_position_and_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("draft.mrk.json");
    let mut some = Landmarks::default();
    for (landmark, side, point) in expected().iter() {
        if landmark.key(side) != "GSN_l" && landmark != Landmark::Iof {
            some.set(landmark, side, point);
        }
    }
    let right = ring(30);
    write_markups(&some, [&[], &right], &path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let points = json["markups"][0]["controlPoints"].as_array().unwrap();
    let undefined = points.iter().filter(|p| p["positionStatus"] == "undefined");
    let undefined: Vec<&str> = undefined
        .inspect(|p| assert_eq!(p["position"], "", "as Slicer writes it"))
        .map(|p| p["label"].as_str().unwrap())
        .collect();
    assert_eq!(
        (points.len(), undefined),
        (16, vec!["IOF_l", "IOF_r", "GSN_l"])
    );
    assert_eq!(json["markups"][1]["name"], "rim_l");
    assert_eq!(json["markups"][1]["controlPoints"], serde_json::json!([]));
    let read = read_landmark_overrides(&path).unwrap();
    assert_eq!((read.landmarks, read.rims), (some, [None, Some(right)]));
    let lines = read.ignored.join("\n");
    for part in ["IOF_l", "IOF_r", "GSN_l", "'rim_l' has no points"] {
        assert!(lines.contains(part), "expected '{part}' in {lines}");
    }
    assert_eq!(read.ignored.len(), 4, "{lines}");
}

#[test]
fn rims_come_from_numbered_points_in_their_order() {
    let mut lines: Vec<String> = ring(24)
        .iter()
        .enumerate()
        // Numbers count, not lines, nor how many digits they have; one may be missing.
        .map(|(n, p)| format!("rim_l_{},{},{},{}", 2 * n + 1, p.x, p.y, p.z))
        .collect();
    lines.reverse();
    let header = "name,x_lps_mm,y_lps_mm,z_lps_mm\n";
    let table = |lines: &[String]| format!("{header}{}\n", lines.join("\n"));
    let (_folder, path) = file("rim.csv", &table(&lines));
    let read = read_landmark_overrides(&path).unwrap();
    assert_eq!(read.rims, [Some(ring(24)), None]);

    let message = refused("rim.csv", &table(&lines[1..]));
    assert!(
        message.contains("the left rim") && message.contains("has 23 points"),
        "{message}"
    );
    let twice = format!("{}rim_l_01,1,2,3\n", table(&lines));
    let message = refused("rim.csv", &twice);
    assert!(message.contains("both mean left rim point 1"), "{message}");
    let far: String = table(&lines).replacen(",0.", ",70.", 1);
    let message = refused("rim.csv", &far);
    assert!(message.contains("jumps"), "{message}");
    let only = format!("{header}rim_l,1,2,3\n");
    let message = refused("rim.csv", &only);
    assert!(
        message.contains("no landmark and no rim") && message.contains("is rim_l_1 meant?"),
        "{message}"
    );
}

#[test]
fn one_rim_is_not_given_twice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mrk.json");
    write_markups(&expected(), [&ring(30), &ring(30)], &path).unwrap();
    let whole = std::fs::read_to_string(&path).unwrap();
    // Slicer numbers a name that it has already.
    let renamed = whole.replace("\"name\": \"rim_r\"", "\"name\": \"Left rim_1\"");
    let message = refused("b.mrk.json", &renamed);
    assert!(
        message.contains("'rim_l' and 'Left rim_1' both mean the left rim"),
        "{message}"
    );
    let points = whole.replacen("GSN_l", "rim_l_3", 1);
    let message = refused("c.mrk.json", &points);
    assert!(message.contains("'rim_l' and 'rim_l_3' both"), "{message}");
    let other = whole.replace("\"name\": \"rim_r\"", "\"name\": \"CC\"");
    let (_folder, path) = file("d.mrk.json", &other);
    let read = read_landmark_overrides(&path).unwrap();
    assert!(read.rims[1].is_none());
    assert_eq!(
        read.ignored,
        ["closed curve 'CC' is neither a landmark nor a rim"]
    );
}

/// As newer versions of Slicer save what they read from one file.
#[test]
fn landmarks_and_rims_may_come_in_a_file_each() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, rims) = (folder.path().join("all.mrk.json"), [ring(40), ring(24)]);
    write_markups(&expected(), rims.each_ref().map(Vec::as_slice), &whole).unwrap();
    let all = read_landmark_overrides(&whole).unwrap();
    let mut json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&whole).unwrap()).unwrap();
    let mut joined = super::LandmarkOverrides::default();
    for name in ["landmarks", "rim_l", "rim_r"] {
        let mut one = json.clone();
        let mut markup = json["markups"].as_array_mut().unwrap().remove(0);
        markup.as_object_mut().unwrap().remove("name");
        one["markups"] = vec![markup].into();
        let path = folder.path().join(format!("{name}.mrk.json"));
        std::fs::write(&path, one.to_string()).unwrap();
        let part = read_landmark_overrides(&path).unwrap();
        joined.join(part.clone()).unwrap();
        let twice = joined.clone().join(part).unwrap_err();
        match name {
            "landmarks" => assert!(twice.contains("ASIS_l"), "{twice}"),
            "rim_l" => assert_eq!(twice, "left rim"),
            _ => assert_eq!(twice, "right rim"),
        }
    }
    assert_eq!(joined, all);
}
