//! Results of a bake that a later bake of nearly the same clips takes over: compressed clips, minima of distance maps, tests for darting
//! feet, the closest links. A bake that was stopped records the results that it has, and the next one continues from them.
//!
//! Each of these results depends only on the contents of one or two clips, their events and the settings. The record identifies a clip by a
//! checksum of its contents, so that it remains usable if other clips are added, changed or removed.
//!
//! Architecture invariant: a graph that is built with a record equals the one that is built without it, to the bit. Results
//! that a record lacks are computed.

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
    /// The compressed clips of the graph.
    pub(super) compressed: Vec<Option<Clip>>,
    /// Bands with minima, in the order of the search.
    pub(super) bands: Vec<BandRecord>,
    /// The band before which the search was stopped.
    pub(super) stopped_before: Option<[u32; 3]>,
    /// Plans of the transitions that were tested for darting feet.
    pub(super) darts: FootPlanList,
    pub(super) links: LinkRecord,
}

/// Inputs that all results depend on.
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

    /// Takes the compressed clip out of the record that clip `clip` of a later bake is equal to.
    pub(super) fn take_clip(&mut self, common: &ClipMatch, clip: usize) -> Option<Clip> {
        let earlier = common.earlier(clip)? as usize;
        self.compressed
            .get_mut(earlier)
            .and_then(|slot| slot.take())
    }

    /// Clips that this record has in common with an earlier one. None if the earlier record has other settings, another skeleton or another
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
        // Serializing to memory does not fail.
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
    stopped_before: Option<[u32; 3]>,
}

impl KnownMinima {
    /// Takes the minima of a record.
    pub(super) fn take(clips: ClipMatch, record: &mut GraphRecord) -> Self {
        let bands = std::mem::take(&mut record.bands).into_iter();
        Self {
            clips,
            bands: bands.map(|band| (band.at, band.minima)).collect(),
            stopped_before: record.stopped_before,
        }
    }

    /// The minima of a band, or `None` if one of its clips is new, or if the search was stopped before it.
    pub(super) fn of(&self, band: &MapBand) -> Option<&[Minimum]> {
        let [a, b] = [band.a, band.b].map(|clip| self.clips.earlier(clip));
        let place = [a?, b?, band.first as u32];
        if self.stopped_before.is_some_and(|end| place >= end) {
            return None;
        }
        Some(self.bands.get(&place).map_or(&[], Vec::as_slice))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_that_a_stopped_search_did_not_reach_are_not_known() {
        let band = |a, b, first| MapBand {
            a,
            b,
            first,
            rows: 10,
            columns: 10,
        };
        let minimum = Minimum {
            a: 3,
            b: 4,
            distance: 0.1,
        };
        let found = BandRecord {
            at: [0, 1, 10],
            minima: vec![minimum],
        };
        let known = |stopped_before| {
            let mut record = GraphRecord {
                bands: vec![found.clone()],
                stopped_before,
                ..GraphRecord::default()
            };
            KnownMinima::take(ClipMatch::same(3), &mut record)
        };
        let of = |known: &KnownMinima, band: MapBand| known.of(&band).map(<[_]>::len);
        let whole = known(None);
        let stopped = known(Some([0, 2, 10]));
        for (place, expected) in [
            (band(0, 0, 0), 0),
            (band(0, 1, 10), 1),
            (band(0, 2, 0), 0),
            (band(0, 2, 10), 0),
            (band(1, 1, 0), 0),
        ] {
            assert_eq!(of(&whole, place), Some(expected));
            let is_before = [place.a, place.b, place.first] < [0, 2, 10];
            assert_eq!(of(&stopped, place), is_before.then_some(expected));
        }
    }
}
