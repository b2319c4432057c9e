//! The attack as discs: slab by slab, clock by clock, each disc with its slice of time.
//!
//! Source: Masaoka & Oshita, section 5.3. Differs: discs have a time, and are drawn twice, rounded
//! inwards and outwards. A step of the attack's way stands for a short time: in its middle the
//! sphere is surely where it is drawn; in all of that time it is nowhere outside of a sphere that
//! is larger by half of the step.

use std::ops::Range;

use glam::Vec3;

use super::scene::{Reach, Scene};
use super::steps::Steps;
use crate::maps::{Cut, Disc, FixedTransform2, HALF_DIAGONAL, MapGrid, MapRect, ROUNDING, Slab};
use crate::math::floor;

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

impl AttackDrawing {
    /// Most texels a side of an attack's maps. What is further out is left away, and candidates are
    /// open.
    pub const MAX_SIDE: u32 = 1024;

    /// Most discs of all layers, 16 MB. Layers that would bring more are left away, and candidates are open.
    pub const MOST_DISCS: usize = 1 << 20;

    /// Draws a scene's attack within `reach`. Returns whether all of it within reach is drawn.
    pub(in crate::query) fn draw(
        &mut self,
        scene: &Scene<'_>,
        reach: &Reach,
        scratch: &mut Steps,
    ) -> bool {
        let grid = scene.atlas.grid().for_attacks();
        // Without time every clock draws the same.
        let clocks = match grid.is_timed() {
            true => scene.clocks,
            false => &scene.clocks[..scene.clocks.len().min(1)],
        };
        self.layers.clear();
        self.discs.clear();
        self.rect = MapRect::default();
        let (rect, whole) = limited(reach.rect);
        if rect.is_empty() || reach.slabs.is_empty() {
            return whole;
        }
        scratch.take(scene, reach);
        let pen = Pen {
            grid,
            rect,
            inner: ROUNDING + FixedTransform2::error(rect.width, rect.height),
            outer: HALF_DIAGONAL + ROUNDING,
        };
        let mut around = MapRect::default();
        for (clock, &offset) in (0..).zip(clocks) {
            for slab in reach.slabs.clone() {
                let inner = self.discs.len();
                pen.inner((scratch, slab), (clock, offset), &mut self.discs);
                let outer = self.discs.len();
                if scene.outer {
                    pen.outer((scratch, slab), (clock, offset), &mut self.discs);
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

/// Cuts steps into discs.
struct Pen {
    grid: MapGrid,
    rect: MapRect,
    /// Margins, sub-texels.
    inner: f32,
    outer: f32,
}

impl Pen {
    fn inner(
        &self,
        (steps, slab): (&Steps, i32),
        (clock, offset): (u32, f32),
        discs: &mut Vec<TimedDisc>,
    ) {
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
        for step in steps.at(slab).filter(|step| step.is_inner(clock)) {
            let slice = i64::from(floor((step.middle - offset) / grid.slice_seconds));
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

    fn outer(
        &self,
        (steps, slab): (&Steps, i32),
        (clock, offset): (u32, f32),
        discs: &mut Vec<TimedDisc>,
    ) {
        let grid = self.grid;
        let cut = Cut::Outer(self.outer);
        for step in steps.at(slab).filter(|step| step.is_met(clock)) {
            if let Some((from, to)) = step.slices(grid, offset) {
                self.push(((step.centre, step.within), slab, cut), from..=to, discs);
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
