//! The closest links of each clip, kept for a later bake.

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::candidate::{Candidate, MOST, WindowPair};
use super::join_record::{JoinRecord, Joins};
use super::margin::{EventFrames, EventMargin};
use super::space::LinkSpace;
use crate::graph::ClipMatch;

/// The closest links between the ranges before evasions and each part of each clip.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::graph) struct LinkRecord {
    /// The evasions whose ranges were compared.
    ranges: Vec<EventFrames>,
    /// Links of each part of each clip, closest first. Their distances are not refined.
    clips: Vec<Vec<Vec<NearLink>>>,
    pub(super) joins: JoinRecord,
}

/// A link as it is recorded. The length of its blend follows from its distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct NearLink {
    /// Index of the range that it leads to.
    range: u32,
    source_frame: u32,
    target_frame: u32,
    distance: f32,
}

/// The links that an earlier bake found.
#[derive(Debug, Default)]
pub(in crate::graph) struct KnownLinks {
    clips: ClipMatch,
    record: LinkRecord,
}

/// The ranges of a bake, matched with those of an earlier bake.
pub(super) struct KnownRanges<'a> {
    ranges: &'a [EventMargin],
    /// For each range of the record, its index among the ranges of this bake.
    now: Vec<Option<usize>>,
    /// Indices of the ranges that the record lacks.
    pub(super) new: Vec<usize>,
}

impl KnownLinks {
    pub(in crate::graph) fn new(clips: ClipMatch, record: LinkRecord) -> Self {
        Self { clips, record }
    }

    /// Whether there are known links.
    pub(in crate::graph) fn has_any(&self) -> bool {
        self.record != LinkRecord::default()
    }

    /// The links of events that the graph would drop.
    pub(super) fn joins(&self) -> Joins {
        Joins::onto(&self.clips, &self.record.joins)
    }

    pub(super) fn ranges<'r>(&self, ranges: &'r [EventMargin]) -> KnownRanges<'r> {
        let places: FxHashMap<EventFrames, usize> = ranges
            .iter()
            .enumerate()
            .map(|(index, range)| (range.frames, index))
            .collect();
        let place = |range: &EventFrames| {
            let clip = self.clips.now(range.clip)?;
            places.get(&EventFrames { clip, ..*range }).copied()
        };
        let now: Vec<Option<usize>> = self.record.ranges.iter().map(place).collect();
        let mut is_known = vec![false; ranges.len()];
        for &index in now.iter().flatten() {
            is_known[index] = true;
        }
        KnownRanges {
            ranges,
            now,
            new: (0..ranges.len())
                .filter(|&index| !is_known[index])
                .collect(),
        }
    }

    /// The closest links of each part of a clip to the ranges of the record. `None` if the clip is new, or if links to removed evasions may have
    /// displaced other links of a part.
    pub(super) fn parts(
        &self,
        space: &LinkSpace<'_>,
        known: &KnownRanges<'_>,
        clip: usize,
    ) -> Option<Vec<Vec<Candidate>>> {
        let parts = self.record.clips.get(self.clips.earlier(clip)? as usize)?;
        let frames = space.source.aligner.clouds[clip].frames();
        if parts.len() != frames.div_ceil(space.lengths.spread) {
            return None;
        }
        let candidate = |link: &NearLink| {
            let range = &known.ranges[known.now.get(link.range as usize).copied().flatten()?];
            let pair = WindowPair {
                beside: (link.target_frame as usize + 1).checked_sub(range.window)?,
                clip,
                start: link.source_frame as usize + 1,
                distance: link.distance,
            };
            space.candidate(range, pair)
        };
        let of_part = |part: &Vec<NearLink>| {
            let found: Vec<Candidate> = part.iter().filter_map(candidate).collect();
            (found.len() == part.len() || part.len() < MOST).then_some(found)
        };
        parts.iter().map(of_part).collect()
    }
}

impl LinkRecord {
    /// Records the closest links of each part of each clip.
    pub(super) fn set_links(&mut self, ranges: &[EventMargin], clips: &[Vec<Vec<Candidate>>]) {
        let link = |candidate: &Candidate| {
            let range = ranges.partition_point(|range| range.event < candidate.event);
            NearLink {
                range: range as u32,
                source_frame: candidate.link.source_frame as u32,
                target_frame: candidate.link.target_frame as u32,
                distance: candidate.link.distance,
            }
        };
        let of_part = |part: &Vec<Candidate>| part.iter().map(link).collect();
        let of_clip = |parts: &Vec<Vec<Candidate>>| parts.iter().map(of_part).collect();
        self.ranges = ranges.iter().map(|range| range.frames).collect();
        self.clips = clips.iter().map(of_clip).collect();
    }
}
