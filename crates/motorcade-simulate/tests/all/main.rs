//! Tests on rendered drives. One program: it links once.

mod alignment;
mod common;
mod folder;
mod measurements;
mod own_networks;
mod pictures;
mod places;
mod scenarios;
mod steady;
