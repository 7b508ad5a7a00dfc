//! The answer to Ctrl-C: the first one asks to stop and write what there is, the second one stops at once.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use crate::exit::{INTERRUPTED, eprint};

/// Raised by the first Ctrl-C.
static FLAG: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
/// Number of the write that waits for another program; even while there is none.
static WRITES: AtomicU64 = AtomicU64::new(0);
/// Time that another program has to read on after the first Ctrl-C.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Listens to Ctrl-C; the flag that the first one raises.
pub fn listen() -> Arc<AtomicBool> {
    // A second handler (tests in one process) is refused; the first one then keeps listening.
    let _ = ctrlc::set_handler(|| {
        if FLAG.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        eprint("motorcade: stopping; writing what there is (Ctrl-C again to stop at once)");
        std::thread::spawn(end_where_nothing_moves);
    });
    Arc::clone(&FLAG)
}

/// True once Ctrl-C was pressed.
pub fn interrupted() -> bool {
    FLAG.load(Ordering::SeqCst)
}

/// A write that another program can hold up for ever by not reading. After Ctrl-C the program does not wait for it.
pub fn held_up<T>(write: impl FnOnce() -> T) -> T {
    WRITES.fetch_add(1, Ordering::SeqCst);
    let written = write();
    WRITES.fetch_add(1, Ordering::SeqCst);
    written
}

/// Waits until something is done, after Ctrl-C for a moment more; false where it is not done then.
pub fn wait_for(mut done: impl FnMut() -> bool) -> bool {
    let mut stopped: Option<Instant> = None;
    while !done() {
        if interrupted() && stopped.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
            return false;
        }
        std::thread::sleep(LOOK_EVERY);
    }
    true
}

/// Ends the program once a write waits for longer than the time that it has.
fn end_where_nothing_moves() {
    let (mut write, mut since) = (0, Instant::now());
    loop {
        let now = WRITES.load(Ordering::SeqCst);
        if now != write || now.is_multiple_of(2) {
            (write, since) = (now, Instant::now());
        } else if since.elapsed() > PATIENCE {
            eprint("motorcade: stopped while another program did not read what was written to it");
            std::process::exit(i32::from(INTERRUPTED));
        }
        std::thread::sleep(LOOK_EVERY);
    }
}
