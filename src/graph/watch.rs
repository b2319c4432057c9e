//! What follows a bake, and may stop it.

use std::fmt::Debug;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::math::in_parallel;

/// A long stage of a bake, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BakeStage {
    /// Windows are compared, counted in pairs.
    Transitions,
    /// Transitions are tested for darting feet.
    Feet,
    /// Links of events that the graph would drop are searched. It may be repeated.
    Joins,
    /// Links to evasions are searched, clip by clip.
    Links,
    /// Links to evasions are chosen, goal by goal.
    Choice,
    /// Entries, exits and layers are tested, by batches of moments.
    Entries,
    /// Exits are tested of moments without a branch point.
    Exits,
}

/// What is done of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeProgress {
    /// The stage.
    pub stage: BakeStage,
    /// Pieces of work that are done.
    pub done: u64,
    /// All pieces of the stage.
    pub all: u64,
}

/// Follows a bake, and may stop it. Every thread of the bake calls it.
pub trait BakeWatch: Sync + Debug {
    /// Some work is done.
    fn progress(&self, progress: BakeProgress);

    /// Whether the bake stops here. Once it has stopped, it stays so.
    fn is_stopped(&self) -> bool;
}

/// Lets a bake go on to its end.
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

/// What a step of a bake made, and a record of it: a later bake takes it over or, if this one was stopped, goes on from it.
#[derive(Clone, Debug)]
pub struct Recorded<M, R> {
    /// `None` if the step was stopped.
    pub made: Option<M>,
    /// All that is known.
    pub record: R,
}

impl dyn BakeWatch + '_ {
    /// Returns an error if the bake stops here.
    pub(crate) fn check(&self) -> Result<(), Stopped> {
        match self.is_stopped() {
            true => Err(Stopped),
            false => Ok(()),
        }
    }

    /// A stage that `threads` threads work at.
    pub(crate) fn stage(&self, stage: BakeStage, threads: usize) -> WatchedStage<'_> {
        WatchedStage {
            watch: self,
            stage,
            threads,
        }
    }
}

/// A stage of a watched bake.
#[derive(Clone, Copy)]
pub(crate) struct WatchedStage<'a> {
    watch: &'a dyn BakeWatch,
    stage: BakeStage,
    threads: usize,
}

impl WatchedStage<'_> {
    /// Does the pieces of work of the stage, like [`in_parallel`]. After a stop the results are those of the first pieces.
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

    /// Some work is done.
    pub(crate) fn progress(self, done: u64, all: u64) {
        self.watch.progress(BakeProgress {
            stage: self.stage,
            done,
            all,
        });
    }
}
