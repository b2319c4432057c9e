//! The closest links of events that the graph would drop, kept for a later bake.
//!
//! The links of an event depend on the moments that may be linked, and thus on all clips. They are taken over for clips in which the same
//! moments may be linked. Only the other clips are searched again.

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::candidate::{Candidate, WindowPair};
use super::margin::{EventFrames, EventMargin, Side};
use super::space::LinkSpace;
use crate::graph::ClipMatch;

/// The closest links of events that the graph would drop.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct JoinRecord {
    /// Number of frames of each clip.
    frames: Vec<u32>,
    /// For each round of searches, the moments that may be linked.
    allowed: Vec<Vec<bool>>,
    found: Vec<(SearchKey, Vec<JoinLink>)>,
}

/// A search for the links of one event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
struct SearchKey {
    round: u32,
    event: EventFrames,
    is_before: bool,
    most: u32,
}

/// A link as it is recorded. The length of its blend follows from its distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct JoinLink {
    clip: u32,
    /// First frames of the windows beside the event and in the other clip.
    beside: u32,
    start: u32,
    distance: f32,
}

impl JoinLink {
    fn windows(&self) -> WindowPair {
        WindowPair {
            beside: self.beside as usize,
            clip: self.clip as usize,
            start: self.start as usize,
            distance: self.distance,
        }
    }
}

/// The links that an earlier bake found, and the links of this bake.
#[derive(Debug, Default)]
pub(super) struct Joins {
    found: FxHashMap<SearchKey, Vec<JoinLink>>,
    /// For each round of the earlier bake, the moments of each clip of this bake that could be linked.
    allowed: Vec<Vec<Option<Vec<bool>>>>,
    /// For each clip, whether the moments that may be linked in this round are those of the earlier bake.
    pub(super) is_same: Vec<bool>,
    pub(super) record: JoinRecord,
}

impl Joins {
    /// Takes over the links of a record. `clips` maps the clips of the record to those of this bake.
    pub(super) fn onto(clips: &ClipMatch, record: &JoinRecord) -> Self {
        let now = |event: &EventFrames| {
            let clip = clips.now(event.clip)?;
            Some(EventFrames { clip, ..*event })
        };
        let found = record.found.iter().filter_map(|(key, links)| {
            let event = now(&key.event)?;
            // Links to clips that were removed get an invalid clip.
            let clip = |link: &JoinLink| clips.now(link.clip).unwrap_or(u32::MAX);
            let links = links.iter().map(|link| JoinLink {
                clip: clip(link),
                ..*link
            });
            Some((SearchKey { event, ..*key }, links.collect()))
        });
        let mut firsts = vec![0];
        for &frames in &record.frames {
            firsts.push(firsts[firsts.len() - 1] + frames as usize);
        }
        let of_round = |allowed: &Vec<bool>| {
            let of_clip = |clip: usize| {
                let earlier = clips.earlier(clip)? as usize;
                let own = *firsts.get(earlier)?..*firsts.get(earlier + 1)?;
                Some(allowed.get(own)?.to_vec())
            };
            (0..clips.len()).map(of_clip).collect()
        };
        Self {
            found: found.collect(),
            allowed: record.allowed.iter().map(of_round).collect(),
            ..Self::default()
        }
    }

    /// Begins a round of searches, in which some moments may be linked.
    pub(super) fn begin(&mut self, space: &LinkSpace<'_>, allowed: &[bool]) {
        let earlier = self.allowed.get(self.record.allowed.len());
        let clips = space.source.aligner.clouds;
        let is_same = |clip: usize| {
            let earlier = earlier.and_then(|of_clips| of_clips.get(clip)?.as_deref());
            earlier == Some(&allowed[space.moments.of_clip(clip)])
        };
        self.is_same = (0..clips.len()).map(is_same).collect();
        let frames = clips.iter().map(|cloud| cloud.frames() as u32);
        self.record.frames = frames.collect();
        self.record.allowed.push(allowed.to_vec());
    }

    fn key(&self, margin: &EventMargin, most: usize) -> SearchKey {
        SearchKey {
            round: self.record.allowed.len() as u32,
            event: margin.frames,
            is_before: margin.side == Side::Before,
            most: u32::try_from(most).unwrap_or(u32::MAX),
        }
    }

    /// The closest links among the clips with the same moments, or `None` if they are not known.
    pub(super) fn known(
        &self,
        space: &LinkSpace<'_>,
        margin: &EventMargin,
        most: usize,
    ) -> Option<Vec<Candidate>> {
        let links = self.found.get(&self.key(margin, most))?;
        let is_kept = |link: &&JoinLink| self.is_same.get(link.clip as usize) == Some(&true);
        let kept: Vec<&JoinLink> = links.iter().filter(is_kept).collect();
        // If the list was full, closer links to other clips may have displaced some.
        if kept.len() < links.len() && links.len() >= most {
            return None;
        }
        let candidate = |link: &JoinLink| space.candidate(margin, link.windows());
        kept.into_iter().map(candidate).collect()
    }

    /// Records the links that were found for an event.
    pub(super) fn add(&mut self, margin: &EventMargin, most: usize, found: &[Candidate]) {
        let link = |candidate: &Candidate| {
            let link = &candidate.link;
            let source = link.source_frame + 1;
            let target = link.target_frame + 1 - margin.window;
            let (clip, beside, start) = match margin.side {
                Side::Before => (link.source_clip, target, source),
                Side::After => (link.target_clip, source, target),
            };
            let [clip, beside, start] = [clip, beside, start].map(|index| index as u32);
            JoinLink {
                clip,
                beside,
                start,
                distance: link.distance,
            }
        };
        let key = self.key(margin, most);
        let links = found.iter().map(link).collect();
        self.record.found.push((key, links));
    }
}
