//! Exponential, logarithm, adjoint and Jacobians of SO(3), SE(3) and Sim(3).
//!
//! Tangents are `[ω, ν]` (SE(3)) and `[ω, ν, λ]` (Sim(3), λ = log of the scale), perturbations act on the right.

pub mod se3;
pub mod sim3;
pub mod so3;
