//! Runs that are killed and go on with their state: frames before it are not taken again.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::common::{Answer, drive, frame_file, json, no_leftovers};
use crate::resume::{BESIDE, RUN, answer, command, same};

const NO_NETWORKS: &str = "run frames --calibration camera.toml --height 1.5 --progress none --models none --set run.checkpoint_s=0";
const SAVED: &str = "goes on after ";

/// Place of the state: in the directory of the results where that is there, else beside it.
fn state_file(folder: &Path) -> PathBuf {
    let checkpoint = if folder.join("out").exists() { "out/.motorcade-checkpoint" } else { BESIDE };
    folder.join(format!("{checkpoint}.state/state"))
}

/// Kills a run once its state was written so many times.
fn killed(folder: &Path, arguments: &str, writes: usize) {
    let mut child = command(folder, arguments).spawn().unwrap();
    let (mut seen, mut last) = (0, None);
    while seen < writes {
        assert!(child.try_wait().unwrap().is_none(), "ended before its state was written {writes} times");
        // A state that is renamed over the one before is another file.
        let found = fs::metadata(state_file(folder)).ok().map(|m| std::os::unix::fs::MetadataExt::ino(&m));
        if found.is_some() && found != last {
            (seen, last) = (seen + 1, found);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!folder.join("out/run.json").exists());
}

/// Frames that a resumed run did not take again.
fn saved(output: &Answer) -> usize {
    let from = output.stderr.lines().find_map(|line| line.split_once(SAVED)).unwrap().1;
    from.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn a_killed_run_goes_on_with_its_state_to_the_same_bytes() {
    let folder = drive(30);
    let folder = folder.path();
    answer(folder, &format!("{NO_NETWORKS} --out whole")).expect(0, &[]);
    let run = format!("{NO_NETWORKS} --out out");
    for (writes, threads) in [(1, 1), (9, 2), (16, 1)] {
        killed(folder, &format!("{run} --threads {threads}"), writes);
        // A picture before the state is another one now, of the same size: nobody reads it.
        let picture = frame_file(&folder.join("frames"), 1);
        let kept = fs::read(&picture).unwrap();
        let output = if writes > 2 {
            fs::write(&picture, vec![0; kept.len()]).unwrap();
            answer(folder, &format!("{run} --resume"))
        } else {
            answer(folder, &format!("{run} --resume"))
        };
        fs::write(&picture, kept).unwrap();
        output.expect(0, &[SAVED]);
        assert!(saved(&output) >= writes, "{}", output.stderr);
        same(folder, "whole", "out");
        assert!(!folder.join(BESIDE).exists() && !state_file(folder).exists());
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
    // Killed twice, into a directory that is there.
    fs::create_dir(folder.join("out")).unwrap();
    killed(folder, &run, 4);
    killed(folder, &format!("{run} --resume"), 6);
    let output = answer(folder, &format!("{run} --resume"));
    assert!(saved(output.expect(0, &[SAVED])) >= 9, "{}", output.stderr);
    same(folder, "whole", "out");
    no_leftovers(folder);
    no_leftovers(&folder.join("out"));
}

/// Line of each frame of an online run.
fn lines(output: &str) -> Vec<&str> {
    output.lines().filter(|line| line.contains("\"camera\"")).collect()
}

#[test]
fn a_killed_online_run_goes_on_with_the_lines_of_the_frames_after_its_state() {
    let folder = drive(30);
    let folder = folder.path();
    let run = format!("{NO_NETWORKS} --online --out");
    let whole = answer(folder, &format!("{run} whole"));
    whole.expect(0, &[]);
    for (writes, threads) in [(2, 2), (12, 1)] {
        killed(folder, &format!("{run} out --threads {threads}"), writes);
        let output = answer(folder, &format!("{run} out --resume"));
        output.expect(0, &[SAVED]);
        assert_eq!(lines(&output.stdout), lines(&whole.stdout)[saved(&output)..]);
        same(folder, "whole", "out");
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
    no_leftovers(folder);
}

/// Vehicles of each frame are on the disk as soon as they are estimated; a killed run leaves them, a resumed one goes on with them.
#[test]
fn the_table_of_vehicles_grows_while_an_online_run_goes_on() {
    let folder = drive(30);
    let folder = folder.path();
    // A car that keeps 12 m ahead on the left.
    let boxes = (0..30).map(|k| format!("{k},149,105,201,153.8,0.9\n")).collect::<String>();
    fs::write(folder.join("boxes.csv"), boxes).unwrap();
    let run = format!("{NO_NETWORKS} --detections boxes.csv --online --out");
    answer(folder, &format!("{run} whole")).expect(0, &[]);
    no_leftovers(folder);
    let tracks = fs::read_to_string(folder.join("whole/tracks.csv")).unwrap();
    assert!(tracks.lines().count() > 20, "{tracks}");
    let growing = folder.join(".out.motorcade-tracks.csv");
    // Poses and speeds; sizes are those known in that frame.
    let state = |row: &str| {
        row.split(',')
            .enumerate()
            .filter(|(k, _)| !(11..=13).contains(k))
            .take(14)
            .map(|c| c.1.to_owned())
            .collect::<Vec<_>>()
    };
    let rows = |text: &str| text.lines().map(state).collect::<Vec<_>>();
    for begun in [12, 4] {
        killed(folder, &format!("{run} out"), begun);
        let text = fs::read_to_string(&growing).unwrap();
        assert!(text.lines().count() >= begun - 2, "{text}");
        let whole = &text[..=text.rfind('\n').unwrap()];
        assert!(rows(&tracks).starts_with(&rows(whole)), "{whole}\n{tracks}");
        // Killed again with the state of a later frame, and a row that was cut off.
        killed(folder, &format!("{run} out --resume"), begun);
        let text = fs::read(&growing).unwrap();
        fs::write(&growing, &text[..text.len() - 9]).unwrap();
        answer(folder, &format!("{run} out --resume")).expect(0, &[SAVED]);
        same(folder, "whole", "out");
        assert!(!growing.exists());
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
    // Started anew without --resume: the rows of the killed run are kept.
    killed(folder, &format!("{run} out"), 12);
    let text = fs::read(&growing).unwrap();
    answer(folder, &format!("{run} out")).expect(0, &[".out.motorcade-tracks.1.csv"]);
    assert_eq!(fs::read(folder.join(".out.motorcade-tracks.1.csv")).unwrap(), text);
    assert!(!growing.exists());
    // Nor does a run replace the table that another one is writing.
    fs::remove_dir_all(folder.join("out")).unwrap();
    fs::write(&growing, b"").unwrap();
    let other = fs::File::open(&growing).unwrap();
    other.lock().unwrap();
    answer(folder, &format!("{run} out")).expect(0, &["is written by another run"]);
    assert_eq!(fs::read(&growing).unwrap(), b"");
    drop(other);
    fs::remove_file(&growing).unwrap();
    // In a directory that is there, and over results.
    answer(folder, &format!("{run} out --force")).expect(0, &[]);
    no_leftovers(&folder.join("out"));
    // Something else of that name stays as it is.
    fs::remove_dir_all(folder.join("out")).unwrap();
    std::os::unix::fs::symlink("boxes.csv", &growing).unwrap();
    answer(folder, &format!("{run} out")).expect(0, &["no regular file"]);
    assert!(fs::symlink_metadata(&growing).unwrap().is_symlink());
    assert!(fs::read_to_string(folder.join("boxes.csv")).unwrap().starts_with("0,149"));
}

#[test]
fn a_killed_run_beside_a_trajectory_goes_on_with_its_state() {
    let folder = drive(20);
    let folder = folder.path();
    answer(folder, &format!("{NO_NETWORKS} --out first")).expect(0, &[]);
    for mode in ["", "--online "] {
        let run = format!("{NO_NETWORKS} {mode}--trajectory first/ego.kitti.txt --out");
        answer(folder, &format!("{run} whole --force")).expect(0, &[]);
        killed(folder, &format!("{run} out"), 8);
        let output = answer(folder, &format!("{run} out --resume"));
        assert!(saved(output.expect(0, &[SAVED])) >= 7, "{}", output.stderr);
        same(folder, "whole", "out");
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
}

/// Networks too: keypoints are looked for every few frames, and all output is kept.
#[test]
fn what_detectors_remember_and_what_is_kept_of_them_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    answer(folder, "simulate --scenario demo --frames 16 --width 400 --out drive --progress none")
        .expect(0, &[]);
    let run =
        "run drive/training --sequence 0000 --keep-perception --progress none --set run.checkpoint_s=0 --out";
    answer(folder, &format!("{run} whole")).expect(0, &[]);
    for writes in [2, 8] {
        killed(folder, &format!("{run} out"), writes);
        let output = answer(folder, &format!("{run} out --resume"));
        output.expect(0, &[SAVED, "frames came from the checkpoint"]);
        same(folder, "whole", "out");
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
    // Without the lines of its frames a state is of no use.
    killed(folder, &format!("{run} out"), 8);
    let text = fs::read_to_string(folder.join(BESIDE)).unwrap();
    let some: Vec<&str> = text.lines().take(4).collect();
    fs::write(folder.join(BESIDE), some.join("\n") + "\n").unwrap();
    answer(folder, &format!("{run} out --resume")).expect(0, &["is not used", "does not hold all frames"]);
    same(folder, "whole", "out");
}

#[test]
fn states_that_cannot_be_used_are_said_and_the_run_starts_at_the_first_frame() {
    let folder = drive(14);
    let folder = folder.path();
    answer(folder, &format!("{NO_NETWORKS} --out whole")).expect(0, &[]);
    let run = format!("{NO_NETWORKS} --out out");
    let tried = |change: &dyn Fn(Vec<u8>) -> Vec<u8>, words: &str| {
        killed(folder, &run, 6);
        let state = fs::read(state_file(folder)).unwrap();
        fs::write(state_file(folder), change(state)).unwrap();
        let output = answer(folder, &format!("{run} --resume"));
        output.expect(0, &["is not used", words, "from the first frame"]);
        assert!(!output.stderr.contains(SAVED), "{}", output.stderr);
        same(folder, "whole", "out");
        fs::remove_dir_all(folder.join("out")).unwrap();
        assert!(!state_file(folder).exists());
    };
    tried(
        &|mut state| {
            let middle = state.len() / 2;
            state[middle] ^= 1;
            state
        },
        "damaged",
    );
    tried(&|state| state[..state.len() - 100].to_vec(), "damaged");
    tried(
        &|mut state| {
            state[16] += 1;
            state
        },
        "another version",
    );
    killed(folder, &format!("{run} --set run.seed=7"), 6);
    let foreign = fs::read(state_file(folder)).unwrap();
    tried(&|_| foreign.clone(), "another run");
    // A copy of the program has another time, as another build has.
    killed(folder, &run, 6);
    let copy = folder.join("program");
    fs::copy(env!("CARGO_BIN_EXE_motorcade"), &copy).unwrap();
    let mut other = Command::new(&copy);
    other
        .args(format!("{run} --resume").split_whitespace())
        .current_dir(folder)
        .env_remove("MOTORCADE_MODELS");
    let output: Answer = other.output().unwrap().into();
    output.expect(0, &["is not used", "another build", "from the first frame"]);
    same(folder, "whole", "out");
    fs::remove_dir_all(folder.join("out")).unwrap();
    // The last picture before the state is another one of the same size.
    killed(folder, &run, 6);
    let state = fs::read(state_file(folder)).unwrap();
    for number in 0..14 {
        let picture = frame_file(&folder.join("frames"), number);
        let mut bytes = fs::read(&picture).unwrap();
        let (first, end) = (bytes.len() / 3, bytes.len() - 20);
        bytes[first..end].fill(0);
        if number > 0 {
            fs::write(&picture, bytes).unwrap();
        }
    }
    answer(folder, &format!("{run} --resume"))
        .expect(3, &["is not the picture that the stopped run had there"]);
    assert_eq!(fs::read(state_file(folder)).unwrap(), state);
}

#[test]
fn a_run_that_ctrl_c_stopped_goes_on_with_its_state() {
    let folder = drive(40);
    let folder = folder.path();
    answer(folder, &format!("{RUN} --out whole")).expect(0, &[]);
    let mut child = command(folder, &format!("{RUN} --out out --threads 1")).spawn().unwrap();
    while fs::read_to_string(folder.join(BESIDE)).unwrap_or_default().lines().count() < 6 {
        std::thread::sleep(Duration::from_millis(5));
    }
    // The time to write it of its own accord has not come.
    assert!(!state_file(folder).exists());
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    child.wait().unwrap();
    assert_eq!(json(&folder.join("out/run.json"))["interrupted"], true);
    let output = answer(folder, &format!("{RUN} --out out --resume"));
    output.expect(0, &[SAVED]);
    assert!(saved(&output) >= 4, "{}", output.stderr);
    same(folder, "whole", "out");
    no_leftovers(folder);
}

/// Frames that come ten a second, on a machine of any speed.
#[test]
fn a_state_is_written_when_it_is_due_and_not_before() {
    use std::os::unix::fs::PermissionsExt;
    let folder = drive(1);
    let folder = folder.path();
    let settings = answer(folder, "config");
    assert!(settings.expect(0, &[]).stdout.contains("\ncheckpoint_s = 60.0\n"), "{}", settings.stdout);
    fs::write(folder.join("drive.mp4"), "no video").unwrap();
    let version = "[ \"$1\" = -version ] && { echo ffmpeg version 7.0; exit; }";
    let frame = "sleep 0.1; printf 'P6\\n480 240\\n255\\n'; head -c 345600 /dev/zero\n";
    for (name, script) in [
        ("ffprobe", "echo avg_frame_rate=10/1; echo nb_read_packets=60".to_owned()),
        ("ffmpeg", format!("{version}\n{}", frame.repeat(60))),
    ] {
        fs::write(folder.join(name), format!("#!/bin/sh\n{script}")).unwrap();
        fs::set_permissions(folder.join(name), fs::Permissions::from_mode(0o755)).unwrap();
    }
    let run = NO_NETWORKS.replace("frames", "drive.mp4").replace("checkpoint_s=0", "checkpoint_s=1");
    let mut command = command(folder, &format!("{run} --set run.fixed_regions=false --out out"));
    command.env("PATH", format!("{}:{}", folder.display(), std::env::var("PATH").unwrap()));
    let start = std::time::Instant::now();
    let mut child = command.spawn().unwrap();
    while !state_file(folder).exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended without a state");
        std::thread::sleep(Duration::from_millis(2));
    }
    let time = start.elapsed();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(time >= Duration::from_secs(1), "written after {time:?}");
}
