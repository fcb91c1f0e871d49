//! A rectangle of pixels.

/// The pixels of columns `x0..x1` and rows `y0..y1`; empty when a range is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRect {
    pub x0: usize,
    pub y0: usize,
    pub x1: usize,
    pub y1: usize,
}

impl PixelRect {
    /// A rectangle without pixels.
    pub const EMPTY: Self = Self {
        x0: 0,
        y0: 0,
        x1: 0,
        y1: 0,
    };

    /// All pixels of an image.
    pub fn of_image(width: usize, height: usize) -> Self {
        Self {
            x0: 0,
            y0: 0,
            x1: width,
            y1: height,
        }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.x1.saturating_sub(self.x0)
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.y1.saturating_sub(self.y0)
    }

    /// True when there is no pixel in it.
    pub fn is_empty(&self) -> bool {
        self.width() == 0 || self.height() == 0
    }

    /// The smallest rectangle that holds both.
    pub fn union(&self, other: &Self) -> Self {
        if self.is_empty() {
            return *other;
        }
        if other.is_empty() {
            return *self;
        }
        Self {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }

    /// The pixels that lie in both.
    pub fn intersection(&self, other: &Self) -> Self {
        let both = Self {
            x0: self.x0.max(other.x0),
            y0: self.y0.max(other.y0),
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
        };
        if both.is_empty() { Self::EMPTY } else { both }
    }

    /// The rectangle with `margin` more pixels on each side, as far as they lie in `bounds`. An
    /// empty one stays empty.
    pub fn grown(&self, margin: usize, bounds: &Self) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        Self {
            x0: self.x0.saturating_sub(margin),
            y0: self.y0.saturating_sub(margin),
            x1: self.x1 + margin,
            y1: self.y1 + margin,
        }
        .intersection(bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn union_intersection_and_growth() {
        let bounds = PixelRect::of_image(20, 10);
        let a = PixelRect {
            x0: 2,
            y0: 3,
            x1: 5,
            y1: 4,
        };
        let b = PixelRect {
            x0: 4,
            y0: 0,
            x1: 9,
            y1: 2,
        };
        let union = a.union(&b);
        assert_eq!(union.intersection(&a), a);
        assert_eq!(union.intersection(&b), b);
        assert_eq!((union.width(), union.height()), (7, 4));
        assert!(a.intersection(&b).is_empty());
        assert_eq!(a.union(&PixelRect::EMPTY), a);
        assert_eq!(a.grown(100, &bounds), bounds);
        assert_eq!(a.grown(1, &bounds).width(), 5);
        assert!(PixelRect::EMPTY.grown(3, &bounds).is_empty());
    }
}
