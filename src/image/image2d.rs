//! A single-channel image.

/// `height` rows of `width` pixels, row-major; pixel (x, y) is (column, row).
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T = f32> {
    pub width: usize,
    pub height: usize,
    pub data: Vec<T>,
}

impl<T: Copy> Image<T> {
    /// An image of one value.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self {
            width,
            height,
            data: vec![value; width * height],
        }
    }

    /// An image of given values.
    ///
    /// # Panics
    /// When their number is not `width * height`.
    pub fn new(width: usize, height: usize, data: Vec<T>) -> Self {
        assert_eq!(data.len(), width * height, "one value per pixel");
        Self {
            width,
            height,
            data,
        }
    }

    /// The value of column `x`, row `y`.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.data[y * self.width + x]
    }

    /// One row of pixels.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }
}
