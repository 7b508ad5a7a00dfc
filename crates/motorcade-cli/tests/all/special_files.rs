//! FIFOs, sockets and devices in the place of files: refused at once, by name.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;

use crate::common::cost::cost;
use crate::common::places::make_fifo;
use crate::common::{answer, no_leftovers};
use tempfile::TempDir;

const RUN: &str = "run drive/training --sequence 0000 --progress none --out out";

/// A drive and a run on it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let render = "simulate --scenario demo --frames 6 --width 320 --out drive --progress none";
    answer(folder.path(), render).expect(0, &[]);
    answer(folder.path(), &RUN.replace("--out out", "--out done")).expect(0, &[]);
    folder
}

#[test]
fn special_files_are_no_inputs_of_any_command() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    make_fifo(&at("fifo.csv"));
    let _socket = UnixListener::bind(at("socket.csv")).unwrap();
    symlink("/dev/zero", at("device.csv")).unwrap();
    for (special, kind) in
        [("fifo.csv", "a FIFO"), ("socket.csv", "a socket"), ("device.csv", "a character device")]
    {
        // Opened as files: the kind is said.
        for command in [
            format!("{RUN} --perception {special}"),
            format!("{RUN} --speed {special}"),
            format!("{RUN} --gps {special}"),
            format!("{RUN} --map {special}"),
            format!("draw done --calibration {special} --out pictures"),
            format!("export done --track {special} --out map"),
            format!("batch {special} --out fleet"),
            format!("calibrate {special} --out found.toml"),
            format!("ablate graph drive/training --sequence 0000 --ground-truth {special} --out table"),
            format!("map info {special}"),
            format!("map merge {special} {special} --out both.map"),
        ] {
            cost(folder.path(), &command).at_most_a_second().expect(3, &[special, kind]);
        }
        // Taken for directories.
        for command in [
            format!("evaluate {special} --kitti drive/training --sequence 0000"),
            format!("evaluate done --kitti {special}"),
            format!("draw {special} --out pictures"),
            format!("draw done {special} --out pictures"),
            format!("export {special} --out map"),
            format!("tables {special} --out tables"),
            format!("tables done {special} --out tables"),
        ] {
            cost(folder.path(), &command).at_most_a_second().expect(3, &[special]);
        }
    }
    for name in ["out", "pictures", "map", "tables", "fleet", "found.toml", "both.map", "table"] {
        assert!(!at(name).exists(), "{name}");
    }
    no_leftovers(folder.path());
}

#[test]
fn special_files_are_no_files_of_a_run() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let (draw, export, tables) =
        ("draw done --out drawn", "export done --out map", "tables done --out tables");
    let evaluate = "evaluate done --kitti drive/training --sequence 0000";
    for command in [draw, export, tables, evaluate] {
        answer(folder.path(), command).expect(0, &[]);
    }
    for (name, readers) in [
        ("run.json", &[draw, export, tables, evaluate][..]),
        ("frames.csv", &[draw, export, tables, evaluate]),
        ("ego.tum", &[draw, export, tables, evaluate]),
        ("ego_covariance.csv", &[draw, export, tables, evaluate]),
        ("speeds.csv", &[draw, export, tables]),
        ("tracks.csv", &[draw, export, tables]),
        ("ego.kitti.txt", &[evaluate]),
        ("tracks.kitti.txt", &[evaluate]),
    ] {
        let path = at("done").join(name);
        fs::rename(&path, at("kept")).unwrap();
        make_fifo(&path);
        for command in readers {
            let command = command.replace("--out ", "--out new-");
            let named = format!("done/{name}: is a FIFO");
            cost(folder.path(), &command).at_most_a_second().expect(3, &[&named]);
        }
        fs::rename(at("kept"), &path).unwrap();
    }
    for name in ["new-drawn", "new-map", "new-tables"] {
        assert!(!at(name).exists(), "{name}");
    }
    no_leftovers(folder.path());
}
