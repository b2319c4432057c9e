//! A folder in which several processes share one bake.
//!
//! ```text
//! plan.json     manifest: settings, checksums of all inputs, number of shards
//! clips/I       points of clip I, which the search reads
//! shards/I      number of the shard, and the minima of its bands
//! ```
//! [`shared_entries`](super::shared_entries) has the files of the second half.
//! Files are complete or not there, and each has a checksum. A process needs no other process: it may be killed, or run twice.

use std::path::{Path, PathBuf};

use sabaki::internal::{
    BandMinima, BandParts, GraphBuilder, MapBand, Minimum, PointCloud, PrunedSearch,
    TransitionList, Windows,
};

use super::super::{Failure, cancel, output};
use super::manifest::{Manifest, PlanInput};
use super::partition::Partition;
use super::sealed::{self, Kind, Seal, Unusable};

/// Seal of the files of points.
const POINTS: Seal = Seal {
    kind: Kind::Points,
    plan: 0,
};

/// The folder of a divided bake.
pub(super) struct SharedBake {
    folder: PathBuf,
    manifest: Manifest,
    /// Checksum of the manifest. Shards of another plan have another one.
    plan: u32,
    partition: Partition,
}

/// Outcome of the work on a shard.
pub(super) enum ShardOutcome {
    /// A sound file of the shard existed.
    WasThere,
    /// The shard was computed.
    Computed {
        /// Number of minima.
        minima: usize,
        /// Number of window pairs whose distance was computed.
        distances: u64,
    },
}

impl SharedBake {
    /// Writes the plan and the points of all clips.
    pub(super) fn create(
        folder: &Path,
        input: PlanInput<'_>,
        builder: &GraphBuilder<'_>,
    ) -> Result<Self, Failure> {
        let mut manifest = Manifest::new(input, builder)?;
        manifest.shards = manifest.shards.clamp(1, builder.bands().count().max(1));
        let bytes = output::Done::json(&manifest.to_json()?).into_bytes();
        for part in ["clips", "shards"] {
            let path = folder.join(part);
            std::fs::create_dir_all(&path).map_err(|source| Failure::Write { path, source })?;
        }
        let bake = Self::new(folder, manifest, &bytes);
        for (clip, cloud) in builder.clouds().iter().enumerate() {
            sealed::write(&bake.points_file(clip), POINTS, &sealed::encode(cloud)?)?;
        }
        let path = folder.join("plan.json");
        sabaki::archive::write_atomically(&path, |file| std::io::Write::write_all(file, &bytes))
            .map_err(|source| Failure::Write { path, source })?;
        Ok(bake)
    }

    /// Reads the plan of a folder.
    pub(super) fn open(folder: &Path) -> Result<Self, Failure> {
        let path = folder.join("plan.json");
        let bytes = std::fs::read(&path).map_err(|source| Failure::Open {
            path: path.clone(),
            source,
        })?;
        Ok(Self::new(folder, Manifest::parse(&bytes, &path)?, &bytes))
    }

    fn new(folder: &Path, manifest: Manifest, bytes: &[u8]) -> Self {
        let frames: Vec<usize> = manifest.clips.iter().map(|clip| clip.frames).collect();
        Self {
            folder: folder.to_owned(),
            partition: Partition::new(
                manifest.search.bands(&frames).collect(),
                &frames,
                manifest.shards,
            ),
            manifest,
            plan: crc32fast::hash(bytes),
        }
    }

    pub(super) fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Number of shards.
    pub(super) fn shards(&self) -> usize {
        self.manifest.shards
    }

    /// Checks that there is a shard of a number.
    pub(super) fn check_number(&self, shard: usize) -> Result<(), Failure> {
        let last = self.shards() - 1;
        match shard <= last {
            true => Ok(()),
            false => Err(Failure::Usage(format!(
                "shard {shard}: the plan has the shards 0 to {last}"
            ))),
        }
    }

    /// Number of window pairs of a shard.
    pub(super) fn pairs(&self, shard: usize) -> u64 {
        self.partition.bands(shard).map(|band| band.pairs()).sum()
    }

    /// The clips that a shard reads, sorted.
    pub(super) fn clips_of(&self, shard: usize) -> Vec<usize> {
        let mut clips: Vec<usize> = self
            .partition
            .bands(shard)
            .flat_map(|band| [band.a, band.b])
            .collect();
        clips.sort_unstable();
        clips.dedup();
        clips
    }

    /// Computes a shard, unless it is there and sound. Ctrl-C stops it between parts of it.
    pub(super) fn compute(&self, shard: usize, threads: usize) -> Result<ShardOutcome, Failure> {
        if self.read_shard(shard).is_ok() {
            return Ok(ShardOutcome::WasThere);
        }
        cancel::listen();
        let clips = self.clips_of(shard);
        let windows = clips.iter().map(|&clip| {
            cancel::check()?;
            self.windows(clip)
        });
        let windows: Vec<Windows> = windows.collect::<Result<_, _>>()?;
        let place = |clip: usize| clips.partition_point(|&other| other < clip);
        // The search names clips by their place among those that were read.
        let own = self.partition.bands(shard).map(|band| MapBand {
            a: place(band.a),
            b: place(band.b),
            ..band
        });
        let search = PrunedSearch::new(self.manifest.search, windows.iter().collect(), threads);
        let mut found: Vec<BandMinima> = Vec::new();
        for part in BandParts::new(own, threads) {
            cancel::check()?;
            found.extend(search.minima_of(&part, threads)?);
        }
        let distances = found.iter().map(|found| found.computed).sum();
        let found: Vec<Vec<Minimum>> = found.into_iter().map(|found| found.minima).collect();
        let contents = sealed::encode(&(shard, &found))?;
        sealed::write(&self.shard_file(shard), self.seal(Kind::Shard), &contents)?;
        Ok(ShardOutcome::Computed {
            minima: found.iter().map(Vec::len).sum(),
            distances,
        })
    }

    /// Reads all shards.
    ///
    /// # Errors
    /// All shards that are missing or damaged, each with the command that computes it.
    pub(super) fn transitions(
        &self,
        builder: &GraphBuilder<'_>,
    ) -> Result<TransitionList, Failure> {
        let found = self.read_all(["shard", "is"], |shard| self.read_shard(shard))?;
        let found = self.partition.order().zip(found.into_iter().flatten());
        let mut by_band: Vec<(usize, Vec<Minimum>)> = found.collect();
        by_band.sort_unstable_by_key(|&(band, _)| band);
        let mut list = builder.transition_list();
        for (band, (_, minima)) in builder.bands().zip(by_band) {
            list.add(band, &minima)?;
        }
        Ok(list)
    }

    /// Reads the files of all shards, each of which the step computes that the first word names.
    ///
    /// # Errors
    /// All files that are missing or damaged, each with the command that computes it.
    pub(super) fn read_all<T>(
        &self,
        [step, are]: [&str; 2],
        read: impl Fn(usize) -> Result<T, Unusable>,
    ) -> Result<Vec<T>, Failure> {
        let (mut found, mut lacking) = (Vec::new(), Vec::new());
        for shard in 0..self.shards() {
            match read(shard) {
                Ok(one) => found.push(one),
                Err(why) => lacking.push(format!(
                    "{step} {shard} {are} {why}: {}",
                    command(&["bake", step], &self.folder, &[&shard.to_string()])
                )),
            }
        }
        match lacking.is_empty() {
            true => Ok(found),
            false => Err(Failure::Shards {
                lacking,
                all: self.shards(),
            }),
        }
    }

    /// Checks that the clips that were read now have the points of the plan, to the bit.
    pub(super) fn check_points(&self, builder: &GraphBuilder<'_>) -> Result<(), Failure> {
        let planned = &self.manifest.clips;
        let mut same =
            builder.search() == self.manifest.search && builder.clouds().len() == planned.len();
        for (cloud, planned) in builder.clouds().iter().zip(planned) {
            same &= crc32fast::hash(&sealed::encode(cloud)?) == planned.crc32;
        }
        match same {
            true => Ok(()),
            false => Err(Failure::Usage(format!(
                "{}: the clips are not those of the plan any more, or this machine reads them differently; run bake plan again",
                self.folder.display()
            ))),
        }
    }

    fn read_shard(&self, shard: usize) -> Result<Vec<Vec<Minimum>>, Unusable> {
        let ((of_shard, minima), _): ((usize, Vec<Vec<Minimum>>), _) =
            sealed::read(&self.shard_file(shard), self.seal(Kind::Shard))?;
        let bands: Vec<MapBand> = self.partition.bands(shard).collect();
        let search = &self.manifest.search;
        let fits = of_shard == shard
            && minima.len() == bands.len()
            && bands
                .iter()
                .zip(&minima)
                .all(|(band, minima)| band.admits(minima, search));
        fits.then_some(minima).ok_or(Unusable::Damaged)
    }

    fn windows(&self, clip: usize) -> Result<Windows, Failure> {
        let (path, planned) = (self.points_file(clip), &self.manifest.clips[clip]);
        let read = sealed::read::<PointCloud>(&path, POINTS);
        let checked = read.and_then(|(cloud, crc32)| match crc32 == planned.crc32 {
            true if cloud.is_sound() && cloud.frames() == planned.frames => Ok(cloud),
            _ => Err(Unusable::OtherPlan),
        });
        match checked {
            Ok(cloud) => Ok(Windows::new(&cloud, self.manifest.search.window)),
            Err(why) => Err(Failure::Usage(format!(
                "{}: {why}; run bake plan again",
                path.display()
            ))),
        }
    }

    /// Seal of files of this plan.
    pub(super) fn seal(&self, kind: Kind) -> Seal {
        Seal {
            kind,
            plan: self.plan,
        }
    }

    fn points_file(&self, clip: usize) -> PathBuf {
        self.folder.join("clips").join(clip.to_string())
    }

    fn shard_file(&self, shard: usize) -> PathBuf {
        self.folder.join("shards").join(shard.to_string())
    }
}

/// A command of this program on a folder, to be shown or run by a shell.
pub(super) fn command(words: &[&str], folder: &Path, more: &[&str]) -> String {
    let folder = quoted(&folder.display().to_string());
    let words: Vec<&str> = ["sabaki"]
        .iter()
        .chain(words)
        .copied()
        .chain([folder.as_str()])
        .chain(more.iter().copied())
        .collect();
    words.join(" ")
}

/// A word as a shell reads it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
