//! How well two segmentations agree.

use super::Volume;

/// Dice's coefficient of one label of two maps on the same grid: 2 |A and B| / (|A| + |B|), 0 to 1; NaN when
/// neither map has the label.
///
/// # Panics
/// When the maps differ in their numbers of voxels.
pub fn dice<T: PartialEq>(a: &Volume<T>, b: &Volume<T>, label: T) -> f64 {
    assert_eq!(a.grid.dims, b.grid.dims, "maps on the same grid");
    let (mut both, mut each) = (0usize, 0usize);
    for (x, y) in a.data.iter().zip(&b.data) {
        let here = [*x == label, *y == label];
        both += usize::from(here == [true; 2]);
        each += here.map(usize::from).iter().sum::<usize>();
    }
    2.0 * both as f64 / each as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::volume::Grid;

    #[test]
    fn dice_counts_what_is_common() {
        let grid = Grid::axis_aligned([2, 2, 2], 1.0, Point::origin());
        let a = Volume::new(grid.clone(), vec![0u8, 1, 1, 1, 2, 2, 0, 0]);
        let b = Volume::new(grid, vec![0u8, 1, 1, 0, 1, 1, 1, 0]);
        assert_eq!(dice(&a, &b, 1), 0.5);
        assert_eq!(dice(&a, &a, 2), 1.0);
        assert_eq!(dice(&a, &b, 2), 0.0);
    }
}
