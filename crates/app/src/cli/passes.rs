//! Answers the same attacks by one method after the other.

use clap::ValueEnum;
use sabaki::maps::BakedGraph;
use sabaki::math::{in_parallel, thread_count};
use sabaki::query::{Answer, CullPath, Enumerate, Lookup, QuerySettings};
use sabaki_app::demo::throw::Throw;

use super::culling::{Culling, path_parser};
use super::stats::{QueryRunner, Run};
use super::{Failure, cancel, output};

/// The methods to run.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MethodArgs {
    /// Culling paths, run one after the other on the same attacks. Default: stencil with a Vulkan
    /// device, else cpu.
    #[arg(long, value_delimiter = ',', value_parser = path_parser())]
    cull: Vec<CullPath>,
    /// Source of the candidates: the node's grid, with the whole search where the grid has none, or
    /// always the whole search. Both are run one after the other.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "on")]
    grid: Vec<GridArg>,
    /// Cells of the grid that are looked up.
    #[arg(long, value_enum, default_value = "union")]
    lookup: LookupArg,
    /// Threads of one query, which test candidates in parallel; 0 for all of the machine.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(0..=1024))]
    query_threads: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum GridArg {
    On,
    Off,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LookupArg {
    /// The cell nearest to the character, of those that the attack touches.
    Nearest,
    /// The nearest of these cells that holds a path which is in time.
    NearestFiled,
    /// All cells that the attack touches.
    Union,
}

impl From<LookupArg> for Lookup {
    fn from(lookup: LookupArg) -> Self {
        match lookup {
            LookupArg::Nearest => Self::Nearest,
            LookupArg::NearestFiled => Self::NearestFiled,
            LookupArg::Union => Self::Union,
        }
    }
}

/// A culling path and a source of candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Method {
    pub(crate) cull: CullPath,
    pub(crate) enumerate: Enumerate,
}

impl MethodArgs {
    /// Threads of each query.
    pub(crate) fn query_threads(&self) -> usize {
        self.query_threads as usize
    }

    /// Each culling path with each kind of grid.
    pub(crate) fn methods(&self, culling: &Culling) -> Vec<Method> {
        let culls = match self.cull.as_slice() {
            [] => vec![culling.best()],
            some => some.to_vec(),
        };
        let lookup = Lookup::from(self.lookup);
        let grids = self.grid.iter().map(|grid| match grid {
            GridArg::On => Enumerate::Grid(lookup),
            GridArg::Off => Enumerate::Whole,
        });
        let with = |cull: CullPath| {
            grids
                .clone()
                .map(move |enumerate| Method { cull, enumerate })
        };
        culls.into_iter().flat_map(with).collect()
    }
}

impl Method {
    /// The reference that the other methods are compared with.
    pub(crate) const EXACT: Self = Self {
        cull: CullPath::Exact,
        enumerate: Enumerate::Whole,
    };

    /// Settings of its queries.
    pub(crate) fn settings(self) -> QuerySettings {
        QuerySettings {
            enumerate: self.enumerate,
            ..QuerySettings::default()
        }
    }

    pub(crate) fn grid_name(self) -> &'static str {
        match self.enumerate {
            Enumerate::Grid(_) => "on",
            Enumerate::Whole => "off",
        }
    }
}

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

/// Answers all attacks with one method. `each` is called with each answer, which is then dropped.
pub(crate) fn pass(
    (baked, throws): (&BakedGraph, &[Throw]),
    settings: &PassSettings,
    culling: &mut Culling,
    each: impl Fn(usize, &QuerySettings, &Answer) -> Result<(), Failure> + Sync,
) -> Result<Pass, Failure> {
    let method = settings.method;
    let query = QuerySettings {
        list_late: settings.list_late,
        threads: settings.query_threads,
        ..method.settings()
    };
    culling.warm_up(method.cull, baked.atlas())?;
    cancel::listen();
    let bar = output::progress(method.cull.name(), throws.len() as u64);
    // Every n-th attack, from the given one on.
    let part = |first: usize, step: usize, culling: &mut Culling| {
        let mut runner = QueryRunner::new(baked);
        let numbered = throws.iter().enumerate().skip(first).step_by(step);
        let runs = numbered.map(|(index, throw)| {
            cancel::check()?;
            let run = runner.ask(&query, throw, (&mut *culling, method.cull))?;
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
