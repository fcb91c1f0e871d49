//! The specimen's grid: along the world's axes, over what a study needs.

use super::error::CtImportError;
use super::note::Note;
use crate::anatomy::{Structure, StructureLabels};
use crate::geometry::{Point, Vector};
use crate::volume::resample::resample_intensities;
use crate::volume::{Grid, Volume};
use nalgebra::Matrix3;

/// Grids that place no voxel farther apart than this part of one are the same: headers round.
const SAME_VOXELS: f64 = 0.01;

/// A bone of which less lies in the CT belongs to another CT.
const LEAST_INSIDE: f64 = 0.5;

/// How a CT gets onto the specimen's lattice.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Lattice {
    /// Its voxels lie on one already, but for the order and the direction of its axes: axis `a` of
    /// the lattice is its axis `axes[a]`, read backwards where `flipped[a]`.
    Kept {
        grid: Grid,
        axes: [usize; 3],
        flipped: [bool; 3],
    },
    /// It has to be interpolated.
    New { grid: Grid },
}

impl Lattice {
    /// The lattice of a CT: axis-aligned cubic voxels over all of it.
    pub fn of(ct: &Grid, voxel_mm: f64) -> Self {
        kept(ct, voxel_mm).unwrap_or_else(|| {
            let (low, high) = centers(ct);
            let dims = std::array::from_fn(|a| {
                ((high[a] - low[a]) / voxel_mm + 1e-6).floor() as usize + 1
            });
            Self::New {
                grid: Grid::axis_aligned(dims, voxel_mm, low),
            }
        })
    }

    pub fn grid(&self) -> &Grid {
        match self {
            Self::Kept { grid, .. } | Self::New { grid } => grid,
        }
    }

    /// The CT on the lattice's voxels `min..=max`.
    pub fn ct(&self, ct: &Volume<i16>, min: [usize; 3], max: [usize; 3]) -> Volume<i16> {
        match self {
            Self::New { grid } => resample_intensities(ct, &grid.cropped(min, max)),
            Self::Kept {
                grid,
                axes,
                flipped,
            } => {
                let part = grid.cropped(min, max);
                let strides = [1, ct.grid.dims[0], ct.grid.dims[0] * ct.grid.dims[1]];
                let at = |axis: usize, n: usize| {
                    let n = n + min[axis];
                    let own = if flipped[axis] {
                        grid.dims[axis] - 1 - n
                    } else {
                        n
                    };
                    own * strides[axes[axis]]
                };
                let mut data = Vec::with_capacity(part.len());
                for k in 0..part.dims[2] {
                    for j in 0..part.dims[1] {
                        let row = at(1, j) + at(2, k);
                        data.extend((0..part.dims[0]).map(|i| ct.data[row + at(0, i)]));
                    }
                }
                Volume::new(part, data)
            }
        }
    }
}

fn kept(ct: &Grid, voxel_mm: f64) -> Option<Lattice> {
    let mut axes = [0; 3];
    let mut flipped = [false; 3];
    for (own, column) in ct.direction.column_iter().enumerate() {
        let world = column.iamax();
        axes[world] = own;
        flipped[world] = column[world] < 0.0;
    }
    let mut sorted = axes;
    sorted.sort_unstable();
    if sorted != [0, 1, 2] {
        return None;
    }
    let first: [usize; 3] = std::array::from_fn(|own| {
        let world = axes.iter().position(|&a| a == own).expect("a permutation");
        if flipped[world] { ct.dims[own] - 1 } else { 0 }
    });
    let grid = Grid {
        dims: axes.map(|own| ct.dims[own]),
        spacing: [voxel_mm; 3],
        origin: ct.center(first),
        direction: Matrix3::identity(),
    };
    // The farthest corners would show any other spacing or direction most.
    let lies = |corner: usize| {
        let on_grid: [usize; 3] = std::array::from_fn(|a| (corner >> a & 1) * (grid.dims[a] - 1));
        let mut own = [0; 3];
        for a in 0..3 {
            own[axes[a]] = if flipped[a] {
                grid.dims[a] - 1 - on_grid[a]
            } else {
                on_grid[a]
            };
        }
        (grid.center(on_grid) - ct.center(own)).norm() < SAME_VOXELS * voxel_mm
    };
    (0..8).all(lies).then_some(Lattice::Kept {
        grid,
        axes,
        flipped,
    })
}

/// True when two grids place each voxel alike.
pub(super) fn same_grid(a: &Grid, b: &Grid) -> bool {
    let voxel_mm = a.spacing.into_iter().fold(f64::MAX, f64::min);
    let alike = |corner: usize| {
        let voxel = std::array::from_fn(|axis| (corner >> axis & 1) * (a.dims[axis] - 1));
        (a.center(voxel) - b.center(voxel)).norm() < SAME_VOXELS * voxel_mm
    };
    a.dims == b.dims && (0..8).all(alike)
}

/// Lowest and highest world coordinates of a grid's voxel centres.
fn centers(grid: &Grid) -> (Point, Point) {
    let (mut low, mut high) = (Vector::repeat(f64::MAX), Vector::repeat(f64::MIN));
    for corner in 0..8 {
        let voxel = std::array::from_fn(|a| (corner >> a & 1) * (grid.dims[a] - 1));
        let p = grid.center(voxel);
        low = low.inf(&p.coords);
        high = high.sup(&p.coords);
    }
    (low.into(), high.into())
}

/// The lattice's voxels around all bones, with a margin, both ends included.
pub(super) fn around_bones(
    labels: &StructureLabels,
    lattice: &Grid,
    margin_mm: f64,
) -> ([usize; 3], [usize; 3]) {
    let own = &labels.volume().grid;
    let (min, max) = labels
        .volume()
        .bounds(|v| v != 0)
        .unwrap_or(([0; 3], own.dims.map(|n| n - 1)));
    let (low, high) = centers(&own.cropped(min, max));
    let reach = margin_mm + own.spacing.into_iter().fold(0.0, f64::max);
    let voxel = |value: f64, axis: usize| {
        let index = (value - lattice.origin[axis]) / lattice.spacing[axis];
        index.round().clamp(0.0, lattice.dims[axis] as f64 - 1.0) as usize
    };
    (
        std::array::from_fn(|a| voxel(low[a] - reach, a)),
        std::array::from_fn(|a| voxel(high[a] + reach, a)),
    )
}

/// Whether CT and labels overlap.
///
/// # Errors
/// When most of a hip bone or the sacrum lies outside the CT.
pub(super) fn check_overlap(
    ct: &Grid,
    labels: &StructureLabels,
) -> Result<Vec<Note>, CtImportError> {
    let own = &labels.volume().grid;
    if same_grid(ct, own) {
        return Ok(Vec::new());
    }
    let mut total = [0usize; 6];
    let mut inside = [0usize; 6];
    for (offset, &value) in labels.volume().data.iter().enumerate() {
        if value != 0 {
            total[usize::from(value)] += 1;
            let p = own.center(own.voxel(offset));
            inside[usize::from(value)] += usize::from(ct.nearest(&p).is_some());
        }
    }
    let mut notes = vec![Note::LabelsResampled];
    for structure in Structure::ALL {
        let n = usize::from(structure.value());
        if total[n] == 0 {
            continue;
        }
        let share = inside[n] as f64 / total[n] as f64;
        let shaft = matches!(structure, Structure::Femur(_));
        if share < LEAST_INSIDE && (!shaft || share == 0.0) {
            return Err(CtImportError::Apart {
                structure,
                percent: 100.0 * share,
                ct: span(ct),
                labels: span(own),
            });
        }
        // Whole femora are often segmented in another scan's grid; their ends are not needed.
        if share < 1.0 && !shaft {
            notes.push(Note::Outside {
                structure,
                percent: 100.0 * (1.0 - share),
            });
        }
    }
    Ok(notes)
}

/// Where a grid lies, for people.
pub(super) fn span(grid: &Grid) -> String {
    let (low, high) = centers(grid);
    let axis = |name: &str, a: usize| format!("{name} {:.0} to {:.0}", low[a], high[a]);
    format!(
        "LPS {}, {}, {} mm",
        axis("x", 0),
        axis("y", 1),
        axis("z", 2)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;

    /// Axes in another order and direction, as scanners write them.
    fn turned() -> Volume<i16> {
        let grid = Grid {
            dims: [3, 4, 5],
            spacing: [1.0; 3],
            origin: Point::new(10.0, 20.5, -30.0),
            direction: Matrix3::from_columns(&[-Vector::y(), Vector::z(), -Vector::x()]),
        };
        Volume::new(grid, (0..60).collect())
    }

    #[test]
    fn a_ct_of_the_right_voxels_is_only_reordered() {
        let ct = turned();
        let lattice = Lattice::of(&ct.grid, 1.0);
        assert!(matches!(lattice, Lattice::Kept { .. }));
        let max = lattice.grid().dims.map(|n| n - 1);
        let whole = lattice.ct(&ct, [0; 3], max);
        assert_eq!(whole.grid.direction, Matrix3::identity());
        for offset in 0..ct.data.len() {
            let p = ct.grid.center(ct.grid.voxel(offset));
            assert_eq!(whole.nearest(&p), Some(ct.data[offset]));
        }
        let part = lattice.ct(&ct, [1, 0, 2], [4, 2, 3]);
        assert_eq!(part, whole.cropped([1, 0, 2], [4, 2, 3]));
    }

    #[test]
    fn an_axis_aligned_ct_keeps_every_bit() {
        let grid = Grid::axis_aligned([3, 4, 5], 1.0, Point::new(0.1, 0.2, 0.3));
        let ct = Volume::new(grid, (0..60).collect());
        let lattice = Lattice::of(&ct.grid, 1.0);
        assert_eq!(lattice.ct(&ct, [0; 3], [2, 3, 4]), ct);
    }

    #[test]
    fn other_voxels_and_tilted_axes_are_interpolated() {
        let mut fine = turned().grid;
        fine.spacing[1] = 0.98;
        assert!(matches!(Lattice::of(&fine, 1.0), Lattice::New { .. }));
        let mut tilted = turned().grid;
        tilted.direction =
            nalgebra::Rotation3::from_euler_angles(0.0, 0.0, 0.02) * tilted.direction;
        let lattice = Lattice::of(&tilted, 1.0);
        assert!(matches!(lattice, Lattice::New { .. }));
        assert_eq!(lattice.grid().spacing, [1.0; 3]);
        // All of the CT lies in it.
        for offset in 0..60 {
            let p = tilted.center(tilted.voxel(offset));
            assert!(lattice.grid().nearest(&p).is_some());
        }
    }

    #[test]
    fn labels_elsewhere_are_refused() {
        let ct = Grid::axis_aligned([20, 20, 20], 1.0, Point::origin());
        let at = |x: f64| {
            let grid = Grid::axis_aligned([10, 10, 10], 1.0, Point::new(x, 2.0, 2.0));
            StructureLabels::new(Volume::filled(grid, Structure::Hip(Side::Left).value()))
        };
        assert_eq!(
            check_overlap(&ct, &at(4.0)).unwrap(),
            [Note::LabelsResampled]
        );
        assert_eq!(check_overlap(&ct, &at(14.0)).unwrap().len(), 2);
        let message = check_overlap(&ct, &at(16.0)).unwrap_err().to_string();
        assert!(
            message.contains("only 40 % of the left hip bone"),
            "{message}"
        );
        assert!(message.contains("x 16 to 25"), "{message}");
    }
}
