//! The readers beside files that trimesh, meshio and VTK wrote (`scripts/make_surface_fixtures.py`).

use super::super::error::ImportError;
use super::read_closed_surface;
use crate::anatomy::PatientFrame;
use crate::volume::Surface;
use std::path::{Path, PathBuf};

/// The corners of the files' body in RAS.
const CORNERS: [[f64; 3]; 8] = [
    [-10.5, 20.25, 100.0],
    [19.5, 20.25, 100.0],
    [-10.5, 60.25, 100.0],
    [19.5, 60.25, 100.0],
    [-10.5, 20.25, 150.0],
    [19.5, 20.25, 150.0],
    [-10.5, 60.25, 150.0],
    [25.125, 64.5, 160.75],
];

/// Its triangles, by the numbers of their corners.
const TRIANGLES: [[usize; 3]; 12] = [
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
];

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/surfaces")
}

/// Triangles by their corners' coordinates, in an order that does not depend on the file's.
fn canonical(mut triangles: Vec<[[u64; 3]; 3]>) -> Vec<[[u64; 3]; 3]> {
    for triangle in &mut triangles {
        let first = (0..3).min_by_key(|&n| triangle[n]).unwrap();
        triangle.rotate_left(first);
    }
    triangles.sort_unstable();
    triangles
}

fn triangles(surface: &Surface) -> Vec<[[u64; 3]; 3]> {
    let corner = |v: u32| {
        let p = surface.vertices()[v as usize];
        [p.x, p.y, p.z].map(f64::to_bits)
    };
    let all = surface.triangles().iter().map(|t| t.map(corner));
    canonical(all.collect())
}

fn expected() -> Vec<[[u64; 3]; 3]> {
    let lps = |n: usize| {
        let [x, y, z] = CORNERS[n];
        [-x, -y, z].map(f64::to_bits)
    };
    canonical(TRIANGLES.iter().map(|t| t.map(lps)).collect())
}

/// Reads bytes as a file of this name.
fn read(name: &str, bytes: &[u8], unstated: PatientFrame) -> Result<Surface, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_closed_surface(&path, unstated)
}

fn refused(name: &str, bytes: &[u8]) -> String {
    let message = read(name, bytes, PatientFrame::Ras)
        .unwrap_err()
        .to_string();
    assert!(message.contains(name), "{message}");
    message
}

#[test]
fn every_writers_file_gives_the_same_triangles_in_lps() {
    let mut files = 0;
    for entry in std::fs::read_dir(fixtures()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        if name == "unstructured" {
            continue;
        }
        files += 1;
        let stated = name.ends_with("_lps") || name.ends_with("_ras");
        let surface = read_closed_surface(&path, PatientFrame::Ras).unwrap();
        assert_eq!(surface.vertices().len(), 8, "{name}");
        assert_eq!(triangles(&surface), expected(), "{name}");
        // The frame that the file states wins over any other.
        let other = read_closed_surface(&path, PatientFrame::Lps).unwrap();
        assert_eq!(triangles(&other) == expected(), stated, "{name}");
    }
    assert_eq!(files, 21);
}

#[test]
fn an_unstructured_grid_is_refused_by_name() {
    let path = fixtures().join("unstructured.vtk");
    let message = read_closed_surface(&path, PatientFrame::Ras)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("unstructured.vtk") && message.contains("UNSTRUCTURED_GRID"),
        "{message}"
    );
}

#[test]
fn an_inward_surface_is_turned_inside_out_and_an_open_one_refused() {
    let text = std::fs::read_to_string(fixtures().join("trimesh.obj")).unwrap();
    let inward: String = text
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["f", a, b, c] => format!("f {a} {c} {b}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let surface = read("bone.obj", inward.as_bytes(), PatientFrame::Ras).unwrap();
    assert_eq!(triangles(&surface), expected());
    let end = text.trim_end().rfind('\n').unwrap();
    let message = refused("bone.obj", &text.as_bytes()[..end]);
    assert!(message.contains("not closed: 3 edges"), "{message}");
}

#[test]
fn announced_counts_beyond_the_file_are_refused_with_both_numbers() {
    let stl = |count: u32| {
        let mut bytes = std::fs::read(fixtures().join("trimesh_binary.stl")).unwrap();
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        bytes
    };
    let message = refused("bone.stl", &stl(4_000_000_000));
    assert!(
        message.contains("4000000000 triangles") && message.contains("has 684"),
        "{message}"
    );
    refused("bone.stl", &stl(11));
    // A binary file may begin with the word of ascii ones, whole or cut off.
    let mut solid = stl(12);
    solid[..5].copy_from_slice(b"solid");
    read("bone.stl", &solid, PatientFrame::Ras).unwrap();
    let message = refused("bone.stl", &solid[..600]);
    assert!(message.contains("has 600"), "{message}");

    let replaced = |file: &str, from: &str, to: &str| {
        let bytes = std::fs::read(fixtures().join(file)).unwrap();
        let at = bytes
            .windows(from.len())
            .position(|w| w == from.as_bytes())
            .unwrap();
        [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
    };
    for (file, from, to, reason) in [
        (
            "trimesh_binary.ply",
            "vertex 8",
            "vertex 99999999999",
            "announces 99999999999 of 'vertex'",
        ),
        (
            "trimesh_binary.ply",
            "element face 12",
            "element none 90\nelement face 12",
            "'none' has no properties",
        ),
        (
            "vtk42_binary_lps.vtk",
            "POINTS 8",
            "POINTS 6148914691236517206",
            "of POINTS",
        ),
        (
            "vtk42_ascii_lps.vtk",
            "12 48",
            "12 999999999999",
            "of POLYGONS",
        ),
        (
            "vtk51_binary_lps.vtk",
            "13 36",
            "13 9999999999999999",
            "of CONNECTIVITY",
        ),
        (
            "vtk51_ascii_lps.vtk",
            "number 1 1",
            "number 99999999999 99999999999",
            "of number",
        ),
    ] {
        let name = format!("bone.{}", file.rsplit('.').next().unwrap());
        let message = refused(&name, &replaced(file, from, to));
        assert!(
            message.contains(reason),
            "expected '{reason}' in: {message}"
        );
    }
}

#[test]
fn several_solids_or_objects_are_refused_and_groups_are_one() {
    let text = |file: &str| std::fs::read_to_string(fixtures().join(file)).unwrap();
    let solids = text("vtk_ascii_lps.stl").repeat(2);
    let message = refused("bone.stl", solids.as_bytes());
    assert!(message.contains("2 solids"), "{message}");
    let obj = text("vtk.obj");
    let cut = obj.find("f 1 2 6").unwrap();
    let two = format!("o a\n{}o b\n{}", &obj[..cut], &obj[cut..]);
    let message = refused("bone.obj", two.as_bytes());
    assert!(message.contains("2 objects (a, b)"), "{message}");
    let groups = two.replace("o a", "g a").replace("o b", "usemtl b");
    let surface = read("bone.obj", groups.as_bytes(), PatientFrame::Ras).unwrap();
    assert_eq!(triangles(&surface), expected());
}

#[test]
fn obj_faces_may_count_backwards_and_name_normals() {
    let obj = std::fs::read_to_string(fixtures().join("vtk.obj")).unwrap();
    let other: String = obj
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["f", a, b, c] => {
                let back = |v: &str| v.parse::<i64>().unwrap() - 9;
                format!("f {}/1/2 {}//3 {}/4\n", back(a), back(b), back(c))
            }
            ["v", x, y, z] => format!("v {x} {y} {z} 0.5 0.5 0.5\nvn 0 0 1\nvt 0 0\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let surface = read("bone.OBJ", other.as_bytes(), PatientFrame::Ras).unwrap();
    assert_eq!(triangles(&surface), expected());
}

#[test]
fn vtk_dataset_fields_and_metadata_are_passed_over() {
    let vtk = std::fs::read_to_string(fixtures().join("vtk42_ascii_lps.vtk")).unwrap();
    let other = vtk.replace(
        "number 1 1 int\n7 \n",
        "number 1 1 int\n7 \nMETADATA\nINFORMATION 1\nNAME L LOCATION b\nDATA 3\n\n",
    );
    let other = other
        .replace(
            "FieldData 1",
            "FieldData 2\nSPACE 1 1 string\nwith%20a%20gap",
        )
        .replace("POLYGONS", "VERTICES 1 2\n1 0\nLINES 1 3\n2 0 1\nPOLYGONS");
    assert_eq!(other.matches("METADATA").count(), 1);
    let surface = read("bone.vtk", other.as_bytes(), PatientFrame::Ras).unwrap();
    assert_eq!(triangles(&surface), expected());
}

#[test]
fn broken_files_are_refused_with_the_reason() {
    let text = |file: &str| std::fs::read_to_string(fixtures().join(file)).unwrap();
    for (file, from, to, reason) in [
        ("trimesh_ascii.ply", "ply", "plx", "not a readable PLY"),
        (
            "trimesh_ascii.ply",
            "3 0 2 3",
            "3 0 2 9",
            "names a vertex that is not there: 9",
        ),
        ("trimesh_ascii.ply", "3 0 2 3", "2 0 2", "has 2 corners"),
        ("vtk_ascii_lps.ply", "-25.125", "1e39", "vertex 7 is (inf"),
        (
            "vtk_ascii_lps.ply",
            "float z",
            "float w",
            "vertex 0 lacks x, y or z",
        ),
        ("vtk_ascii_lps.ply", "SPACE=LPS", "SPACE=LIP", "SPACE=LIP"),
        ("vtk_ascii_lps.stl", "SPACE=LPS", "SPACE=LIP", "SPACE=LIP"),
        ("vtk_ascii_lps.stl", "solid", "sol", "no ascii file"),
        ("vtk_ascii_lps.stl", "vertex 10.5", "vertex x", "triangle 0"),
        ("vtk_ascii_lps.stl", "outer", "other", "outer"),
        ("vtk_ascii_lps.stl", "endsolid", "", "facet or endsolid"),
        ("vtk.obj", "v 19.5", "v x", "line 3"),
        ("vtk.obj", "f 1 3 4", "f 1 3 0", "'0' is no corner"),
        ("vtk.obj", "f 1 3 4", "f 1 3 99", "line 10: face 0 names"),
        ("vtk.obj", "f 1 3 4", "f 1 3 \\", "goes on"),
        (
            "vtk.obj",
            "f 1 3 4",
            "f 1 -9223372036854775808 4",
            "names a vertex that is not there",
        ),
        (
            "vtk42_ascii_lps.vtk",
            "# vtk DataFile Version 4",
            "# vtk DataFile Version 6",
            "version is 6",
        ),
        ("vtk42_ascii_lps.vtk", "# vtk", "#vtk", "begin with"),
        ("vtk42_ascii_lps.vtk", "ASCII", "TEXT", "'TEXT'"),
        ("vtk42_ascii_lps.vtk", "8 float", "8 long", "type 'long'"),
        ("vtk42_ascii_lps.vtk", "10.5", "ten", "'ten'"),
        (
            "vtk42_ascii_lps.vtk",
            "3 0 2 3",
            "3 0 2 2.5",
            "not there: -1",
        ),
        (
            "vtk42_ascii_lps.vtk",
            "3 0 2 3",
            "99 0 2 3",
            "has 99 points",
        ),
        ("vtk42_ascii_lps.vtk", "12 48", "11 48", "holds 12"),
        ("vtk42_ascii_lps.vtk", "POLYGONS", "POLYGON", "'POLYGON'"),
        ("vtk42_ascii_lps.vtk", "POLYGONS", "LINES", "no triangle"),
        ("vtk51_ascii_lps.vtk", "OFFSETS", "OFFSET", "OFFSETS"),
        ("vtk51_ascii_lps.vtk", "0 3 6 9", "0 6 3 9", "do not rise"),
        ("vtk51_ascii_lps.vtk", "0 3 6 9", "3 3 6 9", "do not rise"),
    ] {
        let whole = text(file);
        assert!(whole.contains(from), "{file}: {from}");
        let name = format!("bone.{}", file.rsplit('.').next().unwrap());
        let message = refused(&name, whole.replacen(from, to, 1).as_bytes());
        assert!(
            message.contains(reason),
            "expected '{reason}' in: {message}"
        );
        assert!(!message.contains('\n') && message.len() < 500, "{message}");
    }
    // Cut anywhere before its triangles end, no file passes.
    for file in [
        "trimesh_binary.ply",
        "vtk_ascii_lps.stl",
        "vtk42_ascii_lps.vtk",
        "vtk51_ascii_lps.vtk",
        "trimesh.obj",
    ] {
        let bytes = std::fs::read(fixtures().join(file)).unwrap();
        let name = format!("bone.{}", file.rsplit('.').next().unwrap());
        let attributes = bytes.windows(10).position(|w| w == b"POINT_DATA");
        let end = attributes.unwrap_or(bytes.len()) - 10;
        for length in (0..end).step_by(7) {
            refused(&name, &bytes[..length]);
        }
    }
}
