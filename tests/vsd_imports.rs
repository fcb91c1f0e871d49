//! Six people through every importer: the same specimen must come out. Too slow for every day:
//!
//! ```sh
//! PAO_SIM_PYTHON=python cargo test --release --test vsd_imports -- --ignored --nocapture
//! ```
//!
//! The files of DeepFluoro and VSD are written by `scripts/write_deepfluoro.py` and
//! `scripts/write_vsd.py` with that Python (h5py, pynrrd, nibabel).

mod data;

use data::SUBJECTS;
use pao_sim::anatomy::detect::{Given, detect};
use pao_sim::anatomy::import::deepfluoro::read_deepfluoro;
use pao_sim::anatomy::import::labels::{read_label_table, structures_of_labels};
use pao_sim::anatomy::import::totalseg::read_totalseg;
use pao_sim::anatomy::import::vsd::{find_vsd, read_vsd};
use pao_sim::anatomy::import::{
    CtImport, CtImportParameters, CtOrigin, Imported, specimen_from_ct,
};
use pao_sim::anatomy::surfaces::{
    SurfacesOrigin, SurfacesParameters, read_bone_surfaces, specimen_from_surfaces,
    structures_from_surfaces,
};
use pao_sim::anatomy::{
    Landmark, Landmarks, PhantomParameters, Side, Specimen, Structure, StructureLabels,
    phantom_structures, write_specimen,
};
use pao_sim::geometry::Point;
use pao_sim::volume::resample::resample_labels;
use pao_sim::volume::{Grid, Volume, dice, read_volume, write_nifti};
use std::path::Path;
use std::process::Command;

fn imported(ct: Volume<i16>, structures: StructureLabels, landmarks: Landmarks) -> Imported {
    let import = CtImport {
        ct,
        structures,
        given: Given {
            landmarks,
            rims: [None, None],
        },
        origin: CtOrigin {
            kind: "labels",
            name: "body".into(),
            sex: "unknown".into(),
            licence: "none".into(),
            from: "a test".into(),
        },
        notes: vec![],
    };
    specimen_from_ct(import, &CtImportParameters::default()).unwrap()
}

fn farthest(a: &Landmarks, b: &Landmarks) -> f64 {
    a.iter()
        .filter_map(|(landmark, side, p)| Some((b.get(landmark, side)? - p).norm()))
        .fold(0.0, f64::max)
}

fn python(script: &str, arguments: &[&Path]) {
    let python = std::env::var("PAO_SIM_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scripts")
        .join(script);
    let status = Command::new(python).arg(script).args(arguments).status();
    assert!(
        status.is_ok_and(|s| s.success()),
        "PAO_SIM_PYTHON has no h5py, pynrrd or nibabel"
    );
}

fn assert_same(found: &Specimen, expected: &Specimen) {
    assert_eq!(found.ct.grid, expected.ct.grid);
    assert!(found.ct.data == expected.ct.data);
    assert!(found.labels == expected.labels);
}

#[test]
#[ignore = "minutes, and Python packages"]
fn every_importer_gives_the_same_specimen() {
    let Some(data) = data::vsd() else { return };
    println!(
        "subject: voxels; Dice of pelvis, femora through surfaces; landmarks (mm) through surfaces; dropped"
    );
    for subject in SUBJECTS {
        let surfaces = read_bone_surfaces(&data.join(subject)).unwrap();
        let origin = SurfacesOrigin::of_folder(&data.join(subject), subject).unwrap();
        let body =
            specimen_from_surfaces(&surfaces, &origin, &SurfacesParameters::default()).unwrap();
        let bones = structures_from_surfaces(&surfaces, &body.ct.grid);
        let direct = imported(body.ct.clone(), bones.clone(), Landmarks::default());
        let notes: Vec<String> = direct.notes.iter().map(ToString::to_string).collect();
        let direct = direct.specimen;
        assert_eq!(direct.ct, body.ct, "{subject}");

        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        write_specimen(&body, &at("body")).unwrap();
        write_nifti(bones.volume(), &at("bones.nii.gz")).unwrap();
        let ct = read_volume::<i16>(&at("body").join("ct.nii.gz")).unwrap();

        let rows =
            "value,structure\n1,sacrum\n2,hip_left\n3,hip_right\n4,femur_left\n5,femur_right\n";
        std::fs::write(at("table.csv"), rows).unwrap();
        let map = read_volume(&at("bones.nii.gz")).unwrap();
        let (read, _) =
            structures_of_labels(&map, &read_label_table(&at("table.csv")).unwrap()).unwrap();
        // A header's floats have 32 bits: the grid that was written is not the one that is read.
        let written = imported(ct.clone(), read.clone(), Landmarks::default()).specimen;
        assert!(written.ct.data == direct.ct.data && written.labels.data == direct.labels.data);
        assert!(
            farthest(&written.landmarks, &direct.landmarks) < 1e-3,
            "{subject}"
        );

        std::fs::create_dir(at("masks")).unwrap();
        for structure in Structure::ALL {
            let value = structure.value();
            let path = at("masks").join(format!("{}.nii.gz", structure.name()));
            write_nifti(&map.map(|v: u8| u8::from(v == value)), &path).unwrap();
        }
        let (masks, notes_of_masks) = read_totalseg(&at("masks"), None).unwrap();
        assert_eq!((&masks, notes_of_masks.len()), (&read, 0), "{subject}");

        python(
            "write_vsd.py",
            &[&at("vsd"), &at("body"), &at("bones.nii.gz"), Path::new("x")],
        );
        let files = find_vsd(&at("vsd")).unwrap();
        assert!(files.ct.ends_with("SMIR.x.Pelvis-Thighs.nrrd"));
        let vsd = read_vsd(&files).unwrap();
        assert!(
            vsd.structures.volume().data == read.volume().data,
            "{subject}"
        );
        assert!(vsd.ct.data == ct.data, "{subject}");
        let from_vsd = imported(vsd.ct, vsd.structures, Landmarks::default()).specimen;
        assert!(from_vsd.ct.data == written.ct.data && from_vsd.labels.data == written.labels.data);

        python(
            "write_deepfluoro.py",
            &[
                &at("d.h5"),
                &at("body"),
                &at("bones.nii.gz"),
                Path::new("17-1882"),
            ],
        );
        let h5 = read_deepfluoro(&at("d.h5"), None).unwrap();
        assert!(h5.ct.data == ct.data && h5.structures.volume().data == read.volume().data);
        let from_h5 = imported(h5.ct, h5.structures, h5.landmarks).specimen;
        assert_same(&from_h5, &written);
        assert!(
            farthest(&from_h5.landmarks, &body.landmarks) < 1e-9,
            "all are in the file"
        );
        assert_eq!(from_h5.rims, written.rims);

        // As closed surfaces, and voxels of them again.
        let closed = bones.surfaces(&Default::default());
        let back = structures_from_surfaces(&closed, &body.ct.grid).labels();
        let dices = [1, 2, 3].map(|label| dice(&back, &direct.labels, label));
        let apart = farthest(&detect(&closed).unwrap().landmarks, &direct.landmarks);
        println!(
            "{subject}: {:?}; {:.4} {:.4} {:.4}; {apart:.3}; {}",
            direct.ct.grid.dims,
            dices[0],
            dices[1],
            dices[2],
            notes.join("; ")
        );
    }
}

/// Where landmarks of a segmentation in slices of some thickness lie.
fn in_slices(
    surfaces: &dyn Fn(&Grid) -> StructureLabels,
    extent: (Point, Point),
    slice_mm: f64,
) -> Landmarks {
    let spacing = match slice_mm {
        1.0 => [1.0; 3],
        _ => [0.8, 0.8, slice_mm],
    };
    let (low, high) = extent;
    let grid = Grid {
        dims: std::array::from_fn(|a| ((high[a] - low[a]) / spacing[a]) as usize + 1),
        spacing,
        ..Grid::axis_aligned([1; 3], 1.0, low)
    };
    let structures = surfaces(&grid);
    let ct = Volume::filled(grid, 0i16);
    imported(ct, structures, Landmarks::default())
        .specimen
        .landmarks
}

fn row(name: &str, slice_mm: f64, pairs: &[(Landmarks, Landmarks)]) {
    print!("| {name} | {slice_mm} |");
    for landmark in Landmark::ALL {
        let distances: Vec<f64> = pairs
            .iter()
            .flat_map(|(a, b)| {
                Side::BOTH.map(|side| {
                    (a.get(landmark, side).unwrap() - b.get(landmark, side).unwrap()).norm()
                })
            })
            .collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        let most = distances.iter().copied().fold(0.0, f64::max);
        print!(" {mean:.1} ({most:.1}) |");
    }
    println!();
}

#[test]
#[ignore = "minutes"]
fn landmarks_are_found_in_thick_slices() {
    let Some(data) = data::vsd() else { return };
    for slice_mm in [1.0, 2.0, 3.0] {
        let mut pairs = Vec::new();
        for subject in SUBJECTS {
            let surfaces = read_bone_surfaces(&data.join(subject)).unwrap();
            let reference = detect(&surfaces).unwrap();
            let mut low = Point::from([f64::MAX; 3]);
            let mut high = Point::from([f64::MIN; 3]);
            let all = surfaces
                .hips
                .iter()
                .chain(&surfaces.femurs)
                .chain([&surfaces.sacrum]);
            for p in all.flat_map(|s| s.vertices()) {
                low = low.coords.inf(&p.coords).into();
                high = high.coords.sup(&p.coords).into();
            }
            low.z = low.z.max(reference.heads[0].unwrap().center.z - 160.0);
            let margin = pao_sim::geometry::Vector::new(10.37, 10.21, 10.43);
            let extent = (low - margin, high + margin);
            let of = |grid: &Grid| structures_from_surfaces(&surfaces, grid);
            pairs.push((in_slices(&of, extent, slice_mm), reference.landmarks));
        }
        row("six subjects", slice_mm, &pairs);
    }
    for slice_mm in [1.0, 2.0, 3.0] {
        let mut pairs = Vec::new();
        for number in 1..=3 {
            let (body, bones) = phantom_structures(number, &PhantomParameters::default());
            let own = &body.ct.grid;
            let extent = (own.origin, own.center(own.dims.map(|n| n - 1)));
            let of = |grid: &Grid| StructureLabels::new(resample_labels(bones.volume(), grid));
            pairs.push((in_slices(&of, extent, slice_mm), body.landmarks));
        }
        row("phantoms 1 to 3, from their truth", slice_mm, &pairs);
    }
}
