//! Where candidates stand, and the attack's maps that they are held against.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn in the frame in which the paths
//! start, the evasions' maps are moved and turned into place. Differs: only the part of the attack
//! is drawn that some candidate's maps can reach.

use glam::{Vec2, Vec3};

use super::drawing::AttackDrawing;
use super::input::CullCandidate;
use super::scene::{PlacedRegion, Reach, Scene};
use super::steps::Steps;
use crate::maps::{CLOCK_ERROR, FixedTransform2, Slab, SphereKey};

/// The maps of one query, and the scratch of drawing them: filled again and again.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct QueryMaps {
    pub attack: AttackDrawing,
    /// One for each placed region, in order.
    pub candidates: Vec<CullCandidate>,
    scratch: Steps,
}

impl QueryMaps {
    /// The slabs that the attack reaches near a candidate's body and evasion maps, while they last.
    pub(in crate::query) fn slabs(&self, candidate: usize) -> impl Iterator<Item = Slab> + '_ {
        let touched = self.scratch.touched.get(candidate).cloned();
        touched.unwrap_or_default().map(Slab)
    }

    /// Draws the attack where the maps of the placed evasions may meet it.
    pub(in crate::query) fn draw(&mut self, scene: &Scene<'_>) {
        let grid = scene.atlas.grid();
        let whole = self.attack.draw(scene, &reach(scene), &mut self.scratch);
        let origin = (self.attack.rect.u, self.attack.rect.v);
        self.candidates.clear();
        let candidate = |placed: &PlacedRegion| {
            let back = placed.placement.inverse();
            CullCandidate {
                region: placed.region,
                clock: if grid.is_timed() { placed.clock } else { 0 },
                turn: FixedTransform2::new(back, origin, grid),
                open: !scene.outer
                    || !whole
                    || !FixedTransform2::keeps(back, grid.texel)
                    || is_open(scene, placed),
            }
        };
        self.candidates.extend(scene.placed.iter().map(candidate));
    }
}

/// What the maps of all placed evasions reach.
fn reach(scene: &Scene<'_>) -> Reach {
    let (near, grid) = (scene.atlas.coarse(), scene.atlas.grid());
    let mut reach = Reach::default();
    for placed in scene.placed {
        let region = scene.atlas.region(placed.region);
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

/// Whether the attack may come near before the evasion's first slice or after its last one.
fn is_open(scene: &Scene<'_>, placed: &PlacedRegion) -> bool {
    let start = scene.attack.start() + scene.clocks[placed.clock as usize];
    let seconds = scene.atlas.region(placed.region).seconds;
    let (first, last) = (start - CLOCK_ERROR, start + seconds + CLOCK_ERROR);
    if scene.attack.start() >= first && scene.attack.end() <= last {
        return false;
    }
    scene.attack.spheres().iter().any(|sphere| {
        let before = [sphere.start(), sphere.end().min(first)];
        let after = [sphere.start().max(last), sphere.end()];
        [before, after]
            .into_iter()
            .filter(|[from, to]| from <= to && (*from < first || *to > last))
            .any(|times| {
                let ends = times.map(|time| sphere.at(time));
                // Between them lie straight pieces, whose ends are tested as well.
                let keys = sphere.keys().iter().copied();
                let between = keys.filter(|key| key.t > times[0] && key.t < times[1]);
                let mut from = ends[0];
                between.chain([ends[1]]).any(|to| {
                    let piece = [from, to];
                    from = to;
                    may_touch(piece, (scene, placed), start)
                })
            })
    })
}

/// Whether a body that evades at a place may be where a sphere passes at another time than the
/// evasion's.
fn may_touch(
    piece: [SphereKey; 2],
    (scene, placed): (&Scene<'_>, &PlacedRegion),
    start: f32,
) -> bool {
    /// No character's root goes faster, metres per second.
    const FASTEST: f32 = 20.0;
    let times = piece.map(|key| (key.t - start).abs());
    let radius = piece[0].radius.max(piece[1].radius);
    let reach = scene.reach + radius + FASTEST * times[0].max(times[1]);
    let ground = |point: Vec3| Vec2::new(point.x, point.z);
    let [a, b] = piece.map(|key| ground(key.center) - placed.placement.ground());
    let way = b - a;
    let share = (-a.dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
    (a + way * share).length() <= reach
}
