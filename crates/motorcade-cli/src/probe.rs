//! Trial of networks from a folder in a process of its own: a graph can ask for any amount of memory, and an allocation that
//! fails ends the process it is in.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use motorcade_perception::{ModelOptions, try_models};

use crate::arguments::ProbeArguments;
use crate::exit;
use crate::interruption::interrupted;

/// Most memory of a network and one picture \[kB\]; the largest detectors for vehicles need a quarter of it.
const MOST_KB: u64 = 4 << 20;
/// Longest time for loading all networks and running them on one picture.
const LONGEST: Duration = Duration::from_secs(120);
/// Time between two looks at the process.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// The hidden command: loads the networks and runs those for this size on a black picture, each after a line with its file.
pub fn probe(arguments: &ProbeArguments) -> anyhow::Result<u8> {
    let size = (arguments.width, arguments.height);
    // Without a reader nobody reads it.
    let mut report = |path: &Path| exit::say(&path.to_string_lossy());
    try_models(&arguments.folder, size, &ModelOptions::default(), &mut report)?;
    Ok(exit::FINE)
}

/// Tries the networks of a folder. Errors other than a lack of memory or time are left to the run itself, which names them.
///
/// # Errors
/// A network that ends the process or asks for too much; Ctrl-C.
pub fn check(folder: &Path, (width, height): (u32, u32)) -> anyhow::Result<()> {
    // Without a second process the networks run untried.
    let Ok(program) = std::env::current_exe() else { return Ok(()) };
    let mut command = Command::new(program);
    command.arg("probe-models").arg(folder).arg(width.to_string()).arg(height.to_string());
    // Ctrl-C in a terminal is for this process, which ends that one.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    let Ok(mut child) = command.spawn() else { return Ok(()) };
    let problem = wait(&mut child);
    let mut names = String::new();
    if let Some(mut out) = child.stdout.take() {
        // The name is lost, the error is not.
        let _ = out.read_to_string(&mut names);
    }
    let path = names.lines().last().map_or_else(|| folder.to_path_buf(), PathBuf::from);
    match problem {
        None => Ok(()),
        Some(_) if interrupted() => Err(exit::Stopped("stopped while the networks were tried").into()),
        Some(problem) => Err(motorcade_perception::Error::Model { path, problem }.into()),
    }
}

/// Waits for the process; the problem where it did not end by itself.
fn wait(child: &mut Child) -> Option<String> {
    let start = Instant::now();
    let problem = loop {
        match child.try_wait() {
            Ok(Some(status)) => {
                let died = "the network ends the process that runs it, as a rule by asking for more memory than there is";
                return status.code().is_none().then(|| died.to_owned());
            }
            Err(_) => return None,
            Ok(None) if interrupted() => break "stopped".to_owned(),
            Ok(None) if memory_kb(child.id()).is_some_and(|kb| kb > MOST_KB) => {
                break format!("the network asks for more than {} GB of memory", MOST_KB >> 20);
            }
            Ok(None) if start.elapsed() > LONGEST => {
                break format!("the network takes longer than {} s for a picture", LONGEST.as_secs());
            }
            Ok(None) => std::thread::sleep(LOOK_EVERY),
        }
    };
    // It may have ended in the meantime.
    let _ = child.kill();
    let _ = child.wait();
    Some(problem)
}

/// Private writable memory of a process \[kB\], touched or not; unknown outside Linux.
fn memory_kb(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmData:"))?;
    line.split_whitespace().next()?.parse().ok()
}
