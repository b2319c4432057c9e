//! Where candidates stand, and the attack's maps that they are held against.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn in the frame in which the paths
//! start, the evasions' maps are moved and turned into place. Differs: only the part of the attack
//! is drawn that some candidate's maps can reach.

use glam::Vec3;

use super::Attack;
use super::cull::{AttackDrawing, CullCandidate};
use crate::math::Rigid2;
use crate::region::{Drawing, MapRect, MapTurn, RegionAtlas, RegionId, Slab};

/// An evasion where a candidate performs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlacedRegion {
    pub region: RegionId,
    /// The character's frame at the evasion's start, in the frame in which the paths start.
    pub placement: Rigid2,
}

/// The maps of one query.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CullMaps {
    pub attack: Vec<AttackDrawing>,
    /// One for each placed region, in order.
    pub candidates: Vec<CullCandidate>,
}

impl CullMaps {
    /// The slabs that the attack touches.
    pub(super) fn slabs(&self) -> impl Iterator<Item = Slab> + '_ {
        self.attack.iter().map(|attack| attack.slab)
    }
}

/// Draws `attack`, given in the frame in which the paths start, where the maps of `placed` may meet
/// it.
pub(super) fn cull_maps(atlas: &RegionAtlas, attack: &Attack, placed: &[PlacedRegion]) -> CullMaps {
    let texel = atlas.grid.texel;
    let reach = placed
        .iter()
        .map(|placed| moved_rect(region_rect(atlas, placed.region), placed.placement, texel))
        .fold(MapRect::default(), MapRect::union);
    let mut slabs = attack_discs(atlas, attack, reach);
    let around = slabs
        .iter()
        .map(|(_, drawing)| MapRect::around(&drawing.discs))
        .fold(MapRect::default(), MapRect::union);
    let rect = around.intersection(reach);
    for (_, drawing) in &mut slabs {
        drawing.rect = rect;
        drawing
            .discs
            .iter_mut()
            .for_each(|disc| *disc = disc.relative_to(rect.u, rect.v));
    }
    let turn =
        |placed: &PlacedRegion| MapTurn::new(placed.placement.inverse(), (rect.u, rect.v), texel);
    // Without maps nothing is culled, and the exact test has the work.
    let fits = !rect.is_empty() && rect.fits();
    CullMaps {
        attack: slabs
            .into_iter()
            .filter(|_| fits)
            .map(|(slab, drawing)| AttackDrawing { slab, drawing })
            .collect(),
        candidates: placed
            .iter()
            .map(|p| CullCandidate {
                region: p.region,
                turn: turn(p),
            })
            .collect(),
    }
}

/// The attack's discs in each slab that some evasion has maps of, as far as they meet `reach`.
fn attack_discs(atlas: &RegionAtlas, attack: &Attack, reach: MapRect) -> Vec<(Slab, Drawing)> {
    let grid = atlas.grid;
    let known = |region: &crate::region::RegionMaps| {
        region.first_slab.0..region.first_slab.0 + region.slabs.len() as i32
    };
    let low = atlas
        .regions
        .iter()
        .map(|r| known(r).start)
        .min()
        .unwrap_or(0);
    let high = atlas
        .regions
        .iter()
        .map(|r| known(r).end)
        .max()
        .unwrap_or(0);
    let mut slabs: Vec<(Slab, Drawing)> = (low..high)
        .map(|slab| (Slab(slab), Drawing::default()))
        .collect();
    for sphere in attack.spheres() {
        sphere.for_each_step(|center, radius| {
            let reached = grid.slabs(center, radius);
            for (slab, drawing) in slabs
                .iter_mut()
                .filter(|(slab, _)| reached.contains(&slab.0))
            {
                let disc = grid.disc(center, radius, *slab);
                let near = |disc: &crate::region::Disc| {
                    !MapRect::around(&[*disc]).intersection(reach).is_empty()
                };
                if let Some(disc) = disc.filter(near) {
                    drawing.discs.push(disc);
                    drawing.frame_ends.push(drawing.discs.len() as u32);
                }
            }
        });
    }
    slabs.retain(|(_, drawing)| !drawing.discs.is_empty());
    slabs
}

/// The rectangle that holds all maps of a region.
fn region_rect(atlas: &RegionAtlas, region: RegionId) -> MapRect {
    let slabs = &atlas.regions[region.index()].slabs;
    slabs
        .iter()
        .map(|maps| maps.body.rect())
        .fold(MapRect::default(), MapRect::union)
}

/// The rectangle around another one that is moved and turned.
fn moved_rect(rect: MapRect, placement: Rigid2, texel: f32) -> MapRect {
    let (u, v) = (
        [rect.u, rect.u + rect.width as i32],
        [rect.v, rect.v + rect.height as i32],
    );
    let corners = u.iter().flat_map(|&u| {
        v.iter()
            .map(move |&v| Vec3::new(u as f32, 0.0, v as f32) * texel)
    });
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for corner in corners.map(|corner| placement.point(corner) / texel) {
        low = low.min(corner);
        high = high.max(corner);
    }
    // Further away than any map is looked at, and near enough for whole numbers of sub-texels.
    const FAR: f32 = (1 << 24) as f32;
    let near = |texels: f32| texels.clamp(-FAR, FAR) as i32;
    // A texel on every side for rounding.
    let (first_u, first_v) = (near(low.x.floor()) - 1, near(low.z.floor()) - 1);
    let (end_u, end_v) = (near(high.x.ceil()) + 1, near(high.z.ceil()) + 1);
    MapRect {
        u: first_u,
        v: first_v,
        width: (end_u - first_u) as u32,
        height: (end_v - first_v) as u32,
    }
}
