//! Progress reports of a bake, and how to stop it.

use crate::math::in_parallel;
use std::fmt::Debug;
use std::sync::atomic::{AtomicU64, Ordering};

/// A long stage of a bake, in the order of execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BakeStage {
    /// Compares windows. Progress counts pairs.
    Transitions,
    /// Tests transitions for feet that are too fast and pushes that are too hard.
    Feet,
    /// Searches links of events that the graph would drop. The stage may be repeated.
    Joins,
    /// Searches links to evasions. Progress counts clips.
    Links,
    /// Chooses links to evasions, goal by goal.
    Choice,
    /// Tests entries, exits and layers. Progress counts batches of moments.
    Entries,
    /// Tests exits of moments without a branch point.
    Exits,
}

/// Progress of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeProgress {
    /// The stage.
    pub stage: BakeStage,
    /// Number of finished pieces of work.
    pub done: u64,
    /// Number of all pieces of work of the stage.
    pub all: u64,
}

/// Receives the progress of a bake, and may stop it. All threads of the bake call it.
pub trait BakeWatch: Sync + Debug {
    /// Receives the progress of a stage.
    fn progress(&self, progress: BakeProgress);

    /// Whether the bake should stop. Once it returns `true`, it must keep returning `true`.
    fn is_stopped(&self) -> bool;
}

/// A watch that ignores progress and never stops a bake.
#[derive(Clone, Copy, Debug)]
pub struct Unwatched;

impl BakeWatch for Unwatched {
    fn progress(&self, _: BakeProgress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}

/// The watch stopped the bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stopped;

impl dyn BakeWatch + '_ {
    pub(crate) fn check(&self) -> Result<(), Stopped> {
        match self.is_stopped() {
            true => Err(Stopped),
            false => Ok(()),
        }
    }

    pub(crate) fn stage(&self, stage: BakeStage, threads: usize) -> WatchedStage<'_> {
        WatchedStage {
            watch: self,
            stage,
            threads,
        }
    }
}

#[derive(Clone, Copy)]
pub(crate) struct WatchedStage<'a> {
    watch: &'a dyn BakeWatch,
    stage: BakeStage,
    threads: usize,
}

impl WatchedStage<'_> {
    /// Runs the pieces of work of the stage, like [`in_parallel`]. After a stop, only the results of the first pieces are returned.
    pub(crate) fn in_parallel<T: Send>(
        self,
        count: usize,
        work: impl Fn(usize) -> T + Sync,
    ) -> Vec<T> {
        let done = AtomicU64::new(0);
        let results = in_parallel(self.threads, count, |index| {
            self.watch.check().ok()?;
            let result = work(index);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            self.progress(done, count as u64);
            Some(result)
        });
        results.into_iter().map_while(|result| result).collect()
    }

    pub(crate) fn progress(self, done: u64, all: u64) {
        self.watch.progress(BakeProgress {
            stage: self.stage,
            done,
            all,
        });
    }
}
