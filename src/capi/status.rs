//! Status codes of calls, and their messages.

use std::cell::Cell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::log::log;
use crate::character::CharacterError;
use crate::gpu::GpuError;

/// `sabaki_status`.
pub(super) type Status = i32;

pub(super) const OK: Status = 0;
pub(super) const NOT_YET: Status = 1;
const ERROR: Status = -1;
const DEVICE_LOST: Status = -2;

/// Status and message of a failed call.
pub(super) struct Failure {
    status: Status,
    words: String,
}

impl From<String> for Failure {
    fn from(words: String) -> Self {
        Self {
            status: ERROR,
            words,
        }
    }
}

impl From<CharacterError> for Failure {
    fn from(error: CharacterError) -> Self {
        error.to_string().into()
    }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        Self {
            status: if error.is_device_lost() {
                DEVICE_LOST
            } else {
                ERROR
            },
            words: error.to_string(),
        }
    }
}

/// Length of [`LAST`], in bytes.
const LENGTH: usize = 2048;

thread_local! {
    /// The last message of this thread. It has no destructor, so that it is valid as long as the thread, because destructors may call functions
    /// too.
    static LAST: Cell<[u8; LENGTH]> = const { Cell::new([0; LENGTH]) };
}

/// Stores a message, truncated to the size of [`LAST`].
fn remember(words: &CStr) {
    let words = words.to_str().unwrap_or_default();
    let mut end = words.len().min(LENGTH - 1);
    while !words.is_char_boundary(end) {
        end -= 1;
    }
    let mut last = [0; LENGTH];
    last[..end].copy_from_slice(&words.as_bytes()[..end]);
    LAST.set(last);
}

/// Runs a call. Panics are caught and returned as a status.
pub(super) fn call(work: impl FnOnce() -> Result<Status, Failure>) -> Status {
    let ended = catch_unwind(AssertUnwindSafe(work));
    let ended = ended.unwrap_or_else(|_| Err("a fault in sabaki itself".to_owned().into()));
    ended.unwrap_or_else(|failure| {
        let words = CString::new(failure.words.replace('\0', " ")).unwrap_or_default();
        log(&words);
        remember(&words);
        failure.status
    })
}

exported! {
    unsafe extern "C" fn sabaki_last_error() -> *const c_char {
        LAST.with(|last| last.as_ptr().cast())
    }
}
