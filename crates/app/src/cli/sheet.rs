//! A contact sheet of the maps of one dodge: a column for each slab, rows for body, evasion, attack
//! and what they share.

use plotters::prelude::{Rectangle, Text};
use plotters::style::{Color, RGBColor};
use sabaki::maps::{
    BakedGraph, BitMap, Drawing, FixedTransform2, MapGrid, MaskMap, Slab, SlabMaps, raster,
};
use sabaki::query::cull::{CullCandidate, CullInput, TimedDisc};
use sabaki::query::{Answer, Query, QueryContext, QuerySettings, Source};
use sabaki_fixtures::throw::Throw;

use super::Failure;
use super::plot::{INK, Picture, text_style};
use super::queries::Method;

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
const CELL: RGBColor = RGBColor(44, 47, 54);
const BODY: RGBColor = RGBColor(92, 190, 110);
const EVASION: RGBColor = RGBColor(90, 140, 235);
const ATTACK: RGBColor = RGBColor(225, 80, 70);
const AVOIDED: RGBColor = RGBColor(250, 205, 70);
const HIT: RGBColor = RGBColor(255, 255, 255);

/// What the colours mean.
const KEY: [(RGBColor, &str); 5] = [
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

/// Draws the maps of the answer to an attack, or, if it has none because it enters or layers its evasion, those of the candidate with the
/// best score that has maps. Also returns the candidate's index; `None` if no candidate has maps.
///
/// `draw` gets the culling's input with the chosen candidate alone, and returns a map for each drawing of the attack.
pub(crate) fn draw_answer(
    baked: &BakedGraph,
    throw: &Throw,
    answer: &Answer,
    draw: impl FnOnce(&CullInput<'_>, &[Drawing]) -> Result<Vec<BitMap>, Failure>,
) -> Result<Option<(Picture, usize)>, Failure> {
    // The same source of candidates as the answer's.
    let settings = match answer.source {
        Source::Grid => QuerySettings::default(),
        _ => Method::EXACT.settings(),
    };
    let mut context = QueryContext::default();
    let query = Query::new(baked, &settings);
    let session = query.start(throw.request(), &mut context);
    let input = session.cull_input();
    // Candidates with maps come first, in the order of the culling input.
    let score = |&index: &usize| {
        let score = answer.candidates[index].score.map(|score| score.total);
        (index != answer.chosen, score.unwrap_or(f32::INFINITY))
    };
    let with_maps = 0..input.candidates.len().min(answer.candidates.len());
    let best = with_maps.min_by(|a, b| {
        let (a, b) = (score(a), score(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let Some(shown) = best else {
        return Ok(None);
    };
    let candidate = &input.candidates[shown];
    let input = CullInput {
        candidates: std::slice::from_ref(candidate),
        ..input
    };
    let (places, drawings) = attack_drawings(&input, candidate);
    let attack: Vec<AttackMap> = places.into_iter().zip(draw(&input, &drawings)?).collect();
    Ok(Some((draw_sheet(&input, candidate, &attack), shown)))
}

/// Draws the attack on the CPU, for [`draw_answer`].
pub(crate) fn on_cpu(_: &CullInput<'_>, drawings: &[Drawing]) -> Result<Vec<BitMap>, Failure> {
    Ok(drawings.iter().map(raster::any_frame).collect())
}

type AttackMap = ((Slab, u32), BitMap);

/// The attack's inner discs by the candidate's time offset: slab and slice, and a drawing of each.
fn attack_drawings(
    input: &CullInput<'_>,
    candidate: &CullCandidate,
) -> (Vec<(Slab, u32)>, Vec<Drawing>) {
    let layers = input.attack.layers.iter();
    let layers = layers.filter(|layer| layer.clock == candidate.clock);
    let drawings = layers.flat_map(|layer| {
        let [inner, _] = input.attack.discs_of(layer);
        let is_same = |a: &TimedDisc, b: &TimedDisc| a.slice == b.slice;
        inner.chunk_by(is_same).map(|discs| {
            let drawing = Drawing {
                rect: input.attack.rect,
                discs: discs.iter().map(|timed| timed.disc).collect(),
                frame_ends: vec![discs.len() as u32],
            };
            ((layer.slab, discs[0].slice), drawing)
        })
    });
    drawings.unzip()
}

/// Draws the maps of one candidate as the culling sees them: in the frame in which the paths start,
/// the candidate's maps moved and turned into place.
fn draw_sheet(input: &CullInput<'_>, candidate: &CullCandidate, attack: &[AttackMap]) -> Picture {
    let columns = columns(input, candidate, attack);
    let [us, vs] = window(&columns);
    let width = us.len() as u32 * ZOOM;
    let height = vs.len() as u32 * ZOOM;
    let across = NAMES + columns.len() as u32 * (width + GAP);
    let below = HEAD + ROWS.len() as u32 * (height + GAP);
    let key_height = LINE * KEY.len() as u32 + GAP;
    let mut picture = Picture::new([across.max(LEAST_WIDTH), below + key_height]);
    let area = picture.area();
    // A bitmap in memory has no errors.
    let write = |x: u32, y: u32, text: &str| {
        let _ = area.draw(&Text::new(text, (x as i32, y as i32), text_style(16, INK)));
    };
    let fill = |x: u32, y: u32, side: u32, colour: RGBColor| {
        let corners = [(x, y), (x + side, y + side)].map(|(x, y)| (x as i32, y as i32));
        let _ = area.draw(&Rectangle::new(corners, colour.filled()));
    };
    for (row, name) in (0..).zip(ROWS) {
        write(GAP, HEAD + row * (height + GAP) + height / 2 - 8, name);
    }
    for (index, column) in (0..).zip(&columns) {
        let x = NAMES + index * (width + GAP);
        write(x, 5, &heights(column.slab, input.atlas.grid()));
        for row in 0..ROWS.len() {
            let y = HEAD + row as u32 * (height + GAP);
            // As seen from above by a viewer behind the character: +v is up, +u is to the left.
            for (down, v) in (0..).zip(vs.clone().rev()) {
                for (right, u) in (0..).zip(us.clone().rev()) {
                    fill(
                        x + right * ZOOM,
                        y + down * ZOOM,
                        ZOOM,
                        column.colour(row, [u, v]),
                    );
                }
            }
        }
    }
    for (line, (colour, text)) in (0..).zip(KEY) {
        let y = below + line * LINE;
        fill(GAP, y + 3, 13, INK);
        fill(GAP + 1, y + 4, 11, colour);
        write(GAP + 22, y, text);
    }
    drop(area);
    picture
}

/// The slabs that the attack touches, evenly chosen where they are many; the body's where it
/// touches none.
fn columns<'a>(
    input: &CullInput<'a>,
    candidate: &CullCandidate,
    attack: &[AttackMap],
) -> Vec<Column<'a>> {
    let region = input.atlas.region(candidate.region);
    let all: Vec<Column<'_>> = (region.slabs.iter().zip(region.first_slab.0..))
        .map(|(maps, number)| Column {
            slab: Slab(number),
            maps,
            attack: masks(input, attack, Slab(number)),
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

/// The attack's inner maps of one slab, as masks of slices.
fn masks(input: &CullInput<'_>, attack: &[AttackMap], slab: Slab) -> MaskMap {
    let mut masks = MaskMap::new(input.attack.rect, input.atlas.grid().lanes());
    for ((_, slice), map) in attack.iter().filter(|((of, _), _)| *of == slab) {
        map.for_each(|column, row| masks.set(column, row, *slice));
    }
    masks
}

/// The ranges of u and v in the attack's frame that hold all maps.
fn window(columns: &[Column<'_>]) -> [std::ops::Range<i32>; 2] {
    /// Further than any evasion's maps reach from the attack's first texel.
    const FAR: i32 = 400;
    let is_lit = |at| columns.iter().any(|column| column.region(at) != (0, false));
    let all = (-FAR..FAR).flat_map(|v| (-FAR..FAR).map(move |u| [u, v]));
    let (mut low, mut high) = ([FAR; 2], [-FAR; 2]);
    for at in all.filter(|&at| is_lit(at)) {
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
    }
    if low[0] > high[0] {
        (low, high) = ([0; 2], [0; 2]);
    }
    [0, 1].map(|axis| low[axis] - MARGIN..high[axis] + MARGIN + 1)
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
    fn colour(&self, row: usize, [u, v]: [i32; 2]) -> RGBColor {
        let (body, evasion) = self.region([u, v]);
        let attack = self.attack.get(u, v);
        let layers: &[(bool, RGBColor)] = match row {
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
        let top = layers.iter().find(|(is_lit, _)| *is_lit);
        top.map_or(CELL, |&(_, colour)| colour)
    }
}

fn heights(slab: Slab, grid: MapGrid) -> String {
    let bottom = slab.0 as f32 * grid.slab_height;
    format!("{:.2}-{:.2} m", bottom, bottom + grid.slab_height)
}
