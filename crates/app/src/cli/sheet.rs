//! A contact sheet of the maps of one dodge: a column for each slab, rows for body, evasion, attack
//! and what they share.

use sabaki::maps::{Drawing, MapGrid, MaskMap, Slab, SlabMaps, raster};
use sabaki::query::cull::{CullCandidate, CullInput};

use super::picture::Picture;

/// Pixels of a texel's side.
const ZOOM: usize = 3;
/// Texels around the maps.
const MARGIN: i32 = 6;
/// Pixels between cells, and above them for their labels.
const GAP: usize = 8;
const LABEL: usize = 20;
/// Pixels left of the cells for the rows' names.
const NAMES: usize = 80;

/// Slabs that are shown at most.
const MOST_COLUMNS: usize = 8;

const ROWS: [&str; 4] = ["body", "evasion", "attack", "overlap"];
const CELL: [u8; 3] = [44, 47, 54];
const BODY: [u8; 3] = [92, 190, 110];
const EVASION: [u8; 3] = [90, 140, 235];
const ATTACK: [u8; 3] = [225, 80, 70];
const AVOIDED: [u8; 3] = [250, 205, 70];
const HIT: [u8; 3] = [255, 255, 255];

/// One slab of the candidate, with the attack in it.
struct Column<'a> {
    slab: Slab,
    maps: &'a SlabMaps,
    /// The attack's inner map in the frame of its drawing, by slice.
    attack: MaskMap,
}

/// Texels of the attack's frame.
#[derive(Clone, Copy)]
struct Window {
    u: (i32, i32),
    v: (i32, i32),
}

/// Draws the maps of one candidate as the culling sees them: in the frame in which the paths start,
/// the candidate's maps moved and turned into place.
pub(crate) fn draw(input: &CullInput<'_>, candidate: &CullCandidate) -> Picture {
    let columns = columns(input, candidate);
    let window = window(&columns, candidate);
    let (width, height) = (
        (window.u.1 - window.u.0) as usize * ZOOM,
        (window.v.1 - window.v.0) as usize * ZOOM,
    );
    let size = (
        NAMES + columns.len() * (width + GAP),
        LABEL + ROWS.len() * (height + GAP),
    );
    let mut picture = Picture::new(size.0, size.1 + 2 * LABEL);
    for (row, name) in ROWS.iter().enumerate() {
        picture.text(GAP, LABEL + row * (height + GAP) + height / 2, name);
    }
    for (index, column) in columns.iter().enumerate() {
        let x = NAMES + index * (width + GAP);
        picture.text(x, 6, &heights(column.slab, input.atlas.grid()));
        for row in 0..ROWS.len() {
            let y = LABEL + row * (height + GAP);
            draw_cell(&mut picture, (x, y), window, |u, v| {
                colour(row, column, candidate, u, v)
            });
        }
    }
    picture.text(
        GAP,
        size.1 + 4,
        "green: body all through a slice of time  blue: where it was and no longer is",
    );
    picture.text(
        GAP,
        size.1 + LABEL,
        "red: attack  yellow: attack through the evasion region  white: body and attack at one time",
    );
    picture
}

/// The slabs that the attack touches, evenly chosen where they are many; the body's where it
/// touches none.
fn columns<'a>(input: &CullInput<'a>, candidate: &CullCandidate) -> Vec<Column<'a>> {
    let region = input.atlas.region(candidate.region);
    let all: Vec<Column<'_>> = (region.slabs.iter().zip(region.first_slab.0..))
        .map(|(maps, number)| Column {
            slab: Slab(number),
            maps,
            attack: attack_map(input, candidate, Slab(number)),
        })
        .collect();
    let touched = |column: &Column<'_>| column.attack.count() > 0;
    let some = all.iter().any(touched);
    let mut chosen: Vec<_> = { all }
        .into_iter()
        .filter(|column| !some || touched(column))
        .collect();
    let step = chosen.len().div_ceil(MOST_COLUMNS).max(1);
    let mut index = 0;
    chosen.retain(|_| {
        index += 1;
        (index - 1) % step == 0
    });
    chosen
}

/// The attack's inner map in one slab, by the candidate's clock.
fn attack_map(input: &CullInput<'_>, candidate: &CullCandidate, slab: Slab) -> MaskMap {
    let rect = input.attack.rect;
    let mut map = MaskMap::new(rect, input.atlas.grid().lanes());
    let layers = input.attack.layers.iter();
    for layer in layers.filter(|layer| layer.slab == slab && layer.clock == candidate.clock) {
        let [inner, _] = input.attack.discs_of(layer);
        for timed in inner {
            let one = raster::any_frame(&Drawing {
                rect,
                discs: vec![timed.disc],
                frame_ends: vec![1],
            });
            one.for_each(|column, row| map.set(column, row, timed.slice));
        }
    }
    map
}

/// The texels of the attack's frame around all maps of the candidate.
fn window(columns: &[Column<'_>], candidate: &CullCandidate) -> Window {
    /// Further than any evasion's maps reach from the attack's first texel.
    const FAR: i32 = 400;
    let lit = |u: i32, v: i32| {
        columns
            .iter()
            .any(|column| region(column, candidate, u, v) != (0, false))
    };
    let all = (-FAR..FAR).flat_map(|v| (-FAR..FAR).map(move |u| (u, v)));
    let (mut low, mut high) = ((FAR, FAR), (-FAR, -FAR));
    for (u, v) in all.filter(|&(u, v)| lit(u, v)) {
        low = (low.0.min(u), low.1.min(v));
        high = (high.0.max(u), high.1.max(v));
    }
    if low.0 > high.0 {
        (low, high) = ((0, 0), (0, 0));
    }
    Window {
        u: (low.0 - MARGIN, high.0 + MARGIN + 1),
        v: (low.1 - MARGIN, high.1 + MARGIN + 1),
    }
}

/// The slices in which the texel falls on the body map, and whether it falls on the evasion map.
fn region(column: &Column<'_>, candidate: &CullCandidate, u: i32, v: i32) -> (u64, bool) {
    let (x, z) = candidate.turn.texel(u, v);
    let (body, evasion) = (&column.maps.body, &column.maps.evasion);
    (
        body.get(x - body.rect().u, z - body.rect().v),
        evasion.get(x - evasion.rect().u, z - evasion.rect().v),
    )
}

fn colour(row: usize, column: &Column<'_>, candidate: &CullCandidate, u: i32, v: i32) -> [u8; 3] {
    let (body, evasion) = region(column, candidate, u, v);
    let attack = column.attack.get(u, v);
    let layers: &[(bool, [u8; 3])] = match row {
        0 => &[(body != 0, BODY)],
        1 => &[(evasion, EVASION)],
        2 => &[(attack != 0, ATTACK)],
        _ => &[
            (attack & body != 0, HIT),
            (attack != 0 && evasion, AVOIDED),
            (attack != 0, ATTACK),
            (body != 0, BODY),
            (evasion, EVASION),
        ],
    };
    let top = layers.iter().find(|(lit, _)| *lit);
    top.map_or(CELL, |&(_, colour)| colour)
}

fn heights(slab: Slab, grid: MapGrid) -> String {
    let bottom = slab.0 as f32 * grid.slab_height;
    format!("{:.2}-{:.2} m", bottom, bottom + grid.slab_height)
}

/// Rows run away from the viewer upwards: +v is up, +u is to the left, as seen from above by
/// somebody who stands behind the character.
fn draw_cell(
    picture: &mut Picture,
    at: (usize, usize),
    window: Window,
    colour: impl Fn(i32, i32) -> [u8; 3],
) {
    for (row, v) in (window.v.0..window.v.1).rev().enumerate() {
        for (column, u) in (window.u.0..window.u.1).rev().enumerate() {
            picture.fill(
                (at.0 + column * ZOOM, at.1 + row * ZOOM),
                (ZOOM, ZOOM),
                colour(u, v),
            );
        }
    }
}
