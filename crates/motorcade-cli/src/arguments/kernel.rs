//! Robust kernels on the command line.

use std::str::FromStr;

use motorcade_geometry::robust::{RobustKernel, UnknownKernel};
use serde::{Serialize, Serializer};

/// A kernel and its scale \[standard deviations\], written `cauchy:3.5`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KernelChoice {
    /// Of every edge.
    Fixed(RobustKernel),
    /// `gnc:c`: Geman–McClure by graduated non-convexity.
    Graduated(f64),
}

impl KernelChoice {
    /// The kernel of every edge.
    pub fn kernel(self) -> RobustKernel {
        match self {
            Self::Fixed(kernel) => kernel,
            Self::Graduated(c) => RobustKernel::GemanMcClure(c),
        }
    }
}

impl FromStr for KernelChoice {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let kernel =
            |s: &str| s.parse::<RobustKernel>().map_err(|e: UnknownKernel| format!("option robust: {e}"));
        if s == "gnc" || s.starts_with("gnc:") {
            return match kernel(&s.replacen("gnc", "gm", 1))? {
                RobustKernel::GemanMcClure(c) => Ok(Self::Graduated(c)),
                other => Ok(Self::Fixed(other)),
            };
        }
        kernel(s).map(Self::Fixed).map_err(|e| e.replace("dcs, tukey", "dcs, tukey, gnc"))
    }
}

impl Serialize for KernelChoice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(kernel) => serializer.collect_str(kernel),
            Self::Graduated(c) => serializer.collect_str(&format_args!("gnc:{c}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_have_names() {
        for name in ["huber:2", "cauchy:3.5", "geman-mcclure:1", "dcs:12", "gnc:3.55"] {
            let kernel: KernelChoice = name.parse().unwrap();
            assert_eq!(serde_json::to_string(&kernel).unwrap(), format!("{name:?}"));
        }
        for wrong in ["cauchy:-1", "cauchy:x", "square:1", "huber:nan", "gnc:0"] {
            assert!(wrong.parse::<KernelChoice>().unwrap_err().contains("robust"));
        }
    }
}
