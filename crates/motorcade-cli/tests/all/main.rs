//! Tests of the command line. One program: it links once.

mod ablate;
mod bad_input;
mod batch;
mod calibrate;
mod common;
mod draw;
mod evaluate;
mod export;
mod full_disk;
mod graph;
mod help;
mod hostile;
mod interrupts;
mod lenses;
mod live;
mod map;
mod networks;
mod outputs;
mod perception;
mod resume;
mod resume_state;
mod run;
mod simulate;
mod special_files;
mod tables;
