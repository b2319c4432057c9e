//! Search for the entries, exits and layers of each moment. Results of an earlier bake are taken over for moments whose inputs have not
//! changed.

use super::finder::{Departed, Finder, Scratch};
use super::frames::LeftMotion;
use super::layers::LayerSource;
use super::record::MomentTests;
use super::share::MomentShare;
use super::targets::ClipFrame;
use super::{EntrySettings, KnownEntry};
use crate::graph::watch::WatchedStage;
use crate::graph::{ClipId, Node};

/// Input of the search at each moment.
pub(super) struct MomentSearch<'a> {
    pub(super) entries: &'a Finder<'a>,
    pub(super) exits: &'a Finder<'a>,
    pub(super) layers: &'a LayerSource<'a>,
    pub(super) settings: &'a EntrySettings,
}

/// Entries, exits and layers of a moment.
#[derive(Default)]
pub(super) struct MomentFound {
    pub(super) entries: Vec<KnownEntry>,
    pub(super) exits: Vec<KnownEntry>,
    pub(super) layers: Vec<KnownEntry>,
    /// The tests of entries, exits and layers.
    pub(super) tests: [MomentTests; 3],
}

impl MomentFound {
    fn not_played() -> Self {
        Self {
            tests: std::array::from_fn(|_| MomentTests::not_played()),
            ..Self::default()
        }
    }
}

impl MomentSearch<'_> {
    /// Searches a share of all moments. After a stop, only the results of the first moments are returned.
    pub(super) fn of(
        &self,
        share: MomentShare,
        stage: WatchedStage<'_>,
    ) -> impl Iterator<Item = MomentFound> + use<> {
        let (graph, step) = (self.entries.graph, self.settings.moment_step);
        let frames = graph.clips().iter().map(|clip| clip.frames() as u32);
        let moments: Vec<Node> = frames
            .zip(0..)
            .flat_map(|(frames, clip)| {
                let frames = (0..frames).step_by(step as usize);
                let clip = ClipId(clip);
                frames.map(move |frame| Node { clip, frame })
            })
            .collect();
        let batches: Vec<&[Node]> = share.of(&moments).collect();
        let found = stage.in_parallel(batches.len(), |batch| {
            let mut scratch = Scratch::new(graph);
            let own = batches[batch].iter();
            own.map(|&frame| self.at(frame, &mut scratch))
                .collect::<Vec<_>>()
        });
        found.into_iter().flatten()
    }

    fn at(&self, frame: Node, scratch: &mut Scratch<'_>) -> MomentFound {
        let Some(before) = self.entries.places.find(frame) else {
            return MomentFound::not_played();
        };
        let (sampler, playhead) = (&mut scratch.sampler, before.playhead());
        let stays = sampler.stays_in_clip(playhead, LeftMotion::FRAMES);
        let reused = stays.then(|| self.reused(before, scratch));
        match reused.unwrap_or_default() {
            [Some(entries), Some(exits), Some(layers)] => MomentFound {
                entries: entries.entries(),
                exits: exits.exits(),
                layers: layers.entries(),
                tests: [entries, exits, layers],
            },
            reused => {
                let from = self.entries.depart(before, &mut scratch.sampler);
                self.search(&from, reused, scratch)
            }
        }
    }

    /// Tests of an earlier bake that are taken over for a moment whose motion stays in its clip.
    fn reused(&self, before: ClipFrame, scratch: &mut Scratch<'_>) -> [Option<MomentTests>; 3] {
        let Self { entries, exits, .. } = self;
        let has_new = [entries, exits].iter().any(|finder| finder.has_new());
        let from = has_new.then(|| entries.leaving(before));
        let [of_entries, of_exits] = [entries, exits].map(|finder| {
            let known = finder.known.as_ref()?;
            let tests = known.all(before.node())?;
            let (near, furthest) = (&mut scratch.near, tests.furthest);
            let is_near = from
                .as_ref()
                .is_some_and(|from| finder.has_new_near(from, furthest, near));
            (!is_near).then_some((tests, known))
        });
        let most = self.settings.most as usize;
        let of_entries = of_entries
            .filter(|(_, known)| known.has_departures(entries.limits))
            .filter(|(tests, known)| known.has_same() || tests.entries().len() < most);
        let of_exits = of_exits.filter(|(_, known)| known.has_all());
        let of_layers = self.layers.known.as_ref().and_then(|known| {
            let is_known = known.has_same() && scratch.layers.stays_in_clip(before.playhead());
            is_known.then(|| known.all(before.node()))?
        });
        let tests = |(tests, _)| tests;
        [of_entries.map(tests), of_exits.map(tests), of_layers]
    }

    /// Searches the kinds whose tests are not taken over.
    fn search(
        &self,
        from: &Departed,
        [entries, exits, layers]: [Option<MomentTests>; 3],
        scratch: &mut Scratch<'_>,
    ) -> MomentFound {
        let mut found = MomentFound::default();
        let entries = match entries {
            Some(tests) => {
                found.entries = tests.entries();
                tests
            }
            None => {
                let most = self.settings.most as usize;
                found.entries = self.entries.entries(from, most, scratch);
                scratch.take_tests(from.continuation)
            }
        };
        let exits = match exits {
            Some(tests) => {
                found.exits = tests.exits();
                tests
            }
            None => {
                found.exits = self.exits.exits(from, scratch);
                scratch.take_tests(from.continuation)
            }
        };
        let layers = match layers {
            Some(tests) => {
                found.layers = tests.entries();
                tests
            }
            None => {
                let continuation;
                (found.layers, continuation) = self.entries.layers(from, self.layers, scratch);
                scratch.take_tests(continuation)
            }
        };
        MomentFound {
            tests: [entries, exits, layers],
            ..found
        }
    }
}
