//! The candidates' maps, placed over those of the attack, and the queries that count them.
//!
//! Source: Masaoka & Oshita, section 5.3: a candidate's body map is moved and turned into the frame of the attack's maps and drawn over them;
//! a query counts the pixels that both cover, and one such pixel removes the candidate. Section 5.4: the evasion map is counted in the same
//! way, for the score.
//! Differs: the texel of the candidate's map is found in the fragment shader, in fixed point, so that every device finds the same one. The quad
//! only has to cover the map; it is the part of the attack's map that the candidate's map can reach. One query spans the screens of all
//! intervals and slices. If nothing can overlap, there is no query. A third map, the outer one, proves misses.

use std::ops::Range;

use super::{
    attack::{AttackMap, AttackMaps, Kind},
    maps::{MapBits, Maps, Part},
    screen::{Draws, Screen},
};
use crate::{
    gpu::{GpuError, error::within, shader_table::PlacedMap},
    maps::{FixedTransform2, MapRect},
    query::cull::{Counted, CullCandidate, CullInput},
};

/// Maximum number of maps that are drawn in one rendering.
pub(super) const MOST_MAPS: u32 = (Screen::INSTANCE_BYTES / size_of::<PlacedMap>()) as u32;

/// Number of queries of each candidate that a cull has room for: three parts, each in several passes if the attack is large.
const QUERIES: u64 = 12;

/// One count, or a part of it if there are several passes.
#[derive(Clone, Debug)]
pub(super) struct Query {
    pub(super) pass: usize,
    pub(super) candidate: u32,
    pub(super) part: Part,
    pub(super) maps: Range<u32>,
}

/// Input of one cull for the device. The memory is reused; after inputs of similar size nothing is allocated.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    pub(super) attack: AttackMaps,
    pub(super) draws: Vec<Draws>,
    pub(super) maps: Vec<PlacedMap>,
    /// Queries, pass by pass.
    pub(super) queries: Vec<Query>,
}

/// Number of counts of a cull of so many candidates.
pub(super) fn most_queries(candidates: u32) -> u64 {
    QUERIES * u64::from(candidates)
}

impl Gathered {
    /// Places the maps of an attack and its candidates.
    pub(super) fn fill(
        &mut self,
        input: &CullInput<'_>,
        counted: Counted,
        maps: &Maps,
        max_candidates: u32,
    ) -> Result<(), GpuError> {
        let slices = input.atlas.grid().slices;
        self.attack.fill(input.attack, counted, slices)?;
        self.maps.clear();
        self.queries.clear();
        self.draws.iter_mut().for_each(Draws::clear);
        for pass in 0..self.attack.passes.len() {
            if self.draws.len() == pass {
                self.draws.push(Draws::default());
            }
            self.attack.draw(
                input.attack,
                &self.attack.passes[pass],
                &mut self.draws[pass],
            );
            for part in Part::ALL.into_iter().filter(|part| part.is_in(counted)) {
                for (candidate, index) in input.candidates.iter().zip(0..) {
                    self.place(maps, candidate, index, part, pass, slices);
                }
            }
        }
        let queries = self.queries.len() as u64;
        within("counts of a cull", queries, most_queries(max_candidates))
    }

    /// Adds the queries of a candidate's part in a pass.
    fn place(
        &mut self,
        maps: &Maps,
        candidate: &CullCandidate,
        index: u32,
        part: Part,
        pass: usize,
        slices: u32,
    ) {
        let key = (candidate.clock, Kind::against(part, slices));
        let all = &self.attack.maps[self.attack.passes[pass].maps.clone()];
        let start = all.partition_point(|map| (map.clock, map.kind) < key);
        let count = all[start..].partition_point(|map| (map.clock, map.kind) == key);
        let mut query = Query {
            pass,
            candidate: index,
            part,
            maps: self.maps.len() as u32..self.maps.len() as u32,
        };
        let is_same = |a: &AttackMap, b: &AttackMap| a.slab == b.slab;
        for of_slab in all[start..start + count].chunk_by(is_same) {
            let Some(map) = maps.find(candidate, of_slab[0].slab, part) else {
                continue;
            };
            let reach = reach(candidate.transform, map.rect);
            for over in of_slab {
                let shared = reach.intersection(over.rect);
                if shared.is_empty() {
                    continue;
                }
                if query.maps.len() as u32 == MOST_MAPS {
                    self.queries.push(query.clone());
                    query.maps.start = query.maps.end;
                }
                self.maps
                    .push(placed(candidate.transform, map, over, shared));
                query.maps.end += 1;
            }
        }
        if !query.maps.is_empty() {
            self.queries.push(query);
        }
    }
}

/// Rectangle of the attack's maps that contains every texel that a transform may move into a rectangle of the evasion's frame.
fn reach(turn: FixedTransform2, map: MapRect) -> MapRect {
    /// Farther than every map.
    const FAR: f64 = 1e6;
    if map.is_empty() {
        return map;
    }
    let [a, b] = [turn.a, turn.b].map(f64::from);
    let squared = a * a + b * b;
    let one = f64::from(1 << FixedTransform2::SHIFT);
    let [x, z] = [map.u, map.v].map(f64::from);
    let [end_x, end_z] = [x + f64::from(map.width), z + f64::from(map.height)];
    // Half texels of the attack's maps, by the inverse of `FixedTransform2::texel`.
    let back = |[x, z]: [f64; 2]| {
        let [x, z] = [one * x - f64::from(turn.tx), one * z - f64::from(turn.tz)];
        [(a * x - b * z) / squared, (b * x + a * z) / squared]
    };
    let corners = [[x, z], [end_x, z], [x, end_z], [end_x, end_z]].map(back);
    let side = |axis: usize| {
        if squared == 0.0 {
            return [-FAR, FAR];
        }
        let low = corners.iter().map(|corner| corner[axis]);
        let high = low.clone().fold(f64::NEG_INFINITY, f64::max);
        let low = low.fold(f64::INFINITY, f64::min);
        // One texel on every side for rounding errors.
        [low / 2.0 - 1.5, high / 2.0 + 1.5].map(|texel| texel.clamp(-FAR, FAR))
    };
    let [[u, end_u], [v, end_v]] = [side(0), side(1)];
    MapRect {
        u: u.floor() as i32,
        v: v.floor() as i32,
        width: (end_u.ceil() - u.floor()) as u32,
        height: (end_v.ceil() - v.floor()) as u32,
    }
}

/// Instance of a candidate's map over a part of an attack's map.
fn placed(turn: FixedTransform2, map: &MapBits, over: &AttackMap, shared: MapRect) -> PlacedMap {
    // Position in the target of the attack's first texel, which may lie outside.
    let x = over.place.x as i32 - over.rect.u;
    let y = over.place.y as i32 - over.rect.v;
    let MapBits { rect, .. } = *map;
    let clip = [
        shared.u + x,
        shared.v + y,
        shared.u + x + shared.width as i32,
        shared.v + y + shared.height as i32,
    ];
    // The arithmetic of `FixedTransform2::texel`, from texels of the target to texels of the map. Intermediate sums may wrap; the result fits.
    let FixedTransform2 { a, b, tx, tz } = turn;
    let start = |start: i32, along: i32, across: i32, texel: i32| {
        start
            .wrapping_sub(along.wrapping_mul(2 * x))
            .wrapping_sub(across.wrapping_mul(2 * y))
            .wrapping_sub(texel << FixedTransform2::SHIFT)
    };
    PlacedMap {
        clip: clip.map(|texel| texel as u16),
        turn: [a, b, start(tx, a, b, rect.u), start(tz, -b, a, rect.v)],
        map: [
            rect.width | rect.height << 16,
            map.first_bit + over.slice,
            map.row_bits,
            map.texel_bits_log2,
        ],
    }
}
