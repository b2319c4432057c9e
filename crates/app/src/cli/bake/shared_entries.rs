//! The second half of a bake that several processes share: one builds the graph, and all test its entries.
//!
//! ```text
//! graph         the graph that follows from all shards
//! entries/I     tests of the entries of share I of all moments
//! ```
//! A join that finds no graph, or that of another plan, computes all of it by itself.

use std::path::PathBuf;

use sabaki::internal::{EntryShare, MomentShare};
use sabaki::maps::BakeSettings;

use super::super::Failure;
use super::super::source::{BakeBar, BuiltGraph};
use super::sealed::{self, Kind, Unusable};
use super::shared_bake::{SharedBake, command};

impl SharedBake {
    /// Reads the graph.
    pub(super) fn read_graph(&self) -> Result<BuiltGraph, Unusable> {
        let (built, _): (BuiltGraph, _) = sealed::read(&self.graph_file(), self.seal(Kind::Graph))?;
        match built.graph.validate() {
            Ok(()) => Ok(built),
            Err(_) => Err(Unusable::Damaged),
        }
    }

    /// Writes the graph.
    pub(super) fn write_graph(&self, built: &BuiltGraph) -> Result<(), Failure> {
        let path = self.folder().join("entries");
        std::fs::create_dir_all(&path).map_err(|source| Failure::Write { path, source })?;
        sealed::write(
            &self.graph_file(),
            self.seal(Kind::Graph),
            &sealed::encode(built)?,
        )
    }

    /// Tests the entries of a share, unless they are there and sound. Returns whether they were.
    pub(super) fn compute_entries(&self, share: usize, threads: usize) -> Result<bool, Failure> {
        if self.read_entries(share).is_ok() {
            return Ok(true);
        }
        let built = self.read_graph().map_err(|why| self.lacks_graph(&why))?;
        let settings = BakeSettings {
            threads,
            ..BakeSettings::default()
        };
        let own = MomentShare {
            index: share,
            of: self.shards(),
        };
        let found = own.find_entries(&built.graph, &settings, &BakeBar::new())?;
        let contents = sealed::encode(&(share, &found))?;
        sealed::write(
            &self.entries_file(share),
            self.seal(Kind::Entries),
            &contents,
        )?;
        Ok(false)
    }

    /// The graph and the tests of its entries, if they were shared; `None` if there is no graph of this plan.
    ///
    /// # Errors
    /// What is missing or damaged, each with the command that computes it.
    pub(super) fn shared_entries(&self) -> Result<Option<(BuiltGraph, Vec<EntryShare>)>, Failure> {
        let built = match self.read_graph() {
            Err(Unusable::Missing | Unusable::OtherPlan) => return Ok(None),
            built => built.map_err(|why| self.lacks_graph(&why))?,
        };
        let found = self.read_all(["entries", "are"], |share| self.read_entries(share))?;
        Ok(Some((built, found)))
    }

    /// What to run after the graph is built.
    pub(super) fn entries_commands(&self) -> String {
        let last = self.shards() - 1;
        format!(
            "test its entries: {}\nthen join:        {}",
            command(
                &["bake", "entries"],
                self.folder(),
                &[&format!("0 (to {last})")]
            ),
            command(&["bake", "join"], self.folder(), &["--out", "FILE"]),
        )
    }

    fn lacks_graph(&self, why: &Unusable) -> Failure {
        Failure::Usage(format!(
            "the graph of the plan is {why}: {}",
            command(&["bake", "graph"], self.folder(), &[])
        ))
    }

    fn read_entries(&self, share: usize) -> Result<EntryShare, Unusable> {
        let ((of_share, found), _): ((usize, EntryShare), _) =
            sealed::read(&self.entries_file(share), self.seal(Kind::Entries))?;
        (of_share == share)
            .then_some(found)
            .ok_or(Unusable::Damaged)
    }

    fn graph_file(&self) -> PathBuf {
        self.folder().join("graph")
    }

    fn entries_file(&self, share: usize) -> PathBuf {
        self.folder().join("entries").join(share.to_string())
    }
}
