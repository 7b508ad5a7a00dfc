//! Batches with a program that does what the input says.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use motorcade_fleet::{Event, Limits, Manifest, Monitor, Options, Report, Shard, Status, Stop};
use tempfile::TempDir;

/// Notes what is reported; stops when some file is there.
#[derive(Default)]
struct Listener {
    started: Mutex<Vec<String>>,
    waited_for: Mutex<Vec<String>>,
    stop_at: Option<PathBuf>,
}

impl Monitor for Listener {
    fn report(&self, event: &Event<'_>) {
        match event {
            Event::Started { id, .. } => self.started.lock().unwrap().push((*id).to_owned()),
            Event::Waiting { id } => self.waited_for.lock().unwrap().push((*id).to_owned()),
            _ => {}
        }
    }
    fn stop(&self) -> Stop {
        // A file that is there may not be written yet.
        let written = |path: &PathBuf| fs::metadata(path).is_ok_and(|file| file.len() > 0);
        if self.stop_at.as_ref().is_some_and(written) { Stop::Soon } else { Stop::Not }
    }
}

/// A folder with inputs and `drives.csv`.
struct Fleet(TempDir);

impl Fleet {
    fn new(drives: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut manifest = "id,input\n".to_owned();
        for (id, script) in drives {
            fs::write(folder.path().join(id), script).unwrap();
            manifest += &format!("{id},{id}\n");
        }
        fs::write(folder.path().join("drives.csv"), manifest).unwrap();
        Self(folder)
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn options(&self) -> Options {
        Options {
            program: Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fake_motorcade.sh"),
            out: self.at("out"),
            jobs: 2,
            threads: 0,
            pin: true,
            shard: Shard::WHOLE,
            limits: Limits::default(),
            retries: 2,
            retry_pause: Duration::from_millis(1),
            retry_failed: false,
        }
    }

    fn run_with(&self, options: &Options, listener: &Listener) -> Report {
        let manifest = Manifest::read(&self.at("drives.csv"), &[]).unwrap();
        motorcade_fleet::run(&manifest, options, listener).unwrap()
    }

    fn run(&self) -> Report {
        self.run_with(&self.options(), &Listener::default())
    }

    /// For each call of the program on a drive, whether a directory could be replaced.
    fn calls(&self, id: &str) -> Vec<String> {
        let text = fs::read_to_string(self.at(&format!("{id}.calls"))).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }
}

fn statuses(report: &Report) -> Vec<(&str, Status)> {
    report.outcomes.iter().map(|(id, outcome)| (id.as_str(), outcome.status)).collect()
}

#[test]
fn each_drive_ends_for_itself() {
    let fleet = Fleet::new(&[
        ("good", "results f1"),
        ("lost", "results f2; exit 4"),
        ("input", "echo 'motorcade: no such video' >&2; exit 3"),
        ("usage", "exit 1"),
        ("bug", "exit 2"),
        ("disk", "[ $attempt = 3 ] || exit 5; results f3"),
        ("signal", "[ $attempt = 2 ] || kill -9 $$; results f4"),
        ("nothing", "exit 0"),
    ]);
    let report = fleet.run();
    let expected = [
        ("good", Status::Done),
        ("lost", Status::TrackingFailed),
        ("input", Status::Failed),
        ("usage", Status::Failed),
        ("bug", Status::Failed),
        ("disk", Status::Done),
        ("signal", Status::Done),
        ("nothing", Status::Failed),
    ];
    assert_eq!(statuses(&report), expected);
    assert_eq!(report.exit_code(), 4);
    let calls = ["good", "lost", "input", "usage", "bug", "disk", "signal", "nothing"]
        .map(|id| fleet.calls(id).len());
    assert_eq!(calls, [1, 1, 1, 1, 3, 3, 2, 1]);
    let table = fs::read_to_string(fleet.at("out/manifest.done.csv")).unwrap();
    assert!(
        table.starts_with(
            "id,status,exit_code,attempts,message,warnings,frames,length_m,duration_s,vehicles,"
        ),
        "{table}"
    );
    assert!(table.contains("input,failed,3,1,no such video,"), "{table}");
    assert!(table.contains("good,done,0,1,,a warning,20,12.500,2.000,1,"), "{table}");
    {
        let rows = motorcade_tables::read_rows(&fleet.at("out/manifest.done.parquet")).unwrap();
        assert_eq!(
            (rows.len(), rows[0]["length_m"].as_str(), rows[2]["exit_code"].as_str()),
            (8, "12.5", "3")
        );
        assert_eq!(rows[2]["frames"], "", "nothing is null, not 0");
    }
    // Nothing is repeated but what may be temporary.
    fleet.run();
    let calls = ["good", "lost", "input", "usage", "bug", "disk", "signal"].map(|id| fleet.calls(id).len());
    assert_eq!(calls, [1, 1, 1, 1, 6, 3, 2]);
    fleet.run_with(&Options { retry_failed: true, ..fleet.options() }, &Listener::default());
    assert_eq!(
        (fleet.calls("input").len(), fleet.calls("usage").len(), fleet.calls("good").len()),
        (2, 2, 1)
    );
}

#[test]
fn a_changed_row_is_run_again_and_replaces_its_results() {
    let fleet = Fleet::new(&[("a", "results f1"), ("b", "results f2")]);
    fleet.run();
    fs::write(fleet.at("drives.csv"), "id,input,height\na,a,\nb,b,1.5\n").unwrap();
    let report = fleet.run();
    assert_eq!(report.exit_code(), 0);
    assert_eq!(
        (fleet.calls("a"), fleet.calls("b")),
        (vec!["no".to_owned()], vec!["no".to_owned(), "yes".to_owned()])
    );
    assert_eq!(report.outcomes[1].1.attempts, 1, "attempts are those of this row");
}

#[test]
fn results_that_were_lost_or_whose_files_changed_are_made_again() {
    let fleet = Fleet::new(&[("a", "results f1"), ("b", "results f2"), ("c", "exit 3")]);
    fleet.run();
    fs::remove_dir_all(fleet.at("out/runs/a")).unwrap();
    // Another size.
    fs::write(fleet.at("b"), "[ $replace = yes ] || exit 1; results f22").unwrap();
    fs::write(fleet.at("c"), "results f333").unwrap();
    let report = fleet.run();
    assert_eq!(report.count(Status::Done), 3);
    assert_eq!(fleet.calls("a"), ["no", "no"]);
    assert_eq!(
        fleet.calls("b"),
        ["no", "no", "yes"],
        "`run` refuses a directory with other results; it is ours"
    );
}

#[test]
fn a_directory_that_is_not_ours_is_never_replaced() {
    let fleet = Fleet::new(&[("a", "[ $replace = no ] || echo replaced; exit 1")]);
    fs::create_dir_all(fleet.at("out/runs/a")).unwrap();
    fs::write(fleet.at("out/runs/a/run.json"), "{}").unwrap();
    assert_eq!(fleet.run().count(Status::Failed), 1);
    assert_eq!(fleet.calls("a"), ["no"]);
}

#[test]
fn bounds_end_a_drive_and_say_which() {
    let fleet = Fleet::new(&[("slow", "sleep 60"), ("quick", "results f1")]);
    let limits = Limits { timeout: Some(Duration::from_millis(300)), memory_mb: None };
    let report = fleet.run_with(&Options { limits, ..fleet.options() }, &Listener::default());
    assert_eq!(statuses(&report), [("slow", Status::TimedOut), ("quick", Status::Done)]);
    assert!(report.outcomes[0].1.message.contains("--timeout"), "{:?}", report.outcomes[0]);
    assert!(report.outcomes[0].1.wall_s < 10.0 && fleet.calls("slow").len() == 1);
}

#[cfg(target_os = "linux")]
#[test]
fn a_drive_that_takes_too_much_memory_is_killed() {
    // A shell that holds a text of 64 MB, in a process below the one that was started.
    let fleet =
        Fleet::new(&[("large", "(x=$(head -c 64000000 /dev/zero | tr '\\0' a); sleep 30; echo $x | wc -c)")]);
    let limits = Limits { timeout: None, memory_mb: Some(40) };
    let report = fleet.run_with(&Options { limits, ..fleet.options() }, &Listener::default());
    let outcome = &report.outcomes[0].1;
    assert_eq!(outcome.status, Status::OutOfMemory, "{outcome:?}");
    assert!(outcome.message.contains("--memory-mb") && outcome.peak_rss_mb.unwrap() > 40.0, "{outcome:?}");
}

#[test]
fn a_stopped_batch_goes_on_where_it_was() {
    let wait = "trap 'exit 130' TERM; [ $attempt = 1 ] && { sleep 5 & wait; }; results f1";
    let fleet = Fleet::new(&[("a", "results f0"), ("b", wait), ("c", "results f2")]);
    let options = Options { jobs: 1, ..fleet.options() };
    let report =
        fleet.run_with(&options, &Listener { stop_at: Some(fleet.at("b.calls")), ..Listener::default() });
    assert_eq!(statuses(&report), [("a", Status::Done), ("b", Status::Interrupted), ("c", Status::Pending)]);
    assert_eq!(report.exit_code(), 130);
    assert!(fs::read_to_string(fleet.at("out/manifest.done.csv")).unwrap().contains("c,pending,,0,"));
    let report = fleet.run();
    assert_eq!(report.exit_code(), 0);
    assert_eq!((fleet.calls("a").len(), fleet.calls("b").len(), fleet.calls("c").len()), (1, 2, 1));
}

#[test]
fn a_process_that_outlives_its_batch_is_waited_for() {
    // The first attempt is killed and leaves a process behind that still writes.
    let outlived = "[ $attempt = 1 ] && { (sleep 1; echo end >\"$input.ended\") & kill -9 $$; }\n\
                    test -s \"$input.ended\" && results f1";
    let fleet = Fleet::new(&[("a", outlived)]);
    let once = Options { retries: 0, ..fleet.options() };
    assert_eq!(fleet.run_with(&once, &Listener::default()).count(Status::Failed), 1);
    // A batch that is asked to stop meanwhile does not begin the drive.
    let stopped = Listener { stop_at: Some(fleet.at("a.calls")), ..Listener::default() };
    assert_eq!(fleet.run_with(&once, &stopped).exit_code(), 130);
    let listener = Listener::default();
    let report = fleet.run_with(&once, &listener);
    assert_eq!(*listener.waited_for.lock().unwrap(), ["a"]);
    assert_eq!(statuses(&report), [("a", Status::Done)]);
    assert_eq!(fleet.calls("a").len(), 2);
}

#[test]
fn a_line_that_was_cut_off_loses_one_drive() {
    let fleet = Fleet::new(&[("a", "results f1"), ("b", "results f2")]);
    let options = Options { jobs: 1, ..fleet.options() };
    fleet.run_with(&options, &Listener::default());
    let path = fleet.at("out/state.jsonl");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, &text[..text.len() - 20]).unwrap();
    let listener = Listener::default();
    assert_eq!(fleet.run_with(&options, &listener).exit_code(), 0);
    assert_eq!(*listener.started.lock().unwrap(), ["b"]);
    let listener = Listener::default();
    fleet.run_with(&options, &listener);
    assert!(listener.started.lock().unwrap().is_empty());
}

#[test]
fn shards_in_one_directory_give_what_one_batch_gives() {
    let drives = ["a", "b", "c", "d", "e"].map(|id| (id, "results f"));
    let fleet = Fleet::new(&drives);
    std::thread::scope(|scope| {
        for shard in ["0/2", "1/2"] {
            let options = Options { shard: shard.parse().unwrap(), ..fleet.options() };
            let fleet = &fleet;
            scope.spawn(move || assert_eq!(fleet.run_with(&options, &Listener::default()).exit_code(), 0));
        }
    });
    let table =
        |suffix: &str| fs::read_to_string(fleet.at(&format!("out/manifest.done{suffix}.csv"))).unwrap();
    assert_eq!((table(".0-of-2").lines().count(), table(".1-of-2").lines().count()), (4, 3));
    // The whole list afterwards: nothing is run, one table.
    let listener = Listener::default();
    let report = fleet.run_with(&fleet.options(), &listener);
    assert!(listener.started.lock().unwrap().is_empty() && report.count(Status::Done) == 5);
    assert_eq!(table("").lines().count(), 6);
}

/// Cores that a process may use, as a list of numbers.
#[cfg(target_os = "linux")]
fn cores(list: &str) -> Vec<usize> {
    let parts = list.trim().split(',').map(|part| part.split_once('-').unwrap_or((part, part)));
    parts.flat_map(|(a, b)| a.parse::<usize>().unwrap()..=b.parse::<usize>().unwrap()).collect()
}

#[cfg(target_os = "linux")]
#[test]
fn each_job_has_cores_of_its_own_within_those_of_the_batch() {
    // The two drives wait for each other, so that each has a job of its own.
    let print = "sed -n 's/^Cpus_allowed_list://p' /proc/self/status >\"$input.cores\"; echo $threads >\"$input.threads\"\n\
                tries=0; until [ -s \"${input%/*}/a.threads\" ] && [ -s \"${input%/*}/b.threads\" ]; do\n\
                tries=$((tries + 1)); [ $tries -lt 1000 ] || exit 1; sleep 0.01; done; results f1";
    let own = fs::read_to_string("/proc/thread-self/status").unwrap();
    let own = cores(own.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap());
    let usable = std::thread::available_parallelism().unwrap().get();
    for pin in [true, false] {
        let fleet = Fleet::new(&[("a", print), ("b", print)]);
        let report = fleet.run_with(&Options { pin, ..fleet.options() }, &Listener::default());
        assert_eq!(report.count(Status::Done), 2, "{report:?}");
        let read = |name: &str| fs::read_to_string(fleet.at(name)).unwrap();
        let [a, b] = ["a.cores", "b.cores"].map(|name| cores(&read(name)));
        let threads: usize =
            ["a.threads", "b.threads"].iter().map(|n| read(n).trim().parse::<usize>().unwrap()).sum();
        assert_eq!(threads, usable.max(2));
        if pin && own.len() == usable && usable >= 2 {
            assert!(a.iter().all(|core| !b.contains(core)), "{a:?} {b:?}");
            let mut both = [a, b].concat();
            both.sort_unstable();
            assert_eq!(both, own);
        } else {
            assert_eq!((a, b), (own.clone(), own.clone()));
        }
    }
}
