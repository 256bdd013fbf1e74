//! Sixteen numbers at a time, the same bits at every level.
//!
//! A kernel is written once over [`Lanes`] and compiled for each [`SimdLevel`](super::SimdLevel) by `simd_kernel!`. The value
//! of a level is a token: it exists only inside functions compiled for it, so its methods are safe to call. No method
//! fuses or reorders floating-point operations.
// Long because: one trait and its three levels are read side by side.
#![expect(unsafe_code, reason = "the only home of vector instructions")]
#![expect(missing_docs, reason = "methods are named as the instructions are")]

/// Sixteen lanes of `f32`, `i32` or conditions.
///
/// `i32` lanes can also be read as two 16-bit or four 8-bit numbers, in methods documented so.
pub trait Lanes: Copy {
    type F: Copy;
    type I: Copy;
    type M: Copy;

    fn splat(self, value: f32) -> Self::F;
    fn load(self, from: &[f32; 16]) -> Self::F;
    fn store(self, value: Self::F, to: &mut [f32; 16]);
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// The smaller one; `b` where one is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The larger one; `b` where one is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn abs(self, a: Self::F) -> Self::F;
    /// Rounded as specified by IEEE 754.
    fn sqrt(self, a: Self::F) -> Self::F;
    fn ge(self, a: Self::F, b: Self::F) -> Self::M;
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    fn select(self, condition: Self::M, yes: Self::F, no: Self::F) -> Self::F;
    /// Towards zero; lanes must fit.
    fn truncate(self, a: Self::F) -> Self::I;
    fn to_float(self, a: Self::I) -> Self::F;

    fn splat_i(self, value: i32) -> Self::I;
    fn load_i(self, from: &[u32; 16]) -> Self::I;
    fn store_i(self, value: Self::I, to: &mut [u32; 16]);
    fn add_i(self, a: Self::I, b: Self::I) -> Self::I;
    fn sub_i(self, a: Self::I, b: Self::I) -> Self::I;
    fn mul_i(self, a: Self::I, b: Self::I) -> Self::I;
    fn and_i(self, a: Self::I, b: Self::I) -> Self::I;
    fn or_i(self, a: Self::I, b: Self::I) -> Self::I;
    fn shl_i<const N: u32>(self, a: Self::I) -> Self::I;
    /// Zeros come in from above.
    fn shr_i<const N: u32>(self, a: Self::I) -> Self::I;
    /// The sign comes in from above.
    fn sar_i<const N: u32>(self, a: Self::I) -> Self::I;
    /// Each lane by its own count; zeros come in from above.
    fn shr_each(self, a: Self::I, count: Self::I) -> Self::I;
    fn gt_i(self, a: Self::I, b: Self::I) -> Self::M;
    fn eq_i(self, a: Self::I, b: Self::I) -> Self::M;
    /// Signed 16-bit numbers, two per lane.
    fn min_i16(self, a: Self::I, b: Self::I) -> Self::I;
    /// Signed 16-bit numbers, two per lane.
    fn max_i16(self, a: Self::I, b: Self::I) -> Self::I;
    /// 16-bit numbers, two per lane.
    fn sub_i16(self, a: Self::I, b: Self::I) -> Self::I;
    /// Unsigned 8-bit numbers, four per lane.
    fn min_u8(self, a: Self::I, b: Self::I) -> Self::I;
    /// Unsigned 8-bit numbers, four per lane.
    fn max_u8(self, a: Self::I, b: Self::I) -> Self::I;
    /// 8-bit numbers, four per lane.
    fn sub_u8(self, a: Self::I, b: Self::I) -> Self::I;

    fn both(self, a: Self::M, b: Self::M) -> Self::M;
    fn either(self, a: Self::M, b: Self::M) -> Self::M;
    fn not(self, a: Self::M) -> Self::M;
    /// Lane i is bit i.
    fn bits(self, a: Self::M) -> u32;

    /// `table[index]` a lane.
    ///
    /// # Safety
    /// Every index is below the length of the table.
    unsafe fn gather(self, table: &[f32], index: Self::I) -> Self::F;
    /// `table[index]` a lane.
    ///
    /// # Safety
    /// Every index is below the length of the table.
    unsafe fn gather_i(self, table: &[u32], index: Self::I) -> Self::I;
    /// Bytes `index..index + 4` of the table a lane, the first one lowest.
    ///
    /// # Safety
    /// Every index is below the length of the table less 3.
    unsafe fn gather_bytes(self, table: &[u8], index: Self::I) -> Self::I;
    /// Writes the lanes whose bit is set one after the other, and may write any value to the rest of `to`.
    fn compress(self, bits: u32, value: Self::I, to: &mut [u32; 16]);
    /// Bit i is the lowest bit of byte i.
    fn low_bits(self, bytes: &[u8; 64]) -> u64;
}

/// Evaluates one expression for each of several values. A macro, because a closure handed to `map` is compiled without
/// the level's instructions and then calls them one by one.
#[macro_export]
macro_rules! each_of {
    ([$($value:expr),+ $(,)?], $name:pat => $body:expr) => {
        [$({ let $name = $value; $body }),+]
    };
}

pub use each_of;

/// A linear function in all lanes.
pub struct Affine<L: Lanes>([L::F; 4]);

impl<L: Lanes> Affine<L> {
    /// `row[0] x + row[1] y + row[2] z + row[3]`.
    #[inline(always)]
    pub fn new(l: L, row: [f32; 4]) -> Self {
        Self([l.splat(row[0]), l.splat(row[1]), l.splat(row[2]), l.splat(row[3])])
    }

    /// Value of the affine function, summed from the left.
    #[inline(always)]
    pub fn at(&self, l: L, x: L::F, y: L::F, z: L::F) -> L::F {
        let [a, b, c, d] = self.0;
        l.add(l.add(l.add(l.mul(a, x), l.mul(b, y)), l.mul(c, z)), d)
    }
}

/// No vector instruction named; the compiler uses what every machine has.
#[derive(Clone, Copy)]
pub struct Scalar;

#[inline(always)]
fn each<T: Copy, R: Copy>(a: [T; 16], b: [T; 16], f: impl Fn(T, T) -> R) -> [R; 16] {
    std::array::from_fn(|lane| f(a[lane], b[lane]))
}

#[inline(always)]
fn halves(a: i32, b: i32, f: impl Fn(i16, i16) -> i16) -> i32 {
    let (low, high) = (f(a as i16, b as i16), f((a >> 16) as i16, (b >> 16) as i16));
    i32::from(high) << 16 | i32::from(low as u16)
}

#[inline(always)]
fn bytes(a: i32, b: i32, f: impl Fn(u8, u8) -> u8) -> i32 {
    let (a, b) = (a.to_le_bytes(), b.to_le_bytes());
    i32::from_le_bytes(std::array::from_fn(|byte| f(a[byte], b[byte])))
}

impl Lanes for Scalar {
    type F = [f32; 16];
    type I = [i32; 16];
    type M = [bool; 16];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [value; 16]
    }
    #[inline(always)]
    fn load(self, from: &[f32; 16]) -> Self::F {
        *from
    }
    #[inline(always)]
    fn store(self, value: Self::F, to: &mut [f32; 16]) {
        *to = value;
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn sqrt(self, a: Self::F) -> Self::F {
        a.map(f32::sqrt)
    }
    #[inline(always)]
    fn ge(self, a: Self::F, b: Self::F) -> Self::M {
        each(a, b, |a, b| a >= b)
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> Self::M {
        each(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn select(self, condition: Self::M, yes: Self::F, no: Self::F) -> Self::F {
        std::array::from_fn(|lane| if condition[lane] { yes[lane] } else { no[lane] })
    }
    #[inline(always)]
    fn truncate(self, a: Self::F) -> Self::I {
        // SAFETY: lanes fit, as the trait requires.
        a.map(|a| unsafe { a.to_int_unchecked::<i32>() })
    }
    #[inline(always)]
    fn to_float(self, a: Self::I) -> Self::F {
        a.map(|a| a as f32)
    }
    #[inline(always)]
    fn splat_i(self, value: i32) -> Self::I {
        [value; 16]
    }
    #[inline(always)]
    fn load_i(self, from: &[u32; 16]) -> Self::I {
        from.map(|value| value as i32)
    }
    #[inline(always)]
    fn store_i(self, value: Self::I, to: &mut [u32; 16]) {
        *to = value.map(|value| value as u32);
    }
    #[inline(always)]
    fn add_i(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, i32::wrapping_add)
    }
    #[inline(always)]
    fn sub_i(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, i32::wrapping_sub)
    }
    #[inline(always)]
    fn mul_i(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, i32::wrapping_mul)
    }
    #[inline(always)]
    fn and_i(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn or_i(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn shl_i<const N: u32>(self, a: Self::I) -> Self::I {
        a.map(|a| a << N)
    }
    #[inline(always)]
    fn shr_i<const N: u32>(self, a: Self::I) -> Self::I {
        a.map(|a| (a as u32 >> N) as i32)
    }
    #[inline(always)]
    fn sar_i<const N: u32>(self, a: Self::I) -> Self::I {
        a.map(|a| a >> N)
    }
    #[inline(always)]
    fn shr_each(self, a: Self::I, count: Self::I) -> Self::I {
        each(a, count, |a, count| (a as u32).wrapping_shr(count as u32) as i32)
    }
    #[inline(always)]
    fn gt_i(self, a: Self::I, b: Self::I) -> Self::M {
        each(a, b, |a, b| a > b)
    }
    #[inline(always)]
    fn eq_i(self, a: Self::I, b: Self::I) -> Self::M {
        each(a, b, |a, b| a == b)
    }
    #[inline(always)]
    fn min_i16(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| halves(a, b, i16::min))
    }
    #[inline(always)]
    fn max_i16(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| halves(a, b, i16::max))
    }
    #[inline(always)]
    fn sub_i16(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| halves(a, b, i16::wrapping_sub))
    }
    #[inline(always)]
    fn min_u8(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| bytes(a, b, u8::min))
    }
    #[inline(always)]
    fn max_u8(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| bytes(a, b, u8::max))
    }
    #[inline(always)]
    fn sub_u8(self, a: Self::I, b: Self::I) -> Self::I {
        each(a, b, |a, b| bytes(a, b, u8::wrapping_sub))
    }
    #[inline(always)]
    fn both(self, a: Self::M, b: Self::M) -> Self::M {
        each(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn either(self, a: Self::M, b: Self::M) -> Self::M {
        each(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn not(self, a: Self::M) -> Self::M {
        a.map(|a| !a)
    }
    #[inline(always)]
    fn bits(self, a: Self::M) -> u32 {
        a.iter().enumerate().fold(0, |bits, (lane, set)| bits | u32::from(*set) << lane)
    }
    #[inline(always)]
    unsafe fn gather(self, table: &[f32], index: Self::I) -> Self::F {
        // SAFETY: the caller keeps indices in range.
        index.map(|index| unsafe { *table.get_unchecked(index as usize) })
    }
    #[inline(always)]
    unsafe fn gather_i(self, table: &[u32], index: Self::I) -> Self::I {
        // SAFETY: the caller keeps indices in range.
        index.map(|index| unsafe { *table.get_unchecked(index as usize) } as i32)
    }
    #[inline(always)]
    unsafe fn gather_bytes(self, table: &[u8], index: Self::I) -> Self::I {
        // SAFETY: the caller keeps indices in range.
        index.map(|index| i32::from_le(unsafe { table.as_ptr().add(index as usize).cast::<i32>().read_unaligned() }))
    }
    #[inline(always)]
    fn compress(self, mut bits: u32, value: Self::I, to: &mut [u32; 16]) {
        let mut count = 0;
        while bits != 0 {
            to[count] = value[bits.trailing_zeros() as usize] as u32;
            count += 1;
            bits &= bits - 1;
        }
    }
    #[inline(always)]
    fn low_bits(self, bytes: &[u8; 64]) -> u64 {
        bytes.as_chunks::<8>().0.iter().enumerate().fold(0, |bits, (index, eight)| {
            let eight = u64::from_le_bytes(*eight) & 0x0101_0101_0101_0101;
            bits | eight.wrapping_mul(0x0102_0408_1020_4080) >> 56 << (8 * index)
        })
    }
}

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

/// Every `SAFETY` of this module: a token exists only where its instructions may be used, and arrays have 16 numbers.
#[cfg(target_arch = "x86_64")]
#[allow(clippy::undocumented_unsafe_blocks, reason = "stated once for the module, above")]
mod x86 {
    use std::arch::x86_64::*;

    use super::Lanes;

    /// AVX-512 may be used.
    #[derive(Clone, Copy)]
    pub struct Avx512(());

    /// AVX2 may be used.
    #[derive(Clone, Copy)]
    pub struct Avx2(());

    impl Avx512 {
        /// # Safety
        /// Only inside a function compiled for AVX-512 F, BW, DQ, VL and CD.
        #[inline(always)]
        pub unsafe fn token() -> Self {
            Self(())
        }
    }

    impl Avx2 {
        /// # Safety
        /// Only inside a function compiled for AVX2, BMI1, BMI2, LZCNT and POPCNT.
        #[inline(always)]
        pub unsafe fn token() -> Self {
            Self(())
        }
    }

    macro_rules! avx512 {
        ($($name:ident($($arg:ident: $type:ty),*) -> $out:ty = $body:expr;)*) => {$(
            #[inline(always)]
            fn $name(self, $($arg: $type),*) -> $out {
                unsafe { $body }
            }
        )*};
    }

    impl Lanes for Avx512 {
        type F = __m512;
        type I = __m512i;
        type M = __mmask16;

        avx512! {
            splat(value: f32) -> __m512 = _mm512_set1_ps(value);
            load(from: &[f32; 16]) -> __m512 = _mm512_loadu_ps(from.as_ptr());
            store(value: __m512, to: &mut [f32; 16]) -> () = _mm512_storeu_ps(to.as_mut_ptr(), value);
            add(a: __m512, b: __m512) -> __m512 = _mm512_add_ps(a, b);
            sub(a: __m512, b: __m512) -> __m512 = _mm512_sub_ps(a, b);
            mul(a: __m512, b: __m512) -> __m512 = _mm512_mul_ps(a, b);
            div(a: __m512, b: __m512) -> __m512 = _mm512_div_ps(a, b);
            min(a: __m512, b: __m512) -> __m512 = _mm512_min_ps(a, b);
            max(a: __m512, b: __m512) -> __m512 = _mm512_max_ps(a, b);
            abs(a: __m512) -> __m512 = _mm512_abs_ps(a);
            sqrt(a: __m512) -> __m512 = _mm512_sqrt_ps(a);
            ge(a: __m512, b: __m512) -> __mmask16 = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(a, b);
            lt(a: __m512, b: __m512) -> __mmask16 = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b);
            select(condition: __mmask16, yes: __m512, no: __m512) -> __m512 = _mm512_mask_blend_ps(condition, no, yes);
            truncate(a: __m512) -> __m512i = _mm512_cvttps_epi32(a);
            to_float(a: __m512i) -> __m512 = _mm512_cvtepi32_ps(a);
            splat_i(value: i32) -> __m512i = _mm512_set1_epi32(value);
            load_i(from: &[u32; 16]) -> __m512i = _mm512_loadu_si512(from.as_ptr().cast());
            store_i(value: __m512i, to: &mut [u32; 16]) -> () = _mm512_storeu_si512(to.as_mut_ptr().cast(), value);
            add_i(a: __m512i, b: __m512i) -> __m512i = _mm512_add_epi32(a, b);
            sub_i(a: __m512i, b: __m512i) -> __m512i = _mm512_sub_epi32(a, b);
            mul_i(a: __m512i, b: __m512i) -> __m512i = _mm512_mullo_epi32(a, b);
            and_i(a: __m512i, b: __m512i) -> __m512i = _mm512_and_si512(a, b);
            or_i(a: __m512i, b: __m512i) -> __m512i = _mm512_or_si512(a, b);
            shr_each(a: __m512i, count: __m512i) -> __m512i = _mm512_srlv_epi32(a, count);
            gt_i(a: __m512i, b: __m512i) -> __mmask16 = _mm512_cmpgt_epi32_mask(a, b);
            eq_i(a: __m512i, b: __m512i) -> __mmask16 = _mm512_cmpeq_epi32_mask(a, b);
            min_i16(a: __m512i, b: __m512i) -> __m512i = _mm512_min_epi16(a, b);
            max_i16(a: __m512i, b: __m512i) -> __m512i = _mm512_max_epi16(a, b);
            sub_i16(a: __m512i, b: __m512i) -> __m512i = _mm512_sub_epi16(a, b);
            min_u8(a: __m512i, b: __m512i) -> __m512i = _mm512_min_epu8(a, b);
            max_u8(a: __m512i, b: __m512i) -> __m512i = _mm512_max_epu8(a, b);
            sub_u8(a: __m512i, b: __m512i) -> __m512i = _mm512_sub_epi8(a, b);
            compress(bits: u32, value: __m512i, to: &mut [u32; 16]) -> () =
                _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_maskz_compress_epi32(bits as u16, value));
            low_bits(bytes: &[u8; 64]) -> u64 =
                _mm512_test_epi8_mask(_mm512_loadu_si512(bytes.as_ptr().cast()), _mm512_set1_epi8(1));
        }

        #[inline(always)]
        fn shl_i<const N: u32>(self, a: __m512i) -> __m512i {
            unsafe { _mm512_slli_epi32::<N>(a) }
        }
        #[inline(always)]
        fn shr_i<const N: u32>(self, a: __m512i) -> __m512i {
            unsafe { _mm512_srli_epi32::<N>(a) }
        }
        #[inline(always)]
        fn sar_i<const N: u32>(self, a: __m512i) -> __m512i {
            unsafe { _mm512_srai_epi32::<N>(a) }
        }
        #[inline(always)]
        fn both(self, a: __mmask16, b: __mmask16) -> __mmask16 {
            a & b
        }
        #[inline(always)]
        fn either(self, a: __mmask16, b: __mmask16) -> __mmask16 {
            a | b
        }
        #[inline(always)]
        fn not(self, a: __mmask16) -> __mmask16 {
            !a
        }
        #[inline(always)]
        fn bits(self, a: __mmask16) -> u32 {
            u32::from(a)
        }
        #[inline(always)]
        unsafe fn gather(self, table: &[f32], index: __m512i) -> __m512 {
            unsafe { _mm512_i32gather_ps::<4>(index, table.as_ptr().cast()) }
        }
        #[inline(always)]
        unsafe fn gather_i(self, table: &[u32], index: __m512i) -> __m512i {
            unsafe { _mm512_i32gather_epi32::<4>(index, table.as_ptr().cast()) }
        }
        #[inline(always)]
        unsafe fn gather_bytes(self, table: &[u8], index: __m512i) -> __m512i {
            unsafe { _mm512_i32gather_epi32::<1>(index, table.as_ptr().cast()) }
        }
    }

    macro_rules! avx2 {
        ($($name:ident($($arg:ident: $type:ty),*) -> $out:ty = $body:expr;)*) => {$(
            #[inline(always)]
            fn $name(self, $($arg: $type),*) -> $out {
                // No closures: they would be compiled without the level's instructions.
                unsafe {
                    [
                        { $(let $arg = $arg[0];)* $body },
                        { $(let $arg = $arg[1];)* $body },
                    ]
                }
            }
        )*};
    }

    type F = [__m256; 2];
    type I = [__m256i; 2];

    impl Lanes for Avx2 {
        type F = F;
        type I = I;
        type M = I;

        avx2! {
            add(a: F, b: F) -> F = _mm256_add_ps(a, b);
            sub(a: F, b: F) -> F = _mm256_sub_ps(a, b);
            mul(a: F, b: F) -> F = _mm256_mul_ps(a, b);
            div(a: F, b: F) -> F = _mm256_div_ps(a, b);
            min(a: F, b: F) -> F = _mm256_min_ps(a, b);
            max(a: F, b: F) -> F = _mm256_max_ps(a, b);
            abs(a: F) -> F = _mm256_andnot_ps(_mm256_set1_ps(-0.0), a);
            sqrt(a: F) -> F = _mm256_sqrt_ps(a);
            ge(a: F, b: F) -> I = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_GE_OQ>(a, b));
            lt(a: F, b: F) -> I = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b));
            select(condition: I, yes: F, no: F) -> F = _mm256_blendv_ps(no, yes, _mm256_castsi256_ps(condition));
            truncate(a: F) -> I = _mm256_cvttps_epi32(a);
            to_float(a: I) -> F = _mm256_cvtepi32_ps(a);
            add_i(a: I, b: I) -> I = _mm256_add_epi32(a, b);
            sub_i(a: I, b: I) -> I = _mm256_sub_epi32(a, b);
            mul_i(a: I, b: I) -> I = _mm256_mullo_epi32(a, b);
            and_i(a: I, b: I) -> I = _mm256_and_si256(a, b);
            or_i(a: I, b: I) -> I = _mm256_or_si256(a, b);
            shr_each(a: I, count: I) -> I = _mm256_srlv_epi32(a, count);
            gt_i(a: I, b: I) -> I = _mm256_cmpgt_epi32(a, b);
            eq_i(a: I, b: I) -> I = _mm256_cmpeq_epi32(a, b);
            min_i16(a: I, b: I) -> I = _mm256_min_epi16(a, b);
            max_i16(a: I, b: I) -> I = _mm256_max_epi16(a, b);
            sub_i16(a: I, b: I) -> I = _mm256_sub_epi16(a, b);
            min_u8(a: I, b: I) -> I = _mm256_min_epu8(a, b);
            max_u8(a: I, b: I) -> I = _mm256_max_epu8(a, b);
            sub_u8(a: I, b: I) -> I = _mm256_sub_epi8(a, b);
            both(a: I, b: I) -> I = _mm256_and_si256(a, b);
            either(a: I, b: I) -> I = _mm256_or_si256(a, b);
            not(a: I) -> I = _mm256_xor_si256(a, _mm256_set1_epi32(-1));
        }

        #[inline(always)]
        fn splat(self, value: f32) -> F {
            [unsafe { _mm256_set1_ps(value) }; 2]
        }
        #[inline(always)]
        fn load(self, from: &[f32; 16]) -> F {
            unsafe { [_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8))] }
        }
        #[inline(always)]
        fn store(self, value: F, to: &mut [f32; 16]) {
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), value[0]);
                _mm256_storeu_ps(to.as_mut_ptr().add(8), value[1]);
            }
        }
        #[inline(always)]
        fn splat_i(self, value: i32) -> I {
            [unsafe { _mm256_set1_epi32(value) }; 2]
        }
        #[inline(always)]
        fn load_i(self, from: &[u32; 16]) -> I {
            unsafe { [_mm256_loadu_si256(from.as_ptr().cast()), _mm256_loadu_si256(from.as_ptr().add(8).cast())] }
        }
        #[inline(always)]
        fn store_i(self, value: I, to: &mut [u32; 16]) {
            unsafe {
                _mm256_storeu_si256(to.as_mut_ptr().cast(), value[0]);
                _mm256_storeu_si256(to.as_mut_ptr().add(8).cast(), value[1]);
            }
        }
        #[inline(always)]
        fn shl_i<const N: u32>(self, a: I) -> I {
            unsafe {
                let count = _mm256_set1_epi32(N as i32);
                [_mm256_sllv_epi32(a[0], count), _mm256_sllv_epi32(a[1], count)]
            }
        }
        #[inline(always)]
        fn shr_i<const N: u32>(self, a: I) -> I {
            unsafe {
                let count = _mm256_set1_epi32(N as i32);
                [_mm256_srlv_epi32(a[0], count), _mm256_srlv_epi32(a[1], count)]
            }
        }
        #[inline(always)]
        fn sar_i<const N: u32>(self, a: I) -> I {
            unsafe {
                let count = _mm256_set1_epi32(N as i32);
                [_mm256_srav_epi32(a[0], count), _mm256_srav_epi32(a[1], count)]
            }
        }
        #[inline(always)]
        fn bits(self, a: I) -> u32 {
            unsafe {
                let low = _mm256_movemask_ps(_mm256_castsi256_ps(a[0])) as u32;
                let high = _mm256_movemask_ps(_mm256_castsi256_ps(a[1])) as u32;
                high << 8 | low
            }
        }
        #[inline(always)]
        unsafe fn gather(self, table: &[f32], index: I) -> F {
            let table = table.as_ptr();
            unsafe { [_mm256_i32gather_ps::<4>(table, index[0]), _mm256_i32gather_ps::<4>(table, index[1])] }
        }
        #[inline(always)]
        unsafe fn gather_i(self, table: &[u32], index: I) -> I {
            let table = table.as_ptr().cast();
            unsafe { [_mm256_i32gather_epi32::<4>(table, index[0]), _mm256_i32gather_epi32::<4>(table, index[1])] }
        }
        #[inline(always)]
        unsafe fn gather_bytes(self, table: &[u8], index: I) -> I {
            let table = table.as_ptr().cast();
            unsafe { [_mm256_i32gather_epi32::<1>(table, index[0]), _mm256_i32gather_epi32::<1>(table, index[1])] }
        }
        #[inline(always)]
        fn compress(self, bits: u32, value: I, to: &mut [u32; 16]) {
            let low = bits & 0xff;
            // SAFETY: at most 8 numbers come from the lower half, so the 8 of the upper half still fit.
            unsafe {
                compress_half(low, value[0], to.as_mut_ptr());
                compress_half(bits >> 8, value[1], to.as_mut_ptr().add(low.count_ones() as usize));
            }
        }
        #[inline(always)]
        fn low_bits(self, bytes: &[u8; 64]) -> u64 {
            unsafe {
                let low = _mm256_loadu_si256(bytes.as_ptr().cast());
                let high = _mm256_loadu_si256(bytes.as_ptr().add(32).cast());
                let low = _mm256_movemask_epi8(_mm256_slli_epi16::<7>(low)) as u32;
                let high = _mm256_movemask_epi8(_mm256_slli_epi16::<7>(high)) as u32;
                u64::from(high) << 32 | u64::from(low)
            }
        }
    }

    /// The indices of the set bits, one byte each, become the order of a permutation.
    ///
    /// # Safety
    /// AVX2 and BMI2 may be used, and 8 numbers may be written.
    #[inline(always)]
    unsafe fn compress_half(bits: u32, value: __m256i, to: *mut u32) {
        unsafe {
            let chosen = _pdep_u64(u64::from(bits), 0x0101_0101_0101_0101) * 0xff;
            let indices = _pext_u64(0x0706_0504_0302_0100, chosen);
            let order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(indices as i64));
            _mm256_storeu_si256(to.cast(), _mm256_permutevar8x32_epi32(value, order));
        }
    }
}
