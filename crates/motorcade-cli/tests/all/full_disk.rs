//! A full disk: code 5, and what was there before is there after.

#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "helpers of tests may fail loudly; a skipped test says so"
)]

use std::path::Path;
use std::process::Command;

use crate::common::{Answer, drive};

/// Room for the empty folders of a run, not for its files.
const ROOM: &str = "16k";

/// Runs a script in a mount namespace of its own, with `small` a disk of little room: no other process sees the mount, and
/// it ends with the script. `None` where the system does not allow that.
fn on_a_small_disk(folder: &Path, script: &str) -> Option<Answer> {
    std::fs::create_dir(folder.join("small")).unwrap();
    let unshared = |script: &str| {
        let mount = format!("mount -t tmpfs -o size={ROOM} none small || exit 99\n{script}");
        let mut command = Command::new("unshare");
        command.args(["--mount", "--map-root-user", "sh", "-c", &mount]).current_dir(folder);
        command.env("PROGRAM", env!("CARGO_BIN_EXE_motorcade")).env_remove("MOTORCADE_MODELS").output()
    };
    if !unshared("true").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: this system lets no test mount a small disk (unshare, mount)");
        return None;
    }
    Some(unshared(script).unwrap().into())
}

#[test]
fn results_that_do_not_fit() {
    let folder = drive(16);
    let script = "echo mine > small/thesis.tex
        $PROGRAM run frames --calibration camera.toml --height 1.5 --out small/out --threads 1 --progress none
        code=$?
        echo; echo left:; ls -A small; cat small/thesis.tex
        exit $code";
    let Some(output) = on_a_small_disk(folder.path(), script) else { return };
    output.expect(5, &["small/out/", "No space left on device"]);
    assert!(!output.stderr.contains("partial"), "{}", output.stderr);
    let left = output.stdout.rsplit("left:\n").next().unwrap();
    // Output of the networks is kept for `--resume`, with room made.
    assert!(output.stderr.contains("--resume"), "{}", output.stderr);
    assert_eq!(left, ".out.motorcade-checkpoint\nthesis.tex\nmine\n", "{}", output.stdout);
}

/// Nor does a run that was there have to make room for one that fails.
#[test]
fn an_earlier_run_stays() {
    let folder = drive(16);
    let script = "mkdir small/out; echo '{\"files\": []}' > small/out/run.json
        $PROGRAM run frames --calibration camera.toml --height 1.5 --out small/out --force --progress none
        code=$?
        echo; echo left:; ls -A small small/out; cat small/out/run.json
        exit $code";
    let Some(output) = on_a_small_disk(folder.path(), script) else { return };
    output.expect(5, &["small", "No space left on device"]);
    let left = output.stdout.rsplit("left:\n").next().unwrap();
    assert_eq!(
        left, "small:\nout\n\nsmall/out:\n.motorcade-checkpoint\nrun.json\n{\"files\": []}\n",
        "{}",
        output.stdout
    );
}

#[test]
fn a_simulated_drive_that_does_not_fit() {
    let folder = tempfile::tempdir().unwrap();
    let script = "exec $PROGRAM simulate --scenario demo --frames 2 --width 400 --out small/drive";
    let Some(output) = on_a_small_disk(folder.path(), script) else { return };
    output.expect(5, &["small/drive"]);
}
