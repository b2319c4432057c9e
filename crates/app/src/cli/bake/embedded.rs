//! The embedded motions, baked once for each build of the command.
//!
//! A bake of them takes seconds and gives the same bytes on every machine. What the first command has baked is kept in the
//! user's cache folder, where later ones read it. The file has the checksum of the program beside the graph, so another build bakes anew.

use std::path::{Path, PathBuf};
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

/// The file in the cache folder, and the checksum of the program that it is for.
struct Cache {
    file: PathBuf,
    build: Vec<u8>,
}

/// The embedded motions, from the cache folder or baked now.
fn embedded() -> Result<BakedGraph, Failure> {
    read_or_bake(cache().as_ref(), || Ok(bake_embedded()?.graph))
}

/// Bakes the embedded motions anew, for later commands too.
pub(crate) fn embedded_anew() -> Result<Baked, Failure> {
    let baked = bake_embedded()?;
    keep(&baked.graph, cache().as_ref());
    Ok(baked)
}

/// The cache of this build; `None` where the system has no cache folder.
fn cache() -> Option<Cache> {
    let program = fs::read(env::current_exe().ok()?).ok()?;
    let build = format!("{:08x}-{:x}", crc32fast::hash(&program), program.len());
    let folder = etcetera::choose_base_strategy().ok()?.cache_dir();
    Some(Cache {
        file: folder.join("sabaki/embedded.sabaki"),
        build: build.into_bytes(),
    })
}

/// Reads the file of this build; one that is missing, damaged or another build's is made.
fn read_or_bake(
    cache: Option<&Cache>,
    bake: impl FnOnce() -> Result<BakedGraph, Failure>,
) -> Result<BakedGraph, Failure> {
    let is_own = |cache: &&Cache| {
        archive::read_attachment(&cache.file).is_ok_and(|build| build == cache.build)
    };
    let own = cache.filter(is_own);
    if let Some(graph) = own.and_then(|cache| archive::read(&cache.file).ok()) {
        return Ok(graph);
    }
    let graph = bake()?;
    keep(&graph, cache);
    Ok(graph)
}

/// Writes the file. If that fails, later commands take the time of a bake, and nothing else changes.
fn keep(graph: &BakedGraph, cache: Option<&Cache>) {
    let Some(Cache { file, build }) = cache else {
        return;
    };
    let folder = file.parent().unwrap_or(Path::new(""));
    let written = fs::create_dir_all(folder)
        .and_then(|()| archive::write_with(file, graph, build).map_err(io::Error::other));
    if let Err(error) = written {
        tracing::debug!(%error, file = %file.display(), "the embedded motions are not kept");
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use sabaki_fixtures::small::small;

    #[test]
    fn a_file_that_is_missing_damaged_or_of_another_build_is_made_and_a_sound_one_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let (file, build) = (folder.path().join("cache/sabaki/e.sabaki"), b"1".to_vec());
        let cache = Cache { file, build };
        let file = &cache.file;
        let expected = archive::to_bytes(small()).unwrap();
        let others: [&dyn Fn(); 4] = [
            &|| {},
            &|| fs::write(file, &expected[..expected.len() / 2]).unwrap(),
            &|| fs::write(file, b"").unwrap(),
            &|| archive::write_with(file, small(), b"2").unwrap(),
        ];
        for before in others {
            before();
            let mut bakes = 0;
            for _ in 0..3 {
                let graph = read_or_bake(Some(&cache), || {
                    bakes += 1;
                    Ok(small().clone())
                });
                assert_eq!(archive::to_bytes(&graph.unwrap()).unwrap(), expected);
                assert_eq!(archive::read_attachment(file).unwrap(), b"1");
            }
            assert_eq!(bakes, 1);
        }
    }
}
