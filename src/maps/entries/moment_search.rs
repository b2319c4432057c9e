//! Search for the entries, exits and layers of each moment.

use serde::{Deserialize, Serialize};

use super::finder::{Finder, Scratch};
use super::layers::LayerSource;
use super::share::MomentShare;
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

/// Entries, exits and layers of a moment. A moment that the graph does not play has none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct MomentFound {
    pub(super) entries: Vec<KnownEntry>,
    pub(super) exits: Vec<KnownEntry>,
    pub(super) layers: Vec<KnownEntry>,
}

impl MomentSearch<'_> {
    /// Searches a share of all moments. After a stop, only the results of the first moments are returned.
    pub(super) fn of(&self, share: MomentShare, stage: WatchedStage<'_>) -> Vec<MomentFound> {
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
        found.into_iter().flatten().collect()
    }

    fn at(&self, frame: Node, scratch: &mut Scratch<'_>) -> MomentFound {
        let Some(before) = self.entries.places.find(frame) else {
            return MomentFound::default();
        };
        let from = self.entries.depart(before, &mut scratch.sampler);
        let most = self.settings.most as usize;
        MomentFound {
            entries: self.entries.entries(&from, most, scratch),
            exits: self.exits.exits(&from, scratch),
            layers: self.entries.layers(&from, self.layers, scratch),
        }
    }
}
