//! The way of an attack's spheres in short steps: which of them any candidate's maps can meet.

use std::ops::Range;

use glam::Vec3;

use super::scene::{Reach, Scene};
use crate::maps::{CLOCK_ERROR, Disc, MapGrid, MapRect, MovingSphere, SUB_TEXELS, SphereKey};
use crate::math::floor;

/// A short part of a sphere's way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// In the middle of its time.
    pub(super) centre: Vec3,
    pub(super) radius: f32,
    /// The sphere is never larger than this around that centre.
    pub(super) within: f32,
    /// Seconds since the attack's start.
    pub(super) middle: f32,
    from: f32,
    to: f32,
    /// Slabs within reach that it may touch.
    slabs: (i32, i32),
    /// By which clocks some candidate's outer or body maps may be met, and which may use its inner
    /// discs: a bit each; the last one for all clocks further on.
    met: u64,
    met_inner: u64,
}

/// The bit of a clock.
fn clock_bit(clock: u32) -> u64 {
    1 << clock.min(63)
}

/// The steps of an attack's spheres: scratch of a query.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct Steps {
    steps: Vec<Step>,
    /// Where maps are untimed: the spheres as the paper draws them.
    pub(super) untimed: Vec<(Vec3, f32)>,
    /// For each placed evasion the slabs in which a step may meet its inner maps.
    pub(in crate::query) touched: Vec<Range<i32>>,
    /// Whether something is too large to be drawn whole.
    pub(super) cut_off: bool,
}

/// Most steps within reach. Those beyond are drawn nowhere: then more candidates are left to the exact test.
const MOST_STEPS: usize = 1 << 18;

impl Steps {
    /// Fills itself with the steps of an attack that may come within reach, at a time that some
    /// clock draws.
    pub(super) fn take(&mut self, scene: &Scene<'_>, reach: &Reach) {
        let (clocks, attack) = (scene.clocks, scene.attack);
        let grid = scene.atlas.grid().for_attacks();
        self.steps.clear();
        self.untimed.clear();
        self.touched.clear();
        self.cut_off = false;
        let latest = clocks.iter().copied().fold(f32::NEG_INFINITY, f32::max) + grid.seconds();
        let earliest = clocks.iter().copied().fold(f32::INFINITY, f32::min);
        let start = attack.start();
        for sphere in attack.spheres() {
            if !grid.is_timed() {
                sphere.for_each_step(|centre, radius| {
                    // What no map reaches is drawn nowhere.
                    if !meets((centre, radius), grid, reach.rect) {
                        return;
                    }
                    match self.untimed.len() < MOST_STEPS {
                        true => self.untimed.push((centre, radius)),
                        false => self.cut_off = true,
                    }
                });
            }
            for_each_span(sphere, grid, |ends| {
                let [from, to] = ends.map(|key| key.t - start);
                if grid.is_timed() && (to < earliest - CLOCK_ERROR || from > latest + CLOCK_ERROR) {
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
                if step.slabs.0 > step.slabs.1
                    || !meets((step.centre, step.within), grid, reach.rect)
                {
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
        self.meet_inner(scene);
        if grid.is_timed() && scene.outer {
            self.meet(scene);
        }
    }
}

/// Whether a sphere may touch a texel of the rectangle, or one of the attack's that falls into it.
fn meets((centre, radius): (Vec3, f32), grid: MapGrid, rect: MapRect) -> bool {
    let reach = radius / grid.texel + 2.0 * grid.attack_pitch as f32;
    let axis = |place: f32, first: i32, texels: u32| {
        let place = place / grid.texel;
        place + reach >= first as f32 && place - reach <= (first + texels as i32) as f32
    };
    axis(centre.x, rect.u, rect.width) && axis(centre.z, rect.v, rect.height)
}

/// Calls `visit` with the ends of each step of a sphere: at most half its radius and half a slice
/// long.
fn for_each_span(sphere: &MovingSphere, grid: MapGrid, mut visit: impl FnMut([SphereKey; 2])) {
    /// A sphere that is far faster than wide is drawn in large steps rather than without end.
    const MOST_STEPS: f32 = 1024.0;
    let keys = sphere.keys();
    if let [only] = keys {
        visit([*only; 2]);
    }
    for pair in keys.windows(2) {
        let smallest = pair[0].radius.min(pair[1].radius);
        let by_way = pair[0].center.distance(pair[1].center) / (0.5 * smallest);
        let by_time = (pair[1].t - pair[0].t) / (0.5 * grid.slice_seconds);
        let steps = by_way.max(by_time).ceil().clamp(1.0, MOST_STEPS);
        let at = |step: f32| {
            let share = step / steps;
            let between = |a: f32, b: f32| a + (b - a) * share;
            SphereKey {
                t: between(pair[0].t, pair[1].t),
                center: pair[0].center.lerp(pair[1].center, share),
                radius: between(pair[0].radius, pair[1].radius),
            }
        };
        let mut from = pair[0];
        for step in 1..=steps as usize {
            let to = at(step as f32);
            visit([from, to]);
            from = to;
        }
    }
}

impl Step {
    /// Whether its outer discs may be met by a clock's candidates.
    pub(super) fn is_met(&self, clock: u32) -> bool {
        self.met & clock_bit(clock) != 0
    }

    /// Whether its inner discs may be.
    pub(super) fn is_inner(&self, clock: u32) -> bool {
        self.met_inner & clock_bit(clock) != 0
    }

    /// The slices that it may last in, first and last.
    pub(super) fn slices(&self, grid: MapGrid, offset: f32) -> Option<(u32, u32)> {
        if !grid.is_timed() {
            return Some((0, 0));
        }
        let slice = |time: f32| i64::from(floor((time - offset) / grid.slice_seconds));
        let (from, to) = (slice(self.from - CLOCK_ERROR), slice(self.to + CLOCK_ERROR));
        let last = i64::from(grid.slices) - 1;
        (to >= 0 && from <= last).then(|| (from.max(0) as u32, to.min(last) as u32))
    }
}

impl Steps {
    /// Finds out of which steps some candidate's inner maps can meet something, and in which slabs those are.
    fn meet_inner(&mut self, scene: &Scene<'_>) {
        let (grid, regions) = (scene.atlas.grid(), scene.atlas.coarse());
        for placed in scene.placed {
            let inner = regions[placed.region.index()].inner;
            let rect = grid.transformed_rect(inner, placed.placement);
            let (bit, offset) = (clock_bit(placed.clock), scene.clocks[placed.clock as usize]);
            let (mut low, mut end) = (i32::MAX, i32::MIN);
            if !rect.is_empty() {
                for step in &mut self.steps {
                    let near = meets((step.centre, step.within), grid.for_attacks(), rect);
                    if near && step.slices(grid, offset).is_some() {
                        step.met_inner |= bit;
                        (low, end) = (low.min(step.slabs.0), end.max(step.slabs.1 + 1));
                    }
                }
            }
            let region = scene.atlas.region(placed.region);
            let first = region.first_slab.0;
            low = low.max(first);
            self.touched
                .push(low..end.min(first + region.slabs.len() as i32));
        }
    }

    /// Finds out which steps some candidate's outer or body maps can meet.
    fn meet(&mut self, scene: &Scene<'_>) {
        let (grid, regions) = (scene.atlas.grid(), scene.atlas.coarse());
        for placed in scene.placed {
            let bit = clock_bit(placed.clock);
            let offset = scene.clocks[placed.clock as usize];
            let (maps, back) = (&regions[placed.region.index()], placed.placement.inverse());
            for step in &mut self.steps {
                if step.met & bit != 0 {
                    continue;
                }
                let Some((from, to)) = step.slices(grid, offset) else {
                    continue;
                };
                let ball = (back.point(step.centre), step.within);
                let near = |rect: MapRect| !rect.is_empty() && meets(ball, grid, rect);
                let slices = &maps.slices[from as usize..=to as usize];
                if slices.iter().any(|&rect| near(rect)) {
                    step.met |= bit;
                }
            }
        }
    }

    /// The steps that may touch a slab.
    pub(super) fn at(&self, slab: i32) -> impl Iterator<Item = &Step> {
        self.steps
            .iter()
            .filter(move |step| (step.slabs.0..=step.slabs.1).contains(&slab))
    }
}
