//! The maps of the candidates of a query, and the attack's discs that they are compared with.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn in the frame in which the paths start, and the evasions' maps are
//! transformed to their places. Differs: only the part of the attack that the maps of some candidate can reach is drawn.

use glam::{Vec2, Vec3};

use super::draw_input::{DrawInput, PlacedRegion, Reach};
use super::drawing::AttackDrawing;
use super::input::CullCandidate;
use super::steps::AttackSteps;
use crate::maps::{CLOCK_ERROR, FixedTransform2, Slab, SphereKey};

/// The maps of one round of a query. The next round reuses their memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct QueryMaps {
    pub attack: AttackDrawing,
    /// Candidates: one for each placed evasion, in order.
    pub candidates: Vec<CullCandidate>,
    scratch: AttackSteps,
}

impl QueryMaps {
    /// The slabs in which the attack may overlap a candidate's body and evasion maps.
    pub(in crate::query) fn slabs(&self, candidate: usize) -> impl Iterator<Item = Slab> + '_ {
        let touched = self.scratch.touched.get(candidate).cloned();
        touched.unwrap_or_default().map(Slab)
    }

    /// Draws the part of the attack that the maps of the placed evasions may overlap.
    pub(in crate::query) fn draw(&mut self, input: &DrawInput<'_>) {
        let grid = input.atlas.grid();
        let whole = self.attack.draw(input, &reach(input), &mut self.scratch);
        let rect = self.attack.rect;
        self.candidates.clear();
        let candidate = |placed: &PlacedRegion| {
            let back = placed.placement.inverse();
            CullCandidate {
                region: placed.region,
                clock: if grid.is_timed() { placed.clock } else { 0 },
                transform: FixedTransform2::new(back, rect, grid),
                open: !input.outer
                    || !whole
                    || !FixedTransform2::keeps(back, grid.texel)
                    || is_open(input, placed),
            }
        };
        self.candidates.extend(input.placed.iter().map(candidate));
    }
}

/// The space that the maps of all placed evasions cover.
fn reach(input: &DrawInput<'_>) -> Reach {
    let (near, grid) = (input.atlas.coarse(), input.atlas.grid());
    let mut reach = Reach::default();
    for placed in input.placed {
        let region = input.atlas.region(placed.region);
        let rect = near[placed.region.index()].rect;
        reach.rect = reach
            .rect
            .union(grid.transformed_rect(rect, placed.placement));
        let low = region.first_slab.0;
        let end = low + region.slabs.len() as i32;
        reach.slabs = match reach.slabs.is_empty() {
            true => low..end,
            false => reach.slabs.start.min(low)..reach.slabs.end.max(end),
        };
    }
    reach
}

/// Whether the attack may come near the body before the evasion's first slice or after its last slice.
fn is_open(input: &DrawInput<'_>, placed: &PlacedRegion) -> bool {
    let start = input.attack.start() + input.clocks[placed.clock as usize];
    let seconds = input.atlas.region(placed.region).seconds;
    let (first, last) = (start - CLOCK_ERROR, start + seconds + CLOCK_ERROR);
    if input.attack.start() >= first && input.attack.end() <= last {
        return false;
    }
    let evasion = EvasionStart {
        ground: placed.placement.ground(),
        reach: input.reach,
        time: start,
    };
    input.attack.spheres().iter().any(|sphere| {
        let before = [sphere.start(), sphere.end().min(first)];
        let after = [sphere.start().max(last), sphere.end()];
        [before, after]
            .into_iter()
            .filter(|[from, to]| from <= to && (*from < first || *to > last))
            .any(|times| {
                let ends = times.map(|time| sphere.at(time));
                // Straight pieces between keys.
                let keys = sphere.keys().iter().copied();
                let between = keys.filter(|key| key.t > times[0] && key.t < times[1]);
                let mut from = ends[0];
                between.chain([ends[1]]).any(|to| {
                    let piece = [from, to];
                    from = to;
                    evasion.may_be_touched(piece)
                })
            })
    })
}

/// Position and time of the start of an evasion.
struct EvasionStart {
    /// Position of the character on the ground, in metres.
    ground: Vec2,
    /// Radius around the character that contains the body, in metres.
    reach: f32,
    /// Time of the evasion's start on the attack's clock, in seconds.
    time: f32,
}

impl EvasionStart {
    /// Whether a piece of a sphere's path may touch the body at a time that the maps do not cover.
    fn may_be_touched(&self, piece: [SphereKey; 2]) -> bool {
        /// Maximum speed of a character's root, in metres per second.
        const FASTEST: f32 = 20.0;
        let times = piece.map(|key| (key.t - self.time).abs());
        let radius = piece[0].radius.max(piece[1].radius);
        let reach = self.reach + radius + FASTEST * times[0].max(times[1]);
        let ground = |point: Vec3| Vec2::new(point.x, point.z);
        let [a, b] = piece.map(|key| ground(key.center) - self.ground);
        let way = b - a;
        let share = (-a.dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
        (a + way * share).length() <= reach
    }
}
