//! `motorcade batch` on drives made on the spot.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::Stdio;

use crate::common::{answer, drive, json, program, rows};

const OUT: &str =
    "batch drives.csv --out fleet --calibration camera.toml --height 1.5 --progress plain --retries 0";

/// Three drives of one folder, the second of which is broken.
const MANIFEST: &str =
    "id,input,frames,settings\nfirst,frames,0..16,\nbroken,nothing.mp4,,\nlast,frames,8..24,run.seed=3\n";

/// Files of a run by name, without those that hold times and the command.
fn results(run: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(run).unwrap().map(|entry| entry.unwrap()).filter(|e| e.path().is_file());
    let named = files.map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap()));
    named.filter(|(name, _)| name != "run.json" && name != "report.html").collect()
}

/// Columns id and status of a table.
fn statuses(table: &Path) -> Vec<(String, String)> {
    rows(table).into_iter().map(|row| (row[0].clone(), row[1].clone())).collect()
}

fn pairs(expected: &[(&str, &str)]) -> Vec<(String, String)> {
    expected.iter().map(|(id, status)| ((*id).to_owned(), (*status).to_owned())).collect()
}

#[test]
fn a_broken_drive_stops_no_other_and_nothing_is_repeated() {
    let folder = drive(24);
    let at = |name: &str| folder.path().join(name);
    fs::write(at("drives.csv"), MANIFEST).unwrap();
    let output = answer(folder.path(), &format!("{OUT} --jobs 2"));
    output.expect(4, &["3 drives, 0 done before", "broken: failed: ", "nothing.mp4"]);
    assert!(output.stdout.contains("2 of 3 drives done, 1 failed"), "{}", output.stdout);
    let table = at("fleet/manifest.done.csv");
    let expected = pairs(&[("first", "done"), ("broken", "failed"), ("last", "done")]);
    assert_eq!(statuses(&table), expected);
    let cells = rows(&table);
    assert_eq!((cells[0][2].as_str(), cells[1][2].as_str()), ("0", "3"));
    assert_eq!(json(&at("fleet/runs/first/run.json"))["counters"]["frames"], 16);
    // The bytes of a run of its own.
    let alone = "run frames --calibration camera.toml --height 1.5 --frames 8..24 --set run.seed=3 --out alone --progress none";
    answer(folder.path(), alone).expect(0, &[]);
    assert_eq!(results(&at("alone")), results(&at("fleet/runs/last")));
    assert!(results(&at("alone")).len() >= 8);

    let again = answer(folder.path(), OUT);
    again.expect(4, &["3 drives, 2 done before, 1 failed before"]);
    assert!(!again.stderr.contains("begins"), "{}", again.stderr);
    assert_eq!(statuses(&table), expected);

    // A row that says something else replaces its results; a file that is there now is tried.
    fs::write(at("drives.csv"), MANIFEST.replace("8..24", "8..22").replace("nothing.mp4", "frames")).unwrap();
    let changed = answer(folder.path(), OUT);
    changed.expect(0, &["1 done before", "broken: begins", "last: begins"]);
    assert!(!changed.stderr.contains("first: begins"), "{}", changed.stderr);
    assert_eq!(json(&at("fleet/runs/last/run.json"))["counters"]["frames"], 14);
}

#[cfg(unix)]
#[test]
fn an_interrupted_batch_goes_on_and_gives_the_same_bytes() {
    let folder = drive(24);
    let at = |name: &str| folder.path().join(name);
    fs::write(at("drives.csv"), "id,input,frames\na,frames,0..12\nb,frames,4..24\nc,frames,10..22\n")
        .unwrap();
    let mut command = std::process::Command::new(program(folder.path(), "").get_program());
    command.args(OUT.split(' ')).args(["--jobs", "1"]).current_dir(folder.path());
    command.env("MOTORCADE_MODELS", "none").stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut text = String::new();
    while !text.contains("b: begins") {
        assert!(stderr.read_line(&mut text).unwrap() > 0, "{text}");
    }
    let sent = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    stderr.read_to_string(&mut text).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{text}");
    let table = statuses(&at("fleet/manifest.done.csv"));
    assert_eq!((table[0].1.as_str(), table[2].1.as_str()), ("done", "pending"), "{text}");

    let output = answer(folder.path(), &format!("{OUT} --jobs 2"));
    output.expect(0, &["3 drives", "c: begins"]);
    assert!(!output.stderr.contains("a: begins"), "{}", output.stderr);
    for (id, frames) in [("a", "0..12"), ("b", "4..24"), ("c", "10..22")] {
        let alone = format!(
            "run frames --calibration camera.toml --height 1.5 --frames {frames} --out {id} --progress none"
        );
        answer(folder.path(), &alone).expect(0, &[]);
        assert_eq!(results(&at(id)), results(&at("fleet/runs").join(id)), "{id}");
    }
}

#[test]
fn two_shards_at_once_give_what_one_batch_gives() {
    let folder = drive(16);
    let at = |name: &str| folder.path().join(name);
    fs::write(at("drives.csv"), "id,input,frames\na,frames,0..10\nb,frames,2..12\nc,frames,4..16\n").unwrap();
    std::thread::scope(|scope| {
        for shard in ["0/2", "1/2"] {
            let folder = folder.path();
            scope.spawn(move || {
                answer(folder, &format!("{OUT} --jobs 1 --shard {shard}")).expect(0, &[]).code
            });
        }
    });
    let expected = [pairs(&[("a", "done"), ("c", "done")]), pairs(&[("b", "done")])];
    let tables = [0, 1].map(|k| statuses(&at(&format!("fleet/manifest.done.{k}-of-2.csv"))));
    assert_eq!(tables, expected);
    // The whole list runs nothing and writes one table.
    let output = answer(folder.path(), OUT);
    output.expect(0, &["3 drives, 3 done before"]);
    assert_eq!(statuses(&at("fleet/manifest.done.csv")).len(), 3);
    // One batch whose jobs are not bound to cores, with threads that differ: the same bytes.
    answer(folder.path(), &format!("{} --jobs 2 --threads 3 --no-pin", OUT.replace("fleet", "one")))
        .expect(0, &[]);
    for id in ["a", "b", "c"] {
        assert_eq!(results(&at("fleet/runs").join(id)), results(&at("one/runs").join(id)), "{id}");
    }
}

#[test]
fn what_cannot_be_a_batch_is_said_at_once() {
    let folder = drive(2);
    fs::write(folder.path().join("drives.csv"), "input,hight\nframes,1.5\n").unwrap();
    answer(folder.path(), OUT).expect(3, &["drives.csv:1: column `hight` is not known", "height"]);
    answer(folder.path(), "batch none.csv --out fleet").expect(3, &["none.csv"]);
    answer(folder.path(), "batch drives.csv --out fleet --shard 2/2").expect(1, &["INDEX/COUNT"]);
    assert!(!folder.path().join("fleet").exists());
    fs::write(folder.path().join("drives.csv"), "input\nframes\n").unwrap();
    fs::write(folder.path().join("fleet"), "a file").unwrap();
    answer(folder.path(), OUT).expect(5, &["cannot write", "fleet"]);
}
