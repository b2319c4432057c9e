//! Draws the attack as discs, for each slab and clock. Each disc belongs to a slice of time.
//!
//! Source: Masaoka & Oshita, section 5.3. Differs: discs have a time, and there are two kinds, rounded inwards and outwards. The
//! attack is cut into short steps. Inner discs represent the sphere in the middle of a step. Outer discs represent a sphere
//! that is larger by half of the step, so that it contains the attack's sphere during the whole step.

use std::ops::Range;

use super::draw_input::{DrawInput, Reach};
use super::steps::AttackSteps;
use crate::maps::{Cut, Disc, FixedTransform2, HALF_DIAGONAL, MapGrid, MapRect, ROUNDING, Slab};
use crate::math::{Sphere, floor};

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
    /// Clock of the layer ([`CullCandidate::clock`](super::CullCandidate::clock)).
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

impl AttackDrawing {
    /// Maximum side of an attack's maps, in texels. Parts outside are not drawn, and candidates are then open.
    pub const MAX_SIDE: u32 = 1024;

    /// Maximum number of discs of all layers (16 MB). Further layers are not drawn, and candidates are then open.
    pub const MOST_DISCS: usize = 1 << 20;

    /// Draws the attack within `reach`. Returns whether everything within reach is drawn.
    pub(in crate::query) fn draw(
        &mut self,
        input: &DrawInput<'_>,
        reach: &Reach,
        scratch: &mut AttackSteps,
    ) -> bool {
        let grid = input.atlas.grid().for_attacks();
        // Untimed maps are the same for every clock.
        let clocks = match grid.is_timed() {
            true => input.clocks,
            false => &input.clocks[..input.clocks.len().min(1)],
        };
        self.layers.clear();
        self.discs.clear();
        self.rect = MapRect::default();
        let (rect, whole) = limited(reach.rect);
        if rect.is_empty() || reach.slabs.is_empty() {
            scratch.clear();
            return whole;
        }
        scratch.take(input, reach);
        let cutter = DiscCutter {
            grid,
            rect,
            inner: ROUNDING + FixedTransform2::error(rect.width, rect.height),
            outer: HALF_DIAGONAL + ROUNDING,
        };
        let mut around = MapRect::default();
        for (clock, &offset) in (0..).zip(clocks) {
            for slab in reach.slabs.clone() {
                let inner = self.discs.len();
                let layer = LayerTime {
                    slab,
                    clock,
                    offset,
                };
                cutter.inner(scratch, layer, &mut self.discs);
                let outer = self.discs.len();
                if input.outer {
                    cutter.outer(scratch, layer, &mut self.discs);
                }
                let end = self.discs.len();
                if inner == end {
                    continue;
                }
                if end > Self::MOST_DISCS {
                    self.discs.truncate(inner);
                    scratch.cut_off = true;
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

    /// The discs of a layer's inner map and outer map.
    #[must_use]
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

fn timed_rect(discs: &[TimedDisc]) -> MapRect {
    let one = |timed: &TimedDisc| MapRect::around(&[timed.disc]);
    discs
        .iter()
        .map(one)
        .fold(MapRect::default(), MapRect::union)
}

/// A map of the attack: the part in a slab, relative to a clock.
#[derive(Clone, Copy)]
struct LayerTime {
    slab: i32,
    clock: u32,
    /// Time at which the clock's first slice begins, in seconds.
    offset: f32,
}

/// Cuts the spheres of steps into discs.
struct DiscCutter {
    grid: MapGrid,
    rect: MapRect,
    /// Margins of inner and outer discs, in sub-texels.
    inner: f32,
    outer: f32,
}

impl DiscCutter {
    /// Appends the inner discs of a layer.
    fn inner(&self, steps: &AttackSteps, layer: LayerTime, discs: &mut Vec<TimedDisc>) {
        let grid = self.grid;
        let cut = if grid.is_certain() {
            Cut::Inner(self.inner)
        } else {
            Cut::Nearest
        };
        if !grid.is_timed() {
            let all = steps.untimed.iter();
            let cut = all.filter_map(|&ball| self.disc(ball, layer.slab, cut));
            discs.extend(cut.map(|disc| TimedDisc { disc, slice: 0 }));
            return;
        }
        for step in steps
            .at(layer.slab)
            .filter(|step| step.is_inner(layer.clock))
        {
            let slice = i64::from(floor((step.middle - layer.offset) / grid.slice_seconds));
            if (0..i64::from(grid.slices)).contains(&slice) {
                let slice = slice as u32;
                let disc = self.disc(Sphere::new(step.centre, step.radius), layer.slab, cut);
                discs.extend(disc.map(|disc| TimedDisc { disc, slice }));
            }
        }
    }

    /// Appends the outer discs of a layer.
    fn outer(&self, steps: &AttackSteps, layer: LayerTime, discs: &mut Vec<TimedDisc>) {
        let cut = Cut::Outer(self.outer);
        for step in steps.at(layer.slab).filter(|step| step.is_met(layer.clock)) {
            let Some((from, to)) = step.slices(self.grid, layer.offset) else {
                continue;
            };
            if let Some(disc) = self.disc(step.bound(), layer.slab, cut) {
                discs.extend((from..=to).map(|slice| TimedDisc { disc, slice }));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::RegionAtlas;
    use crate::query::Attack;

    #[test]
    fn nothing_within_reach_leaves_nothing_of_an_earlier_attack() {
        let atlas = RegionAtlas::new(MapGrid::default(), Vec::new(), Vec::new());
        let input = DrawInput {
            atlas: &atlas,
            attack: &Attack::empty(),
            clocks: &[],
            placed: &[],
            reach: 1.0,
            outer: true,
        };
        let mut steps = AttackSteps::default();
        steps.touched.push(0..3);
        steps.cut_off = true;
        assert!(AttackDrawing::default().draw(&input, &Reach::default(), &mut steps));
        assert_eq!(steps, AttackSteps::default());
    }
}
