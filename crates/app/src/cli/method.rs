//! Culling paths and sources of candidates, as options.

use clap::ValueEnum;
use sabaki::query::{CullPath, Enumerate, QuerySettings};

use super::culling::{Culling, path_parser};
use super::numbers::whole;

/// The methods to run.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Culling")]
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
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>(0..=1024))]
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

impl From<LookupArg> for Enumerate {
    fn from(lookup: LookupArg) -> Self {
        match lookup {
            LookupArg::Nearest => Self::NearestCell,
            LookupArg::NearestFiled => Self::NearestFiledCell,
            LookupArg::Union => Self::TouchedCells,
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

    /// Whether culling paths are named, and each of them needs a device.
    pub(crate) fn all_need_device(&self) -> bool {
        !self.cull.is_empty() && self.cull.iter().all(|path| path.needs_device())
    }

    /// Each culling path with each kind of grid.
    pub(crate) fn methods(&self, culling: &Culling) -> Vec<Method> {
        let culls = match self.cull.as_slice() {
            [] => vec![culling.best()],
            some => some.to_vec(),
        };
        let grids = self.grid.iter().map(|grid| match grid {
            GridArg::On => Enumerate::from(self.lookup),
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
        if self.enumerate.uses_grid() {
            "on"
        } else {
            "off"
        }
    }
}
