//! wip
#![allow(missing_docs)]
pub mod bundle;
pub mod corners;
pub mod klt;
pub mod landmark;
pub mod odometry;
pub mod pose_only;
pub mod pyramid;
pub mod road;
pub mod static_mask;
pub mod window;
