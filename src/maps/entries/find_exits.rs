//! Search for the exits of all moments.

use super::align::Aligned;
use super::finder::{Departed, Finder, Scratch};
use super::record::{MomentTests, TestTable};
use super::stretches::PlayedFrames;
use super::{EntryTable, KnownEntry, MomentLists};
use crate::graph::ClipId;
use crate::math::in_parallel;

impl EntryTable {
    /// Finds exits of the moments of stretches without a branch point that are longer than `longest` seconds. The result does not depend on
    /// the number of threads. Returns the tests.
    pub(super) fn shorten_stretches(
        &mut self,
        exits: &Finder<'_>,
        longest: f32,
        threads: usize,
    ) -> TestTable {
        let (graph, step) = (exits.graph, self.step as usize);
        let longest = (f64::from(longest) * graph.frame_rate()) as usize;
        // Moments, and their clips and frames.
        let mut places: Vec<(u32, (usize, u32))> = Vec::new();
        for clip in (0..graph.clips().len()).map(|clip| ClipId(clip as u32)) {
            let first = self.moments_of(clip).start;
            let mut stretches = PlayedFrames::of(graph, exits.places, clip).stretches(self);
            stretches.retain(|stretch| stretch.len() > longest);
            for stretch in stretches {
                let moments = stretch.start.div_ceil(step)..stretch.end.div_ceil(step);
                let place = |at: usize| (first + at as u32, (clip.index(), (at * step) as u32));
                places.extend(moments.map(place));
            }
        }
        type Found = (Vec<KnownEntry>, MomentTests);
        let found = in_parallel(threads, places.len(), |number| -> Found {
            let mut scratch = Scratch::new(graph, self.step);
            let place = places[number].1;
            let Some(before) = exits.playhead(place) else {
                return (Vec::new(), MomentTests::not_played());
            };
            let from = exits.depart(place, before, &mut scratch.sampler);
            let found = exits.exits(&from, &mut scratch);
            (found, scratch.take_tests(from.beyond))
        });
        let mut found = places
            .iter()
            .map(|&(moment, _)| moment)
            .zip(found)
            .peekable();
        let (mut lists, mut table) = (MomentLists::default(), TestTable::new(exits.basis()));
        for moment in 0..self.exits.lists.moments() as u32 {
            match found.next_if(|(at, _)| *at == moment) {
                Some((_, (list, tests))) => {
                    lists.push(&list);
                    table.push(tests);
                }
                None => {
                    lists.push(self.exits.lists.of(moment));
                    table.push(MomentTests::not_played());
                }
            }
        }
        self.exits.lists = lists;
        table
    }
}

impl Finder<'_> {
    /// Finds exits of a frame of a clip, the least departure first.
    pub(super) fn exits(&self, from: &Departed, scratch: &mut Scratch<'_>) -> Vec<KnownEntry> {
        /// Maximum number of exits of a moment.
        const MOST: usize = 3;
        /// Number of targets whose motion is examined, if one of them is plausible, and otherwise.
        const EXAMINED: usize = 24;
        const LAST: usize = 192;
        /// Exits of one moment lead to frames so far apart in their clip, at least.
        const APART: u32 = 10;
        let mut found: Vec<KnownEntry> = Vec::new();
        scratch.furthest = f32::INFINITY;
        self.find_near(from, &mut scratch.near);
        let near = scratch.near.iter().enumerate();
        let near = near.filter_map(|(target, &near)| near.then_some(target));
        let mut nearest: Vec<(f32, usize, Aligned)> = near
            .filter_map(|target| {
                let aligned = self.align(&from.at, target)?;
                Some((aligned.cost, target, aligned))
            })
            .collect();
        nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut considered = 0.0;
        for (rank, (cost, target, aligned)) in nearest.into_iter().enumerate() {
            if found.len() == MOST || rank >= EXAMINED && (!found.is_empty() || rank >= LAST) {
                scratch.furthest = considered;
                break;
            }
            considered = cost;
            let at = self.targets[target];
            let is_alike = |known: &KnownEntry| {
                let other = self.targets[usize::from(known.target)];
                other.clip == at.clip && other.frame.abs_diff(at.frame) < APART
            };
            if found.iter().any(is_alike) {
                continue;
            }
            let how = self.plausible(from, (target, aligned), scratch);
            let Some((blend, _)) = how else {
                continue;
            };
            if let Some(test) = scratch.tests.last_mut() {
                test.set_rank(found.len());
            }
            found.push(KnownEntry::new(target as u16, (blend, aligned.pin, 0)));
        }
        found
    }
}
