//! The folder in which several processes share a bake.
//!
//! ```text
//! plan          settings and number of shards
//! clips         skeleton, clips and events, from which the graph is built
//! points        points of all clips, which the search reads
//! shards/I      minima of the windows that shard I compares
//! graph         the graph that follows from all shards
//! entries/I     entries of share I of all moments
//! ```
//! Each file has a mark, the checksum of the plan and a checksum of its contents, 16 bytes together; the contents are the version and name of
//! the part and its data, serialized by postcard. Files are complete or not there. A process needs no other process: it may be killed, or run
//! twice.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use sabaki::anim::{Clip, Event, Skeleton};
use sabaki::archive::{open_regular, write_atomically};
use sabaki::graph::search::{MapBand, Minimum, PointCloud, PrunedSearch, SearchSettings, Windows};
use sabaki::graph::{ClipSource, GraphBuilder, GraphSettings};
use sabaki::maps::{BakeSettings, EntryShare, MomentShare};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::super::Failure;
use super::super::output::usage;
use super::MapDrawing;
use super::args::PART;
use super::bar::BakeBar;
use super::run::{Bake, BakeInput, Baked, BuiltGraph, finish};

/// Length of mark and checksums, in bytes.
const HEADER: usize = 16;

pub(super) const MOST_SHARDS: usize = 100_000;

/// What all steps of a bake share.
#[derive(Serialize, Deserialize)]
pub(super) struct Plan {
    pub(super) shards: usize,
    search: SearchSettings,
    graph: GraphSettings,
    settings: BakeSettings,
    /// Files that were left out, with the reasons.
    pub(super) left_out: Vec<String>,
    /// What is doubtful in the input.
    pub(super) notes: Vec<String>,
    /// As [`Baked::mesh`].
    mesh: Vec<u8>,
    /// Checksums of clips and points, so that plans of other input differ.
    inputs: [u32; 2],
}

pub(super) struct SharedBake {
    folder: PathBuf,
    pub(super) plan: Plan,
    /// Checksum of the plan, by which its files are told from those of another one.
    id: u32,
}

/// The step that was done for a shard: its name, what it did as text, and its figures.
pub(super) type ShardStep = (&'static str, String, Value);

/// A file whose contents are not what was written. Functions that read files return why one cannot be used.
const DAMAGED: &str = "damaged";

/// Divides bands into runs with about equal numbers of window pairs. Returns the shard of each band.
fn shards_of(bands: impl Iterator<Item = MapBand> + Clone, shards: usize) -> Vec<usize> {
    let all: u128 = bands.clone().map(|band| u128::from(band.pairs())).sum();
    let mut before = 0;
    let shard = |band: MapBand| {
        let shard = before * shards as u128 / all.max(1);
        before += u128::from(band.pairs());
        shard as usize
    };
    bands.map(shard).collect()
}

/// The contents of a part.
fn encode(part: &str, data: &impl Serialize) -> Result<Vec<u8>, Failure> {
    let name = format!("{} {part}", env!("CARGO_PKG_VERSION"));
    postcard::to_stdvec(&(name, data)).map_err(usage)
}

fn write(folder: &Path, part: &str, id: u32, contents: &[u8]) -> Result<(), Failure> {
    let path = folder.join(part);
    let written = write_atomically(&path, |file| {
        file.write_all(PART)?;
        file.write_all(&id.to_le_bytes())?;
        file.write_all(&crc32fast::hash(contents).to_le_bytes())?;
        file.write_all(contents)
    });
    written.map_err(Failure::file(&path))
}

/// Reads a part. Returns its data and the checksum of its contents.
fn read<T: DeserializeOwned>(folder: &Path, part: &str, id: u32) -> Result<(T, u32), String> {
    let mut bytes = Vec::new();
    let read = open_regular(&folder.join(part));
    match read.and_then(|mut file| file.read_to_end(&mut bytes)) {
        Ok(_) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Err("missing".to_owned()),
        Err(error) => return Err(format!("not readable ({error})")),
    }
    let (header, contents) = bytes.split_at_checked(HEADER).ok_or(DAMAGED)?;
    let crc32 = crc32fast::hash(contents);
    if header[..8] != *PART || header[12..] != crc32.to_le_bytes() {
        return Err(DAMAGED.to_owned());
    }
    let name = format!("{} {part}", env!("CARGO_PKG_VERSION"));
    match postcard::take_from_bytes::<&str>(contents) {
        Ok((found, data)) if found == name && header[8..12] == id.to_le_bytes() => {
            match postcard::take_from_bytes(data) {
                Ok((data, [])) => Ok((data, crc32)),
                _ => Err(DAMAGED.to_owned()),
            }
        }
        _ => Err("of another plan or version".to_owned()),
    }
}

impl SharedBake {
    /// Writes a plan, with the clips and their points. Returns the number of window pairs of each shard, too.
    pub(super) fn create(
        folder: &Path,
        input: &BakeInput,
        shards: usize,
    ) -> Result<(Self, Vec<u64>), Failure> {
        let bake = input.bake();
        let builder = GraphBuilder::new(bake.source, &bake.graph)?;
        let ClipSource {
            skeleton,
            clips,
            events,
        } = bake.source;
        let shards = shards.clamp(1, builder.bands().count().max(1));
        let mut pairs = vec![0; shards];
        for (shard, band) in shards_of(builder.bands(), shards)
            .into_iter()
            .zip(builder.bands())
        {
            pairs[shard] += band.pairs();
        }
        let inputs = [
            ("clips", encode("clips", &(skeleton, clips, events))?),
            ("points", encode("points", &builder.clouds())?),
        ];
        let plan = Plan {
            shards,
            search: builder.search(),
            inputs: inputs
                .each_ref()
                .map(|(_, contents)| crc32fast::hash(contents)),
            left_out: input.set.left_out.clone(),
            notes: input.notes(),
            mesh: input.mesh.clone(),
            graph: bake.graph.clone(),
            settings: bake.settings.clone(),
        };
        for part in ["shards", "entries"] {
            let path = folder.join(part);
            std::fs::create_dir_all(&path).map_err(Failure::file(&path))?;
        }
        let contents = encode("plan", &plan)?;
        let id = crc32fast::hash(&contents);
        for (part, contents) in &inputs {
            write(folder, part, id, contents)?;
        }
        write(folder, "plan", 0, &contents)?;
        let folder = folder.to_owned();
        Ok((Self { folder, plan, id }, pairs))
    }

    /// Reads the plan of a folder.
    pub(super) fn open(folder: &Path) -> Result<Self, Failure> {
        let (plan, id): (Plan, u32) = read(folder, "plan", 0).map_err(|why| {
            let path = folder.join("plan");
            Failure::Usage(format!("{}: {why}; run bake plan", path.display()))
        })?;
        if !(1..=MOST_SHARDS).contains(&plan.shards) || plan.search.window == 0 {
            return Err(Failure::Usage(format!("{}: no plan", folder.display())));
        }
        let folder = folder.to_owned();
        Ok(Self { folder, plan, id })
    }

    fn read<T: DeserializeOwned>(&self, part: &str) -> Result<T, String> {
        read(&self.folder, part, self.id).map(|(data, _)| data)
    }

    fn write(&self, part: &str, data: &impl Serialize) -> Result<(), Failure> {
        write(&self.folder, part, self.id, &encode(part, data)?)
    }

    /// The files `PART/I` of all shards, or a line for each that cannot be used.
    fn read_all<T: DeserializeOwned>(&self, part: &str) -> Result<Vec<T>, Vec<String>> {
        let (mut found, mut lacking) = (Vec::new(), Vec::new());
        for shard in 0..self.plan.shards {
            match self.read(&format!("{part}/{shard}")) {
                Ok(data) => found.push(data),
                Err(why) => lacking.push(format!(
                    "{part}/{shard} is {why}: {}",
                    self.command("shard", &shard.to_string())
                )),
            }
        }
        match lacking.is_empty() {
            true => Ok(found),
            false => Err(lacking),
        }
    }

    fn input<T: DeserializeOwned>(&self, part: &str) -> Result<T, Failure> {
        self.read(part).map_err(|why| {
            let path = self.folder.join(part);
            Failure::Usage(format!("{}: {why}; run bake plan again", path.display()))
        })
    }

    /// Does the next step of a shard. Ctrl-C stops it.
    pub(super) fn step(&self, shard: usize, threads: usize) -> Result<ShardStep, Failure> {
        let entries = format!("entries/{shard}");
        if let Some(built) = self.graph() {
            if self.read::<EntryShare>(&entries).is_ok() {
                return Ok(("nothing", "nothing to do".to_owned(), json!({})));
            }
            let settings = BakeSettings {
                threads,
                ..self.plan.settings.clone()
            };
            let share = MomentShare {
                index: shard,
                of: self.plan.shards,
            };
            let found = share.find_entries(&built.graph, &settings, &BakeBar::new())?;
            self.write(&entries, &found)?;
            return Ok(("entries", "its entries are found".to_owned(), json!({})));
        }
        let minima = format!("shards/{shard}");
        if self.read::<Vec<Vec<Minimum>>>(&minima).is_err() {
            return self.search(shard, threads);
        }
        match self.read_all("shards") {
            Err(lacking) => {
                let told = format!("nothing to do before others\n{}", lacking.join("\n"));
                Ok(("wait", told, json!({})))
            }
            Ok(found) => {
                let built = self.build(&found)?;
                self.write("graph", &built)?;
                let told = "the graph is built from all shards".to_owned();
                Ok(("graph", told, json!({})))
            }
        }
    }

    fn search(&self, shard: usize, threads: usize) -> Result<ShardStep, Failure> {
        let watch = BakeBar::new();
        let clouds: Vec<PointCloud> = self.input("points")?;
        if !clouds.iter().all(PointCloud::is_sound) {
            return Err(Failure::Usage("points: damaged".to_owned()));
        }
        let frames: Vec<usize> = clouds.iter().map(PointCloud::frames).collect();
        let window = self.plan.search.window;
        let windows: Vec<Windows> = clouds
            .iter()
            .map(|cloud| Windows::new(cloud, window))
            .collect();
        let search = PrunedSearch::new(self.plan.search, windows.iter().collect(), threads);
        let bands = self.plan.search.bands(&frames);
        let shards = shards_of(bands.clone(), self.plan.shards);
        let own = bands
            .zip(&shards)
            .filter(|(_, of)| **of == shard)
            .map(|(band, _)| band);
        let (mut minima, mut distances) = (Vec::new(), 0);
        search.search(own, threads, &watch, |_, found| {
            distances += found.computed;
            minima.push(found.minima);
            Ok(())
        })?;
        self.write(&format!("shards/{shard}"), &minima)?;
        let count = minima.iter().map(Vec::len).sum::<usize>();
        let millions = distances as f64 * 1e-6;
        let told = format!("{count} minima, {millions:.1} million distances computed");
        let figures = json!({ "minima": count, "distances": distances });
        Ok(("search", told, figures))
    }

    /// The graph, if it is there and sound.
    fn graph(&self) -> Option<BuiltGraph> {
        let built: BuiltGraph = self.read("graph").ok()?;
        built.graph.validate().is_ok().then_some(built)
    }

    /// Builds the graph from the minima of each shard's bands.
    fn build(&self, found: &[Vec<Vec<Minimum>>]) -> Result<BuiltGraph, Failure> {
        let (skeleton, clips, events): (Skeleton, Vec<Clip>, Vec<Event>) = self.input("clips")?;
        let bake = Bake {
            source: ClipSource {
                skeleton: &skeleton,
                clips: &clips,
                events: &events,
            },
            graph: self.plan.graph.clone(),
            settings: self.plan.settings.clone(),
        };
        bake.build(&BakeBar::new(), |builder| {
            let (mut list, search) = (builder.transition_list(), builder.search());
            // The shards hold runs of all bands, in order.
            let mut found = found.iter().flatten();
            for band in builder.bands() {
                let minima = found.next().filter(|minima| band.admits(minima, &search));
                let minima = minima.ok_or_else(|| {
                    let folder = self.folder.display();
                    Failure::Usage(format!("{folder}: the shards are not those of the clips"))
                })?;
                list.add(band, minima)?;
            }
            Ok(list)
        })
    }

    /// Finishes the bake: it does what is not there of the steps that are not shared.
    pub(super) fn join(&self) -> Result<Baked, Failure> {
        let lacking = |lacking| Failure::Shards {
            lacking,
            all: self.plan.shards,
        };
        let built = match self.graph() {
            Some(built) => built,
            None => self.build(&self.read_all("shards").map_err(lacking)?)?,
        };
        let is_shared = (0..self.plan.shards)
            .any(|shard| self.folder.join(format!("entries/{shard}")).exists());
        let entries = match is_shared {
            true => self.read_all("entries").map_err(lacking)?,
            false => Vec::new(),
        };
        let mut baked = finish(
            built,
            self.plan.settings.clone(),
            entries,
            MapDrawing::Cpu,
            &BakeBar::new(),
        )?;
        baked.mesh.clone_from(&self.plan.mesh);
        baked.warnings.splice(..0, self.plan.notes.clone());
        baked.left_out.clone_from(&self.plan.left_out);
        Ok(baked)
    }

    /// A command of this program on the folder, as a shell reads it.
    pub(super) fn command(&self, step: &str, more: &str) -> String {
        let folder = quoted(&self.folder.display().to_string());
        format!("sabaki bake {step} {folder} {more}")
    }
}

/// A word as a shell reads it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
