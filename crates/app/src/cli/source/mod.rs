//! Where a graph comes from: a baked file, clips, or the embedded motions.

mod args;
mod bake;
mod bake_bar;
mod embedded;
mod statistics;

pub(crate) use args::{ClipArgs, ReadArgs};
pub(crate) use bake::{
    BakeInput, BuiltGraph, from_clips, from_clips_with, from_graph, graph_of_clips,
};
pub(crate) use bake_bar::BakeBar;
pub(crate) use embedded::embedded_anew;
pub(crate) use statistics::{describe, left_out_and_notes, statistics};

use std::path::{Path, PathBuf};

use sabaki::archive;
use sabaki::graph::BuildReport;
use sabaki::internal::FootSlide;
use sabaki::maps::BakedGraph;

use super::Failure;
use super::figure::Figure;

/// The graph to query.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct GraphArgs {
    /// Graph written by `bake`. Default: --clips, or the embedded motions without them.
    baked: Option<PathBuf>,
    #[command(flatten)]
    clips: ClipArgs,
}

impl GraphArgs {
    /// All files and folders that are read.
    pub(crate) fn files(&self) -> Vec<&Path> {
        let baked = self.baked.iter().map(PathBuf::as_path);
        baked.chain(self.clips.files()).collect()
    }

    /// Refuses a graph that is given where none is read.
    pub(crate) fn check_unused(&self, by: &str) -> Result<(), Failure> {
        match self.files().first() {
            Some(path) => Err(Failure::Usage(format!(
                "{by} takes no graph and no clips ({})",
                path.display()
            ))),
            None => self.clips.read.check_unused("--clips"),
        }
    }

    /// Loads or builds the graph, and prepares it, so that no query that is measured or seen computes what later ones use.
    pub(crate) fn load(&self) -> Result<Baked, Failure> {
        let baked = self.load_unprepared()?;
        baked.graph.prepare();
        Ok(baked)
    }

    /// Loads or builds the graph for a command that asks no query.
    pub(crate) fn load_unprepared(&self) -> Result<Baked, Failure> {
        if self.clips.clips.is_empty() {
            self.clips.read.check_unused("--clips")?;
        }
        match (&self.baked, self.clips.clips.is_empty()) {
            (_, true) if self.clips.events.is_some() => {
                Err(Failure::Usage("--events needs --clips".to_owned()))
            }
            (Some(_), false) => Err(Failure::Usage(
                "either a baked graph or --clips, not both".to_owned(),
            )),
            (Some(path), true) => from_file(path),
            (None, false) => from_clips(&self.clips),
            (None, true) => embedded::embedded(),
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

/// Reads a baked file.
pub(crate) fn from_file(path: &Path) -> Result<Baked, Failure> {
    Ok(Baked {
        graph: archive::read(path)?,
        made: None,
    })
}
