//! Where a graph comes from: a baked file, or the embedded motions. Bakes of clips.

mod args;
mod bake;
mod bake_bar;
mod embedded;
mod statistics;

pub(crate) use args::{ClipArgs, ReadArgs};
pub(crate) use bake::{Bake, BakeInput, BuiltGraph, finish, from_clips};
pub(crate) use bake_bar::BakeBar;
pub(crate) use embedded::embedded_anew;
pub(crate) use statistics::{
    bake_statistics, describe, describe_bake, headline, left_out_and_notes, statistics,
};

use std::path::PathBuf;

use sabaki::archive;
use sabaki::graph::BuildReport;
use sabaki::graph::FootSlide;
use sabaki::maps::BakedGraph;

use super::Failure;
use super::figure::Figure;

/// The graph to query.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct GraphArgs {
    /// Graph written by `bake`. Default: the embedded motions.
    baked: Option<PathBuf>,
}

impl GraphArgs {
    /// Reads the graph and prepares it, so that no query that is measured or seen computes what later ones use.
    pub(crate) fn load(&self) -> Result<BakedGraph, Failure> {
        let baked = self.load_unprepared()?;
        baked.prepare();
        Ok(baked)
    }

    /// Reads the graph for a command that asks no query.
    pub(crate) fn load_unprepared(&self) -> Result<BakedGraph, Failure> {
        match &self.baked {
            Some(path) => Ok(archive::read(path)?),
            None => embedded::embedded(),
        }
    }
}

/// A graph, with its build report if it was built now.
pub(crate) struct Baked {
    pub(crate) graph: BakedGraph,
    pub(crate) made: Option<BuildSummary>,
}

/// Report on the build of a graph.
pub(crate) struct BuildSummary {
    pub(crate) report: BuildReport,
    pub(crate) feet: FootSlide,
    pub(crate) seconds: f64,
    pub(crate) warnings: Vec<String>,
    pub(crate) figure: Figure,
    /// Files that were left out, with the reasons.
    pub(crate) left_out: Vec<String>,
}
