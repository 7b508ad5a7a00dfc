//! Ctrl-C: every wait ends with the first one, and what there is stays.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use motorcade_testing::onnx;

use crate::common::{Answer, answer, drive, json, no_leftovers, nothing_written, program};

/// Time that a program has to end in, with other work on the machine.
const SOON: Duration = Duration::from_secs(20);

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

/// A program that waits, as of now.
fn started(folder: &Path, arguments: &str) -> Child {
    let mut command = Command::new(program(folder, "").get_program());
    command.args(arguments.split(' ')).current_dir(folder).env("MOTORCADE_MODELS", "none");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Interrupts a program that waits for somebody else; its code and what it says.
fn ended(mut child: Child) -> (Option<i32>, String) {
    interrupt(&child);
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > SOON {
            child.kill().unwrap();
            panic!("goes on after Ctrl-C");
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    (status.code(), said)
}

/// Programs in front of those of the system.
fn scripts(folder: &Path, scripts: &[(&str, &str)]) -> String {
    for (name, script) in scripts {
        fs::write(folder.join(name), script).unwrap();
        fs::set_permissions(folder.join(name), fs::Permissions::from_mode(0o755)).unwrap();
    }
    format!("{}:{}", folder.display(), std::env::var("PATH").unwrap())
}

/// Sends SIGINT as soon as the program says `said` on stderr; its answer and the time it took to end.
fn interrupted(folder: &Path, arguments: &str, said: &str) -> (Answer, Duration) {
    interrupted_with(folder, arguments, said, &[])
}

fn interrupted_with(
    folder: &Path,
    arguments: &str,
    said: &str,
    environment: &[(&str, &str)],
) -> (Answer, Duration) {
    let mut command = Command::new(program(folder, "").get_program());
    command.args(arguments.split(' ')).current_dir(folder).env("MOTORCADE_MODELS", "none");
    command.envs(environment.iter().copied());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut text = String::new();
    while !text.contains(said) {
        assert!(stderr.read_line(&mut text).unwrap() > 0, "ended before `{said}`: {text}");
    }
    let start = Instant::now();
    interrupt(&child);
    stderr.read_to_string(&mut text).unwrap();
    let output = child.wait_with_output().unwrap();
    let output = Answer {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: text,
    };
    (output, start.elapsed())
}

#[test]
fn simulate_and_demo_obey_the_first_interrupt() {
    let folder = tempfile::tempdir().unwrap();
    for command in [
        "simulate --scenario demo --frames 3000 --out out --progress json",
        "simulate --training vehicle --count 100000 --out out --progress json",
        "demo --frames 3000 --out out --progress json",
    ] {
        let (output, time) = interrupted(folder.path(), command, "rendering");
        output.expect(130, &["nothing was written"]);
        assert!(time < Duration::from_secs(60), "{command}: {time:?}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{command}");
    }
}

#[test]
fn an_interrupted_run_says_which_frames_it_has() {
    let folder = drive(60);
    let command = "run frames --calibration camera.toml --height 1.5 --out out --progress json --threads 2";
    let (output, _) = interrupted(folder.path(), command, "\"done\":5");
    output.expect(130, &["interrupted"]);
    let record = json(&folder.path().join("out/run.json"));
    let done = record["counters"]["frames"].as_u64().unwrap();
    assert!(record["interrupted"] == true && done >= 5, "{record}");
    if done < 60 {
        let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
        let said = format!("{done} of 60 frames, numbers 0 to {}", done - 1);
        assert!(output.stderr.contains(&said) && page.contains(&said), "{said}: {}", output.stderr);
    }
    no_leftovers(folder.path());
}

/// A video program that hands out three frames and then nothing more.
#[test]
fn a_run_that_waits_for_frames_obeys_the_first_interrupt() {
    for threads in [1, 2] {
        let folder = drive(1);
        let at = |name: &str| folder.path().join(name);
        fs::write(at("drive.mp4"), "no video").unwrap();
        let ffprobe = "#!/bin/sh\necho avg_frame_rate=10/1\necho nb_read_packets=50\n";
        let frame = "printf 'P6\\n480 240\\n255\\n'; head -c 345600 /dev/zero; ";
        // The reader looks at the version first; `exec` leaves no child of the shell behind.
        let version = "[ \"$1\" = -version ] && { echo ffmpeg version 7.0; exit; }";
        let ffmpeg = format!("#!/bin/sh\n{version}\n{}exec sleep 30\n", frame.repeat(3));
        let path = scripts(folder.path(), &[("ffprobe", ffprobe), ("ffmpeg", &ffmpeg)]);
        let command = format!(
            "run drive.mp4 --calibration camera.toml --height 1.5 --out out --progress json --threads {threads} --set run.fixed_regions=false"
        );
        let (output, time) = interrupted_with(folder.path(), &command, "\"done\":3", &[("PATH", &path)]);
        output.expect(130, &["3 of 50 frames, numbers 0 to 2"]);
        assert!(time < Duration::from_secs(20), "{threads} threads: {time:?}");
    }
}

#[test]
fn a_run_whose_estimates_nobody_reads_writes_its_results() {
    let folder = drive(300);
    let run = "run frames --calibration camera.toml --height 1.5 --out out --online --progress json";
    let mut child = started(folder.path(), run);
    let text = Arc::new(Mutex::new(String::new()));
    let (mut said, told) = (BufReader::new(child.stderr.take().unwrap()), Arc::clone(&text));
    let reader = std::thread::spawn(move || {
        let mut line = String::new();
        while said.read_line(&mut line).unwrap() > 0 {
            told.lock().unwrap().push_str(&std::mem::take(&mut line));
        }
    });
    // More lines than the pipe and the queue before it hold: it waits for its reader.
    let frames = || text.lock().unwrap().matches("\"done\"").count();
    let (mut before, mut since, start) = (0, Instant::now(), Instant::now());
    while (before == 0 || since.elapsed() < Duration::from_secs(2)) && start.elapsed() < 3 * SOON {
        std::thread::sleep(Duration::from_millis(20));
        if frames() > before {
            (before, since) = (frames(), Instant::now());
        }
    }
    assert!(before < 290 && child.try_wait().unwrap().is_none(), "{before}");
    interrupt(&child);
    let start = Instant::now();
    reader.join().unwrap();
    let text = text.lock().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(5), "{text}");
    assert!(start.elapsed() < SOON && text.contains("stdout: the last lines were not read"), "{text}");
    let frames = json(&folder.path().join("out/run.json"))["counters"]["frames"].as_u64().unwrap();
    assert!(frames as usize >= before, "{frames} of {before}");
}

/// A pipe that was opened and is not read.
#[test]
fn a_file_that_nobody_reads_is_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let poses = 1500;
    let mut graph = String::new();
    for k in 0..poses {
        graph += &format!("VERTEX_SE3:QUAT {k} {k} 0 0 0 0 0 1\n");
    }
    let information = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";
    for k in 1..poses {
        graph += &format!("EDGE_SE3:QUAT {} {k} 1 0 0 0 0 0 1 {information}\n", k - 1);
    }
    fs::write(folder.path().join("chain.g2o"), graph).unwrap();
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
    let (sender, opened) = std::sync::mpsc::channel();
    let pipe = folder.path().join("pipe");
    std::thread::spawn(move || sender.send(fs::File::open(pipe)));
    let child = started(folder.path(), "graph optimise chain.g2o --out pipe");
    let reader = opened.recv_timeout(SOON).unwrap().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    let (code, said) = ended(child);
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("did not read"), "{said}");
    drop(reader);
}

#[test]
fn an_encoder_that_takes_no_frames_is_not_waited_for() {
    let folder = drive(12);
    let run = "run frames --calibration camera.toml --height 1.5 --out out --progress none";
    answer(folder.path(), run).expect(0, &[]);
    let ffmpeg = "#!/bin/sh\n[ \"$2\" = -encoders ] && { echo libx264; exit; }\ntouch begun\nexec sleep 60\n";
    let path = scripts(folder.path(), &[("ffmpeg", ffmpeg)]);
    let mut command = Command::new(program(folder.path(), "").get_program());
    command.args(["draw", "out", "frames", "--out", "drawn.mp4", "--progress", "none"]);
    command.current_dir(folder.path()).env("PATH", path).stdout(Stdio::null()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    let start = Instant::now();
    while !folder.path().join("begun").exists() && start.elapsed() < SOON {
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(500));
    let (code, said) = ended(child);
    assert_eq!(code, Some(130), "{said}");
    assert!(!folder.path().join("drawn.mp4").exists());
}

/// The trial of a network goes on for a long time in a process of its own.
#[test]
fn the_trial_of_networks_obeys_the_first_interrupt() {
    let folder = drive(3);
    let models = folder.path().join("models");
    fs::create_dir(&models).unwrap();
    fs::write(models.join("tiny.onnx"), onnx::tiled(&[1, 1, 480, 480])).unwrap();
    let manifest = "[[model]]\nname = \"tiny\"\nfile = \"tiny.onnx\"\nlicence = \"MIT\"\n\
         input = { colour = \"rgb\", resize = \"stretch\" }\noutput = { kind = \"segmentation\", road = [0] }\n";
    fs::write(models.join("models.toml"), manifest).unwrap();
    let child = started(
        folder.path(),
        "run frames --calibration camera.toml --height 1.5 --out out --progress json --models models",
    );
    std::thread::sleep(Duration::from_millis(300));
    let start = Instant::now();
    let (code, said) = ended(child);
    // It may have ended by the memory that it asks for.
    assert!(code == Some(130) || said.contains("memory"), "{code:?} {said}");
    assert!(start.elapsed() < Duration::from_secs(5), "{said}");
    nothing_written(folder.path());
}

/// A g2o file of poses tied to each other all over: one factorisation takes many seconds.
fn tied_all_over(path: &Path, poses: usize) {
    let mut graph = String::new();
    for k in 0..poses {
        graph += &format!("VERTEX_SE3:QUAT {k} {k} 0.1 0 0 0 0 1\n");
    }
    let information = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";
    for k in 1..poses {
        for other in [k - 1, 104_729 % k, 224_737 % k, 350_377 % k] {
            let ahead = k - other;
            graph += &format!("EDGE_SE3:QUAT {other} {k} {ahead} 0 0 0 0 0 1 {information}\n");
        }
    }
    fs::write(path, graph).unwrap();
}

#[test]
fn a_factorisation_obeys_the_first_interrupt_and_the_time_limit() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    tied_all_over(&at("tied.g2o"), 2500);
    let command = "graph optimise tied.g2o --out out.g2o --json out.json";
    let vertices = || fs::read_to_string(at("out.g2o")).unwrap().matches("VERTEX_SE3:QUAT").count();
    let child = started(folder.path(), command);
    std::thread::sleep(Duration::from_millis(1500));
    let start = Instant::now();
    let (code, said) = ended(child);
    assert!(code == Some(130) && start.elapsed() < SOON / 2, "{code:?} {:?} {said}", start.elapsed());
    let report = json(&at("out.json"));
    assert_eq!((report["termination"].as_str(), report["iterations"].as_u64()), (Some("cancelled"), Some(0)));
    assert_eq!(vertices(), 2500);
    let limited = "graph optimise tied.g2o --out limited.g2o --json out.json --time-limit-s 1";
    let start = Instant::now();
    answer(folder.path(), limited).expect(0, &[]);
    let report = json(&at("out.json"));
    assert_eq!((report["termination"].as_str(), report["iterations"].as_u64()), (Some("time"), Some(0)));
    assert!(start.elapsed() < SOON / 2, "{:?}", start.elapsed());
}

/// As many boxes as are taken in a frame keep the estimation of vehicles busy for a while.
#[test]
fn a_run_among_its_vehicles_obeys_the_first_interrupt() {
    let folder = drive(6);
    let mut boxes = String::new();
    for frame in 0..6 {
        for k in 0..999 {
            let (x, y) = (10 + 13 * (k % 33), 100 + 3 * (k / 33));
            let bbox = format!("{x} {y} {} {}", x + 30, y + 20);
            boxes += &format!("{frame} -1 Car -1 -1 -10 {bbox} -1 -1 -1 -1000 -1000 -1000 -10 0.9\n");
        }
    }
    fs::write(folder.path().join("boxes.txt"), boxes).unwrap();
    let command =
        "run frames --calibration camera.toml --height 1.5 --out out --detections boxes.txt --progress json";
    let (output, time) = interrupted(folder.path(), command, "\"stage\":\"vehicles\"");
    output.expect(130, &["stopped while vehicles were estimated", "6 of 6 frames"]);
    assert!(time < SOON / 2, "{time:?}");
    let record = json(&folder.path().join("out/run.json"));
    assert!(record["interrupted"] == true && record["counters"]["frames"] == 6, "{record}");
    assert!(folder.path().join("out/ego.tum").exists());
}
