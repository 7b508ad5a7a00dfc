//! The one place with `unsafe`: choosing at run time between the plain build of a kernel and the one compiled for
//! AVX2 and FMA. Kernels are written once, as safe generic functions over `const FMA: bool`, and inlined into both.
#![allow(unsafe_code)]

use super::panel;

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

/// Declares a function that runs `$body::<true>` compiled for AVX2/FMA where the processor has them, else
/// `$body::<false>`.
macro_rules! dispatch {
    ($(#[$doc:meta])* $name:ident = $module:ident :: $body:ident, ($($arg:ident: $ty:ty),*) $(-> $ret:ty)?) => {
        $(#[$doc])*
        pub(crate) fn $name($($arg: $ty),*) $(-> $ret)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,fma")]
                fn fast($($arg: $ty),*) $(-> $ret)? {
                    $module::$body::<true>($($arg),*)
                }
                if has_fma() {
                    // SAFETY: the processor has just been asked for both features.
                    return unsafe { fast($($arg),*) };
                }
            }
            $module::$body::<false>($($arg),*)
        }
    };
}

dispatch!(
    /// See [`panel::factor`].
    factor_panel = panel::factor,
    (panel: &mut [f64], shape: panel::Shape) -> Option<panel::Pivots>
);
dispatch!(
    /// See [`panel::schur`].
    schur_complement = panel::schur,
    (panel: &[f64], shape: panel::Shape, out: &mut [f64])
);
dispatch!(
    /// See [`panel::forward`].
    solve_forward = panel::forward,
    (panel: &[f64], shape: panel::Shape, x: &mut [f64], below: &mut [f64])
);
dispatch!(
    /// See [`panel::backward`].
    solve_backward = panel::backward,
    (panel: &[f64], shape: panel::Shape, x: &mut [f64], below: &[f64])
);
