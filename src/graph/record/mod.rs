//! Results of a bake that a later bake of nearly the same clips takes over: compressed clips, minima of distance maps, tests for darting
//! feet, the closest links.
//!
//! Each of these results depends on the contents of one or two clips, their events and the settings, and on nothing else. The record names
//! a clip by a checksum of its contents, so that it also serves where clips were added, changed or removed.
//!
//! Architecture invariant: a graph that is built with a record equals the one that is built without it, to the bit. What a record lacks is
//! computed.

mod clips;

use std::hash::Hasher;

use rustc_hash::{FxHashMap, FxHasher};
use serde::{Deserialize, Serialize};

pub use clips::ClipMatch;

use super::GraphSettings;
use super::feet::FootPlanList;
use super::links::LinkRecord;
use super::search::{MapBand, Minimum};
use super::source::ClipSource;
use crate::anim::{Clip, Event, Skeleton};
use crate::math::in_parallel;

/// Checksums of a clip and its events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(crate) struct ClipKey {
    hash: u64,
    crc32: u32,
    bytes: u64,
}

/// Results of a graph build that a later one takes over.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GraphRecord {
    basis: Option<Basis>,
    pub(super) clips: Vec<ClipKey>,
    /// The clips as the graph has them.
    pub(super) compressed: Vec<Option<Clip>>,
    /// Bands with minima, in the order of the search.
    pub(super) bands: Vec<BandRecord>,
    /// Transitions that were tested for darting feet, and how they move their feet.
    pub(super) darts: FootPlanList,
    pub(super) links: LinkRecord,
}

/// What all results depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Basis {
    version: String,
    skeleton: Skeleton,
    settings: GraphSettings,
}

/// Minima of a band.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct BandRecord {
    /// Clips of the rows and of the columns, and the first row.
    pub(super) at: [u32; 3],
    pub(super) minima: Vec<Minimum>,
}

impl BandRecord {
    pub(super) fn place(band: &MapBand) -> [u32; 3] {
        [band.a, band.b, band.first].map(|index| index as u32)
    }
}

impl GraphRecord {
    /// A record without results.
    pub(super) fn new(source: ClipSource<'_>, settings: &GraphSettings) -> Self {
        Self {
            basis: Some(Basis {
                version: env!("CARGO_PKG_VERSION").to_owned(),
                skeleton: source.skeleton.clone(),
                settings: GraphSettings {
                    threads: 0,
                    memory: 0,
                    ..settings.clone()
                },
            }),
            clips: keys(source, settings.threads),
            ..Self::default()
        }
    }

    /// The compressed clip that a clip of a later bake has in common with the bake of this record.
    pub(super) fn take_clip(&mut self, common: &ClipMatch, clip: usize) -> Option<Clip> {
        let earlier = common.earlier(clip)? as usize;
        { self.compressed.get_mut(earlier) }.and_then(|slot| slot.take())
    }

    /// The clips of this record that an earlier one has, too; none if that was made with other settings, for another skeleton or by another
    /// version.
    #[must_use]
    pub fn clips_of(&self, earlier: &Self) -> ClipMatch {
        let is_comparable = self.basis.is_some() && self.basis == earlier.basis;
        let known: &[ClipKey] = if is_comparable { &earlier.clips } else { &[] };
        ClipMatch::new(&self.clips, known)
    }
}

/// The keys of all clips.
fn keys(source: ClipSource<'_>, threads: usize) -> Vec<ClipKey> {
    in_parallel(threads, source.clips.len(), |clip| {
        let of_clip = source.events.iter().filter(|event| event.clip == clip);
        let events: Vec<Event> = of_clip
            .map(|event| Event {
                clip: 0,
                ..event.clone()
            })
            .collect();
        // Writing to memory does not fail.
        let bytes = postcard::to_stdvec(&(&source.clips[clip], events)).unwrap_or_default();
        let mut hasher = FxHasher::default();
        hasher.write(&bytes);
        ClipKey {
            hash: hasher.finish(),
            crc32: crc32fast::hash(&bytes),
            bytes: bytes.len() as u64,
        }
    })
}

/// The minima that an earlier search found.
#[derive(Debug, Default)]
pub(super) struct KnownMinima {
    clips: ClipMatch,
    bands: FxHashMap<[u32; 3], Vec<Minimum>>,
}

impl KnownMinima {
    pub(super) fn new(clips: ClipMatch, bands: Vec<BandRecord>) -> Self {
        Self {
            clips,
            bands: bands
                .into_iter()
                .map(|band| (band.at, band.minima))
                .collect(),
        }
    }

    /// The minima of a band, or `None` if a clip of it is new.
    pub(super) fn of(&self, band: &MapBand) -> Option<&[Minimum]> {
        let [a, b] = [band.a, band.b].map(|clip| self.clips.earlier(clip));
        let minima = self.bands.get(&[a?, b?, band.first as u32]);
        Some(minima.map_or(&[], Vec::as_slice))
    }
}
