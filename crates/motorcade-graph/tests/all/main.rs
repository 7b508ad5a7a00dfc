//! Tests of the graph. One program: it links once.

mod common;
mod custom;
mod files;
mod graduated;
mod jacobians;
mod marginals;
mod properties;
mod shared_graphs;
