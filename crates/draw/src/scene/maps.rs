//! Draws the maps of a dodge as layers: the texels that the body covers during a whole slice of
//! time, the texels that it has left, and the texels that the attack passes.
//!
//! Source: Masaoka & Oshita, section 3.2, in the colours of their figures: body green, attack red, evasion blue.

use super::{Layer, Shot};
use sabaki::graph::{EdgeId, Motion, MotionGraph};
use sabaki::maps::{
    BakedGraph, BitMap, Disc, Drawing, MapGrid, MapRect, MaskMap, SUB_TEXELS, Slab, raster,
};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack};

/// Placement of maps in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapStyle {
    /// Each slab at its own height.
    Heights,
    /// All slabs merged on the ground.
    Ground,
}

/// Maps of one evasion and of the attack that it avoids.
#[derive(Clone, Debug)]
pub(super) struct DodgeMaps {
    grid: MapGrid,
    /// Transform from the evasion's frame to the world.
    placement: Rigid2,
    /// Start of the evasion, in seconds since the query.
    start: f32,
    slabs: Vec<SlabLayers>,
}

#[derive(Clone, Debug)]
struct SlabLayers {
    height: f32,
    body: MaskMap,
    evasion: BitMap,
    attack: BitMap,
}

const BODY: [f32; 4] = [0.06, 0.50, 0.14, 0.62];
const EVASION: [f32; 4] = [0.05, 0.20, 0.85, 0.42];
const ATTACK: [f32; 4] = [0.85, 0.05, 0.03, 0.60];

impl DodgeMaps {
    /// Maps of the evasion that an answer plays, or `None` if it plays none.
    pub(super) fn of(baked: &BakedGraph, answer: &Answer, attack: &Attack) -> Option<Self> {
        let motion = &answer.motion;
        let evasion = answer.candidates.get(answer.chosen)?.evasion?;
        let start = start_of(baked.graph(), motion, evasion)?;
        let region = baked.evasion(evasion)?.region;
        let placement = motion
            .playhead(baked.graph(), start + 1e-4)
            .placement(baked.graph());
        let grid = baked.atlas().grid();
        let attack = attack.placed(placement.inverse());
        let maps = baked.atlas().region(region);
        let slabs = (maps.first_slab.0..).zip(&maps.slabs);
        let slabs = slabs.map(|(number, maps)| SlabLayers {
            height: (number as f32 + 0.5) * grid.slab_height,
            body: maps.body.clone(),
            evasion: maps.evasion.clone(),
            attack: attack_map(&attack, grid, Slab(number)),
        });
        Some(Self {
            grid,
            placement,
            start,
            slabs: slabs.collect(),
        })
    }

    /// Slice of a time, in seconds since the query.
    fn slice(&self, t: f32) -> u32 {
        let slice = match self.grid.is_timed() {
            true => ((t - self.start) / self.grid.slice_seconds).floor(),
            false => 0.0,
        };
        slice.clamp(0.0, self.grid.slices as f32 - 1.0) as u32
    }

    /// Adds the layers of a time, in seconds since the query, to a shot.
    pub(super) fn add(&self, t: f32, style: MapStyle, shot: &mut Shot) {
        let slice = self.slice(t);
        let body = |slab: &SlabLayers| of_slice(&slab.body, slice);
        let layer = |map: BitMap, height: f32, colour: [f32; 4]| Layer {
            map,
            texel: self.grid.texel,
            placement: self.placement,
            height,
            colour,
        };
        match style {
            MapStyle::Heights => {
                for slab in &self.slabs {
                    // Slabs that the attack does not pass are left out.
                    if slab.attack.count() > 0 {
                        shot.layers
                            .push(layer(slab.evasion.clone(), slab.height, EVASION));
                        shot.layers
                            .push(layer(body(slab), slab.height + 1e-3, BODY));
                        shot.layers
                            .push(layer(slab.attack.clone(), slab.height + 2e-3, ATTACK));
                    }
                }
            }
            MapStyle::Ground => {
                let all = |map: &dyn Fn(&SlabLayers) -> BitMap| union(self.slabs.iter().map(map));
                let evasion = all(&|slab| slab.evasion.clone());
                shot.layers.push(layer(evasion, 0.004, EVASION));
                shot.layers.push(layer(all(&body), 0.006, BODY));
                shot.layers
                    .push(layer(all(&|slab| slab.attack.clone()), 0.008, ATTACK));
            }
        }
    }
}

/// Start of an edge in a motion, in seconds since the motion's start.
fn start_of(graph: &MotionGraph, motion: &Motion, wanted: EdgeId) -> Option<f32> {
    let first = motion.playhead(graph, 0.0);
    let mut start = first.seconds_to_next_node(graph);
    for step in motion.steps() {
        if step.edge == wanted {
            return Some(start);
        }
        start += graph.seconds(step.edge) / step.rate;
    }
    None
}

/// The texels in which an attack's map is drawn, in the evasion's frame. An attack from far away passes more texels than
/// memory holds.
const SHOWN: MapRect = MapRect {
    u: -1024,
    v: -1024,
    width: 2048,
    height: 2048,
};

/// Texels that the attack passes in a slab at any time, in the attack's frame.
fn attack_map(attack: &Attack, grid: MapGrid, slab: Slab) -> BitMap {
    let mut discs = Vec::new();
    for sphere in attack.spheres() {
        sphere.for_each_step(|ball| discs.extend(grid.disc(ball.centre, ball.radius, slab)));
    }
    let rect = MapRect::around(&discs).intersection(SHOWN);
    let moved = |disc: &Disc| Disc {
        x: disc.x - rect.u * SUB_TEXELS,
        z: disc.z - rect.v * SUB_TEXELS,
        ..*disc
    };
    let drawing = Drawing {
        rect,
        frame_ends: vec![discs.len() as u32],
        discs: discs.iter().map(moved).collect(),
    };
    raster::any_frame(&drawing)
}

fn of_slice(map: &MaskMap, slice: u32) -> BitMap {
    let rect = map.rect();
    let mut bits = BitMap::new(rect);
    for row in 0..rect.height as i32 {
        for column in 0..rect.width as i32 {
            if map.get(column, row) >> slice & 1 == 1 {
                bits.set(column, row);
            }
        }
    }
    bits
}

fn union(maps: impl Iterator<Item = BitMap> + Clone) -> BitMap {
    let rects = maps.clone().map(|map| map.rect());
    let rect = rects.fold(MapRect::default(), MapRect::union);
    let mut all = BitMap::new(rect);
    for map in maps {
        let own = map.rect();
        map.for_each(|column, row| all.set(column + own.u - rect.u, row + own.v - rect.v));
    }
    all
}
