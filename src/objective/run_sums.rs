//! Sums over runs of neighbours in a row, by doubling: runs of 2, 4, 8, ... make longer ones.

use super::lanes::{Chunk, Lanes, values, values_mut};

/// Sums of runs while a row streams through registers, eight values at a time.
pub(super) trait RunSums<L: Lanes> {
    /// How many chunks later a chunk of sums comes out.
    const DELAY: usize;

    /// Before the first chunk.
    fn new() -> Self;

    /// Takes the next chunk t of values, and gives the sums of the runs that begin in chunk
    /// t - `DELAY`.
    fn push(&mut self, values: L) -> L;
}

/// Runs of 11 = 8 + 2 + 1: the paper's patches at 1/8.
#[derive(Clone, Copy)]
pub(super) struct Runs11<L> {
    /// The values one and two chunks ago; sums of two, two chunks ago; sums of four, three ago.
    ones: [L; 2],
    twos: L,
    fours: L,
}

impl<L: Lanes> RunSums<L> for Runs11<L> {
    const DELAY: usize = 3;

    #[inline(always)]
    fn new() -> Self {
        Self {
            ones: [L::zero(); 2],
            twos: L::zero(),
            fours: L::zero(),
        }
    }

    #[inline(always)]
    fn push(&mut self, values: L) -> L {
        let twos = self.ones[0].plus(self.ones[0].shifted::<1>(values));
        let fours = self.twos.plus(self.twos.shifted::<2>(twos));
        let eights = self.fours.plus(self.fours.shifted::<4>(fours));
        // Two chunks ago is the chunk after that of the eights: eight places on.
        let last = self.ones[1].shifted::<2>(self.ones[0]);
        let sums = eights.plus(self.twos).plus(last);
        self.ones = [values, self.ones[0]];
        self.twos = twos;
        self.fours = fours;
        sums
    }
}

/// Runs of 21 = 16 + 4 + 1: the paper's patches at 1/4.
#[derive(Clone, Copy)]
pub(super) struct Runs21<L> {
    /// As in [`Runs11`]; sums of eight, four chunks ago.
    ones: [L; 2],
    twos: L,
    fours: L,
    eights: L,
}

impl<L: Lanes> RunSums<L> for Runs21<L> {
    const DELAY: usize = 4;

    #[inline(always)]
    fn new() -> Self {
        Self {
            ones: [L::zero(); 2],
            twos: L::zero(),
            fours: L::zero(),
            eights: L::zero(),
        }
    }

    #[inline(always)]
    fn push(&mut self, values: L) -> L {
        let twos = self.ones[0].plus(self.ones[0].shifted::<1>(values));
        let fours = self.twos.plus(self.twos.shifted::<2>(twos));
        let eights = self.fours.plus(self.fours.shifted::<4>(fours));
        let sixteens = self.eights.plus(eights);
        // These fours and ones are two chunks after that of the sixteens: sixteen places on.
        let last = self.ones[1].shifted::<4>(self.ones[0]);
        let sums = sixteens.plus(fours).plus(last);
        self.ones = [values, self.ones[0]];
        self.twos = twos;
        self.fours = fours;
        self.eights = eights;
        sums
    }
}

/// Memory for sums of runs of any length.
#[derive(Clone, Debug)]
pub(super) struct AnyRuns {
    length: usize,
    /// Sums of runs of 1, 2, 4, ... values; the first are the values themselves.
    doubled: Vec<Vec<Chunk>>,
}

impl AnyRuns {
    /// For runs of `length` values in rows of `chunks` chunks.
    pub fn new(length: usize, chunks: usize) -> Self {
        Self {
            length,
            doubled: vec![vec![Chunk::default(); chunks]; length.ilog2() as usize + 1],
        }
    }

    /// The row whose runs are summed.
    #[inline(always)]
    pub fn row_mut(&mut self) -> &mut [Chunk] {
        &mut self.doubled[0]
    }

    /// Sums of all runs of the first `columns` values of the row.
    #[inline(always)]
    pub fn sum(&mut self, columns: usize, sums: &mut [Chunk]) {
        for level in 1..self.doubled.len() {
            let half = 1 << (level - 1);
            let count = columns + 1 - 2 * half;
            let (shorter, longer) = self.doubled.split_at_mut(level);
            let shorter = values(&shorter[level - 1]);
            let (left, right) = (&shorter[..count], &shorter[half..half + count]);
            let longer = &mut values_mut(&mut longer[0])[..count];
            for i in 0..count {
                longer[i] = left[i] + right[i];
            }
        }
        let count = columns + 1 - self.length;
        let top = self.doubled.len() - 1;
        let sums = &mut values_mut(sums)[..count];
        sums.copy_from_slice(&values(&self.doubled[top])[..count]);
        let mut offset = 1 << top;
        for level in (0..top).rev() {
            if self.length >> level & 1 == 1 {
                let more = &values(&self.doubled[level])[offset..offset + count];
                for i in 0..count {
                    sums[i] += more[i];
                }
                offset += 1 << level;
            }
        }
    }
}
