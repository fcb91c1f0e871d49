//! Photon noise.

use crate::image::Image;
use crate::random::Stream;
use rand_distr::{Distribution, Poisson};
use rayon::prelude::*;

/// Photon counts of an image of line integrals: each pixel is a Poisson draw of mean
/// `photons * exp(-line)` (paper, supplement, Beer-Lambert law).
///
/// Each row draws from its own ChaCha stream number of `stream`'s key, so neither threads nor the
/// number of draws in another row change a pixel. `stream` itself must be fresh: only its key is used.
/// A count above 65,535 saturates, as in a detector; no mean that the parameters allow comes near.
pub fn photon_counts(lines: &Image<f32>, photons: f64, stream: &Stream) -> Image<u16> {
    let mut data = vec![0; lines.data.len()];
    data.par_chunks_mut(lines.width.max(1))
        .enumerate()
        .for_each(|(y, row)| {
            let mut stream = stream.clone();
            stream.set_stream(y as u64 + 1);
            for (count, &line) in row.iter_mut().zip(lines.row(y)) {
                *count = draw(photons * f64::from(-line).exp(), &mut stream);
            }
        });
    Image::new(lines.width, lines.height, data)
}

fn draw(mean: f64, stream: &mut Stream) -> u16 {
    // Behind metal seen end on the mean may be too small for the distribution's constructor: no
    // photon arrives.
    let Ok(poisson) = Poisson::new(mean) else {
        return 0;
    };
    let count: f64 = poisson.sample(stream);
    count.min(f64::from(u16::MAX)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    /// Mean and variance of counts over an image of one line integral.
    fn moments(line: f32) -> (f64, f64, f64) {
        let lines = Image::filled(400, 300, line);
        let counts = photon_counts(&lines, 2000.0, &stream(3, Purpose::Noise, "test"));
        let n = counts.data.len() as f64;
        let mean = counts.data.iter().map(|&c| f64::from(c)).sum::<f64>() / n;
        let square = |c: &u16| (f64::from(*c) - mean).powi(2);
        let variance = counts.data.iter().map(square).sum::<f64>() / n;
        (mean, variance, n)
    }

    #[test]
    fn variance_equals_mean_at_every_brightness() {
        // From air to dense metal; both sampling methods of the distribution (means above and below
        // 12) are passed.
        for line in [0.0, 1.0, 3.0, 5.0, 5.2, 7.0, 9.0] {
            let expected = 2000.0 * f64::from(-line).exp();
            let (mean, variance, n) = moments(line);
            assert!(
                (mean - expected).abs() < 5.0 * (expected / n).sqrt(),
                "line {line}: mean {mean}, expected {expected}"
            );
            // The variance of a Poisson sample variance is (mean + 2 mean^2) / n, nearly.
            let error = ((expected + 2.0 * expected * expected) / n).sqrt();
            assert!(
                (variance - expected).abs() < 5.0 * error,
                "line {line}: variance {variance}, expected {expected}"
            );
        }
    }

    #[test]
    fn opaque_pixels_count_nothing() {
        for line in [200.0, 1000.0, f32::INFINITY] {
            assert_eq!(moments(line).0, 0.0);
        }
    }

    #[test]
    fn rows_are_independent_of_each_other_and_of_the_number_of_threads() {
        let bright = Image::filled(64, 8, 0.5);
        let mut changed = bright.clone();
        changed.data[..64].fill(4.0);
        let key = stream(3, Purpose::Noise, "test");
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let a = one.install(|| photon_counts(&bright, 2000.0, &key));
        let b = photon_counts(&changed, 2000.0, &key);
        assert_ne!(a.row(0), b.row(0));
        for y in 1..8 {
            assert_eq!(a.row(y), b.row(y));
            assert_ne!(a.row(y), a.row(y - 1));
        }
    }
}
