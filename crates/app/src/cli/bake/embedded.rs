//! The embedded motions, baked once for each build of the command.
//!
//! A bake of them takes seconds and gives the same bytes on every machine. What the first command has baked is kept in the
//! user's cache folder, where later ones read it. The file's name has the checksum of the program, so another build bakes anew.

use std::path::{Path, PathBuf};
use std::time::SystemTime;
use std::{env, fs, io};

use etcetera::BaseStrategy;
use sabaki::archive;
use sabaki::maps::BakedGraph;
use sabaki_import::MeshFile;

use super::super::Failure;
use super::run::{Baked, bake_embedded};

/// The graph to query.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct GraphArgs {
    /// Graph written by `bake`. Default: the embedded motions.
    baked: Option<PathBuf>,
}

impl GraphArgs {
    /// The mesh that the graph's file keeps.
    pub(crate) fn mesh(&self) -> Result<Option<MeshFile>, Failure> {
        let Some(path) = &self.baked else {
            return Ok(None);
        };
        let attachment = archive::read_attachment(path)?;
        if attachment.is_empty() {
            return Ok(None);
        }
        let file = postcard::from_bytes(&attachment);
        let wrong =
            |error: postcard::Error| Failure::Usage(format!("its mesh: {error}")).within(path);
        file.map(Some).map_err(wrong)
    }

    /// Whether it is the graph of the embedded motions.
    pub(crate) fn is_embedded(&self) -> bool {
        self.baked.is_none()
    }

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
            None => embedded(),
        }
    }
}

/// Number of files that are kept, of as many builds.
const KEPT: usize = 4;

/// The embedded motions, from the cache folder or baked now.
fn embedded() -> Result<BakedGraph, Failure> {
    read_or_bake(cache_file().as_deref(), || Ok(bake_embedded()?.graph))
}

/// Bakes the embedded motions anew, for later commands too.
pub(crate) fn embedded_anew() -> Result<Baked, Failure> {
    let baked = bake_embedded()?;
    keep(&baked.graph, cache_file().as_deref());
    Ok(baked)
}

/// The file of this build; `None` where the system has no cache folder.
fn cache_file() -> Option<PathBuf> {
    let program = fs::read(env::current_exe().ok()?).ok()?;
    let (checksum, length) = (crc32fast::hash(&program), program.len());
    let name = format!("embedded-{checksum:08x}-{length:x}.sabaki");
    let folder = etcetera::choose_base_strategy().ok()?.cache_dir();
    Some(folder.join("sabaki").join(name))
}

/// Reads a file; one that is missing or damaged is made.
fn read_or_bake(
    file: Option<&Path>,
    bake: impl FnOnce() -> Result<BakedGraph, Failure>,
) -> Result<BakedGraph, Failure> {
    if let Some(graph) = file.and_then(|file| archive::read(file).ok()) {
        return Ok(graph);
    }
    let graph = bake()?;
    keep(&graph, file);
    Ok(graph)
}

/// Writes a file. If that fails, later commands take the time of a bake, and nothing else changes.
fn keep(graph: &BakedGraph, file: Option<&Path>) {
    if let Some(file) = file
        && let Err(error) = write(graph, file)
    {
        tracing::debug!(%error, file = %file.display(), "the embedded motions are not kept");
    }
}

/// Writes a file, and removes those of the oldest builds beside it.
fn write(graph: &BakedGraph, file: &Path) -> io::Result<()> {
    let Some(folder) = file.parent() else {
        return Ok(());
    };
    fs::create_dir_all(folder)?;
    archive::write(file, graph).map_err(io::Error::other)?;
    let mut files: Vec<(SystemTime, PathBuf)> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with("embedded-") {
            files.push((entry.metadata()?.modified()?, entry.path()));
        }
    }
    files.sort_unstable_by(|a, b| b.cmp(a));
    for (_, oldest) in files.iter().skip(KEPT) {
        fs::remove_file(oldest)?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use sabaki_fixtures::small::small;

    fn bytes_of(graph: &BakedGraph) -> Vec<u8> {
        archive::to_bytes(graph).unwrap()
    }

    #[test]
    fn a_file_that_is_missing_or_damaged_is_made_and_a_sound_one_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("cache/sabaki/embedded-0.sabaki");
        let expected = bytes_of(small());
        for before in [None, Some(&expected[..expected.len() / 2]), Some(b"")] {
            if let Some(damaged) = before {
                fs::write(&file, damaged).unwrap();
            }
            let mut bakes = 0;
            for _ in 0..3 {
                let graph = read_or_bake(Some(&file), || {
                    bakes += 1;
                    Ok(small().clone())
                });
                assert_eq!(bytes_of(&graph.unwrap()), expected);
                assert_eq!(fs::read(&file).unwrap(), expected);
            }
            assert_eq!(bakes, 1);
        }
    }

    #[test]
    fn the_oldest_files_and_no_others_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let named = |name: String| folder.path().join(name);
        let old = |age: u64| SystemTime::now() - std::time::Duration::from_secs(3600 * age);
        for age in 1..=6 {
            let file = fs::File::create(named(format!("embedded-{age}.sabaki"))).unwrap();
            file.set_modified(old(age)).unwrap();
        }
        let other = fs::File::create(named("mine.sabaki".to_owned())).unwrap();
        other.set_modified(old(100)).unwrap();
        write(small(), &named("embedded-9.sabaki".to_owned())).unwrap();
        let mut left: Vec<String> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        left.sort_unstable();
        let embedded = ["1", "2", "3", "9"].map(|age| format!("embedded-{age}.sabaki"));
        assert_eq!(left[..4], embedded);
        assert_eq!(left[4..], ["mine.sabaki"]);
    }
}
