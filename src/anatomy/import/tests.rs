//! One body through each importer: the same voxels and landmarks must come out.

use super::labels::{LabelTable, label_table_of_segments, read_label_table, structures_of_labels};
use super::totalseg::{TotalsegVersion, read_totalseg};
use super::*;
use crate::anatomy::detect::Given;
use crate::anatomy::phantom::{PhantomParameters, phantom_structures};
use crate::anatomy::{Landmark, Side, Specimen, Structure, StructureLabels, specimen_problems};
use crate::geometry::Vector;
use crate::volume::{Grid, Volume, dice, read_volume, write_nifti};
use std::path::Path;
use std::sync::LazyLock;

const VOXEL_MM: f64 = 2.0;

/// A coarse body, and the segmentation of its CT without its loose voxels.
static BODY: LazyLock<(Specimen, StructureLabels)> = LazyLock::new(|| {
    let parameters = PhantomParameters {
        voxel_mm: VOXEL_MM,
        ..Default::default()
    };
    let (mut specimen, structures) = phantom_structures(3, &parameters);
    let structures = clean::clean(&structures).0;
    specimen.labels = structures.labels();
    (specimen, structures)
});

/// The body by its own voxels, without a file between.
static DIRECT: LazyLock<Specimen> = LazyLock::new(|| {
    let (body, structures) = &*BODY;
    made(body.ct.clone(), structures.clone(), vec![]).specimen
});

fn parameters() -> CtImportParameters {
    CtImportParameters {
        voxel_mm: VOXEL_MM,
        ..Default::default()
    }
}

fn import(ct: Volume<i16>, structures: StructureLabels, notes: Vec<Note>) -> CtImport {
    CtImport {
        ct,
        structures,
        given: Given::default(),
        origin: CtOrigin {
            kind: "labels",
            name: "body".into(),
            sex: "female".into(),
            licence: "none".into(),
            from: "a test".into(),
        },
        notes,
    }
}

fn made(ct: Volume<i16>, structures: StructureLabels, notes: Vec<Note>) -> Imported {
    specimen_from_ct(import(ct, structures, notes), &parameters()).unwrap()
}

fn assert_same(found: &Specimen, expected: &Specimen) {
    assert_eq!(found.ct.grid, expected.ct.grid);
    assert!(found.ct.data == expected.ct.data, "CT values");
    assert_eq!(found.labels.grid, expected.labels.grid);
    assert!(found.labels.data == expected.labels.data, "labels");
    assert_eq!(found.landmarks, expected.landmarks);
    assert_eq!(found.rims, expected.rims);
}

#[test]
fn what_is_on_the_grid_passes_bit_for_bit() {
    let body = &BODY.0;
    assert_eq!(
        DIRECT.ct.grid, body.ct.grid,
        "nothing is cropped from a specimen"
    );
    assert!(DIRECT.ct.data == body.ct.data);
    assert!(DIRECT.labels.data == body.labels.data);
    assert_eq!(specimen_problems(&DIRECT), vec![]);
    assert!(!DIRECT.source.assigned_density);
    // Given points replace those found by rule; the others stay.
    let mut import = import(body.ct.clone(), BODY.1.clone(), vec![]);
    let left = Landmark::Asis;
    let point = body.landmarks.get(left, Side::Left).unwrap();
    import.given.landmarks.set(left, Side::Left, point);
    import.given.rims[1] = Some(body.rims[1].to_vec());
    let with = specimen_from_ct(import, &parameters()).unwrap();
    assert_eq!(with.specimen.landmarks.get(left, Side::Left), Some(point));
    assert_eq!(
        with.specimen.rims,
        [DIRECT.rims[0].clone(), body.rims[1].clone()]
    );
    let mut others = with.specimen.landmarks.clone();
    others.set_with(
        left,
        Side::Left,
        DIRECT.landmarks.get(left, Side::Left).unwrap(),
        DIRECT.landmarks.provenance(left, Side::Left).unwrap(),
    );
    assert_eq!(others, DIRECT.landmarks);
    let note = Note::Overridden("ASIS_l, right rim".into());
    assert!(with.notes.contains(&note), "{:?}", with.notes);
}

/// The body's own landmarks and rims, all of them, carry a segmentation on which nothing is found.
#[test]
fn without_detection_everything_must_be_given() {
    let (body, structures) = &*BODY;
    let mut flat = structures.volume().clone();
    // The heads are cut off: no sphere.
    let head = body.landmarks.get(Landmark::Fh, Side::Left).unwrap();
    for (offset, value) in flat.data.iter_mut().enumerate() {
        let p = structures
            .volume()
            .grid
            .center(structures.volume().grid.voxel(offset));
        if *value >= 4 && p.z > head.z - 30.0 {
            *value = 0;
        }
    }
    let mut import = import(body.ct.clone(), StructureLabels::new(flat), vec![]);
    let message = specimen_from_ct(import.clone(), &parameters())
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("cannot find the landmarks") && message.contains("left"),
        "{message}"
    );
    assert!(
        message.contains("ASIS_l") && message.contains("right rim"),
        "{message}"
    );
    import.given.landmarks = body.landmarks.clone();
    import.given.rims = body.rims.clone().map(|rim| Some(rim.to_vec()));
    let with = specimen_from_ct(import, &parameters()).unwrap();
    assert_eq!(with.specimen.landmarks, body.landmarks);
    assert_eq!(with.specimen.rims, body.rims);
    assert!(
        with.notes
            .iter()
            .any(|n| matches!(n, Note::NotDetected { .. }))
    );
}

#[test]
fn totalsegmentator_files_give_the_same() {
    let (body, structures) = &*BODY;
    let folder = tempfile::tempdir().unwrap();
    let map = structures.volume();
    write_nifti(&body.ct, &folder.path().join("ct.nii.gz")).unwrap();
    let masks = folder.path().join("masks");
    std::fs::create_dir(&masks).unwrap();
    let message = read_totalseg(&masks, None).unwrap_err().to_string();
    assert!(
        message.contains("lacks sacrum.nii.gz, hip_left.nii.gz"),
        "{message}"
    );
    for structure in Structure::ALL {
        let value = structure.value();
        let path = masks.join(format!("{}.nii.gz", structure.name()));
        write_nifti(&map.map(|v| u8::from(v == value)), &path).unwrap();
    }
    let ct = read_volume::<i16>(&folder.path().join("ct.nii.gz")).unwrap();
    let (read, notes) = read_totalseg(&masks, None).unwrap();
    assert_eq!(notes, vec![]);
    assert_same(&made(ct.clone(), read, notes).specimen, &DIRECT);

    // A hip's mask that also has the sacrum: the sacrum keeps its voxels.
    let both = map.map(|v| u8::from(v == 1 || v == 2));
    write_nifti(&both, &masks.join("hip_left.nii.gz")).unwrap();
    let (read, notes) = read_totalseg(&masks, None).unwrap();
    assert_eq!(&read, structures);
    let overlap = Note::Overlap {
        first: Structure::Sacrum,
        second: Structure::Hip(Side::Left),
        voxels: structures.count(Structure::Sacrum),
    };
    assert_eq!(notes, [overlap]);

    // All in one file, by both class maps, with a class beside that tells version 2.
    for version in TotalsegVersion::ALL {
        let path = folder.path().join(format!("v{}.nii.gz", version.number()));
        let mut values = [0u8; 6];
        for structure in Structure::ALL {
            values[usize::from(structure.value())] = version.value(structure);
        }
        write_nifti(&map.map(|v| values[usize::from(v)]), &path).unwrap();
        for given in [None, Some(version)] {
            let (read, notes) = read_totalseg(&path, given).unwrap();
            assert_eq!(&read, structures);
            assert_eq!(notes.len(), 1);
        }
        let other = TotalsegVersion::ALL[usize::from(version == TotalsegVersion::V1)];
        let message = read_totalseg(&path, Some(other)).unwrap_err().to_string();
        assert!(message.contains("has no voxel of sacrum"), "{message}");
    }
    // Values of both maps: only people know.
    let mut mixed = map.map(|v| [0u8, 92, 90, 91, 88, 89][usize::from(v)]);
    for (n, v) in [25, 75, 76, 77, 78].into_iter().enumerate() {
        mixed.data[n] = v;
    }
    let path = folder.path().join("mixed.nii.gz");
    write_nifti(&mixed, &path).unwrap();
    let message = read_totalseg(&path, None).unwrap_err().to_string();
    assert!(message.contains("fit class maps 1 and 2"), "{message}");
    assert!(read_totalseg(&path, Some(TotalsegVersion::V1)).is_ok());
}

#[test]
fn label_maps_with_tables_give_the_same() {
    let (body, structures) = &*BODY;
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("table.csv");
    std::fs::write(
        &table,
        "value,structure\n1,sacrum\n12,sacrum\n2,hip_left\n3,hip_right\n9,femora\n",
    )
    .unwrap();
    let table = read_label_table(&table).unwrap();
    // The sacrum in two values, both femora in one, and something else.
    let grid = &structures.volume().grid;
    let mut map = structures.volume().map(|v| if v >= 4 { 9 } else { v });
    for (offset, v) in map.data.iter_mut().enumerate() {
        if *v == 1 && grid.voxel(offset)[2] % 2 == 0 {
            *v = 12;
        }
    }
    map.data[5] = 77;
    let path = folder.path().join("map.nii.gz");
    write_nifti(&map, &path).unwrap();
    let (read, notes) = structures_of_labels(&read_volume(&path).unwrap(), &table).unwrap();
    assert_eq!((&read, notes.len()), (structures, 0));
    assert_same(&made(body.ct.clone(), read, notes).specimen, &DIRECT);
}

/// An uncompressed NRRD file, written here by hand. `keys` are further lines of its header.
fn nrrd(grid: &Grid, kind: &str, keys: &str, voxels: &[u8]) -> Vec<u8> {
    let Grid { dims, origin, .. } = grid;
    let header = format!(
        "NRRD0004\ntype: {kind}\ndimension: 3\nspace: right-anterior-superior\n\
         sizes: {} {} {}\nspace directions: (-{VOXEL_MM},0,0) (0,-{VOXEL_MM},0) (0,0,{VOXEL_MM})\n\
         kinds: domain domain domain\nencoding: raw\nspace origin: ({},{},{})\n{keys}\n",
        dims[0], dims[1], dims[2], -origin.x, -origin.y, origin.z
    );
    [header.as_bytes(), voxels].concat()
}

/// As Slicer saves it, but uncropped.
fn seg_nrrd(structures: &StructureLabels) -> Vec<u8> {
    let mut keys = String::new();
    for (n, name) in ["Sacrum", "Hip_L", "Hip_R", "Femur_L", "Femur_R"]
        .iter()
        .enumerate()
    {
        keys += &format!(
            "Segment{n}_Name:={name}\nSegment{n}_LabelValue:={}\n",
            n + 1
        );
    }
    let map = structures.volume();
    nrrd(&map.grid, "unsigned char", &keys, &map.data)
}

#[test]
fn a_segmentation_by_slicer_is_its_own_table() {
    let (_, structures) = &*BODY;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.seg.nrrd");
    let bytes = seg_nrrd(structures);
    std::fs::write(&path, &bytes).unwrap();
    let table = label_table_of_segments(&path).unwrap();
    let (read, notes) = structures_of_labels(&read_volume(&path).unwrap(), &table).unwrap();
    assert_eq!((&read, notes), (structures, vec![]));

    let says = |from: &str, to: &str, parts: &[&str]| {
        let end = bytes.windows(2).position(|w| w == b"\n\n").unwrap();
        let header = std::str::from_utf8(&bytes[..end]).unwrap();
        assert!(header.contains(from), "{header}");
        std::fs::write(&path, header.replace(from, to) + "\n\n").unwrap();
        let message = label_table_of_segments(&path).unwrap_err().to_string();
        for part in ["map.seg.nrrd"].iter().chain(parts) {
            assert!(message.contains(part), "expected '{part}' in: {message}");
        }
    };
    let names = "segments (Sacrum, Os, Hip_R, Femur_L, Femur_R) no value is hip_left";
    says("Hip_L", "Os", &[names, "or give a table"]);
    let unnamed = ["does not name its values", "give a table"];
    says("Segment", "Part", &unnamed);
    says("NRRD0004", "other", &unnamed);
    says("LabelValue:=2", "LabelValue:=1", &["have the label 1"]);
}

#[test]
fn a_subject_of_vsd_gives_the_same() {
    let (body, structures) = &*BODY;
    let hu: Vec<u8> = body.ct.data.iter().flat_map(|v| v.to_le_bytes()).collect();
    let cts = [
        (
            "a.nrrd",
            nrrd(&body.ct.grid, "short", "endian: little\n", &hu),
        ),
        ("a.nii.gz", vec![]),
    ];
    for (name, ct) in cts {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        match ct.as_slice() {
            [] => write_nifti(&body.ct, &file(name)).unwrap(),
            bytes => std::fs::write(file(name), bytes).unwrap(),
        }
        std::fs::write(file("a_Reconstruction.seg.nrrd"), seg_nrrd(structures)).unwrap();
        let read = vsd::read_vsd(&vsd::find_vsd(folder.path()).unwrap()).unwrap();
        assert_eq!(&read.structures, structures);
        let made = made(read.ct, read.structures, read.notes);
        assert_same(&made.specimen, &DIRECT);
    }
}

#[test]
fn a_deepfluoro_file_gives_the_same_with_its_own_landmarks() {
    use hdf5_pure::FileBuilder;
    let (body, structures) = &*BODY;
    let grid = &body.ct.grid;
    let mut builder = FileBuilder::new();
    let mut specimen = builder.create_group("17-1882");
    let shape = [
        grid.dims[2] as u64,
        grid.dims[1] as u64,
        grid.dims[0] as u64,
    ];
    let place = |group: &mut hdf5_pure::GroupBuilder| {
        group
            .create_dataset("spacing")
            .with_f64_data(&grid.spacing)
            .with_shape(&[3, 1]);
        let origin: [f64; 3] = grid.origin.coords.into();
        group
            .create_dataset("origin")
            .with_f64_data(&origin)
            .with_shape(&[3, 1]);
        let unit = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        group
            .create_dataset("dir-mat")
            .with_f64_data(&unit)
            .with_shape(&[3, 3]);
    };
    let mut vol = specimen.create_group("vol");
    vol.create_dataset("pixels")
        .with_i16_data(&body.ct.data)
        .with_shape(&shape);
    place(&mut vol);
    specimen.add_group(vol.finish());
    let mut seg = specimen.create_group("vol-seg");
    let mut image = seg.create_group("image");
    let map = structures
        .volume()
        .map(|v| [0u8, 4, 1, 2, 5, 6][usize::from(v)]);
    image
        .create_dataset("pixels")
        .with_u8_data(&map.data)
        .with_shape(&shape);
    place(&mut image);
    seg.add_group(image.finish());
    specimen.add_group(seg.finish());
    let mut points = specimen.create_group("vol-landmarks");
    for (landmark, side, p) in body.landmarks.iter() {
        if landmark != Landmark::Aiis {
            let name = landmark.key(side).replace('_', "-");
            let p: [f64; 3] = p.coords.into();
            points
                .create_dataset(&name)
                .with_f64_data(&p)
                .with_shape(&[3, 1]);
        }
    }
    specimen.add_group(points.finish());
    builder.add_group(specimen.finish());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("data.h5");
    builder.write(&path).unwrap();

    let read = deepfluoro::read_deepfluoro(&path, None).unwrap();
    assert_eq!(&read.structures, structures);
    let mut import = import(read.ct, read.structures, read.notes);
    import.given.landmarks = read.landmarks;
    let found = specimen_from_ct(import, &parameters()).unwrap().specimen;
    let mut expected = DIRECT.clone();
    for (landmark, side, p) in body.landmarks.iter() {
        if landmark != Landmark::Aiis {
            expected.landmarks.set(landmark, side, p);
        }
    }
    assert_same(&found, &expected);
}

/// The specimen's own bones as closed surfaces, through the other importer.
#[test]
fn through_surfaces_labels_and_landmarks_stay() {
    use crate::anatomy::surfaces::structures_from_surfaces;
    let structures = &BODY.1;
    let surfaces = structures.surfaces(&parameters().surface);
    let found = crate::anatomy::detect::detect(&surfaces).unwrap();
    for (landmark, side, point) in DIRECT.landmarks.iter() {
        let apart = (point - found.landmarks.get(landmark, side).unwrap()).norm();
        assert!(apart < 0.5, "{landmark:?} {side}: {apart} mm");
    }
    let back = structures_from_surfaces(&surfaces, &DIRECT.labels.grid).labels();
    for label in 1..=3 {
        let dice = dice(&back, &DIRECT.labels, label);
        println!("label {label}: Dice {dice:.4}");
        assert!(dice > 0.97, "label {label}: {dice}");
    }
}

#[test]
fn joined_bones_are_told_apart_or_refused() {
    let structures = &BODY.1;
    let table = |rows: &[(u8, LabelMeaning)]| LabelTable::new(rows.iter().copied()).unwrap();
    let [sacrum, femora] = [LabelMeaning::One(Structure::Sacrum), LabelMeaning::Femora];
    // At 2 mm the joints of hips and sacrum are closed in places.
    let hips = structures
        .volume()
        .map(|v| [0, 3, 1, 1, 2, 2][usize::from(v)]);
    let of_hips = table(&[(1, LabelMeaning::Hips), (2, femora), (3, sacrum)]);
    let (read, _) = structures_of_labels(&hips, &of_hips).unwrap();
    for structure in Structure::ALL {
        let value = structure.value();
        let dice = dice(read.volume(), structures.volume(), value);
        assert!(dice > 0.999, "{structure}: {dice}");
    }
    // Without its joint's voxels the sacrum is a piece for itself; as it is, the coarse one is joined.
    let pelvis = |apart: bool| {
        let mut map = structures
            .volume()
            .map(|v| [0, 1, 1, 1, 2, 2][usize::from(v)]);
        if apart {
            let sacrum = structures.volume().map(|v| v == 1);
            let near = crate::volume::morphology::dilate(&sacrum, 2.5);
            for ((v, s), near) in map
                .data
                .iter_mut()
                .zip(&structures.volume().data)
                .zip(near.data)
            {
                *v = if near && *s > 1 { 0 } else { *v };
            }
        }
        let table = table(&[(1, LabelMeaning::Pelvis), (2, femora)]);
        structures_of_labels(&map, &table)
    };
    let (read, _) = pelvis(true).unwrap();
    let sacrum = Structure::Sacrum.value();
    assert!(dice(read.volume(), structures.volume(), sacrum) > 0.99);
    let message = pelvis(false).unwrap_err().to_string();
    assert!(message.contains("the sacrum is joined"), "{message}");

    // One femur alone is no pair, and neither is half a pelvis.
    let one = hips.map(|v| if v == 2 { 0 } else { v });
    let mut lone = one.clone();
    for (v, s) in lone.data.iter_mut().zip(&structures.volume().data) {
        if *s == 4 {
            *v = 2;
        }
    }
    let message = structures_of_labels(&lone, &of_hips)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("femora: expected two separate pieces"),
        "{message}"
    );
    let mut half = hips.clone();
    for (v, s) in half.data.iter_mut().zip(&structures.volume().data) {
        if *s == 3 {
            *v = 0;
        }
    }
    let message = structures_of_labels(&half, &of_hips)
        .unwrap_err()
        .to_string();
    assert!(message.contains("hips: one piece"), "{message}");
}

#[test]
fn swapped_sides_and_missing_bones_are_named() {
    let (body, structures) = &*BODY;
    let refusal = |values: [u8; 6]| {
        let map = structures.volume().map(|v| values[usize::from(v)]);
        let import = import(body.ct.clone(), StructureLabels::new(map), vec![]);
        specimen_from_ct(import, &parameters())
            .unwrap_err()
            .to_string()
    };
    let message = refusal([0, 1, 3, 2, 5, 4]);
    assert!(
        message.contains("left hip bone lies") && message.contains("swapped"),
        "{message}"
    );
    let message = refusal([0, 1, 2, 3, 5, 4]);
    assert!(message.contains("left femur lies"), "{message}");
    let message = refusal([0, 1, 2, 0, 4, 5]);
    assert!(
        message.contains("no voxel of the right hip bone"),
        "{message}"
    );
}

/// A CT and labels on grids of their own, oblique and anisotropic: the body stays where it is.
#[test]
fn other_grids_are_resampled_in_place() {
    let (body, structures) = &*BODY;
    let own = &body.ct.grid;
    let tilt = nalgebra::Rotation3::from_euler_angles(0.05, -0.03, 0.04);
    let grid = |spacing: [f64; 3]| {
        let extent: [f64; 3] = std::array::from_fn(|a| own.dims[a] as f64 * own.spacing[a] + 20.0);
        let dims = std::array::from_fn(|a| (extent[a] / spacing[a]) as usize);
        let size = Vector::from_fn(|a, _| (dims[a] as f64 - 1.0) * spacing[a]);
        let middle = own.center(own.dims.map(|n| n / 2));
        let direction = *tilt.matrix();
        Grid {
            dims,
            spacing,
            direction,
            origin: middle - direction * (size / 2.0),
        }
    };
    let ct = crate::volume::resample::resample_intensities(&body.ct, &grid([1.6, 1.6, 3.0]));
    let labels =
        crate::volume::resample::resample_labels(structures.volume(), &grid([1.3, 1.3, 2.0]));
    let found = made(ct, StructureLabels::new(labels), vec![]);
    let specimen = &found.specimen;
    assert_eq!(specimen_problems(specimen), vec![]);
    assert_eq!(specimen.ct.grid.spacing, [VOXEL_MM; 3]);
    assert!(found.notes.contains(&Note::LabelsResampled));
    // On the body's own grid again, to compare.
    let back = crate::volume::resample::resample_labels(&specimen.labels, own);
    for label in 1..=3 {
        let dice = dice(&back, &body.labels, label);
        assert!(dice > 0.93, "label {label}: {dice}");
    }
    for (landmark, side, point) in specimen.landmarks.iter() {
        let apart = (point - DIRECT.landmarks.get(landmark, side).unwrap()).norm();
        if landmark == Landmark::Fh {
            assert!(apart < 0.3, "{landmark:?} {side}: {apart} mm");
        }
        assert!(apart < 8.0, "{landmark:?} {side}: {apart} mm");
    }
}

#[test]
fn a_tall_ct_is_cropped_to_what_a_study_needs() {
    let (body, structures) = &*BODY;
    let grid = body.ct.grid.clone();
    let more = [40, 30];
    let tall = Grid {
        dims: [grid.dims[0], grid.dims[1], grid.dims[2] + more[0] + more[1]],
        origin: grid.point(0.0, 0.0, -(more[0] as f64)),
        ..grid.clone()
    };
    let slice = grid.dims[0] * grid.dims[1];
    let mut ct = Volume::filled(tall.clone(), -1000i16);
    ct.data[more[0] * slice..][..body.ct.data.len()].copy_from_slice(&body.ct.data);
    // The femora go on to the end of the CT.
    let mut map = Volume::filled(tall.clone(), 0u8);
    map.data[more[0] * slice..][..body.ct.data.len()].copy_from_slice(&structures.volume().data);
    for k in (0..more[0]).rev() {
        for n in 0..slice {
            map.data[k * slice + n] = map.data[(k + 1) * slice + n];
        }
    }
    let found = made(ct, StructureLabels::new(map), vec![]).specimen;
    let z = |k: usize| found.ct.grid.center([0, 0, k]).z;
    let lower = Side::BOTH.map(|s| found.landmarks.get(Landmark::Fh, s).unwrap().z);
    let below = lower[0].min(lower[1]) - z(0);
    assert!((150.0..=155.0).contains(&below), "{below}");
    assert!(found.ct.grid.dims[2] < tall.dims[2] - 50);
    assert_eq!(found.ct.grid.dims[..2], tall.dims[..2]);
    assert_eq!(specimen_problems(&found), vec![]);
}

/// The landmarks' names of a missing file or folder are the file's.
#[test]
fn files_that_are_not_there_are_named() {
    let nowhere = Path::new("no/such.nii.gz");
    assert!(
        read_totalseg(nowhere, None)
            .unwrap_err()
            .to_string()
            .contains("no/such")
    );
    assert!(
        read_label_table(nowhere)
            .unwrap_err()
            .to_string()
            .contains("no/such")
    );
}
