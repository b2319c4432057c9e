//! Messages for the host's log.

use std::ffi::{CStr, c_char, c_void};
use std::sync::{PoisonError, RwLock};

/// `sabaki_log`.
pub(super) type Log = Option<unsafe extern "C" fn(*mut c_void, *const c_char)>;

/// The host's function, and the pointer that it is called with.
struct Target {
    log: Log,
    user: *mut c_void,
}

// SAFETY: the host says that its function may be called from any thread, with this pointer.
unsafe impl Send for Target {}
// SAFETY: as above.
unsafe impl Sync for Target {}

/// The current target. It is read-locked while the function runs, so that a replaced function is no longer running.
static TARGET: RwLock<Target> = RwLock::new(Target {
    log: None,
    user: std::ptr::null_mut(),
});

exported! {
    unsafe extern "C" fn sabaki_set_log(log: Log, user: *mut c_void) -> () {
        *TARGET.write().unwrap_or_else(PoisonError::into_inner) = Target { log, user };
    }
}

/// Passes a message to the host.
pub(super) fn log(words: &CStr) {
    let target = TARGET.read().unwrap_or_else(PoisonError::into_inner);
    if let Some(log) = target.log {
        // SAFETY: the host vouches for its function and pointer; the text ends with a zero byte.
        unsafe { log(target.user, words.as_ptr()) }
    }
}
