//! Four `f64` at a time, the same bits at every level; the tokens and rules are those of [`Lanes`](super::lanes::Lanes).
#![expect(unsafe_code, reason = "vector instructions")]

use super::lanes::Scalar;

/// Four lanes of `f64`.
pub(crate) trait Doubles: Copy {
    type D: Copy;

    fn splat(self, value: f64) -> Self::D;
    fn add(self, a: Self::D, b: Self::D) -> Self::D;
    fn sub(self, a: Self::D, b: Self::D) -> Self::D;
    fn mul(self, a: Self::D, b: Self::D) -> Self::D;
    fn div(self, a: Self::D, b: Self::D) -> Self::D;
    /// The smaller one; `b` where one is NaN.
    fn min(self, a: Self::D, b: Self::D) -> Self::D;
    /// The larger one; `b` where one is NaN.
    fn max(self, a: Self::D, b: Self::D) -> Self::D;
    fn load(self, from: &[f32; 4]) -> Self::D;
    /// The lower halves of both, and the upper halves: `[a0, a1, b0, b1]` and `[a2, a3, b2, b3]`.
    fn halves(self, a: Self::D, b: Self::D) -> [Self::D; 2];
    /// The even lanes of both, alternating, and the odd ones: `[a0, b0, a2, b2]` and `[a1, b1, a3, b3]`.
    fn alternate(self, a: Self::D, b: Self::D) -> [Self::D; 2];
    fn array(self, a: Self::D) -> [f64; 4];
    /// `[table[low], table[low + 1], table[high], table[high + 1]]`.
    ///
    /// # Safety
    /// `low + 1` and `high + 1` are below the length of the table.
    unsafe fn pairs(self, table: &[f32], low: usize, high: usize) -> Self::D;
    /// `[table[a], table[b], table[c], table[d]]`.
    ///
    /// # Safety
    /// Every index is below the length of the table.
    unsafe fn four(self, table: &[f32], indices: [usize; 4]) -> Self::D;
}

#[inline(always)]
fn each(a: [f64; 4], b: [f64; 4], f: impl Fn(f64, f64) -> f64) -> [f64; 4] {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])]
}

impl Doubles for Scalar {
    type D = [f64; 4];

    #[inline(always)]
    fn splat(self, value: f64) -> [f64; 4] {
        [value; 4]
    }
    #[inline(always)]
    fn add(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn load(self, from: &[f32; 4]) -> [f64; 4] {
        from.map(f64::from)
    }
    #[inline(always)]
    fn halves(self, a: [f64; 4], b: [f64; 4]) -> [[f64; 4]; 2] {
        [[a[0], a[1], b[0], b[1]], [a[2], a[3], b[2], b[3]]]
    }
    #[inline(always)]
    fn alternate(self, a: [f64; 4], b: [f64; 4]) -> [[f64; 4]; 2] {
        [[a[0], b[0], a[2], b[2]], [a[1], b[1], a[3], b[3]]]
    }
    #[inline(always)]
    fn array(self, a: [f64; 4]) -> [f64; 4] {
        a
    }
    #[inline(always)]
    unsafe fn pairs(self, table: &[f32], low: usize, high: usize) -> [f64; 4] {
        // SAFETY: the caller keeps indices in range.
        unsafe { self.four(table, [low, low + 1, high, high + 1]) }
    }
    #[inline(always)]
    unsafe fn four(self, table: &[f32], indices: [usize; 4]) -> [f64; 4] {
        debug_assert!(indices.iter().all(|index| *index < table.len()));
        // SAFETY: the caller keeps indices in range.
        indices.map(|index| f64::from(unsafe { *table.get_unchecked(index) }))
    }
}

/// Every `SAFETY` of this module: a token exists only where its instructions may be used, and the caller keeps indices
/// in range.
#[cfg(target_arch = "x86_64")]
#[allow(clippy::undocumented_unsafe_blocks, reason = "stated once for the module, above")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{
        super::lanes::{Avx2, Avx512},
        Doubles,
    };

    macro_rules! four_lanes {
        ($level:ty) => {
            impl Doubles for $level {
                type D = __m256d;

                #[inline(always)]
                fn splat(self, value: f64) -> __m256d {
                    unsafe { _mm256_set1_pd(value) }
                }
                #[inline(always)]
                fn add(self, a: __m256d, b: __m256d) -> __m256d {
                    unsafe { _mm256_add_pd(a, b) }
                }
                #[inline(always)]
                fn sub(self, a: __m256d, b: __m256d) -> __m256d {
                    unsafe { _mm256_sub_pd(a, b) }
                }
                #[inline(always)]
                fn mul(self, a: __m256d, b: __m256d) -> __m256d {
                    unsafe { _mm256_mul_pd(a, b) }
                }
                #[inline(always)]
                fn div(self, a: __m256d, b: __m256d) -> __m256d {
                    unsafe { _mm256_div_pd(a, b) }
                }
                #[inline(always)]
                fn min(self, a: __m256d, b: __m256d) -> __m256d {
                    unsafe { _mm256_min_pd(a, b) }
                }
                #[inline(always)]
                fn max(self, a: __m256d, b: __m256d) -> __m256d {
                    unsafe { _mm256_max_pd(a, b) }
                }
                #[inline(always)]
                fn load(self, from: &[f32; 4]) -> __m256d {
                    unsafe { _mm256_cvtps_pd(_mm_loadu_ps(from.as_ptr())) }
                }
                #[inline(always)]
                fn halves(self, a: __m256d, b: __m256d) -> [__m256d; 2] {
                    unsafe { [_mm256_permute2f128_pd::<0x20>(a, b), _mm256_permute2f128_pd::<0x31>(a, b)] }
                }
                #[inline(always)]
                fn alternate(self, a: __m256d, b: __m256d) -> [__m256d; 2] {
                    unsafe { [_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b)] }
                }
                #[inline(always)]
                fn array(self, a: __m256d) -> [f64; 4] {
                    let mut array = [0.0; 4];
                    unsafe { _mm256_storeu_pd(array.as_mut_ptr(), a) };
                    array
                }
                #[inline(always)]
                unsafe fn pairs(self, table: &[f32], low: usize, high: usize) -> __m256d {
                    debug_assert!(low + 1 < table.len() && high + 1 < table.len());
                    let table = table.as_ptr();
                    unsafe {
                        let pair = _mm_load_sd(table.add(low).cast());
                        _mm256_cvtps_pd(_mm_castpd_ps(_mm_loadh_pd(pair, table.add(high).cast())))
                    }
                }
                #[inline(always)]
                unsafe fn four(self, table: &[f32], [a, b, c, d]: [usize; 4]) -> __m256d {
                    debug_assert!([a, b, c, d].iter().all(|index| *index < table.len()));
                    let table = table.as_ptr();
                    unsafe {
                        let [a, b, c, d] = [*table.add(a), *table.add(b), *table.add(c), *table.add(d)];
                        _mm256_cvtps_pd(_mm_setr_ps(a, b, c, d))
                    }
                }
            }
        };
    }

    four_lanes!(Avx2);
    // Eight would be fewer instructions, but not less time: loads and their latency are what a lookup waits for.
    four_lanes!(Avx512);
}
