//! Processor seconds of the parts of a case's simulation on a phantom of 1 mm voxels:
//! `cargo bench --bench simulation`. Set `RAYON_NUM_THREADS=1` for the time of one processor; more
//! threads share the work and change no result.

use pao_sim::anatomy::phantom::{PhantomParameters, phantom};
use pao_sim::anatomy::{Hip, Side};
use pao_sim::geometry::{Rigid, Vector, euler};
use pao_sim::random::{Purpose, stream};
use pao_sim::simulation::warp::moved_attenuation;
use pao_sim::simulation::{
    Case, CaseParameters, CutLines, Movement, Operation, fluoroscopy, insert_wires, pelvis_surface,
};
use pao_sim::surgery::{
    FragmentParameters, KWireModel, KWireParameters, NominalCutParameters, cut_fragment,
    nominal_cuts, place_kwires,
};
use pao_sim::xray::BodyVolume;
use std::sync::Arc;

/// Processor time of all threads of this process, which other processes on a shared machine add
/// little to.
fn processor_seconds() -> f64 {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the call writes to the structure that it is given.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    assert_eq!(status, 0, "the system has no clock of processor time");
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

fn timed<T>(name: &str, part: impl FnOnce() -> T) -> T {
    let start = processor_seconds();
    let value = part();
    println!("{name:32} {:8.3} s", processor_seconds() - start);
    value
}

fn main() {
    let voxel_mm = std::env::var("VOXEL_MM")
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(1.0);
    let parameters = PhantomParameters {
        voxel_mm,
        ..Default::default()
    };
    println!("-- once a specimen, hip or fragment");
    let specimen = timed("phantom", || Arc::new(phantom(1, &parameters)));
    println!("{:?} voxels", specimen.ct.grid.dims);
    let hip = Arc::new(Hip::new(specimen, Side::Left).expect("the phantom has all landmarks"));
    let pelvis = timed("pelvis surface", || Arc::new(pelvis_surface(&hip)));
    let map = timed("nominal cuts and fragment", || {
        let cuts = nominal_cuts(&hip, &NominalCutParameters::default()).expect("a phantom is cut");
        cut_fragment(&hip, &cuts, &FragmentParameters::default()).expect("a phantom is cut")
    });
    let operation = timed("operation", || {
        let wires = KWireParameters::default();
        Operation::new(Arc::clone(&hip), Arc::clone(&pelvis), map, &wires).expect("wires fit")
    });
    let map = operation.map();
    let model = KWireModel::new(&hip, &map.labels, &KWireParameters::default()).expect("wires fit");

    println!("-- once a case");
    let shift = Vector::new(-2.0, -2.0, 2.0);
    let movement = Movement {
        fragment: Rigid::from_parts(
            shift.into(),
            euler::from_xyz(&Vector::new(0.15, 0.05, -0.2)),
        ),
        femur: Rigid::translation(shift.x, shift.y, shift.z),
    };
    let p = CaseParameters::default();
    let key = "phantom-1/left/f00/m00";
    let case = timed("whole case", || {
        Case::simulate(&operation, &movement, &p, 1, key).expect("a case")
    });
    println!("-- its parts");
    let wires = timed("wires' places", || {
        let mut draws = stream(1, Purpose::Wires, key);
        place_kwires(&model, &movement.fragment, &movement.femur, &mut draws).expect("wires fit")
    });
    let moved = timed("warp", || {
        moved_attenuation(
            &hip,
            &map.labels,
            &movement.fragment,
            &movement.femur,
            &p.warp,
            &p.attenuation,
            &mut stream(1, Purpose::MuscleFill, key),
        )
    });
    let volume = timed("wires into the volume", || {
        insert_wires(moved.attenuation, &wires, &p.wire_insertion, &p.attenuation)
    });
    println!("{:?} voxels", volume.grid.dims);
    let body = timed("volume for the rays", || BodyVolume::new(&volume));
    for (view, pose) in case.truth.views.camera_from_volume.iter().enumerate() {
        let image = timed(&format!("view {}", view + 1), || {
            let draws = stream(1, Purpose::Noise, &format!("{key}/{view}"));
            fluoroscopy(&body, &p.camera, pose, &p.fluoroscopy, &draws)
        });
        assert_eq!(image, *case.counts()[view], "the case's own image");
    }
    timed("annotations", || {
        let lines = CutLines::new(&hip, &pelvis, map);
        for (view, pose) in case.truth.views.camera_from_volume.iter().enumerate() {
            let mut draws = stream(1, Purpose::Annotation, &format!("{key}/{view}"));
            std::hint::black_box(lines.annotate(view, &p.camera, pose, &p.annotation, &mut draws));
        }
    });
}
