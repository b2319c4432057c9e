//! The attack as discs: slab by slab, clock by clock, each disc with its slice of time.
//!
//! Source: Masaoka & Oshita, section 5.3. Differs: discs have a time, and are drawn twice, rounded
//! inwards and outwards. A step of the attack's way stands for a short time: in its middle the
//! sphere is surely where it is drawn; in all of that time it is nowhere outside of a sphere that
//! is larger by half of the step.

use std::ops::Range;

use glam::Vec3;

use crate::avoid::Attack;
use crate::region::{
    CLOCK_ERROR, Cut, Disc, HALF_DIAGONAL, MapGrid, MapRect, MapTurn, MovingSphere, ROUNDING,
    SUB_TEXELS, Slab, SphereKey,
};

/// The attack's discs, in the frame that the paths start in.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AttackDrawing {
    /// The place of all its maps; at most [`AttackDrawing::MAX_SIDE`] texels a side.
    pub rect: MapRect,
    /// One for each clock and each slab in which something is drawn.
    pub layers: Vec<AttackLayer>,
    /// Of all layers, relative to the rectangle's first texel.
    pub discs: Vec<TimedDisc>,
}

/// The attack in one slab, by one clock.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttackLayer {
    /// Which height.
    pub slab: Slab,
    /// Which clock ([`CullCandidate::clock`](super::CullCandidate::clock)).
    pub clock: u32,
    /// In [`AttackDrawing::discs`], by slice: what the attack covers at some time of the slice.
    pub inner: Range<u32>,
    /// The same for all that it may touch at any time of the slice and any height of the slab.
    pub outer: Range<u32>,
}

/// A disc in one slice of time.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedDisc {
    /// Where.
    pub disc: Disc,
    /// When; 0 where maps are untimed.
    pub slice: u32,
}

/// Which part of the attack is drawn: what some candidate's maps can reach.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::avoid) struct Reach {
    /// Texels of the frame that the paths start in.
    pub rect: MapRect,
    pub slabs: Range<i32>,
}

/// A short part of a sphere's way.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    /// In the middle of its time.
    centre: Vec3,
    radius: f32,
    /// The sphere is never larger than this around that centre.
    within: f32,
    /// Seconds since the attack's start.
    middle: f32,
    from: f32,
    to: f32,
    /// Slabs within reach that it may touch.
    slabs: (i32, i32),
}

/// The steps of an attack's spheres: scratch of a query.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::avoid) struct Steps {
    steps: Vec<Step>,
    /// Where maps are untimed: the spheres as the paper draws them.
    untimed: Vec<(Vec3, f32)>,
    /// Whether something is too large to be drawn whole.
    cut_off: bool,
}

impl AttackDrawing {
    /// Most texels a side of an attack's maps. What is further out is left away, and candidates are
    /// open.
    pub const MAX_SIDE: u32 = 1024;

    /// Draws an attack within `reach`. `clocks` are the seconds from the attack's start to the
    /// evasion's, for each clock. Returns whether all of it within reach is drawn.
    pub(in crate::avoid) fn draw(
        &mut self,
        (attack, clocks): (&Attack, &[f32]),
        (grid, reach): (MapGrid, &Reach),
        scratch: &mut Steps,
    ) -> bool {
        self.layers.clear();
        self.discs.clear();
        self.rect = MapRect::default();
        let (rect, whole) = limited(reach.rect);
        if rect.is_empty() || reach.slabs.is_empty() {
            return whole;
        }
        scratch.take(attack, (grid, reach), clocks);
        let pen = Pen {
            grid,
            rect,
            inner: ROUNDING + MapTurn::error(rect.width, rect.height),
            outer: HALF_DIAGONAL + ROUNDING,
        };
        let mut around = MapRect::default();
        for (clock, &offset) in (0..).zip(clocks) {
            for slab in reach.slabs.clone() {
                let inner = self.discs.len();
                pen.inner((scratch, slab), offset, &mut self.discs);
                let outer = self.discs.len();
                pen.outer((scratch, slab), offset, &mut self.discs);
                let end = self.discs.len();
                if inner == end {
                    continue;
                }
                around = around.union(timed_rect(&self.discs[inner..end]));
                for part in [inner..outer, outer..end] {
                    self.discs[part].sort_unstable_by_key(|one| one.slice);
                }
                self.layers.push(AttackLayer {
                    slab: Slab(slab),
                    clock,
                    inner: inner as u32..outer as u32,
                    outer: outer as u32..end as u32,
                });
            }
        }
        self.rect = around.intersection(rect);
        for one in &mut self.discs {
            one.disc = one.disc.relative_to(self.rect.u, self.rect.v);
        }
        whole && !scratch.cut_off
    }

    /// The discs of a layer's inner and outer map.
    #[must_use]
    pub fn discs_of(&self, layer: &AttackLayer) -> [&[TimedDisc]; 2] {
        [&layer.inner, &layer.outer]
            .map(|range| &self.discs[range.start as usize..range.end as usize])
    }
}

/// The middle of a rectangle, as far as fixed-point turns are exact enough, and whether that is all.
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

fn timed_rect(discs: &[TimedDisc]) -> MapRect {
    let one = |timed: &TimedDisc| MapRect::around(&[timed.disc]);
    discs
        .iter()
        .map(one)
        .fold(MapRect::default(), MapRect::union)
}

impl Steps {
    /// Fills itself with the steps of an attack that may come within reach, at a time that some
    /// clock draws.
    fn take(&mut self, attack: &Attack, (grid, reach): (MapGrid, &Reach), clocks: &[f32]) {
        self.steps.clear();
        self.untimed.clear();
        self.cut_off = false;
        let latest = clocks.iter().copied().fold(f32::NEG_INFINITY, f32::max) + grid.seconds();
        let earliest = clocks.iter().copied().fold(f32::INFINITY, f32::min);
        let start = attack.start();
        for sphere in attack.spheres() {
            if !grid.is_timed() {
                sphere.for_each_step(|centre, radius| self.untimed.push((centre, radius)));
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
                };
                let slabs = grid.slabs(step.centre, step.within);
                step.slabs = (
                    (*slabs.start()).max(reach.slabs.start),
                    (*slabs.end()).min(reach.slabs.end - 1),
                );
                if step.slabs.0 > step.slabs.1 || !meets(&step, grid, reach.rect) {
                    return;
                }
                let texels = step.within / grid.texel + 2.0;
                self.cut_off |= texels * SUB_TEXELS as f32 > Disc::MAX_RADIUS as f32;
                self.steps.push(step);
            });
        }
    }
}

/// Whether a step may touch a texel of the rectangle.
fn meets(step: &Step, grid: MapGrid, rect: MapRect) -> bool {
    let reach = step.within / grid.texel + 2.0;
    let axis = |place: f32, first: i32, texels: u32| {
        let place = place / grid.texel;
        place + reach >= first as f32 && place - reach <= (first + texels as i32) as f32
    };
    axis(step.centre.x, rect.u, rect.width) && axis(step.centre.z, rect.v, rect.height)
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

/// Cuts steps into discs.
struct Pen {
    grid: MapGrid,
    rect: MapRect,
    /// Margins, sub-texels.
    inner: f32,
    outer: f32,
}

impl Pen {
    fn inner(&self, (steps, slab): (&Steps, i32), clock: f32, discs: &mut Vec<TimedDisc>) {
        let grid = self.grid;
        let cut = if grid.is_certain() {
            Cut::Inner(self.inner)
        } else {
            Cut::Nearest
        };
        if !grid.is_timed() {
            for &ball in &steps.untimed {
                self.push((ball, slab, cut), 0..=0, discs);
            }
            return;
        }
        for step in steps.at(slab) {
            let slice = ((step.middle - clock) / grid.slice_seconds).floor() as i64;
            if (0..i64::from(grid.slices)).contains(&slice) {
                let slice = slice as u32;
                self.push(
                    ((step.centre, step.radius), slab, cut),
                    slice..=slice,
                    discs,
                );
            }
        }
    }

    fn outer(&self, (steps, slab): (&Steps, i32), clock: f32, discs: &mut Vec<TimedDisc>) {
        let grid = self.grid;
        let cut = Cut::Outer(self.outer);
        let last = i64::from(grid.slices) - 1;
        for step in steps.at(slab) {
            let slice = |time: f32| ((time - clock) / grid.slice_seconds).floor() as i64;
            let (from, to) = match grid.is_timed() {
                true => (slice(step.from - CLOCK_ERROR), slice(step.to + CLOCK_ERROR)),
                false => (0, 0),
            };
            if to >= 0 && from <= last {
                let slices = from.max(0) as u32..=to.min(last) as u32;
                self.push(((step.centre, step.within), slab, cut), slices, discs);
            }
        }
    }

    fn push(
        &self,
        (ball, slab, cut): ((Vec3, f32), i32, Cut),
        slices: std::ops::RangeInclusive<u32>,
        discs: &mut Vec<TimedDisc>,
    ) {
        let disc = self.grid.cut(ball, Slab(slab), cut);
        let near = |disc: &Disc| !MapRect::around(&[*disc]).intersection(self.rect).is_empty();
        if let Some(disc) = disc.filter(near) {
            discs.extend(slices.map(|slice| TimedDisc { disc, slice }));
        }
    }
}

impl Steps {
    fn at(&self, slab: i32) -> impl Iterator<Item = &Step> {
        self.steps
            .iter()
            .filter(move |step| (step.slabs.0..=step.slabs.1).contains(&slab))
    }
}
