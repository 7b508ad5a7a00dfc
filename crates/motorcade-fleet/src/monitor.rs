//! Progress events of a batch, and the request to stop it.

use crate::outcome::Outcome;

/// Request to stop a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stop {
    /// It goes on.
    Not,
    /// No drive is begun; those in work write what they have.
    Soon,
    /// Those in work are killed.
    Now,
}

/// A progress event.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// The work is known: drives of the shard, and how many of them need nothing.
    Begin {
        /// Drives of the shard.
        total: usize,
        /// Drives that have results.
        done: usize,
        /// Drives that failed before and are left so.
        failed: usize,
    },
    /// An attempt began.
    Started {
        /// The drive.
        id: &'a str,
        /// From 1.
        attempt: u32,
    },
    /// Another process works on the drive: it is waited for.
    Waiting {
        /// The drive.
        id: &'a str,
    },
    /// An attempt failed and another will follow.
    Retry {
        /// The drive.
        id: &'a str,
        /// Its outcome.
        outcome: &'a Outcome,
    },
    /// The drive needs nothing more in this batch.
    Finished {
        /// The drive.
        id: &'a str,
        /// Its outcome.
        outcome: &'a Outcome,
    },
}

/// A listener. Calls come from several threads.
pub trait Monitor: Sync {
    /// Receives an event.
    fn report(&self, event: &Event<'_>);
    /// Asked several times a second.
    fn stop(&self) -> Stop;
}
