//! `motorcade ablate` on a drive rendered on the spot.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;

use crate::common::places::{Fifo, Link};
use crate::common::{answer, no_leftovers};

const FRAMES: &str = "simulate --scenario demo --frames 12 --width 320 --out drive --progress none";

#[test]
fn tables_are_written_through_links_and_into_streams() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    answer(folder.path(), FRAMES).expect(0, &[]);
    fs::create_dir(at("tables")).unwrap();
    let (table, csv) = (Link::new(at("tables/ablation.md")), Fifo::new(at("tables/ablation.csv")));
    let drive = "drive/training --sequence 0000 --kitti drive/training --progress none";
    let ablate = |out: &str| answer(folder.path(), &format!("ablate graph {drive} --out {out}"));
    let said = ablate("tables");
    assert_eq!(said.expect(0, &[]).stdout, table.text());
    let csv = csv.text();
    assert!(csv.starts_with("variant,vehicle,ate_first_pose_m,"), "{csv}");
    // Without vehicles a row for every variant in both, the first of which changes nothing.
    let (rows, variants) = (csv.lines().skip(1), table.text().lines().count() - 2);
    assert!(rows.clone().count() == variants && variants > 10, "{csv}");
    assert!(rows.clone().next().unwrap().starts_with("default,,0."), "{csv}");
    // Plain files have the same content.
    ablate("plain").expect(0, &[]);
    assert_eq!(fs::read_to_string(at("plain/ablation.csv")).unwrap(), csv);
    assert_eq!(fs::read_to_string(at("plain/ablation.md")).unwrap(), table.text());
    // Nobody reads any more.
    ablate("tables").expect(5, &["tables/ablation.csv", "no process reads"]);
    no_leftovers(&at("tables"));
}
