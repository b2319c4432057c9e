//! Threads that stay: each frame's work is shared out among them in fixed parts.
//!
//! Work of a tenth of a millisecond is too short to start threads for, and too even to be stolen
//! from one another.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle, Thread};

/// How long a thread looks for new work before it goes to sleep: some 50 microseconds.
const PATIENCE: u32 = 2_000;

/// Of a worker, bytes: only what is used of it is memory.
const STACK: usize = 16 << 20;

/// Threads that wait for work. They end with it.
pub(crate) struct WorkerPool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
}

struct Shared {
    /// Counts the pieces of work; a worker that sees a new number does its part.
    turn: AtomicU64,
    work: Mutex<Option<Work>>,
    /// Workers that are not done yet.
    busy: AtomicUsize,
    closing: AtomicBool,
    panic: Mutex<Option<Box<dyn std::any::Any + Send>>>,
    caller: Mutex<Option<Thread>>,
}

type Task<'a> = dyn Fn(usize) + Sync + 'a;

/// The work of one [`WorkerPool::run`], which does not return before all workers are done with it.
#[derive(Clone, Copy)]
struct Work(&'static Task<'static>);

impl WorkerPool {
    /// `threads` of them, the caller of [`WorkerPool::run`] counted in.
    pub(crate) fn new(threads: usize) -> Self {
        let shared = Arc::new(Shared {
            turn: AtomicU64::new(0),
            work: Mutex::new(None),
            busy: AtomicUsize::new(0),
            closing: AtomicBool::new(false),
            panic: Mutex::new(None),
            caller: Mutex::new(None),
        });
        let worker = |part| {
            let shared = Arc::clone(&shared);
            // A kernel that is not optimised, as in debug builds, has a frame of megabytes.
            let builder = thread::Builder::new().stack_size(STACK);
            builder.spawn(move || shared.serve(part))
        };
        Self {
            // Where no more can be had, those that there are do.
            workers: (1..threads.max(1))
                .map_while(|part| worker(part).ok())
                .collect(),
            shared,
        }
    }

    /// How many threads, the caller counted in.
    pub(crate) fn threads(&self) -> usize {
        self.workers.len() + 1
    }

    /// `work(0)` to `work(threads - 1)`, each on its thread, the first on the caller's. Returns when
    /// all are done; a panic of one of them goes on here. Allocates nothing.
    pub(crate) fn run(&mut self, work: &(impl Fn(usize) + Sync)) {
        if self.workers.is_empty() {
            work(0);
            return;
        }
        let task: &Task<'_> = work;
        // SAFETY: only the lifetime changes. The reference is gone before this function returns or
        // unwinds: it waits until `busy` is 0, which each worker makes its last step, and takes the
        // work back.
        let task = unsafe { std::mem::transmute::<&Task<'_>, &'static Task<'static>>(task) };
        *lock(&self.shared.work) = Some(Work(task));
        *lock(&self.shared.caller) = Some(thread::current());
        self.shared
            .busy
            .store(self.workers.len(), Ordering::Relaxed);
        self.shared.turn.fetch_add(1, Ordering::Release);
        for worker in &self.workers {
            worker.thread().unpark();
        }
        let own = catch_unwind(AssertUnwindSafe(|| work(0)));
        wait(|| self.shared.busy.load(Ordering::Acquire) == 0);
        *lock(&self.shared.work) = None;
        if let Err(panic) = own {
            resume_unwind(panic);
        }
        if let Some(panic) = lock(&self.shared.panic).take() {
            resume_unwind(panic);
        }
    }
}

impl Drop for WorkerPool {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::Release);
        for worker in self.workers.drain(..) {
            worker.thread().unpark();
            // A worker catches what its work panics with; there is nothing to learn here.
            let _ = worker.join();
        }
    }
}

impl Shared {
    /// A worker's life.
    fn serve(&self, part: usize) {
        let mut done = 0;
        loop {
            wait(|| {
                self.turn.load(Ordering::Acquire) != done || self.closing.load(Ordering::Acquire)
            });
            if self.closing.load(Ordering::Acquire) {
                return;
            }
            done = self.turn.load(Ordering::Acquire);
            let work = *lock(&self.work);
            if let Some(Work(task)) = work
                && let Err(panic) = catch_unwind(AssertUnwindSafe(|| task(part)))
            {
                *lock(&self.panic) = Some(panic);
            }
            let caller = lock(&self.caller).clone();
            self.busy.fetch_sub(1, Ordering::Release);
            if let Some(caller) = caller {
                caller.unpark();
            }
        }
    }
}

/// Looks for a while, then sleeps; whoever makes it true unparks this thread.
fn wait(is_so: impl Fn() -> bool) {
    for _ in 0..PATIENCE {
        if is_so() {
            return;
        }
        std::hint::spin_loop();
    }
    while !is_so() {
        thread::park();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_is_done_once_each_time() {
        for threads in 1..5 {
            let mut pool = WorkerPool::new(threads);
            let counts: Vec<AtomicUsize> = (0..threads).map(|_| AtomicUsize::new(0)).collect();
            for _ in 0..200 {
                pool.run(&|part: usize| {
                    counts[part].fetch_add(1, Ordering::Relaxed);
                });
            }
            let counts: Vec<usize> = counts.into_iter().map(AtomicUsize::into_inner).collect();
            assert_eq!(counts, vec![200; threads]);
        }
    }

    #[test]
    fn a_sleeping_crew_wakes() {
        let mut pool = WorkerPool::new(3);
        let count = AtomicUsize::new(0);
        for _ in 0..3 {
            thread::sleep(std::time::Duration::from_millis(5));
            pool.run(&|_| {
                count.fetch_add(1, Ordering::Relaxed);
            });
        }
        assert_eq!(count.into_inner(), 9);
    }

    #[test]
    fn a_panic_goes_on_at_the_caller_and_the_crew_lives() {
        let mut pool = WorkerPool::new(3);
        for panicking in 0..3 {
            let caught = catch_unwind(AssertUnwindSafe(|| {
                pool.run(&|part| assert!(part != panicking, "part {part}"));
            }));
            assert!(caught.is_err());
        }
        let count = AtomicUsize::new(0);
        pool.run(&|_| {
            count.fetch_add(1, Ordering::Relaxed);
        });
        assert_eq!(count.into_inner(), 3);
    }
}
