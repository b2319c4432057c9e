//! Divides the lines of an attack's spheres into short steps, and finds the steps that the maps of any candidate can overlap.

use std::ops::Range;

use glam::Vec3;

use super::draw_input::{DrawInput, Reach};
use crate::maps::{CLOCK_ERROR, Disc, MapGrid, MapRect, MovingSphere, SUB_TEXELS, SphereKey};
use crate::math::{Sphere, floor};

/// A short part of a sphere's line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// Centre in the middle of the step's time.
    pub(super) centre: Vec3,
    pub(super) radius: f32,
    /// Radius around that centre that contains the sphere during the whole step, in metres.
    pub(super) within: f32,
    /// Time from the attack's start to the middle of the step, in seconds.
    pub(super) middle: f32,
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
    pub(super) fn bound(&self) -> Sphere {
        Sphere::new(self.centre, self.within)
    }
}

/// The bit of a clock.
fn clock_bit(clock: u32) -> u64 {
    1 << clock.min(63)
}

/// The steps of an attack's spheres.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct AttackSteps {
    steps: Vec<Step>,
    /// Spheres for untimed maps, as the paper draws them.
    pub(super) untimed: Vec<Sphere>,
    /// Slabs in which a step may overlap the inner maps of each placed evasion.
    pub(in crate::query) touched: Vec<Range<i32>>,
    /// Whether steps were left out because of a limit.
    pub(super) cut_off: bool,
}

/// Maximum number of steps within reach. Further steps are not drawn, so that more candidates are left to the exact test.
const MOST_STEPS: usize = 1 << 18;

impl AttackSteps {
    /// Removes all steps. The memory is kept.
    pub(super) fn clear(&mut self) {
        self.steps.clear();
        self.untimed.clear();
        self.touched.clear();
        self.cut_off = false;
    }

    /// Replaces the steps by those steps of an attack that may be within reach at a time that some clock covers.
    pub(super) fn take(&mut self, input: &DrawInput<'_>, reach: &Reach) {
        let (clocks, attack) = (input.clocks, input.attack);
        let grid = input.atlas.grid().for_attacks();
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
        self.meet_inner(input);
        if grid.is_timed() && input.outer {
            self.meet(input);
        }
    }
}

/// Whether a sphere may touch a texel of the rectangle, or a texel of the attack's grid that lies in it.
fn meets(sphere: Sphere, grid: MapGrid, rect: MapRect) -> bool {
    let Sphere { centre, radius } = sphere;
    let reach = radius / grid.texel + 2.0 * grid.attack_pitch as f32;
    let axis = |place: f32, first: i32, texels: u32| {
        let place = place / grid.texel;
        place + reach >= first as f32 && place - reach <= (first + texels as i32) as f32
    };
    axis(centre.x, rect.u, rect.width) && axis(centre.z, rect.v, rect.height)
}

/// Calls `visit` with the ends of each step of a sphere. Between two keys a step is at most half of their mean radius and half of a slice
/// long. With the smaller radius, a blast that grows from a point would have very many steps.
fn for_each_span(sphere: &MovingSphere, grid: MapGrid, mut visit: impl FnMut([SphereKey; 2])) {
    /// Maximum number of steps between two keys. The steps of very fast spheres are longer.
    const MOST_STEPS: f32 = 1024.0;
    let keys = sphere.keys();
    if let [only] = keys {
        visit([*only; 2]);
    }
    for pair in keys.windows(2) {
        let mean = 0.5 * (pair[0].radius + pair[1].radius);
        let by_way = pair[0].center.distance(pair[1].center) / (0.5 * mean);
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
    /// Whether the step's outer discs may overlap maps of candidates with a clock.
    pub(super) fn is_met(&self, clock: u32) -> bool {
        self.met & clock_bit(clock) != 0
    }

    /// Whether the step's inner discs may overlap maps of candidates with a clock.
    pub(super) fn is_inner(&self, clock: u32) -> bool {
        self.met_inner & clock_bit(clock) != 0
    }

    /// The first and last slice of the step's time.
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

impl AttackSteps {
    /// Finds the steps that the inner maps of some candidate can overlap, and their slabs.
    fn meet_inner(&mut self, input: &DrawInput<'_>) {
        let (grid, regions) = (input.atlas.grid(), input.atlas.coarse());
        for placed in input.placed {
            let inner = regions[placed.region.index()].inner;
            let rect = grid.transformed_rect(inner, placed.placement);
            let (bit, offset) = (clock_bit(placed.clock), input.clocks[placed.clock as usize]);
            let (mut low, mut end) = (i32::MAX, i32::MIN);
            if !rect.is_empty() {
                for step in &mut self.steps {
                    let near = meets(step.bound(), grid.for_attacks(), rect);
                    if near && step.slices(grid, offset).is_some() {
                        step.met_inner |= bit;
                        (low, end) = (low.min(step.slabs.0), end.max(step.slabs.1 + 1));
                    }
                }
            }
            let region = input.atlas.region(placed.region);
            let first = region.first_slab.0;
            low = low.max(first);
            self.touched
                .push(low..end.min(first + region.slabs.len() as i32));
        }
    }

    /// Finds the steps that the outer or body maps of some candidate can overlap.
    fn meet(&mut self, input: &DrawInput<'_>) {
        let (grid, regions) = (input.atlas.grid(), input.atlas.coarse());
        for placed in input.placed {
            let bit = clock_bit(placed.clock);
            let offset = input.clocks[placed.clock as usize];
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

    /// The steps that may touch a slab.
    pub(super) fn at(&self, slab: i32) -> impl Iterator<Item = &Step> {
        self.steps
            .iter()
            .filter(move |step| (step.slabs.0..=step.slabs.1).contains(&slab))
    }
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
