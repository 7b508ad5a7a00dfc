//! Shared by several tests.

#![allow(dead_code, unused_imports, reason = "every test and benchmark uses a part of this")]

mod street;

pub use street::{CAMERA, HEIGHT_M, Place, depth, street};
