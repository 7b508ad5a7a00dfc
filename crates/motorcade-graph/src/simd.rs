//! The one place with `unsafe`: choosing at run time between the plain build of a kernel and the one compiled for
//! AVX2 and FMA. Kernels are written once, as safe generic functions over `const FMA: bool` or the [`Four`] numbers of
//! a register, and inlined into both.
#![allow(unsafe_code)]

use crate::dense::panel;
use crate::factors::pose_error;
use crate::sparse::{assembly, extend};

/// Four numbers side by side.
pub(crate) trait Four: Copy {
    fn new(x: [f64; 4]) -> Self;
    fn get(self) -> [f64; 4];
    fn add(self, other: Self) -> Self;
    /// `self·s`.
    fn scale(self, s: f64) -> Self;
    /// `self·s + sum`.
    fn scale_add(self, s: f64, sum: Self) -> Self;
    /// Transpose of the upper left 3×3 of three columns.
    fn transpose(columns: [Self; 3]) -> [Self; 3];
    /// The first three of `top`, then those of `bottom`, as four and two.
    fn join(top: Self, bottom: Self) -> ([f64; 4], [f64; 2]);
}

/// For any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain([f64; 4]);

impl Four for Plain {
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

/// For AVX2 and FMA. Only [`dispatch`]'s fast builds name it, so no value of it exists on other processors.
#[cfg(target_arch = "x86_64")]
mod avx {
    use super::Four;
    use std::arch::x86_64::*;

    #[derive(Clone, Copy, Debug)]
    pub(super) struct Avx(__m256d);

    // SAFETY (of every block here): the processor has AVX2 and FMA, see the type.
    impl Four for Avx {
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
pub(crate) fn has_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}

/// Declares a function that runs `$body::<$fast>` compiled for AVX2/FMA where the processor has them, else
/// `$body::<$plain>`.
macro_rules! dispatch {
    ($(#[$doc:meta])* $name:ident = $module:ident :: $body:ident<$plain:tt, $fast:tt>, ($($arg:ident: $ty:ty),*) $(-> $ret:ty)?) => {
        $(#[$doc])*
        pub(crate) fn $name($($arg: $ty),*) $(-> $ret)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,fma")]
                fn fast($($arg: $ty),*) $(-> $ret)? {
                    $module::$body::<$fast>($($arg),*)
                }
                if has_fma() {
                    // SAFETY: the processor has just been asked for both features.
                    return unsafe { fast($($arg),*) };
                }
            }
            $module::$body::<$plain>($($arg),*)
        }
    };
}

dispatch!(
    /// See [`panel::factor`].
    factor_panel = panel::factor<false, true>,
    (panel: &mut [f64], shape: panel::Shape) -> Option<panel::Pivots>
);
dispatch!(
    /// See [`panel::schur`].
    schur_complement = panel::schur<false, true>,
    (panel: &[f64], shape: panel::Shape, out: &mut [f64])
);
dispatch!(
    /// See [`panel::forward`].
    solve_forward = panel::forward<false, true>,
    (panel: &[f64], shape: panel::Shape, front: &mut [f64])
);
dispatch!(
    /// See [`panel::backward`].
    solve_backward = panel::backward<false, true>,
    (panel: &[f64], shape: panel::Shape, front: &mut [f64])
);
dispatch!(
    /// See [`extend::extend_add`].
    extend_add = extend::extend_add<Plain, Avx>,
    (schur: &[f64], ld: usize, place: extend::Place<'_>, target: &mut [f64])
);
dispatch!(
    /// See [`pose_error::normal_equations`].
    pose_normal_equations = pose_error::normal_equations<Plain, Avx>,
    (at: &pose_error::PoseError<'_>, g: &mut [f64; 12], h: &mut [f64; 144]) -> f64
);
dispatch!(
    /// See [`pose_error::squared_norm`].
    pose_squared_norm = pose_error::squared_norm<Plain, Avx>,
    (at: &pose_error::PoseError<'_>) -> f64
);
dispatch!(
    /// See [`assembly::add_pair`].
    add_pair = assembly::add_pair<Plain, Avx>,
    (matrix: &mut [f64], rhs: &mut [f64], share: (&[f64; 12], &[f64; 144]), weight: f64, slots: &assembly::PairSlots)
);
