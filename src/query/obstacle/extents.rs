//! How far the body's spheres reach from the axis of its column.
//!
//! Extents are measured many at a time. One is rounded up a little, so that it is a bound of what a sphere's exact centre, which its joint
//! gives, shows.

use std::ops::Range;

use glam::Vec2;

use crate::maps::{BakedGraph, BodyTrack};
use crate::math::Isa;

/// Number of spheres of a block.
const LANES: usize = BodyTrack::LANES;

/// How far each sphere of a body reaches from an axis, in metres.
#[derive(Clone, Debug, Default)]
pub(super) struct Extents {
    /// Distance of each sphere's far side from the axis, in metres, padded to whole blocks.
    pub all: Vec<f32>,
    /// The largest of each block.
    pub widest: Vec<f32>,
}

impl Extents {
    /// Measures from a vertical axis. `centres` are rows of the coordinates of the spheres' centres.
    pub(super) fn measure(&mut self, baked: &BakedGraph, centres: [&[f32]; 3], axis: Vec2) {
        let radii = baked.body_rows().radii();
        self.all.resize(radii.len(), 0.0);
        self.widest.resize(radii.len() / LANES, 0.0);
        let [x, _, z] = centres;
        Isa::best().run(
            #[inline(always)]
            || self.measure_rows([x, z, radii], axis),
        );
    }

    /// The spheres of a block, without the padding.
    pub(super) fn of_block(&self, block: usize, spheres: usize) -> Range<usize> {
        block * LANES..((block + 1) * LANES).min(spheres)
    }

    #[inline(always)]
    fn measure_rows(&mut self, rows: [&[f32]; 3], axis: Vec2) {
        // Rounding of centres and of their distances, in metres, and as a share of the axis's coordinates.
        const ROUNDING: (f32, f32) = (1e-4, 1e-6);
        let slack = ROUNDING.0 + ROUNDING.1 * axis.abs().max_element();
        let [x, z, radii] = rows.map(|row| row.as_chunks::<LANES>().0);
        let all = self.all.as_chunks_mut::<LANES>().0;
        for (block, (extents, widest)) in all.iter_mut().zip(&mut self.widest).enumerate() {
            for lane in 0..LANES {
                let (x, z) = (x[block][lane] - axis.x, z[block][lane] - axis.y);
                extents[lane] = (x * x + z * z).sqrt() + radii[block][lane] + slack;
            }
            *widest = extents.iter().copied().fold(0.0, f32::max);
        }
    }
}
