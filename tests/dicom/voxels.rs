//! Where voxels lie and what they hold.

use crate::{assert_place, axes, hounsfield, read, wrong};
use pao_sim::geometry::Vector;

#[test]
fn oblique_slices_keep_their_place() {
    let turn = nalgebra::Rotation3::from_axis_angle(&Vector::z_axis(), -35_f64.to_radians())
        * nalgebra::Rotation3::from_axis_angle(&Vector::x_axis(), 20_f64.to_radians());
    let volume = read("oblique");
    let direction = std::array::from_fn(|a| turn.matrix().column(a).into_owned());
    assert_place(&volume, [5, 4, 3], direction);
    assert_eq!(wrong(&volume, hounsfield), []);
}

#[test]
fn coronal_slices_run_backwards() {
    let volume = read("coronal");
    assert_place(&volume, [5, 4, 3], [Vector::x(), -Vector::z(), Vector::y()]);
    assert_eq!(wrong(&volume, hounsfield), []);
}

#[test]
fn numbers_are_read_as_they_are_stored() {
    for name in ["signed_12", "rubbish_above", "bits_32", "padding_in_range"] {
        let volume = read(name);
        assert_place(&volume, [5, 4, 3], axes());
        assert_eq!(wrong(&volume, hounsfield), [], "{name}");
    }
    let extremes = [-32768, 32767, 0];
    let signed = wrong(&read("signed"), |[i, j, k]| match i + j {
        0 => extremes[k],
        _ => hounsfield([i, j, k]),
    });
    assert_eq!(signed, []);
    let tenths = wrong(&read("bits_8"), |[_, j, k]| (100 * k + 10 * j) as i16 - 50);
    assert_eq!(tenths, []);
}

#[test]
fn each_slice_has_its_own_rescaling() {
    // The third slice's line has steps of 2 HU.
    let expected = |[i, j, k]: [usize; 3]| {
        let hu = hounsfield([i, j, k]);
        if k == 2 { hu - hu.rem_euclid(2) } else { hu }
    };
    assert_eq!(wrong(&read("rescale"), expected), []);
}

#[test]
fn padding_below_air_becomes_air() {
    let expected = |[i, j, k]: [usize; 3]| match (i, j) {
        (0, 0..=2) => -1024,
        // Beyond the range of padding.
        (0, 3) => -1985,
        _ => hounsfield([i, j, k]),
    };
    assert_eq!(wrong(&read("padding"), expected), []);
}
