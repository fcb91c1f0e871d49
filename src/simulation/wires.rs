//! Burns K-wires into an attenuation volume (paper, supplement on the simulation study; facts 2.15).

use crate::geometry::{Point, Vector};
use crate::surgery::KWire;
use crate::volume::{Grid, Volume};
use crate::xray::AttenuationParameters;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How finely a wire is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WireInsertionParameters {
    /// Samples along each edge of a voxel that meets a wire.
    pub supersampling: usize,
}

impl Default for WireInsertionParameters {
    fn default() -> Self {
        Self { supersampling: 4 }
    }
}

impl WireInsertionParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(1..=16).contains(&self.supersampling) {
            let message = format!("is {}; expected 1 to 16", self.supersampling);
            problems.push(("supersampling".into(), message));
        }
        problems
    }
}

/// The volume with the wires in it, one after the other. Where a wire fills the fraction phi of a
/// voxel, attenuation becomes `(1 - phi) mu + phi mu_wire`, so that the total attenuation of a wire is
/// its volume times its attenuation however it lies in the grid. (The authors' code gives every voxel
/// that a wire touches the blurred intensity of metal, which makes wires thicker; facts 2.15.)
///
/// A wire may leave the grid: the volume grows by whole voxels of no attenuation to hold it.
pub fn insert_wires(
    attenuation: Volume<f32>,
    wires: &[KWire],
    parameters: &WireInsertionParameters,
    units: &AttenuationParameters,
) -> Volume<f32> {
    let mut volume = grown(attenuation, wires);
    for wire in wires {
        insert(
            &mut volume,
            wire,
            parameters.supersampling,
            units.mu(wire.hu as f32),
        );
    }
    volume
}

/// The volume on a grid that holds every wire with a border of a voxel.
fn grown(volume: Volume<f32>, wires: &[KWire]) -> Volume<f32> {
    let old = &volume.grid;
    let mut before = [0; 3];
    let mut dims = old.dims;
    for wire in wires {
        let (min, max) = index_bounds(old, wire);
        for axis in 0..3 {
            let low = (-(min[axis].floor() - 1.0)).max(0.0) as usize;
            let high = (max[axis].ceil() + 2.0).max(0.0) as usize;
            // `dims` counts from the old first voxel until `before` is known.
            before[axis] = before[axis].max(low);
            dims[axis] = dims[axis].max(high);
        }
    }
    if before == [0; 3] && dims == old.dims {
        return volume;
    }
    let grid = Grid {
        dims: std::array::from_fn(|a| before[a] + dims[a]),
        origin: old.point(
            -(before[0] as f64),
            -(before[1] as f64),
            -(before[2] as f64),
        ),
        ..old.clone()
    };
    let mut larger = Volume::filled(grid, 0.0);
    for k in 0..old.dims[2] {
        for j in 0..old.dims[1] {
            let from = old.offset(0, j, k);
            let to = larger.grid.offset(before[0], j + before[1], k + before[2]);
            larger.data[to..to + old.dims[0]]
                .copy_from_slice(&volume.data[from..from + old.dims[0]]);
        }
    }
    larger
}

/// The continuous indices between which all of a wire lies.
fn index_bounds(grid: &Grid, wire: &KWire) -> (Vector, Vector) {
    let reach = Vector::from(grid.spacing.map(|s| wire.radius_mm / s));
    let ends = [
        grid.index(&(wire.tip_base - wire.direction * wire.body_length_mm)),
        grid.index(&(wire.tip_base + wire.direction * wire.tip_length_mm)),
    ];
    (ends[0].inf(&ends[1]) - reach, ends[0].sup(&ends[1]) + reach)
}

fn insert(volume: &mut Volume<f32>, wire: &KWire, supersampling: usize, mu_wire: f32) {
    let grid = volume.grid.clone();
    let (min, max) = index_bounds(&grid, wire);
    // The grid holds the wire, so the rounded bounds lie inside.
    let first: [usize; 3] = std::array::from_fn(|a| min[a].floor().max(0.0) as usize);
    let last: [usize; 3] = std::array::from_fn(|a| max[a].ceil() as usize);
    let places = subvoxel_places(&grid, supersampling);
    let reach = wire.radius_mm + Vector::from(grid.spacing).norm() / 2.0;
    let slice = grid.dims[0] * grid.dims[1];
    volume.data[first[2] * slice..(last[2] + 1) * slice]
        .par_chunks_mut(slice)
        .enumerate()
        .for_each(|(layer, values)| {
            for j in first[1]..=last[1] {
                for i in first[0]..=last[0] {
                    let center = grid.center([i, j, first[2] + layer]);
                    if !near(wire, &center, reach) {
                        continue;
                    }
                    let inside = places
                        .iter()
                        .filter(|&place| contains(wire, &(center + place)))
                        .count();
                    if inside > 0 {
                        let phi = inside as f32 / places.len() as f32;
                        let value = &mut values[grid.offset(i, j, 0)];
                        *value = (1.0 - phi) * *value + phi * mu_wire;
                    }
                }
            }
        });
}

/// Positions of a voxel's samples relative to its centre, in the world.
fn subvoxel_places(grid: &Grid, supersampling: usize) -> Vec<Vector> {
    let along = |axis: usize, n: usize| {
        ((n as f64 + 0.5) / supersampling as f64 - 0.5) * grid.spacing[axis]
    };
    let mut places = Vec::with_capacity(supersampling.pow(3));
    for c in 0..supersampling {
        for b in 0..supersampling {
            for a in 0..supersampling {
                let local = Vector::new(along(0, a), along(1, b), along(2, c));
                places.push(grid.direction * local);
            }
        }
    }
    places
}

/// Position along the wire, positive from the tip's base towards the tip, and distance from its axis.
fn cylindrical(wire: &KWire, point: &Point) -> (f64, f64) {
    let from_base = point - wire.tip_base;
    let along = from_base.dot(&wire.direction);
    (along, (from_base - wire.direction * along).norm())
}

fn near(wire: &KWire, point: &Point, reach: f64) -> bool {
    let (along, radius) = cylindrical(wire, point);
    radius <= reach && along >= -wire.body_length_mm - reach && along <= wire.tip_length_mm + reach
}

/// True inside the cylinder of the body or the cone of the tip.
fn contains(wire: &KWire, point: &Point) -> bool {
    let (along, radius) = cylindrical(wire, point);
    if along <= 0.0 {
        along >= -wire.body_length_mm && radius <= wire.radius_mm
    } else {
        radius <= wire.radius_mm * (1.0 - along / wire.tip_length_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn wire(tip_base: Point, direction: Vector, radius_mm: f64) -> KWire {
        KWire {
            tip_base,
            direction: direction.normalize(),
            body_length_mm: 60.0,
            tip_length_mm: 5.0,
            radius_mm,
            hu: 20_000.0,
        }
    }

    fn volume_mm3(wire: &KWire) -> f64 {
        PI * wire.radius_mm.powi(2) * (wire.body_length_mm + wire.tip_length_mm / 3.0)
    }

    fn insert_into(volume: Volume<f32>, wires: &[KWire]) -> Volume<f32> {
        insert_wires(
            volume,
            wires,
            &WireInsertionParameters::default(),
            &AttenuationParameters::default(),
        )
    }

    fn total(volume: &Volume<f32>) -> f64 {
        volume.data.iter().map(|&v| f64::from(v)).sum::<f64>()
            * volume.grid.spacing.iter().product::<f64>()
    }

    fn mu() -> f64 {
        f64::from(AttenuationParameters::default().mu(20_000.0))
    }

    #[test]
    fn attenuation_is_conserved_in_any_direction() {
        let grid = Grid {
            spacing: [0.9, 1.0, 1.3],
            direction: *nalgebra::Rotation3::from_euler_angles(0.3, 0.5, -0.2).matrix(),
            ..Grid::axis_aligned([90, 80, 70], 1.0, Point::new(5.0, 5.0, 5.0))
        };
        let center = grid.point(45.2, 40.7, 35.1);
        for (direction, radius) in [
            (Vector::new(1.0, 0.3, -0.4), 0.5),
            (Vector::new(-0.2, 0.9, 0.5), 1.0),
            (Vector::new(0.3, -0.4, -0.8), 1.5),
        ] {
            let wire = wire(center + direction.normalize() * 30.0, direction, radius);
            let result = insert_into(Volume::filled(grid.clone(), 0.0), &[wire]);
            let expected = volume_mm3(&wire) * mu();
            let ratio = total(&result) / expected;
            assert!((ratio - 1.0).abs() < 0.01, "radius {radius}: {ratio}");
        }
    }

    #[test]
    fn tissue_is_displaced_and_not_added_to() {
        let grid = Grid::axis_aligned([70, 60, 60], 1.0, Point::origin());
        let tissue = 0.02;
        let wire = wire(
            Point::new(50.0, 30.3, 29.6),
            Vector::new(1.0, 0.1, 0.2),
            1.5,
        );
        let result = insert_into(Volume::filled(grid.clone(), tissue as f32), &[wire]);
        let before = tissue * grid.len() as f64;
        let expected = before + volume_mm3(&wire) * (mu() - tissue);
        let gained = (total(&result) - before) / (expected - before);
        assert!((gained - 1.0).abs() < 0.01, "{gained}");
        let most = result.data.iter().copied().fold(0.0, f32::max);
        assert!(
            (f64::from(most) - mu()).abs() < 1e-6,
            "a full voxel is all metal"
        );
    }

    #[test]
    fn a_wire_that_leaves_the_volume_makes_it_grow() {
        let grid = Grid::axis_aligned([30, 30, 30], 1.0, Point::new(-10.0, 4.0, 100.0));
        let data = (0..grid.len()).map(|o| (o % 97) as f32 * 1e-4).collect();
        let volume = Volume::new(grid.clone(), data);
        // The body goes out through the low corner, the tip of the second through the high end of i.
        let wires = [
            wire(
                grid.point(15.0, 15.0, 15.0),
                Vector::new(1.0, 0.9, 0.8),
                1.0,
            ),
            wire(
                grid.point(31.0, 20.0, 10.0),
                Vector::new(1.0, 0.0, 0.0),
                0.7,
            ),
        ];
        let inside = total(&volume);
        let result = insert_into(volume.clone(), &wires);
        assert!((0..3).all(|a| result.grid.dims[a] >= 30));
        assert!(result.grid.dims[0] > 60);
        // Voxels keep their places in the world.
        for voxel in [[0, 0, 0], [29, 3, 28], [2, 29, 1]] {
            let there = result.grid.index(&grid.center(voxel));
            assert!((there - there.map(f64::round)).norm() < 1e-9);
        }
        let far = grid.center([2, 29, 1]);
        assert_eq!(result.nearest(&far), volume.nearest(&far));
        let metal = wires.iter().map(volume_mm3).sum::<f64>() * mu();
        let gained = (total(&result) - inside) / metal;
        // Displaced tissue and the wires' crossing are worth less than a percent here.
        assert!((gained - 1.0).abs() < 0.02, "{gained}");
    }

    #[test]
    fn a_wire_inside_leaves_the_grid_alone() {
        let grid = Grid::axis_aligned([80, 20, 20], 1.0, Point::origin());
        let wire = wire(Point::new(70.0, 10.0, 10.0), Vector::x(), 1.0);
        let result = insert_into(Volume::filled(grid.clone(), 0.0), &[wire]);
        assert_eq!(result.grid, grid);
    }
}
