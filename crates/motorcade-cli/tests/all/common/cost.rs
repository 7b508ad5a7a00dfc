//! Cost of a command: time of the processor, time of the clock, memory.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::Answer;

/// Output of the program and what it took, the processes that it started included.
pub struct Cost {
    pub answer: Answer,
    pub clock: Duration,
    /// Time of the processor outside the kernel, which a loaded machine does not lengthen as it does the clock's.
    pub user: Duration,
    /// Largest resident memory of all processes together.
    pub peak_kb: u64,
}

impl Cost {
    /// Fails unless it took at most a second of the processor; on a loaded machine that may be several of the clock.
    #[track_caller]
    pub fn at_most_a_second(&self) -> &Answer {
        let Self { answer, clock, user, .. } = self;
        let said = &answer.stderr;
        assert!(*user <= Duration::from_secs(1), "{user:?} of the processor: {said}");
        assert!(*clock <= Duration::from_secs(20), "{clock:?}: {said}");
        answer
    }
}

/// Runs the program, with arguments separated by spaces, in a folder that is the working directory of no other process. After
/// a minute it is stopped, with code 124.
pub fn cost(folder: &Path, arguments: &str) -> Cost {
    let times = tempfile::NamedTempFile::new().unwrap();
    let mut command = Command::new("sh");
    // The shell's `times`: unsafe code, which the system's own function needs, is denied in the workspace.
    let script = r#"timeout 60 "$PROGRAM" "$@"; code=$?; times > "$TIMES"; exit $code"#;
    command.args(["-c", script, "sh"]).args(arguments.split_whitespace()).current_dir(folder);
    command.env("PROGRAM", env!("CARGO_BIN_EXE_motorcade")).env("MOTORCADE_MODELS", "none");
    command.env("TIMES", times.path());
    let (start, ended) = (Instant::now(), AtomicBool::new(false));
    let place = fs::canonicalize(folder).unwrap();
    let (output, peak_kb) = std::thread::scope(|scope| {
        let watch = scope.spawn(|| {
            let mut peak_kb = 0;
            while !ended.load(Ordering::Relaxed) {
                peak_kb = peak_kb.max(memory_kb(&place));
                std::thread::sleep(Duration::from_millis(2));
            }
            peak_kb
        });
        let output = command.output();
        ended.store(true, Ordering::Relaxed);
        (output.unwrap(), watch.join().unwrap())
    });
    let clock = start.elapsed();
    let user = user_time(&fs::read_to_string(times.path()).unwrap());
    Cost { answer: output.into(), clock, user, peak_kb }
}

/// Peaks of the resident memory of the processes in a folder, added up.
fn memory_kb(folder: &Path) -> u64 {
    let processes = fs::read_dir("/proc").unwrap().flatten().map(|entry| entry.path());
    let inside = processes.filter(|process| fs::read_link(process.join("cwd")).is_ok_and(|at| at == folder));
    // A process that ends meanwhile has no memory any more.
    let status = inside.filter_map(|process| fs::read_to_string(process.join("status")).ok());
    let peak_kb = |status: String| -> Option<u64> {
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
        line.split_whitespace().next()?.parse().ok()
    };
    status.filter_map(peak_kb).sum()
}

/// User time of the children from the second line of the shell's `times`, such as `0m0.110000s 0m0.020000s`.
fn user_time(times: &str) -> Duration {
    let (minutes, seconds) = times.lines().nth(1).unwrap().split_once('m').unwrap();
    let seconds: f64 = seconds.split('s').next().unwrap().parse().unwrap();
    Duration::from_secs_f64(60.0 * minutes.parse::<f64>().unwrap() + seconds)
}
