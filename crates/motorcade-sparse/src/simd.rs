//! Vector registers, and the choice at run time between the portable build of a kernel and the one compiled for AVX2
//! and FMA. Kernels are written once, as safe functions generic over [`Four`], and inlined into both builds.
//!
//! This module holds all `unsafe` code of the workspace.
#![allow(unsafe_code)]

/// Four numbers in one vector register.
pub trait Four: Copy {
    /// True where [`f64::mul_add`] is one instruction; elsewhere it is a library call, a hundred times slower.
    const FMA: bool;
    /// Four numbers.
    fn new(x: [f64; 4]) -> Self;
    /// The numbers.
    fn get(self) -> [f64; 4];
    /// `self + other`.
    #[must_use]
    fn add(self, other: Self) -> Self;
    /// `self·s`.
    #[must_use]
    fn scale(self, s: f64) -> Self;
    /// `self·s + sum`.
    #[must_use]
    fn scale_add(self, s: f64, sum: Self) -> Self;
    /// Transpose of the upper left 3×3 of three columns.
    fn transpose(columns: [Self; 3]) -> [Self; 3];
    /// The first three of `top`, then those of `bottom`, as four and two.
    fn join(top: Self, bottom: Self) -> ([f64; 4], [f64; 2]);
}

/// For any processor.
#[derive(Clone, Copy, Debug)]
pub struct Plain([f64; 4]);

impl Four for Plain {
    const FMA: bool = false;
    #[inline(always)]
    fn new(x: [f64; 4]) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn get(self) -> [f64; 4] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
    #[inline(always)]
    fn scale(self, s: f64) -> Self {
        Self(self.0.map(|x| x * s))
    }
    #[inline(always)]
    fn scale_add(self, s: f64, sum: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * s + sum.0[i]))
    }
    #[inline(always)]
    fn transpose([a, b, c]: [Self; 3]) -> [Self; 3] {
        std::array::from_fn(|i| Self([a.0[i], b.0[i], c.0[i], 0.0]))
    }
    #[inline(always)]
    fn join(Self([a, b, c, _]): Self, Self([d, e, f, _]): Self) -> ([f64; 4], [f64; 2]) {
        ([a, b, c, d], [e, f])
    }
}

/// For AVX2 and FMA. Only [`dispatch`] names it, after it has asked the processor for both features.
#[cfg(target_arch = "x86_64")]
mod avx {
    use super::Four;
    use std::arch::x86_64::*;

    #[derive(Clone, Copy, Debug)]
    pub(super) struct Avx(__m256d);

    // SAFETY (of every block here): the processor has AVX2 and FMA, see the type.
    impl Four for Avx {
        const FMA: bool = true;
        #[inline(always)]
        fn new([x, y, z, w]: [f64; 4]) -> Self {
            Self(unsafe { _mm256_setr_pd(x, y, z, w) })
        }
        #[inline(always)]
        fn get(self) -> [f64; 4] {
            let mut out = [0.0; 4];
            unsafe { _mm256_storeu_pd(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Self(unsafe { _mm256_add_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn scale(self, s: f64) -> Self {
            Self(unsafe { _mm256_mul_pd(self.0, _mm256_set1_pd(s)) })
        }
        #[inline(always)]
        fn scale_add(self, s: f64, sum: Self) -> Self {
            Self(unsafe { _mm256_fmadd_pd(self.0, _mm256_set1_pd(s), sum.0) })
        }
        #[inline(always)]
        fn transpose([a, b, c]: [Self; 3]) -> [Self; 3] {
            unsafe {
                let zero = _mm256_setzero_pd();
                let (low, high) = (_mm256_unpacklo_pd(a.0, b.0), _mm256_unpackhi_pd(a.0, b.0));
                let (c_low, c_high) = (_mm256_unpacklo_pd(c.0, zero), _mm256_unpackhi_pd(c.0, zero));
                [
                    Self(_mm256_permute2f128_pd::<0x20>(low, c_low)),
                    Self(_mm256_permute2f128_pd::<0x20>(high, c_high)),
                    Self(_mm256_permute2f128_pd::<0x31>(low, c_low)),
                ]
            }
        }
        #[inline(always)]
        fn join(top: Self, bottom: Self) -> ([f64; 4], [f64; 2]) {
            let mut rest = [0.0; 2];
            unsafe {
                let turned = _mm256_permute4x64_pd::<0b00_00_10_01>(bottom.0);
                _mm_storeu_pd(rest.as_mut_ptr(), _mm256_castpd256_pd128(turned));
                (Self(_mm256_blend_pd::<0b1000>(top.0, turned)).get(), rest)
            }
        }
    }
}
#[cfg(target_arch = "x86_64")]
use avx::Avx;

/// True when this processor runs the AVX2/FMA builds.
#[inline]
fn has_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}

/// Code to be compiled for every register type. `run` and all it calls should be `#[inline(always)]`, or parts are
/// compiled without the vector instructions.
pub trait Kernel {
    /// The result.
    type Output;
    /// The code.
    fn run<V: Four>(self) -> Self::Output;
}

/// Runs the build of a kernel for this processor. Results may differ in the last bits between processors with and
/// without fused multiply-add.
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn fast<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<Avx>()
        }
        if has_fma() {
            // SAFETY: the processor has both features.
            return unsafe { fast(kernel) };
        }
    }
    kernel.run::<Plain>()
}
