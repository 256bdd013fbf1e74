//! Which vector instructions a kernel may use.

use std::{fmt, str::FromStr};

/// A level of vector instructions. Every kernel gives the same bits at every level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// No explicit vector instructions: every machine.
    Scalar,
    /// AVX2 (x86-64-v3 machines).
    Avx2,
    /// AVX-512 F, BW, DQ, VL and CD (x86-64-v4 machines).
    Avx512,
}

impl SimdLevel {
    /// The best level of this machine.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let v4 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512cd");
            // Both levels also use BMI1, BMI2, LZCNT and POPCNT, which every such machine has; checked nevertheless.
            let bits = is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            if v4 && bits {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") && bits {
                return Self::Avx2;
            }
        }
        Self::Scalar
    }

    /// This level, or the best of this machine where that is lower: what every kernel's owner passes on.
    pub fn usable(self) -> Self {
        self.min(Self::detect())
    }

    /// Every level that this machine can run, scalar first.
    pub fn available() -> impl Iterator<Item = Self> {
        let best = Self::detect();
        [Self::Scalar, Self::Avx2, Self::Avx512].into_iter().filter(move |level| *level <= best)
    }
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        })
    }
}

/// A text that names no SIMD level.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no SIMD level: scalar, avx2 or avx512")]
pub struct UnknownSimdLevel(pub String);

impl FromStr for SimdLevel {
    type Err = UnknownSimdLevel;

    fn from_str(text: &str) -> Result<Self, UnknownSimdLevel> {
        match text {
            "scalar" => Ok(Self::Scalar),
            "avx2" => Ok(Self::Avx2),
            "avx512" => Ok(Self::Avx512),
            _ => Err(UnknownSimdLevel(text.to_owned())),
        }
    }
}

/// Compiles one kernel body, an `#[inline(always)]` function generic over `Lanes`, for every level.
///
/// `simd_kernel! { fn name(a: A, b: B) -> R = body; }` makes `fn name(level: SimdLevel, a: A, b: B) -> R` of
/// `fn body<L: Lanes>(lanes: L, a: A, b: B) -> R`, to be called with a level from [`SimdLevel::usable`] only. Rust contracts and reorders no floating-point operation, so the wider
/// instructions that the compiler picks give the same bits.
#[macro_export]
macro_rules! simd_kernel {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $out:ty)? = $body:ident;) => {
        $(#[$meta])*
        #[allow(clippy::too_many_arguments)]
        #[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "calls a function compiled for more instructions"))]
        $vis fn $name(level: $crate::geom::SimdLevel, $($arg: $type),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            {
                use $crate::geom::{SimdLevel, lanes};

                #[allow(clippy::too_many_arguments)]
                #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
                fn avx2($($arg: $type),*) $(-> $out)? {
                    // SAFETY: this function is compiled for AVX2.
                    $body(unsafe { lanes::Avx2::token() }, $($arg),*)
                }

                #[allow(clippy::too_many_arguments)]
                #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512cd,bmi1,bmi2,lzcnt,popcnt")]
                fn avx512($($arg: $type),*) $(-> $out)? {
                    // SAFETY: this function is compiled for AVX-512.
                    $body(unsafe { lanes::Avx512::token() }, $($arg),*)
                }

                debug_assert!(level <= SimdLevel::detect());
                match level {
                    SimdLevel::Scalar => {}
                    // SAFETY: `level` is usable, so the machine has these instructions.
                    SimdLevel::Avx2 => return unsafe { avx2($($arg),*) },
                    // SAFETY: as above.
                    SimdLevel::Avx512 => return unsafe { avx512($($arg),*) },
                }
            }
            let _ = level;
            $body($crate::geom::lanes::Scalar, $($arg),*)
        }
    };
}

pub use simd_kernel;
