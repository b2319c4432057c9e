//! A contact sheet of the maps of one dodge: a column for each slab, rows for body, evasion, attack
//! and what they share.

use plotters::style::RGBColor;
use sabaki::internal::{CullCandidate, Drawing, FixedTransform2, MaskMap, Slab, SlabMaps, raster};
use sabaki::maps::MapGrid;
use sabaki::query::cull::CullInput;

use super::picture::{Picture, TextLook};
use super::plot::INK;

/// Pixels of a texel's side.
const ZOOM: u32 = 3;
/// Texels around the maps.
const MARGIN: i32 = 6;
/// Pixels between cells, above them for the slabs' heights, and left of them for the rows' names.
const GAP: u32 = 8;
const HEAD: u32 = 28;
const NAMES: u32 = 76;
/// Pixels of a line of the key, and the width that its longest line needs.
const LINE: u32 = 21;
const LEAST_WIDTH: u32 = 420;

/// The largest number of slabs that are shown.
const MOST_COLUMNS: usize = 8;

const ROWS: [&str; 4] = ["body", "evasion", "attack", "overlap"];
const CELL: [u8; 3] = [44, 47, 54];
const BODY: [u8; 3] = [92, 190, 110];
const EVASION: [u8; 3] = [90, 140, 235];
const ATTACK: [u8; 3] = [225, 80, 70];
const AVOIDED: [u8; 3] = [250, 205, 70];
const HIT: [u8; 3] = [255, 255, 255];

/// What the colours mean.
const KEY: [([u8; 3], &str); 5] = [
    (BODY, "body, all through a slice of time"),
    (
        EVASION,
        "evasion region: where the body was and no longer is",
    ),
    (ATTACK, "attack"),
    (AVOIDED, "attack through the evasion region"),
    (HIT, "body and attack at one time"),
];

/// One slab of the candidate, with the attack in it.
struct Column<'a> {
    slab: Slab,
    maps: &'a SlabMaps,
    /// The attack's inner map in the frame of its drawing, by slice.
    attack: MaskMap,
    /// Transform from the attack's frame to the maps' frame.
    transform: FixedTransform2,
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
    let window = window(&columns);
    let width = (window.u.1 - window.u.0) as u32 * ZOOM;
    let height = (window.v.1 - window.v.0) as u32 * ZOOM;
    let across = NAMES + columns.len() as u32 * (width + GAP);
    let below = HEAD + ROWS.len() as u32 * (height + GAP);
    let key_height = LINE * KEY.len() as u32 + GAP;
    let mut picture = Picture::new([across.max(LEAST_WIDTH), below + key_height]);
    let look = TextLook {
        height: 16,
        colour: INK,
    };
    for (row, name) in (0..).zip(ROWS) {
        let y = HEAD + row * (height + GAP) + height / 2 - 8;
        picture.text((GAP as i32, y as i32), name, look);
    }
    for (index, column) in (0..).zip(&columns) {
        let x = NAMES + index * (width + GAP);
        let heights = heights(column.slab, input.atlas.grid());
        picture.text((x as i32, 5), &heights, look);
        for row in 0..ROWS.len() {
            let y = HEAD + row as u32 * (height + GAP);
            let colour = |u, v| column.colour(row, [u, v]);
            picture.place([x, y], &cell(window, colour));
        }
    }
    for (line, (colour, text)) in (0..).zip(KEY) {
        let y = (below + line * LINE) as i32;
        let [red, green, blue] = colour;
        let left = GAP as i32;
        picture.swatch(
            (left, y + 3),
            (left + 12, y + 15),
            RGBColor(red, green, blue),
        );
        picture.text((GAP as i32 + 22, y), text, look);
    }
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
            transform: candidate.transform,
        })
        .collect();
    let touched = |column: &Column<'_>| column.attack.count() > 0;
    let some = all.iter().any(touched);
    let mut chosen = all;
    chosen.retain(|column| !some || touched(column));
    let step = chosen.len().div_ceil(MOST_COLUMNS).max(1);
    chosen.into_iter().step_by(step).collect()
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

/// The texels of the attack's frame around all maps.
fn window(columns: &[Column<'_>]) -> Window {
    /// Further than any evasion's maps reach from the attack's first texel.
    const FAR: i32 = 400;
    let lit = |u: i32, v: i32| {
        columns
            .iter()
            .any(|column| column.region([u, v]) != (0, false))
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

impl Column<'_> {
    /// The slices in which the texel falls on the body map, and whether it falls on the evasion map.
    fn region(&self, [u, v]: [i32; 2]) -> (u64, bool) {
        let (x, z) = self.transform.texel(u, v);
        let (body, evasion) = (&self.maps.body, &self.maps.evasion);
        (
            body.get(x - body.rect().u, z - body.rect().v),
            evasion.get(x - evasion.rect().u, z - evasion.rect().v),
        )
    }

    /// Colour of a texel in a row of the sheet.
    fn colour(&self, row: usize, [u, v]: [i32; 2]) -> [u8; 3] {
        let (body, evasion) = self.region([u, v]);
        let attack = self.attack.get(u, v);
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
}

fn heights(slab: Slab, grid: MapGrid) -> String {
    let bottom = slab.0 as f32 * grid.slab_height;
    format!("{:.2}-{:.2} m", bottom, bottom + grid.slab_height)
}

/// One cell. Rows run away from the viewer upwards: +v is up, +u is to the left, as seen from above by
/// a viewer behind the character.
fn cell(window: Window, colour: impl Fn(i32, i32) -> [u8; 3]) -> Picture {
    let columns = (window.u.1 - window.u.0) as u32 * ZOOM;
    let rows = (window.v.1 - window.v.0) as u32 * ZOOM;
    let texel = |column: u32, row: u32| {
        let (right, down) = ((column / ZOOM) as i32, (row / ZOOM) as i32);
        colour(window.u.1 - 1 - right, window.v.1 - 1 - down)
    };
    let pixels = (0..rows).flat_map(|row| (0..columns).flat_map(move |column| texel(column, row)));
    Picture::from_rgb([columns, rows], pixels.collect())
}
