//! Work shared out among threads, with results in order; and a pool of threads that share the work of each frame.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::thread::{JoinHandle, Thread};

/// Returns `work(0)` to `work(count - 1)`, in order, computed by `threads` threads; 0 for as many as the machine has. Each
/// thread takes short runs of neighbouring items, so that long items do not hold up others and short ones have little
/// overhead.
pub fn in_parallel<T: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    /// Number of runs for each thread, if there are enough items.
    const RUNS: usize = 16;
    let threads = thread_count(threads).min(count).max(1);
    let length = (count / (threads * RUNS)).max(1);
    let mut runs = Vec::new();
    runs.resize_with(count.div_ceil(length), Vec::new);
    each_on(
        threads,
        runs.iter_mut().enumerate(),
        |(number, run), (): &mut ()| {
            let first = number * length;
            let items = first..(first + length).min(count);
            *run = items.map(&work).collect();
        },
    );
    runs.into_iter().flatten().collect()
}

/// Locks a mutex, also after a panic of another thread.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Calls `work` once on each part, on as many threads as the machine has. Each thread has its own scratch.
pub fn each<T: Send, S: Default>(
    parts: impl Iterator<Item = T> + Send,
    work: impl Fn(T, &mut S) + Sync,
) {
    each_on(thread_count(0), parts, work);
}

fn each_on<T: Send, S: Default>(
    threads: usize,
    parts: impl Iterator<Item = T> + Send,
    work: impl Fn(T, &mut S) + Sync,
) {
    let parts = Mutex::new(parts);
    let next = || lock(&parts).next();
    on_threads(threads, &|| {
        let mut scratch = S::default();
        while let Some(part) = next() {
            work(part, &mut scratch);
        }
    });
}

/// Runs `a` and `b` at the same time, on two threads, and returns their results.
pub fn both<A: Send, B>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B) -> (A, B) {
    std::thread::scope(|scope| {
        let a = scope.spawn(a);
        let b = b();
        (a.join().unwrap_or_else(|panic| resume_unwind(panic)), b)
    })
}

/// Runs `work` on a number of threads, including the caller's. The function is not generic, so that the code that starts and
/// joins threads is compiled once.
fn on_threads(threads: usize, work: &(dyn Fn() + Sync)) {
    std::thread::scope(|scope| {
        let workers: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        work();
        for worker in workers {
            worker.join().unwrap_or_else(|panic| resume_unwind(panic));
        }
    });
}

/// The number of threads for a setting: 0 for as many as the machine has. At most 1024.
pub fn thread_count(setting: usize) -> usize {
    /// More threads would only cost time and memory.
    const MOST_THREADS: usize = 1024;
    let threads = match setting {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    threads.min(MOST_THREADS)
}

/// Number of times that a thread polls for new work before it sleeps: about 50 microseconds.
const SPINS: u32 = 2_000;

/// Stack size of a worker, in bytes. Only what is used of it is memory.
const STACK: usize = 16 << 20;

/// Threads that wait for work, because work of a tenth of a millisecond is too short to start threads for. They end when the
/// pool is dropped. The pool does not wait for a thread that wakes late because another process has its core:
/// [`WorkerPool::run`] returns when the work that was begun is done.
pub struct WorkerPool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
}

struct Shared {
    /// The number of the piece of work, the flag [`OPEN`], and the number of workers that are running it ([`INSIDE`]).
    gate: AtomicU64,
    work: Mutex<Option<Work>>,
    closing: AtomicBool,
    panic: Mutex<Option<Box<dyn std::any::Any + Send>>>,
    caller: Mutex<Option<Thread>>,
}

/// Flag: workers may begin the work.
const OPEN: u64 = 1 << 15;
/// Bits that hold the number of workers that have begun and are not done.
const INSIDE: u64 = OPEN - 1;
/// Lowest bit of the number of the piece of work.
const TURN: u64 = 1 << 16;

type Task<'a> = dyn Fn(usize) + Sync + 'a;

/// The work of one [`WorkerPool::run`], which does not return before all workers that began it are done.
#[derive(Clone, Copy)]
struct Work(&'static Task<'static>);

impl WorkerPool {
    /// Creates a pool with this number of threads, including the caller of [`WorkerPool::run`]. It has fewer if the system refuses more.
    pub fn new(threads: usize) -> Self {
        let shared = Arc::new(Shared {
            gate: AtomicU64::new(0),
            work: Mutex::new(None),
            closing: AtomicBool::new(false),
            panic: Mutex::new(None),
            caller: Mutex::new(None),
        });
        let worker = |part| {
            let shared = Arc::clone(&shared);
            // Kernels that are not optimised, as in debug builds, have stack frames of megabytes.
            let builder = thread::Builder::new().stack_size(STACK);
            builder.spawn(move || shared.serve(part))
        };
        Self {
            workers: (1..threads.clamp(1, INSIDE as usize))
                .map_while(|part| worker(part).ok())
                .collect(),
            shared,
        }
    }

    /// Number of threads, the caller included.
    pub fn threads(&self) -> usize {
        self.workers.len() + 1
    }

    /// Calls `work(0)` on this thread, and `work(1)` to `work(threads - 1)` on the others, each at most once: a thread that is
    /// not free before `work(0)` returns is left out. So `work` must take what there is to do piece by piece until none is
    /// left. Returns when all calls have; a panic of one of them continues here. Allocates nothing.
    pub fn run(&mut self, work: &(impl Fn(usize) + Sync)) {
        if self.workers.is_empty() {
            work(0);
            return;
        }
        let task: &Task<'_> = work;
        // SAFETY: only the lifetime changes. The reference is gone before this function returns or unwinds: no worker begins
        // once the gate is closed, and this function waits until those that began are done.
        let task = unsafe { std::mem::transmute::<&Task<'_>, &'static Task<'static>>(task) };
        *lock(&self.shared.work) = Some(Work(task));
        *lock(&self.shared.caller) = Some(thread::current());
        let gate = &self.shared.gate;
        let turn = gate.load(Ordering::Relaxed) / TURN + 1;
        gate.store((turn * TURN) | OPEN, Ordering::Release);
        for worker in &self.workers {
            worker.thread().unpark();
        }
        let own = catch_unwind(AssertUnwindSafe(|| work(0)));
        gate.fetch_and(!OPEN, Ordering::AcqRel);
        wait(|| gate.load(Ordering::Acquire) & INSIDE == 0);
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
            // A worker catches the panics of its work: the result says nothing.
            let _ = worker.join();
        }
    }
}

impl Shared {
    /// The loop of a worker.
    fn serve(&self, part: usize) {
        let mut done = 0;
        let is_new = |gate: u64, done: u64| gate & OPEN != 0 && gate / TURN != done;
        loop {
            wait(|| {
                is_new(self.gate.load(Ordering::Acquire), done)
                    || self.closing.load(Ordering::Acquire)
            });
            if self.closing.load(Ordering::Acquire) {
                return;
            }
            let gate = self.gate.load(Ordering::Acquire);
            let (entered, missed) = (Ordering::AcqRel, Ordering::Relaxed);
            if !is_new(gate, done)
                || self
                    .gate
                    .compare_exchange(gate, gate + 1, entered, missed)
                    .is_err()
            {
                continue;
            }
            done = gate / TURN;
            let work = *lock(&self.work);
            if let Some(Work(task)) = work
                && let Err(panic) = catch_unwind(AssertUnwindSafe(|| task(part)))
            {
                *lock(&self.panic) = Some(panic);
            }
            let caller = lock(&self.caller).clone();
            self.gate.fetch_sub(1, Ordering::Release);
            if let Some(caller) = caller {
                caller.unpark();
            }
        }
    }
}

/// Spins, then sleeps, until `is_so` returns true. The thread that makes it true unparks this one.
fn wait(is_so: impl Fn() -> bool) {
    for _ in 0..SPINS {
        if is_so() {
            return;
        }
        std::hint::spin_loop();
    }
    while !is_so() {
        thread::park();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn two_things_are_done() {
        assert_eq!(both(|| 1, || 2), (1, 2));
    }

    #[test]
    fn each_part_is_worked_on_once() {
        let mut list = vec![0u32; 100];
        each(
            list.iter_mut().zip(0..),
            |(value, number), before: &mut Option<u32>| {
                assert!(before.replace(number).is_none_or(|before| before < number));
                *value += number;
            },
        );
        assert!(list.into_iter().eq(0..100));
    }

    #[test]
    fn a_setting_is_taken_at_its_word_up_to_a_limit() {
        assert!(thread_count(0) >= 1);
        assert_eq!([1, 7, 1024].map(thread_count), [1, 7, 1024]);
        assert_eq!([1025, 999_999, usize::MAX].map(thread_count), [1024; 3]);
    }

    #[test]
    fn results_come_in_order_for_any_number_of_threads() {
        for threads in 0..6 {
            for count in [0, 1, 2, 7, 100] {
                let squares = in_parallel(threads, count, |index| index * index);
                let expected: Vec<usize> = (0..count).map(|index| index * index).collect();
                assert_eq!(squares, expected, "{threads} threads, {count} pieces");
            }
        }
    }

    #[test]
    fn each_piece_is_done_once_each_time() {
        for threads in 1..5 {
            let mut pool = WorkerPool::new(threads);
            let counts: Vec<AtomicUsize> = (0..50).map(|_| AtomicUsize::new(0)).collect();
            for _ in 0..200 {
                let next = AtomicUsize::new(0);
                pool.run(&|thread: usize| {
                    assert!(thread < threads);
                    while let Some(count) = counts.get(next.fetch_add(1, Ordering::Relaxed)) {
                        count.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
            let counts: Vec<usize> = counts.into_iter().map(AtomicUsize::into_inner).collect();
            assert_eq!(counts, vec![200; 50]);
        }
    }

    /// Runs a piece of work that ends when all threads have begun it.
    fn run_on_all(pool: &mut WorkerPool, work: impl Fn(usize) + Sync) {
        let threads = pool.threads();
        let begun = AtomicUsize::new(0);
        pool.run(&|thread| {
            begun.fetch_add(1, Ordering::AcqRel);
            while begun.load(Ordering::Acquire) < threads {
                thread::yield_now();
            }
            work(thread);
        });
    }

    #[test]
    fn sleeping_workers_wake() {
        let mut pool = WorkerPool::new(3);
        let count = AtomicUsize::new(0);
        for _ in 0..3 {
            thread::sleep(std::time::Duration::from_millis(5));
            run_on_all(&mut pool, |_| {
                count.fetch_add(1, Ordering::Relaxed);
            });
        }
        assert_eq!(count.into_inner(), 9);
    }

    #[test]
    fn a_panic_continues_at_the_caller_and_the_pool_survives() {
        let mut pool = WorkerPool::new(3);
        for panicking in 0..3 {
            let caught = catch_unwind(AssertUnwindSafe(|| {
                run_on_all(&mut pool, |part| {
                    assert!(part != panicking, "part {part}");
                });
            }));
            assert!(caught.is_err());
        }
        let count = AtomicUsize::new(0);
        run_on_all(&mut pool, |_| {
            count.fetch_add(1, Ordering::Relaxed);
        });
        assert_eq!(count.into_inner(), 3);
    }
}
