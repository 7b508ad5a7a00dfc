//! Runs that are killed and go on: the same bytes as unbroken ones.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{Answer, drive, json, no_leftovers};

pub const RUN: &str = "run frames --calibration camera.toml --height 1.5 --progress none";
pub const BESIDE: &str = ".out.motorcade-checkpoint";

/// The program with its own networks.
pub fn command(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_motorcade"));
    command.args(arguments.split_whitespace()).current_dir(folder).env_remove("MOTORCADE_MODELS");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

pub fn answer(folder: &Path, arguments: &str) -> Answer {
    command(folder, arguments).output().unwrap().into()
}

/// Kills a run as soon as its checkpoint holds this many frames.
pub fn killed(folder: &Path, arguments: &str, checkpoint: &str, frames: usize) {
    let mut child = command(folder, arguments).spawn().unwrap();
    let lines = || fs::read_to_string(folder.join(checkpoint)).unwrap_or_default().lines().count();
    while lines() < frames + 1 {
        assert!(child.try_wait().unwrap().is_none(), "ended before {frames} frames");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

/// All files of a run, without times of the clock and the command.
fn results(run: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![run.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(run).unwrap().to_string_lossy().into_owned();
            let content = match name.as_str() {
                "run.json" => {
                    let mut record = json(&path);
                    for changing in ["command", "timings"] {
                        record.as_object_mut().unwrap().remove(changing).unwrap();
                    }
                    // The report holds times: its size may differ.
                    let files = record["files"].as_array_mut().unwrap();
                    files
                        .iter_mut()
                        .filter(|f| f["name"] == "report.html")
                        .for_each(|f| f["bytes"] = 0.into());
                    record.to_string().into_bytes()
                }
                "report.html" => continue,
                _ => fs::read(&path).unwrap(),
            };
            all.insert(name, content);
        }
    }
    all
}

pub fn same(folder: &Path, one: &str, two: &str) {
    let (one, two) = (results(&folder.join(one)), results(&folder.join(two)));
    assert!(one.keys().eq(two.keys()), "{:?} {:?}", one.keys(), two.keys());
    for (name, content) in &one {
        assert!(two[name] == *content, "{name} differs");
    }
    assert!(one.len() >= 8, "{:?}", one.keys());
}

#[test]
fn a_run_that_is_killed_anywhere_goes_on_to_the_same_bytes() {
    let folder = drive(12);
    let folder = folder.path();
    answer(folder, &format!("{RUN} --keep-perception --out whole")).expect(0, &[]);
    let run = format!("{RUN} --keep-perception --out out");
    for (frames, threads) in [(0, 1), (1, 2), (5, 1), (11, 2)] {
        killed(folder, &format!("{run} --threads {threads}"), BESIDE, frames);
        assert!(!folder.join("out").exists() && folder.join(BESIDE).exists());
        let output = answer(folder, &format!("{run} --resume"));
        let from = output.stderr.lines().find_map(|line| line.strip_prefix("motorcade: perception of "));
        let taken: usize = from.map_or(0, |line| line.split(' ').next().unwrap().parse().unwrap());
        output.expect(0, &[]);
        assert!(taken >= frames, "{taken} of {frames} frames: {}", output.stderr);
        same(folder, "whole", "out");
        assert!(!folder.join(BESIDE).exists());
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
    // Killed twice, into a directory that is there; then with a line that was cut off.
    fs::create_dir(folder.join("out")).unwrap();
    let inside = "out/.motorcade-checkpoint";
    killed(folder, &run, inside, 2);
    killed(folder, &format!("{run} --resume"), inside, 6);
    let mut text = fs::read(folder.join(inside)).unwrap();
    text.truncate(text.len() - 9);
    fs::write(folder.join(inside), text).unwrap();
    answer(folder, &format!("{run} --resume")).expect(0, &["frames came from the checkpoint"]);
    same(folder, "whole", "out");
    assert!(!folder.join(inside).exists());
    no_leftovers(folder);
}

/// Vehicles whose keypoints are looked for every few frames: what the detector remembers comes back too.
#[test]
fn vehicles_and_keypoints_of_a_resumed_run_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    answer(folder, "simulate --scenario demo --frames 16 --width 400 --out drive --progress none")
        .expect(0, &[]);
    let run = "run drive/training --sequence 0000 --keep-perception --progress none --out";
    answer(folder, &format!("{run} whole")).expect(0, &[]);
    let kept = fs::read_to_string(folder.join("whole/perception.jsonl")).unwrap();
    let with = kept.lines().filter(|line| line.contains("\"points\"")).count();
    assert!((2..15).contains(&with), "{with} of 16 frames have keypoints");
    for frames in [1, 6, 9] {
        killed(folder, &format!("{run} out"), BESIDE, frames);
        answer(folder, &format!("{run} out --resume")).expect(0, &["frames came from the checkpoint"]);
        same(folder, "whole", "out");
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
}

#[test]
fn online_and_stopped_runs_go_on_too() {
    let folder = drive(10);
    let folder = folder.path();
    let run = format!("{RUN} --online --out");
    let whole = answer(folder, &format!("{run} whole"));
    whole.expect(0, &[]);
    let mut child = command(folder, &format!("{run} out --threads 1")).spawn().unwrap();
    while fs::read_to_string(folder.join(BESIDE)).unwrap_or_default().lines().count() < 4 {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    child.wait().unwrap();
    assert_eq!(json(&folder.join("out/run.json"))["interrupted"], true);
    // The results of a stopped run are replaced without --force, those of a whole one are not.
    let again = answer(folder, &format!("{run} out --resume"));
    again.expect(0, &["goes on after "]);
    // Lines of the frames that the stopped run estimated stand in its output.
    assert!(again.stdout.lines().count() < 10 && whole.stdout.ends_with(&again.stdout), "{}", again.stdout);
    same(folder, "whole", "out");
    let output = answer(folder, &format!("{run} out --resume"));
    assert!(output.expect(0, &[]).stdout.contains("already holds this run"));
    no_leftovers(folder);
}

#[test]
fn checkpoints_of_other_runs_are_refused() {
    let folder = drive(8);
    let folder = folder.path();
    let run = format!("{RUN} --out out");
    killed(folder, &run, BESIDE, 3);
    let kept = fs::read(folder.join(BESIDE)).unwrap();
    let refused = |command: &str, words: &[&str]| {
        answer(folder, command).expect(3, words);
        assert!(!folder.join("out").exists());
        assert_eq!(fs::read(folder.join(BESIDE)).unwrap(), kept);
    };
    refused(&format!("{run} --resume --set run.seed=7"), &[BESIDE, "another set of settings"]);
    refused(&format!("{run} --resume --height 1.6").replace("--height 1.5 ", ""), &["another height"]);
    refused(&format!("{run} --resume --stride 2"), &["another input"]);
    // The same number of bytes, another picture.
    let text = String::from_utf8(kept.clone()).unwrap();
    let (before, rest) = text.split_once("\"pixels\":\"").unwrap();
    let changed = format!("{before}\"pixels\":\"0000000000000000{}", &rest[16..]);
    fs::write(folder.join(BESIDE), &changed).unwrap();
    answer(folder, &format!("{run} --resume")).expect(3, &["frame 0 is not the picture"]);
    fs::write(
        folder.join(BESIDE),
        text.replacen("version of the program\",\"", "version of the program\",\"9", 1),
    )
    .unwrap();
    answer(folder, &format!("{run} --resume")).expect(3, &["another version of the program (90"]);
    // Without --resume the run starts over.
    answer(folder, &run).expect(0, &[]);
    assert!(!folder.join(BESIDE).exists());
    let output = answer(folder, &format!("{RUN} --out two --resume"));
    output.expect(0, &["no checkpoint of an earlier run"]);
}

#[test]
fn times_of_the_checkpoint_are_checked() {
    let folder = drive(3);
    let folder = folder.path();
    for (seconds, code) in [("0", 0), ("1e9", 0), ("1e300", 1), ("-1", 1), ("nan", 1)] {
        let output = answer(folder, &format!("{RUN} --out at{seconds} --set run.checkpoint_s={seconds}"));
        output.expect(code, if code == 0 { &[] } else { &["run.checkpoint_s"] });
    }
}
