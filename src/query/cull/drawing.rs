//! Draws the attack as discs, for each slab and clock, in the frame in which the paths start. Each disc belongs to a slice of time.
//!
//! Source: Masaoka & Oshita, section 5.3: the evasions' maps are transformed to their places. Differs: discs have a time, and there are two kinds,
//! rounded inwards and outwards. The attack is cut into short steps. Inner discs represent the sphere in the middle of a step. Outer discs
//! represent a sphere that is larger by half of the step, so that it contains the attack's sphere during the whole step. Only the part of the
//! attack that the maps of some candidate can reach is drawn.
//!
//! ```text
//! reach = union of the maps of all placed evasions: a rectangle of texels, and slabs
//! steps = short parts of the spheres' lines within reach, each with the clocks whose maps it can overlap
//! for each clock, for each slab:
//!     for each step that can overlap maps of the clock in the slab: a disc for each slice of its time
//! ```

use std::ops::Range;

use glam::{Vec2, Vec3};

use crate::maps::{
    Cut, Disc, FixedTransform2, HALF_DIAGONAL, MapGrid, MapRect, MovingSphere, ROUNDING,
    RegionAtlas, RegionId, SUB_TEXELS, Slab, SphereKey, TIME_ERROR,
};
use crate::math::{Rigid2, Sphere, floor};
use crate::query::attack::Attack;

/// The input of a culling path.
#[derive(Clone, Copy, Debug)]
pub struct CullInput<'a> {
    /// Maps of all evasions.
    pub atlas: &'a RegionAtlas,
    /// Discs of the attack, in the frame in which the paths start.
    pub attack: &'a AttackDrawing,
    /// Candidates that are counted.
    pub candidates: &'a [CullCandidate],
}

/// An evasion at one position and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CullCandidate {
    /// Maps of the evasion.
    pub region: RegionId,
    /// Clock of the candidate. Only the layers of that clock are compared with its maps.
    pub clock: u32,
    /// Transform from the attack's maps to the evasion's frame.
    pub transform: FixedTransform2,
    /// Whether the attack may come near the body outside the space or time of the maps. An
    /// [`Overlap::outer`](super::Overlap::outer) of 0 then does not prove a miss.
    pub open: bool,
}

/// The attack's discs, in the frame in which the paths start.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AttackDrawing {
    /// Rectangle of all maps. Each side has at most [`AttackDrawing::MAX_SIDE`] texels.
    pub rect: MapRect,
    /// Layers, one for each clock and each slab that has discs.
    pub layers: Vec<AttackLayer>,
    /// Discs of all layers, relative to the rectangle's first texel.
    pub discs: Vec<TimedDisc>,
}

/// The attack in one slab, relative to one clock.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttackLayer {
    /// Slab of the layer.
    pub slab: Slab,
    /// Clock of the layer ([`CullCandidate::clock`]).
    pub clock: u32,
    /// Range of the inner discs in [`AttackDrawing::discs`], sorted by slice: texels that the attack covers at some time of the slice.
    pub inner: Range<u32>,
    /// Range of the outer discs in [`AttackDrawing::discs`], sorted by slice: texels that the attack may touch at any time of the slice and any
    /// height of the slab.
    pub outer: Range<u32>,
}

/// A disc in one slice of time.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedDisc {
    /// Disc, relative to the rectangle's first texel.
    pub disc: Disc,
    /// Slice of time; 0 if maps are not timed.
    pub slice: u32,
}

/// The maps of one round of a query. The next round reuses their memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct QueryMaps {
    pub attack: AttackDrawing,
    /// Candidates: one for each placed evasion, in order.
    pub candidates: Vec<CullCandidate>,
    scratch: AttackSteps,
}

/// An evasion at the position where a candidate performs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::query) struct PlacedRegion {
    pub region: RegionId,
    /// The character's frame at the evasion's start, in the frame in which the paths start.
    pub placement: Rigid2,
    /// Index of the candidate's clock in the clocks.
    pub clock: u32,
}

/// The space that the maps of any candidate cover. Only the part of the attack within it is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
struct Reach {
    /// Rectangle of texels, in the frame in which the paths start.
    rect: MapRect,
    slabs: Range<i32>,
}

impl QueryMaps {
    /// The slabs in which the attack may overlap a candidate's body and evasion maps.
    pub(in crate::query) fn slabs(&self, candidate: usize) -> impl Iterator<Item = Slab> + '_ {
        let touched = self.scratch.touched.get(candidate).cloned();
        touched.unwrap_or_default().map(Slab)
    }

    /// Draws the part of an attack that the maps of the placed evasions may overlap. `clocks` are times from the attack's start to the start of
    /// evasions, in seconds, and no part of the body is further than `body_reach` metres from the root. Outer maps are drawn only if `outer` is
    /// set; without them every candidate is open.
    pub(in crate::query) fn draw(
        &mut self,
        atlas: &RegionAtlas,
        attack: &Attack,
        clocks: &[f32],
        placed: &[PlacedRegion],
        body_reach: f32,
        outer: bool,
    ) {
        let (grid, steps) = (atlas.grid(), &mut self.scratch);
        let reach = Reach::new(atlas, placed);
        let (rect, mut whole) = limited(reach.rect);
        self.attack.clear();
        steps.clear();
        if !rect.is_empty() && !reach.slabs.is_empty() {
            steps.take(atlas, attack, clocks, placed, &reach, outer);
            self.attack
                .draw(grid, clocks, rect, reach.slabs, outer, steps);
            whole &= !steps.cut_off;
        }
        let rect = self.attack.rect;
        self.candidates.clear();
        let candidate = |placed: &PlacedRegion| {
            let back = placed.placement.inverse();
            CullCandidate {
                region: placed.region,
                clock: if grid.is_timed() { placed.clock } else { 0 },
                transform: FixedTransform2::new(back, rect, grid),
                open: !outer
                    || !whole
                    || !FixedTransform2::keeps(back, grid.texel)
                    || is_open(
                        atlas,
                        attack,
                        clocks[placed.clock as usize],
                        placed,
                        body_reach,
                    ),
            }
        };
        self.candidates.extend(placed.iter().map(candidate));
    }
}

impl Reach {
    fn new(atlas: &RegionAtlas, placed: &[PlacedRegion]) -> Self {
        let (near, grid) = (atlas.coarse(), atlas.grid());
        let mut reach = Self::default();
        for placed in placed {
            let region = atlas.region(placed.region);
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
}

/// Whether the attack may come near the body before the evasion's first slice or after its last slice.
fn is_open(
    atlas: &RegionAtlas,
    attack: &Attack,
    clock: f32,
    placed: &PlacedRegion,
    body_reach: f32,
) -> bool {
    let start = attack.start() + clock;
    let seconds = atlas.region(placed.region).seconds;
    let (first, last) = (start - TIME_ERROR, start + seconds + TIME_ERROR);
    if attack.start() >= first && attack.end() <= last {
        return false;
    }
    let ground = placed.placement.ground();
    attack.spheres().iter().any(|sphere| {
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
                    may_touch(piece, ground, body_reach, start)
                })
            })
    })
}

/// Whether a piece of a sphere's path may touch the body of a character that begins an evasion at a place of the ground and at a time of the
/// attack's clock, at a time that the maps do not cover.
fn may_touch(piece: [SphereKey; 2], place: Vec2, body_reach: f32, start: f32) -> bool {
    /// Maximum speed of a character's root, in metres per second.
    const FASTEST: f32 = 20.0;
    let times = piece.map(|key| (key.t - start).abs());
    let radius = piece[0].radius.max(piece[1].radius);
    let reach = body_reach + radius + FASTEST * times[0].max(times[1]);
    let ground = |point: Vec3| Vec2::new(point.x, point.z);
    let [a, b] = piece.map(|key| ground(key.center) - place);
    let way = b - a;
    let share = (-a.dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
    (a + way * share).length() <= reach
}

impl AttackDrawing {
    /// Maximum side of an attack's maps, in texels. Parts outside are not drawn, and candidates are then open.
    pub const MAX_SIDE: u32 = 1024;

    /// Maximum number of discs of all layers (16 MB). Further layers are not drawn, and candidates are then open.
    pub const MOST_DISCS: usize = 1 << 20;

    fn clear(&mut self) {
        self.rect = MapRect::default();
        self.layers.clear();
        self.discs.clear();
    }

    /// Draws the steps of an attack within a rectangle and some slabs.
    fn draw(
        &mut self,
        grid: MapGrid,
        clocks: &[f32],
        rect: MapRect,
        slabs: Range<i32>,
        outer: bool,
        steps: &mut AttackSteps,
    ) {
        // Untimed maps are the same for every clock.
        let clocks = match grid.is_timed() {
            true => clocks,
            false => &clocks[..clocks.len().min(1)],
        };
        let cutter = DiscCutter {
            grid,
            rect,
            inner: ROUNDING + FixedTransform2::error(rect.width, rect.height),
            outer: HALF_DIAGONAL + ROUNDING,
        };
        let mut around = MapRect::default();
        for (clock, &offset) in (0..).zip(clocks) {
            for slab in slabs.clone() {
                let first = self.discs.len();
                cutter.cut(steps, slab, (clock, offset), false, &mut self.discs);
                let middle = self.discs.len();
                if outer {
                    cutter.cut(steps, slab, (clock, offset), true, &mut self.discs);
                }
                let end = self.discs.len();
                if first == end {
                    continue;
                }
                if end > Self::MOST_DISCS {
                    self.discs.truncate(first);
                    steps.cut_off = true;
                    continue;
                }
                for timed in &self.discs[first..end] {
                    around = around.union(MapRect::around(&[timed.disc]));
                }
                for part in [first..middle, middle..end] {
                    self.discs[part].sort_unstable_by_key(|one| one.slice);
                }
                self.layers.push(AttackLayer {
                    slab: Slab(slab),
                    clock,
                    inner: first as u32..middle as u32,
                    outer: middle as u32..end as u32,
                });
            }
        }
        self.rect = around.intersection(rect);
        for one in &mut self.discs {
            one.disc = one.disc.relative_to(self.rect.u, self.rect.v);
        }
    }

    /// The discs of a layer's inner map and outer map.
    pub fn discs_of(&self, layer: &AttackLayer) -> [&[TimedDisc]; 2] {
        [&layer.inner, &layer.outer]
            .map(|range| &self.discs[range.start as usize..range.end as usize])
    }
}

/// The middle part of a rectangle, limited to the size for which fixed-point transforms are exact enough, and whether that is the whole
/// rectangle.
fn limited(rect: MapRect) -> (MapRect, bool) {
    let side = |first: i32, texels: u32| {
        let kept = texels.min(AttackDrawing::MAX_SIDE);
        (first + ((texels - kept) / 2) as i32, kept)
    };
    let ((u, width), (v, height)) = (side(rect.u, rect.width), side(rect.v, rect.height));
    let limited = MapRect {
        u,
        v,
        width,
        height,
    };
    (limited, limited == rect)
}

struct DiscCutter {
    grid: MapGrid,
    rect: MapRect,
    /// Margins of inner and outer discs, in sub-texels.
    inner: f32,
    outer: f32,
}

impl DiscCutter {
    /// Appends the inner or the outer discs of a slab, relative to a clock whose first slice begins `offset` seconds after the attack's start.
    fn cut(
        &self,
        steps: &AttackSteps,
        slab: i32,
        (clock, offset): (u32, f32),
        is_outer: bool,
        discs: &mut Vec<TimedDisc>,
    ) {
        let grid = self.grid;
        if is_outer {
            for step in steps.at(slab, clock, |step| step.met) {
                let disc = self.disc(step.bound(), slab, Cut::Outer(self.outer));
                if let Some(((from, to), disc)) = step.slices(grid, offset).zip(disc) {
                    discs.extend((from..=to).map(|slice| TimedDisc { disc, slice }));
                }
            }
            return;
        }
        let cut = match grid.is_certain() {
            true => Cut::Inner(self.inner),
            false => Cut::Nearest,
        };
        let mut add = |ball: Sphere, slice: u32| {
            let disc = self.disc(ball, slab, cut);
            discs.extend(disc.map(|disc| TimedDisc { disc, slice }));
        };
        if !grid.is_timed() {
            steps.untimed.iter().for_each(|&ball| add(ball, 0));
            return;
        }
        for step in steps.at(slab, clock, |step| step.met_inner) {
            let slice = i64::from(floor((step.middle - offset) / grid.slice_seconds));
            if (0..i64::from(grid.slices)).contains(&slice) {
                add(Sphere::new(step.centre, step.radius), slice as u32);
            }
        }
    }

    /// The disc that a ball cuts from a slab, if it touches the rectangle.
    fn disc(&self, ball: Sphere, slab: i32, cut: Cut) -> Option<Disc> {
        let disc = self.grid.cut(ball, Slab(slab), cut);
        let near = |disc: &Disc| !MapRect::around(&[*disc]).intersection(self.rect).is_empty();
        disc.filter(near)
    }
}

/// A short part of a sphere's line.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    /// Centre in the middle of the step's time.
    centre: Vec3,
    radius: f32,
    /// Radius around that centre that contains the sphere during the whole step, in metres.
    within: f32,
    /// Time from the attack's start to the middle of the step, in seconds.
    middle: f32,
    from: f32,
    to: f32,
    /// First and last slab within reach that the step may touch.
    slabs: (i32, i32),
    /// A bit for each clock for which the step may overlap the outer or body map of some candidate. The last bit stands for all further clocks.
    met: u64,
    /// A bit for each clock for which the step may overlap the inner maps of some candidate.
    met_inner: u64,
}

impl Step {
    /// Sphere that contains the attack's sphere during the whole step.
    fn bound(&self) -> Sphere {
        Sphere::new(self.centre, self.within)
    }

    /// The first and last slice of the step's time.
    fn slices(&self, grid: MapGrid, offset: f32) -> Option<(u32, u32)> {
        if !grid.is_timed() {
            return Some((0, 0));
        }
        let slice = |time: f32| i64::from(floor((time - offset) / grid.slice_seconds));
        let (from, to) = (slice(self.from - TIME_ERROR), slice(self.to + TIME_ERROR));
        let last = i64::from(grid.slices) - 1;
        (to >= 0 && from <= last).then(|| (from.max(0) as u32, to.min(last) as u32))
    }
}

fn clock_bit(clock: u32) -> u64 {
    1 << clock.min(63)
}

#[derive(Clone, Debug, Default, PartialEq)]
struct AttackSteps {
    steps: Vec<Step>,
    /// Spheres for untimed maps, as the paper draws them.
    untimed: Vec<Sphere>,
    /// Slabs in which a step may overlap the inner maps of each placed evasion.
    touched: Vec<Range<i32>>,
    /// Whether steps were left out because of a limit.
    cut_off: bool,
}

/// Maximum number of steps within reach. Further steps are not drawn, so that more candidates are left to the exact test.
const MOST_STEPS: usize = 1 << 18;

impl AttackSteps {
    fn clear(&mut self) {
        self.steps.clear();
        self.untimed.clear();
        self.touched.clear();
        self.cut_off = false;
    }

    /// Replaces the steps by those steps of an attack that may be within reach at a time that some clock covers.
    fn take(
        &mut self,
        atlas: &RegionAtlas,
        attack: &Attack,
        clocks: &[f32],
        placed: &[PlacedRegion],
        reach: &Reach,
        outer: bool,
    ) {
        let grid = atlas.grid();
        self.clear();
        let latest = clocks.iter().copied().fold(f32::NEG_INFINITY, f32::max) + grid.seconds();
        let earliest = clocks.iter().copied().fold(f32::INFINITY, f32::min);
        let start = attack.start();
        for sphere in attack.spheres() {
            if !grid.is_timed() {
                sphere.for_each_step(|ball| {
                    // No map reaches this sphere.
                    if !meets(ball, grid, reach.rect) {
                        return;
                    }
                    match self.untimed.len() < MOST_STEPS {
                        true => self.untimed.push(ball),
                        false => self.cut_off = true,
                    }
                });
            }
            for_each_span(sphere, grid, |ends| {
                let [from, to] = ends.map(|key| key.t - start);
                if grid.is_timed() && (to < earliest - TIME_ERROR || from > latest + TIME_ERROR) {
                    return;
                }
                let [a, b] = ends;
                let radius = 0.5 * (a.radius + b.radius);
                let away = 0.5 * (a.center.distance(b.center) + (b.radius - a.radius).abs());
                let mut step = Step {
                    centre: 0.5 * (a.center + b.center),
                    radius,
                    within: radius + away,
                    middle: 0.5 * (from + to),
                    from,
                    to,
                    slabs: (0, 0),
                    met: if grid.is_timed() { 0 } else { u64::MAX },
                    met_inner: 0,
                };
                let slabs = grid.slabs(step.centre, step.within);
                step.slabs = (
                    (*slabs.start()).max(reach.slabs.start),
                    (*slabs.end()).min(reach.slabs.end - 1),
                );
                if step.slabs.0 > step.slabs.1 || !meets(step.bound(), grid, reach.rect) {
                    return;
                }
                if self.steps.len() == MOST_STEPS {
                    self.cut_off = true;
                    return;
                }
                let texels = step.within / grid.texel + 2.0;
                self.cut_off |= texels * SUB_TEXELS as f32 > Disc::MAX_RADIUS as f32;
                self.steps.push(step);
            });
        }
        self.meet_inner(atlas, clocks, placed);
        if grid.is_timed() && outer {
            self.meet(atlas, clocks, placed);
        }
    }

    /// Finds the steps that the inner maps of some candidate can overlap, and their slabs.
    fn meet_inner(&mut self, atlas: &RegionAtlas, clocks: &[f32], placed: &[PlacedRegion]) {
        let (grid, regions) = (atlas.grid(), atlas.coarse());
        for placed in placed {
            let inner = regions[placed.region.index()].inner;
            let rect = grid.transformed_rect(inner, placed.placement);
            let (bit, offset) = (clock_bit(placed.clock), clocks[placed.clock as usize]);
            let (mut low, mut end) = (i32::MAX, i32::MIN);
            if !rect.is_empty() {
                for step in &mut self.steps {
                    let near = meets(step.bound(), grid, rect);
                    if near && step.slices(grid, offset).is_some() {
                        step.met_inner |= bit;
                        (low, end) = (low.min(step.slabs.0), end.max(step.slabs.1 + 1));
                    }
                }
            }
            let region = atlas.region(placed.region);
            let first = region.first_slab.0;
            low = low.max(first);
            self.touched
                .push(low..end.min(first + region.slabs.len() as i32));
        }
    }

    /// Finds the steps that the outer or body maps of some candidate can overlap.
    fn meet(&mut self, atlas: &RegionAtlas, clocks: &[f32], placed: &[PlacedRegion]) {
        let (grid, regions) = (atlas.grid(), atlas.coarse());
        for placed in placed {
            let bit = clock_bit(placed.clock);
            let offset = clocks[placed.clock as usize];
            let (maps, back) = (&regions[placed.region.index()], placed.placement.inverse());
            for step in &mut self.steps {
                if step.met & bit != 0 {
                    continue;
                }
                let Some((from, to)) = step.slices(grid, offset) else {
                    continue;
                };
                let ball = Sphere::new(back.point(step.centre), step.within);
                let near = |rect: MapRect| !rect.is_empty() && meets(ball, grid, rect);
                let slices = &maps.slices[from as usize..=to as usize];
                if slices.iter().any(|&rect| near(rect)) {
                    step.met |= bit;
                }
            }
        }
    }

    /// The steps that may touch a slab, and with a clock some maps whose clocks are the bits of `met`.
    fn at(&self, slab: i32, clock: u32, met: fn(&Step) -> u64) -> impl Iterator<Item = &Step> {
        self.steps.iter().filter(move |step| {
            (step.slabs.0..=step.slabs.1).contains(&slab) && met(step) & clock_bit(clock) != 0
        })
    }
}

/// Whether a sphere may touch a texel of the rectangle, or a texel of the attack's grid that lies in it.
fn meets(sphere: Sphere, grid: MapGrid, rect: MapRect) -> bool {
    let Sphere { centre, radius } = sphere;
    let reach = radius / grid.texel + 2.0;
    let axis = |place: f32, first: i32, texels: u32| {
        let place = place / grid.texel;
        place + reach >= first as f32 && place - reach <= (first + texels as i32) as f32
    };
    axis(centre.x, rect.u, rect.width) && axis(centre.z, rect.v, rect.height)
}

/// Calls `visit` with the ends of each step of a sphere. Between two keys a step is at most half of their mean radius and half of a slice
/// long. With the smaller radius, a blast that grows from a point would have very many steps.
fn for_each_span(sphere: &MovingSphere, grid: MapGrid, mut visit: impl FnMut([SphereKey; 2])) {
    if let [only] = sphere.keys() {
        visit([*only; 2]);
    }
    let steps = |from: &SphereKey, to: &SphereKey| {
        let mean = 0.5 * (from.radius + to.radius);
        let by_way = from.center.distance(to.center) / (0.5 * mean);
        by_way.max((to.t - from.t) / (0.5 * grid.slice_seconds))
    };
    sphere.for_each_span(steps, visit);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blast_that_grows_from_a_point_has_few_steps_and_a_ball_as_many_as_its_radius_asks_for() {
        let key = |t, x, radius| SphereKey {
            t,
            center: Vec3::new(x, 1.0, 0.0),
            radius,
        };
        let steps = |keys: [SphereKey; 2]| {
            let sphere = MovingSphere::new(keys.to_vec()).unwrap();
            let (mut count, mut longest) = (0, 0.0f32);
            for_each_span(&sphere, MapGrid::default(), |[from, to]| {
                count += 1;
                longest = longest.max(from.center.distance(to.center));
            });
            (count, longest)
        };
        let (count, _) = steps([key(0.5, 0.0, 0.001), key(0.9, 0.5, 2.0)]);
        let by_time = (0.4 / (0.5 * MapGrid::default().slice_seconds)).ceil() as usize;
        assert!(count <= by_time + 1, "{count} steps, {by_time} by time");
        let (count, longest) = steps([key(0.5, 0.0, 0.1), key(0.6, 10.0, 0.1)]);
        assert!(count == 200 && longest < 0.0501, "{count}, {longest} m");
    }
}
