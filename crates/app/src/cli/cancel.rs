//! Ctrl-C: work that asks stops at its next step, so that nothing is left half-written.

use std::panic::resume_unwind;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use super::{Failure, output};

static CANCELLED: AtomicBool = AtomicBool::new(false);
static LISTENS: OnceLock<()> = OnceLock::new();

/// Installs the handler. The first Ctrl-C then only requests the end; a second one ends the process, as it does if no handler can be installed.
pub(crate) fn listen() {
    LISTENS.get_or_init(|| {
        let asked = || {
            if CANCELLED.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
            output::notice("stops at the next step; Ctrl-C again stops at once");
        };
        if let Err(error) = ctrlc::set_handler(asked) {
            tracing::warn!("Ctrl-C ends the process at once: {error}");
        }
    });
}

/// Asked between the steps of work that takes long.
///
/// # Errors
/// [`Failure::Cancelled`] after Ctrl-C.
pub(crate) fn check() -> Result<(), Failure> {
    match is_asked() {
        true => Err(Failure::Cancelled),
        false => Ok(()),
    }
}

/// Whether Ctrl-C asked for the end.
pub(crate) fn is_asked() -> bool {
    CANCELLED.load(Ordering::Relaxed)
}

/// Does work that never calls [`check`], in a thread of its own. After Ctrl-C the thread is abandoned and ends with the process; the work
/// must therefore write no file.
///
/// # Errors
/// Those of the work, and [`Failure::Cancelled`] after Ctrl-C.
pub(crate) fn detached<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    /// Time between two checks.
    const PAUSE: Duration = Duration::from_millis(10);
    listen();
    let worker = thread::spawn(work);
    while !worker.is_finished() {
        check()?;
        thread::sleep(PAUSE);
    }
    check()?;
    worker.join().unwrap_or_else(|panic| resume_unwind(panic))
}
