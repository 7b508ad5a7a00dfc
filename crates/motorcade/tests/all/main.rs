//! Tests of estimation from frames to results. One program: it links once.

mod common;
mod distances;
mod faults;
mod height;
mod hour;
mod long_drives;
mod online;
mod resumed_state;
mod stopped;
mod turned;
mod unknown_unit;
