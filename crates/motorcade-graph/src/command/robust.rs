//! Robust kernels by name.

use std::str::FromStr;

use serde::Serialize;

use crate::GraphError;
use crate::g2o::KernelSource;
use crate::robust::{Cauchy, Dcs, GemanMcClure, Gnc, Huber, Kernel};

/// A kernel and its scale in whitened units, written `cauchy:3.5`.
#[derive(Clone, Debug)]
pub enum RobustKernel {
    /// `huber:c`
    Huber(Huber),
    /// `cauchy:c`
    Cauchy(Cauchy),
    /// `geman-mcclure:c` or `gm:c`
    GemanMcClure(GemanMcClure),
    /// `dcs:phi`
    Dcs(Dcs),
    /// `gnc:c`: graduated non-convexity
    Gnc(Gnc),
}

impl FromStr for RobustKernel {
    type Err = GraphError;
    fn from_str(s: &str) -> Result<Self, GraphError> {
        let wrong = |reason: String| GraphError::Option { name: "robust", reason };
        let (name, scale) = s.split_once(':').unwrap_or((s, "1"));
        let c: f64 = scale.parse().map_err(|_| wrong(format!("{scale:?} is not a number")))?;
        if !(c.is_finite() && c > 0.0) {
            return Err(wrong(format!("the scale {c} must be positive")));
        }
        match name {
            "huber" => Ok(Self::Huber(Huber { c })),
            "cauchy" => Ok(Self::Cauchy(Cauchy { c })),
            "geman-mcclure" | "gm" => Ok(Self::GemanMcClure(GemanMcClure { c })),
            "dcs" => Ok(Self::Dcs(Dcs { phi: c })),
            "gnc" => Ok(Self::Gnc(Gnc::new(c))),
            _ => Err(wrong(format!("{name:?} is none of huber, cauchy, geman-mcclure, dcs, gnc"))),
        }
    }
}

impl KernelSource for RobustKernel {
    fn kernel(&self) -> Box<dyn Kernel> {
        match self {
            Self::Huber(k) => Box::new(*k),
            Self::Cauchy(k) => Box::new(*k),
            Self::GemanMcClure(k) => Box::new(*k),
            Self::Dcs(k) => Box::new(*k),
            Self::Gnc(k) => Box::new(k.clone()),
        }
    }
}

impl Serialize for RobustKernel {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&match self {
            Self::Huber(k) => format!("huber:{}", k.c),
            Self::Cauchy(k) => format!("cauchy:{}", k.c),
            Self::GemanMcClure(k) => format!("geman-mcclure:{}", k.c),
            Self::Dcs(k) => format!("dcs:{}", k.phi),
            Self::Gnc(k) => format!("gnc:{}", k.c),
        })
    }
}
