//! Threads that take cores from those that pose, as other processes do.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// Threads that never wait. They end when this is dropped.
pub(super) struct BusyThreads {
    closing: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl BusyThreads {
    pub(super) fn new(count: usize) -> Self {
        let closing = Arc::new(AtomicBool::new(false));
        let threads = (0..count).map(|_| {
            let closing = Arc::clone(&closing);
            thread::spawn(move || {
                while !closing.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })
        });
        let threads = threads.collect();
        Self { closing, threads }
    }
}

impl Drop for BusyThreads {
    fn drop(&mut self) {
        self.closing.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // It cannot panic.
            let _ = thread.join();
        }
    }
}
