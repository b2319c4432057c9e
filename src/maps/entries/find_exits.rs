//! Search for the exits of all moments.

use super::aligned::Aligned;
use super::finder::{Departed, Finder, Scratch};
use super::stretches::PlayedFrames;
use super::{EntryTable, KnownEntry, MomentLists};
use crate::graph::watch::WatchedStage;
use crate::graph::{ClipId, Node};
use crate::math::sort_rarely;

impl EntryTable {
    /// Finds exits for the moments of stretches without a branch point that are longer than `longest` seconds. The result does not depend
    /// on the number of threads. After a stop, some exits are missing.
    pub(super) fn shorten_stretches(
        &mut self,
        exits: &Finder<'_>,
        longest: f32,
        stage: WatchedStage<'_>,
    ) {
        let (graph, step) = (exits.graph, self.step as usize);
        let longest = (f64::from(longest) * graph.frame_rate()) as usize;
        // Moments and their frames.
        let mut places: Vec<(u32, Node)> = Vec::new();
        for clip in (0..graph.clips().len()).map(|clip| ClipId(clip as u32)) {
            let first = self.moments_of(clip).start;
            let mut stretches = PlayedFrames::of(graph, exits.places, clip).stretches(self);
            stretches.retain(|stretch| stretch.len() > longest);
            for stretch in stretches {
                let moments = stretch.start.div_ceil(step)..stretch.end.div_ceil(step);
                places.extend(moments.map(|moment| {
                    let frame = (moment * step) as u32;
                    (first + moment as u32, Node { clip, frame })
                }));
            }
        }
        let found = stage.in_parallel(places.len(), |number| {
            let mut scratch = Scratch::new(graph);
            let Some(before) = exits.places.find(places[number].1) else {
                return Vec::new();
            };
            let from = exits.depart(before, &mut scratch.sampler);
            exits.exits(&from, &mut scratch)
        });
        let mut found = places
            .iter()
            .map(|&(moment, _)| moment)
            .zip(found)
            .peekable();
        let mut lists = MomentLists::default();
        for moment in 0..self.exits.lists.moments() as u32 {
            match found.next_if(|(at, _)| *at == moment) {
                Some((_, list)) => lists.push(&list),
                None => lists.push(self.exits.lists.of(moment)),
            }
        }
        self.exits.lists = lists;
    }
}

impl Finder<'_> {
    /// Finds exits of a frame of a clip, the one with the least departure first.
    pub(super) fn exits(&self, from: &Departed, scratch: &mut Scratch<'_>) -> Vec<KnownEntry> {
        /// Maximum number of exits of a moment.
        const MOST: usize = 3;
        /// Number of targets that are examined if at least one of them is plausible.
        const EXAMINED: usize = 24;
        /// Number of targets that are examined if none of them is plausible.
        const LAST: usize = 192;
        /// Minimum distance of the targets of one moment's exits in a clip, in frames.
        const APART: u32 = 10;
        let mut found: Vec<KnownEntry> = Vec::new();
        self.find_near(from, &mut scratch.near);
        let near = scratch.near.iter().enumerate();
        let near = near.filter_map(|(target, &near)| near.then_some(target));
        let mut nearest: Vec<Aligned> = near
            .filter_map(|target| self.align(&from.at, target))
            .collect();
        sort_rarely(&mut nearest, |a, b| {
            a.cost.total_cmp(&b.cost).then(a.target.cmp(&b.target))
        });
        for (rank, aligned) in nearest.into_iter().enumerate() {
            if found.len() == MOST || rank >= EXAMINED && (!found.is_empty() || rank >= LAST) {
                break;
            }
            let at = self.targets[aligned.target];
            let is_alike = |known: &KnownEntry| {
                let other = self.targets[usize::from(known.target)];
                other.clip == at.clip && other.frame.abs_diff(at.frame) < APART
            };
            if found.iter().any(is_alike) {
                continue;
            }
            found.extend(self.plausible(from, aligned, scratch));
        }
        found
    }
}
