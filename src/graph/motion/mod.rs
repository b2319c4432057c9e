mod blend;
mod layer;
mod sample;

use serde::{Deserialize, Serialize};

pub(crate) use blend::ContinuedBlend;
pub use layer::Layer;
pub(crate) use layer::{heading, layer_tilt};

use super::inertia::{EntryScratch, Inertia};
use super::{EdgeId, EventId, MotionGraph, MotionStep, Playhead};
use crate::anim::Warp;

/// A continuous motion through the graph: the rest of an edge, then the steps of a path, then the
/// default continuation. It can jump to another position of the graph at any time ([`Motion::enter`]).
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Motion {
    pub(super) pieces: Vec<Piece>,
    pub(super) warp: Option<Warp>,
    pub(super) layer: Option<Layer>,
    /// Offsets that fade out, by start time. Only the first `entered` are in use. The others are kept for their memory.
    pub(super) inertias: Vec<Inertia>,
    pub(super) entered: usize,
    #[serde(skip)]
    pub(super) scratch: EntryScratch,
}

/// Clones only the offsets in use.
impl Clone for Motion {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, other: &Self) {
        self.pieces.clone_from(&other.pieces);
        self.warp = other.warp;
        self.layer = other.layer;
        self.entered = 0;
        for inertia in other.inertias() {
            match self.inertias.get_mut(self.entered) {
                Some(memory) => memory.clone_from(inertia),
                None => self.inertias.push(inertia.clone()),
            }
            self.entered += 1;
        }
    }
}

impl PartialEq for Motion {
    fn eq(&self, other: &Self) -> bool {
        self.pieces == other.pieces
            && self.warp == other.warp
            && self.layer == other.layer
            && self.inertias() == other.inertias()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Piece {
    pub(super) playhead: Playhead,
    pub(super) rate: f32,
    /// Start time, in seconds since the motion's start.
    pub(super) start: f32,
    pub(super) end: f32,
}

impl Piece {
    /// Piece that plays `edge` after this one.
    fn followed(&self, graph: &MotionGraph, edge: EdgeId, rate: f32) -> Self {
        Self {
            playhead: Playhead {
                edge,
                frame: 0.0,
                clip_to_world: self.playhead.next_clip_to_world(graph),
            },
            rate,
            start: self.end,
            end: self.end + graph.seconds(edge) / rate,
        }
    }
}

impl Motion {
    /// Motion that starts at `playhead` and follows `steps`.
    ///
    /// The first step must start at the playhead's next node, and each later step at the end of the
    /// step before it.
    #[must_use]
    pub fn new(graph: &MotionGraph, playhead: Playhead, steps: &[MotionStep]) -> Self {
        let mut motion = Self::default();
        motion.restart(graph, playhead, steps.iter().copied());
        motion
    }

    /// Replaces this motion by [`Motion::new`] of the same arguments, without allocating.
    pub fn restart(
        &mut self,
        graph: &MotionGraph,
        playhead: Playhead,
        steps: impl IntoIterator<Item = MotionStep>,
    ) {
        let playhead = playhead.sanitized(graph);
        self.clear();
        self.pieces.push(Piece {
            playhead,
            rate: 1.0,
            start: 0.0,
            end: playhead.seconds_to_next_node(graph),
        });
        for step in steps {
            self.push(graph, step);
        }
    }

    /// Like [`Motion::restart`], for steps in reverse order.
    pub fn restart_backwards(
        &mut self,
        graph: &MotionGraph,
        playhead: Playhead,
        steps: impl IntoIterator<Item = MotionStep>,
    ) {
        self.restart(graph, playhead, []);
        // The edges and rates are final; the times and transforms are computed below.
        let first = self.pieces[0];
        self.pieces.extend(steps.into_iter().map(|step| Piece {
            playhead: Playhead {
                edge: step.edge,
                ..first.playhead
            },
            rate: step.rate,
            ..first
        }));
        self.pieces[1..].reverse();
        let count = self.pieces.len();
        for index in 1..count {
            let Piece { playhead, rate, .. } = self.pieces[index];
            self.pieces[index] = self.pieces[index - 1].followed(graph, playhead.edge, rate);
        }
    }

    fn push(&mut self, graph: &MotionGraph, step: MotionStep) {
        if let Some(last) = self.pieces.last() {
            let next = last.followed(graph, step.edge, step.rate);
            self.pieces.push(next);
        }
    }

    /// Appends [`MotionGraph::natural_edge`] repeatedly until the motion lasts at least `seconds`.
    pub fn extend(&mut self, graph: &MotionGraph, seconds: f32) {
        while let Some(last) = self.pieces.last().filter(|last| last.end < seconds) {
            let step = MotionStep {
                edge: graph.natural_edge(last.playhead.next_node(graph)),
                rate: 1.0,
            };
            self.push(graph, step);
        }
    }

    /// Sets or removes the warp, which bends the played poses while its envelope lasts. Parts of the body that the skeleton lacks are not
    /// bent. Default: none.
    #[doc(hidden)]
    pub fn set_warp(&mut self, warp: Option<Warp>) {
        self.warp = warp;
    }

    /// The warp, or `None` if the motion has none.
    #[must_use]
    #[doc(hidden)]
    pub fn warp(&self) -> Option<&Warp> {
        self.warp.as_ref()
    }

    /// Removes everything. The memory is kept.
    pub fn clear(&mut self) {
        self.pieces.clear();
        self.warp = None;
        self.layer = None;
        self.entered = 0;
    }

    /// Duration, in seconds.
    #[must_use]
    pub fn duration(&self) -> f32 {
        self.pieces.last().map_or(0.0, |last| last.end)
    }

    /// Events that the motion plays, each with its start and end in seconds since the motion's
    /// start. If the motion starts inside an event, the rest of it counts.
    pub fn events<'a>(
        &'a self,
        graph: &'a MotionGraph,
    ) -> impl Iterator<Item = (EventId, [f32; 2])> + 'a {
        self.pieces.iter().filter_map(|piece| {
            let event = graph.edge(piece.playhead.edge).event?;
            Some((event, [piece.start.max(0.0), piece.end]))
        })
    }
}
