//! The cores of each job.

/// The cores of this process, dealt to jobs: neighbouring ones go together, and shares differ by at most one.
pub(crate) struct Cores {
    /// Cores that may be used at a time; a quota of the control group counts.
    count: usize,
    /// Their numbers; empty where jobs are not bound.
    numbers: Vec<usize>,
    jobs: usize,
}

impl Cores {
    /// Cores of the calling thread for `jobs` jobs. They are bound if `pin` says so, there are several, each has a core of its own, and nothing
    /// but the list of cores bounds this process: under a quota, processes elsewhere would be bound to the same first cores.
    pub(crate) fn deal(jobs: usize, pin: bool) -> Self {
        let count = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let mut numbers = if pin { allowed() } else { Vec::new() };
        if numbers.len() != count || jobs < 2 || jobs > count {
            numbers.clear();
        }
        Self { count, numbers, jobs: jobs.max(1) }
    }

    /// Threads that fit a job's share.
    pub(crate) fn threads(&self, job: usize) -> usize {
        share(self.count, self.jobs, job).len().max(1)
    }

    /// Binds the calling thread, and with it the processes that it starts, to the share of a job.
    pub(crate) fn bind(&self, job: usize) {
        let share = self.numbers.get(share(self.numbers.len(), self.jobs, job)).unwrap_or_default();
        if !share.is_empty() {
            bind(share);
        }
    }
}

/// Indices of the cores of a job.
fn share(count: usize, jobs: usize, job: usize) -> std::ops::Range<usize> {
    count * job / jobs..count * (job + 1) / jobs
}

/// Numbers of the cores on which the calling thread may run; empty where the system does not say.
#[cfg(target_os = "linux")]
fn allowed() -> Vec<usize> {
    use rustix::thread::{CpuSet, sched_getaffinity};
    let set = sched_getaffinity(None);
    set.map_or_else(|_| Vec::new(), |set| (0..CpuSet::MAX_CPU).filter(|core| set.is_set(*core)).collect())
}

#[cfg(target_os = "linux")]
fn bind(cores: &[usize]) {
    use rustix::thread::{CpuSet, sched_setaffinity};
    let mut set = CpuSet::new();
    cores.iter().for_each(|core| set.set(*core));
    // A core that went offline in the meantime: the job runs where the others do.
    let _ = sched_setaffinity(None, &set);
}

#[cfg(not(target_os = "linux"))]
fn allowed() -> Vec<usize> {
    Vec::new()
}

#[cfg(not(target_os = "linux"))]
fn bind(_: &[usize]) {}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(count: usize, jobs: usize) -> Cores {
        Cores { count, numbers: (0..count).collect(), jobs }
    }

    #[test]
    fn shares_cover_the_cores_once_and_differ_by_one_at_most() {
        for (count, jobs) in [(1, 1), (2, 1), (2, 2), (7, 3), (64, 5), (3, 3)] {
            let shares: Vec<_> = (0..jobs).map(|job| share(count, jobs, job)).collect();
            assert_eq!(shares.iter().cloned().flatten().collect::<Vec<_>>(), (0..count).collect::<Vec<_>>());
            let lengths = || shares.iter().map(ExactSizeIterator::len);
            assert!(lengths().max().unwrap() - lengths().min().unwrap() <= 1, "{count} cores, {jobs} jobs");
        }
    }

    #[test]
    fn threads_are_as_many_as_cores_and_one_at_least() {
        assert_eq!([0, 1].map(|job| of(4, 2).threads(job)), [2, 2]);
        assert_eq!([0, 1, 2].map(|job| of(2, 3).threads(job)), [1, 1, 1]);
        assert_eq!(of(8, 1).threads(0), 8);
    }

    #[test]
    fn one_job_more_jobs_than_cores_and_no_wish_are_not_bound() {
        let count = std::thread::available_parallelism().unwrap().get();
        for (jobs, pin) in [(1, true), (count + 1, true), (count, false)] {
            assert!(Cores::deal(jobs, pin).numbers.is_empty(), "{jobs} jobs on {count} cores");
        }
    }
}
