//! Processor time and memory of a process and those it started, from `/proc`.

/// Usage of a process at some time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sample {
    /// True when the process has ended and waits to be asked for its exit code.
    pub ended: bool,
    /// Processor time, that of children it waited for included \[s\].
    pub cpu_s: f64,
    /// Resident memory now, that of all processes below included \[MB\].
    pub rss_mb: f64,
    /// The most that the process itself had \[MB\].
    pub peak_mb: f64,
}

/// Usage of a process; `None` where the system does not say.
#[cfg(target_os = "linux")]
pub(crate) fn sample(pid: u32) -> Option<Sample> {
    use std::fs;
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name of the program stands in brackets and may hold anything.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let number = |k: usize| fields.get(k).and_then(|field| field.parse::<f64>().ok()).unwrap_or(0.0);
    let page = rustix::param::page_size() as f64;
    let ticks: f64 = (11..15).map(number).sum();
    let peak = fs::read_to_string(format!("/proc/{pid}/status")).ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("VmHWM:"))?;
        line.split_whitespace().nth(1)?.parse::<f64>().ok()
    });
    Some(Sample {
        ended: fields.first() == Some(&"Z"),
        cpu_s: ticks / rustix::param::clock_ticks_per_second() as f64,
        rss_mb: number(21) * page / 1e6
            + children(pid).into_iter().map(|child| rss_mb(child, 8)).sum::<f64>(),
        peak_mb: peak.unwrap_or(0.0) * 1024.0 / 1e6,
    })
}

/// Resident memory of a process and those below it, to some depth.
#[cfg(target_os = "linux")]
fn rss_mb(pid: u32, depth: usize) -> f64 {
    let pages = std::fs::read_to_string(format!("/proc/{pid}/statm")).ok();
    let pages = pages.and_then(|text| text.split_whitespace().nth(1)?.parse::<f64>().ok()).unwrap_or(0.0);
    let below = if depth == 0 { Vec::new() } else { children(pid) };
    pages * rustix::param::page_size() as f64 / 1e6
        + below.into_iter().map(|child| rss_mb(child, depth - 1)).sum::<f64>()
}

#[cfg(target_os = "linux")]
fn children(pid: u32) -> Vec<u32> {
    // Any thread can start a process.
    let Ok(threads) = std::fs::read_dir(format!("/proc/{pid}/task")) else { return Vec::new() };
    let lists =
        threads.flatten().filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok());
    lists
        .flat_map(|list| list.split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<_>>())
        .collect()
}

/// Usage of a process; `None` where the system does not say.
#[cfg(not(target_os = "linux"))]
pub(crate) fn sample(_: u32) -> Option<Sample> {
    None
}
