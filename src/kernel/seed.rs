//! Randomness by key: a stream is named by its purpose, not by the thread that draws from it or by time.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use crate::ids::{Digest, SampleId};

/// A seeded stream of numbers with samplers of our own: `rand`'s distributions may change between versions.
#[derive(Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream `name` of one sample of a job with this seed.
    pub fn of_sample(seed: u64, sample: &SampleId, name: &str) -> Self {
        Self::keyed(&[b"sample", &seed.to_le_bytes(), &sample.to_bytes(), name.as_bytes()])
    }

    /// The stream `name` of a whole job with this seed, about `subject` (an object's id, a split's name; may be empty).
    pub fn of_job(seed: u64, subject: &[u8], name: &str) -> Self {
        Self::keyed(&[b"job", &seed.to_le_bytes(), subject, name.as_bytes()])
    }

    fn keyed(parts: &[&[u8]]) -> Self {
        Self(ChaCha8Rng::from_seed(Digest::hash_parts(parts.iter().copied()).0))
    }

    /// 64 uniform bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// The next [`Self::bits`], each little-endian, eight bytes a draw.
    ///
    /// # Panics
    /// If the length is no multiple of eight.
    pub fn fill(&mut self, bytes: &mut [u8]) {
        assert!(bytes.len().is_multiple_of(8), "part of a draw");
        self.0.fill_bytes(bytes);
    }

    /// Advances as if `draws` values of [`Self::bits`] had been drawn.
    pub fn skip(&mut self, draws: u64) {
        if draws > 0 {
            self.0.set_word_pos(self.0.get_word_pos() + 2 * u128::from(draws));
        }
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..bound, without bias (Lemire 2019, "Fast random integer generation in an interval", algorithm 5).
    ///
    /// # Panics
    /// If `bound` is 0.
    pub fn below(&mut self, bound: u64) -> u64 {
        assert!(bound > 0, "a draw below 0");
        let threshold = bound.wrapping_neg() % bound;
        loop {
            let product = u128::from(self.bits()) * u128::from(bound);
            if product as u64 >= threshold {
                return (product >> 64) as u64;
            }
        }
    }

    /// Standard normal (Marsaglia polar method; `libm` so that every machine draws the same).
    pub fn normal(&mut self) -> f64 {
        loop {
            let (u, v) = (self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return u * libm::sqrt(-2.0 * libm::log(s) / s);
            }
        }
    }

    /// Reorders `items` uniformly (Fisher-Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last as u64 + 1) as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_those_of_the_draws() {
        let stream = || Stream::of_job(5, b"bytes", "draws");
        let (mut draws, mut filled) = (stream(), stream());
        // Lengths that end inside and at the end of the generator's own buffer.
        for count in [1, 7, 24, 32, 100, 1] {
            let expected: Vec<u8> = (0..count).flat_map(|_| draws.bits().to_le_bytes()).collect();
            let mut bytes = vec![0; expected.len()];
            filled.fill(&mut bytes);
            assert_eq!(bytes, expected);
        }
        assert_eq!(filled.bits(), draws.bits());
    }

    #[test]
    fn skipped_draws_are_those_that_were_not_made() {
        let stream = || Stream::of_job(5, b"bytes", "draws");
        for count in [0, 1, 31, 32, 33, 1000] {
            let (mut drawn, mut skipped) = (stream(), stream());
            drawn.bits();
            skipped.bits();
            (0..count).for_each(|_| _ = drawn.bits());
            skipped.skip(count);
            assert_eq!(skipped.bits(), drawn.bits(), "{count}");
        }
    }
}
