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

#[test]
fn the_papers_tables_and_cues_of_vehicles_have_a_row_each_variant() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    answer(folder.path(), FRAMES).expect(0, &[]);
    let drive = "drive/training --sequence 0000 --kitti drive/training --progress none";
    let paper = answer(folder.path(), &format!("ablate paper {drive} --out paper"));
    assert_eq!(paper.expect(0, &[]).stdout, fs::read_to_string(at("paper/ablation.md")).unwrap());
    assert!(paper.stdout.contains("| baseline: relative scale by motion |"), "{}", paper.stdout);
    let csv = fs::read_to_string(at("paper/ablation.csv")).unwrap();
    assert!(csv.starts_with("table,variant,vehicle,ate_first_pose_m,"), "{csv}");
    let of_camera =
        |table: &str| csv.lines().filter(|l| l.starts_with(table) && l.split(',').nth(2) == Some("")).count();
    assert_eq!(["1,", "2,", "3,"].map(of_camera), [4, 3, 7], "{csv}");
    // Twice the same method on the same frames.
    let numbers = |row: &str| {
        let line = csv.lines().find(|l| l.starts_with(row)).unwrap();
        line.splitn(3, ',').nth(2).unwrap().to_owned()
    };
    assert_eq!(numbers("1,paper; T = 12 m,,"), numbers("3,paper,,"));

    let no_models = "--models none --compare-models missing";
    let without = answer(folder.path(), &format!("ablate vehicles {drive} {no_models} --out cues"));
    without.expect(3, &["missing"]);
    let cues = answer(folder.path(), &format!("ablate vehicles {drive} --models none --out cues"));
    let table = cues.expect(0, &[]).stdout.clone();
    assert!(table.contains("| default without keypoints | 0 | 0 | – |"), "{table}");
    assert_eq!(table.lines().count(), 2 + 20, "{table}");
}
