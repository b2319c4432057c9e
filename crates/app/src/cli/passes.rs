//! Answers the same attacks by one method after the other.

use sabaki::maps::BakedGraph;
use sabaki::math::{in_parallel, thread_count};
use sabaki::query::{Answer, QuerySettings};
use sabaki_fixtures::throw::Throw;

use super::culling::Culling;
pub(crate) use super::method::{LookupArg, Method, MethodArgs};
use super::stats::{QueryRunner, Run};
use super::{Failure, cancel, output};

/// The answers of one method to all attacks.
pub(crate) struct Pass {
    pub(crate) method: Method,
    pub(crate) runs: Vec<Run>,
}

/// Settings of a pass.
pub(crate) struct PassSettings {
    pub(crate) method: Method,
    /// Threads that share the attacks, for paths without a device; 0 for all of the machine.
    pub(crate) threads: usize,
    /// Threads of each query.
    pub(crate) query_threads: usize,
    /// Lists candidates that are not in time in the answers.
    pub(crate) list_late: bool,
}

/// Attacks on the characters of one graph.
#[derive(Clone, Copy)]
pub(crate) struct Attacks<'a> {
    pub(crate) baked: &'a BakedGraph,
    pub(crate) throws: &'a [Throw],
}

impl Attacks<'_> {
    /// Answers all attacks with one method. `each` is called with each answer, which is then dropped.
    pub(crate) fn pass(
        &self,
        settings: &PassSettings,
        culling: &mut Culling,
        each: impl Fn(usize, &QuerySettings, &Answer) -> Result<(), Failure> + Sync,
    ) -> Result<Pass, Failure> {
        let Self { baked, throws } = *self;
        let method = settings.method;
        let query = QuerySettings {
            list_late: settings.list_late,
            threads: settings.query_threads,
            ..method.settings()
        };
        culling.warm_up(method.cull, baked.atlas())?;
        let bar = output::progress(method.cull.name(), throws.len() as u64);
        // Every n-th attack, from the given one on.
        let part = |first: usize, step: usize, culling: &mut Culling| {
            let mut runner = QueryRunner::new(baked);
            let numbered = throws.iter().enumerate().skip(first).step_by(step);
            let runs = numbered.map(|(index, throw)| {
                cancel::check()?;
                let run = runner.ask(&query, throw, culling.on(method.cull))?;
                each(index, &query, &runner.answer)?;
                bar.inc(1);
                Ok(run)
            });
            runs.collect::<Result<Vec<Run>, Failure>>()
        };
        let threads = thread_count(settings.threads).min(throws.len()).max(1);
        let runs = if threads == 1 || method.cull.needs_device() {
            part(0, 1, culling)?
        } else {
            let parts = in_parallel(threads, threads, |first| {
                let mut culling = Culling::without_device("it is for one thread only".to_owned());
                part(first, threads, &mut culling)
            });
            let parts = parts.into_iter().collect::<Result<Vec<_>, Failure>>()?;
            let run = |index: usize| parts[index % threads][index / threads].clone();
            (0..throws.len()).map(run).collect()
        };
        bar.finish_and_clear();
        Ok(Pass { method, runs })
    }
}
