//! Summaries of the attack's blocks of texels, in groups of sixteen.

use super::texels::{AttackTexels, BLOCK, any_of};
use crate::math::Isa;

/// Number of blocks in a group.
pub(super) const LANES: usize = 16;

/// Summaries of sixteen blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Group {
    /// Position of each block's middle, in half texels.
    pub u: [i32; LANES],
    pub v: [i32; LANES],
    /// Union of the slices of each block's texels, `[lane][block]`.
    pub outer: [[u32; LANES]; 2],
    pub inner: [[u32; LANES]; 2],
    /// For each block, all bits set if it has an inner texel, otherwise 0.
    pub any_inner: [u32; LANES],
    pub has_inner: bool,
    /// A bit for each block that exists in the group.
    pub blocks: u32,
}

/// The groups of all layers.
#[derive(Clone, Debug, Default)]
pub(super) struct Groups {
    groups: Vec<Group>,
    /// First group and first block of each layer. The last entry is the end of all groups and blocks.
    layers: Vec<(usize, usize)>,
    largest_first: Vec<usize>,
}

impl Groups {
    /// Replaces the groups by those of an attack.
    pub(super) fn take(&mut self, isa: Isa, texels: &AttackTexels) {
        self.groups.clear();
        self.layers.clear();
        isa.run(
            #[inline(always)]
            || {
                for layer in &texels.layers {
                    let (start, end) = (layer.blocks.start as usize, layer.blocks.end as usize);
                    self.layers.push((self.groups.len(), start));
                    for first in (start..end).step_by(LANES) {
                        self.groups.push(Group::new(texels, first, end));
                    }
                }
            },
        );
        self.layers.push((self.groups.len(), 0));
        self.largest_first.clear();
        self.largest_first.extend(0..texels.layers.len());
        let blocks = |index: usize| texels.layers[index].blocks.len();
        self.largest_first
            .sort_unstable_by_key(|&index| (std::cmp::Reverse(blocks(index)), index));
    }

    /// The layers, the largest first, because a hit is most likely there.
    pub(super) fn largest_first(&self) -> &[usize] {
        &self.largest_first
    }

    /// The groups of one layer, each with its first block.
    pub(super) fn of(&self, layer: usize) -> impl Iterator<Item = (&Group, usize)> {
        let (start, first) = self.layers[layer];
        let groups = &self.groups[start..self.layers[layer + 1].0];
        groups.iter().zip((first..).step_by(LANES))
    }
}

impl Group {
    #[inline(always)]
    fn new(texels: &AttackTexels, first: usize, end: usize) -> Self {
        let mut group = Self::default();
        for (at, block) in (first..end.min(first + LANES)).enumerate() {
            let [u, v] = texels.places[block];
            (group.u[at], group.v[at]) = (2 * u + BLOCK as i32, 2 * v + BLOCK as i32);
            group.blocks |= 1 << at;
            for lane in 0..texels.lanes {
                let index = block * texels.lanes + lane;
                // There may be no outer texels.
                group.outer[lane][at] = texels.outer.get(index).map_or(0, any_of);
                group.inner[lane][at] = any_of(&texels.inner[index]);
                if group.inner[lane][at] != 0 {
                    group.any_inner[at] = u32::MAX;
                    group.has_inner = true;
                }
            }
        }
        group
    }
}
