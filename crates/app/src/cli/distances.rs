//! `sabaki bake --plot`: the distances between all frames of all clips, and the transitions.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use sabaki::anim::Clip;
use sabaki::graph::{EdgeMotion, GraphSettings, MotionGraph};
use sabaki::internal::{DistanceMap, PointCloud, Windows};
use sabaki::math::in_parallel;

use super::picture::FONT;
use super::plot::{Area, Drawn, Figure, Format, INK, Paint, shade, shortened};

/// Letters of the map's side.
const LETTERS: usize = 72;
/// Distances of this many times the threshold and more have one shade.
const FAR: f32 = 5.0;

/// Colours of transitions: below the threshold, and above it.
const JOINED: [u8; 3] = [220, 50, 30];
const LINKED: [u8; 3] = [0, 114, 210];
/// Colour and letter of cells without distances: the last frames of a clip begin no window.
const NOT_COMPARED: [u8; 3] = [250, 236, 190];
const BLANK: char = ' ';

/// The least distance in each cell of a map of all clips, and the transitions by cell.
struct Overview {
    /// Cells of the side.
    side: usize,
    /// Least distance in each cell, row by row, in metres; infinite for cells without distances.
    least: Vec<f32>,
    /// Row and column of each transition, and its distance, metres.
    transitions: Vec<(usize, usize, f32)>,
    /// The first cell of each clip.
    first: Vec<usize>,
}

impl Overview {
    fn new(graph: &MotionGraph, side: usize) -> Self {
        let clips = graph.clips();
        let frames: usize = clips.iter().map(|clip| clip.frames()).sum();
        // Each clip begins in a cell of its own.
        let room = side.saturating_sub(clips.len()).max(side / 2).max(1);
        let step = frames.div_ceil(room).max(1);
        let mut first = vec![0];
        for clip in clips {
            first.push(first[first.len() - 1] + clip.frames().div_ceil(step));
        }
        let side = first[clips.len()];
        let weights = vec![1.0; graph.skeleton().len()];
        let window = GraphSettings::default().window * graph.frame_rate();
        let window = (window.round() as usize).max(1);
        let cloud = |clip| PointCloud::new(graph.skeleton(), clip, &weights);
        let windows: Vec<Windows> = clips
            .iter()
            .map(|clip| Windows::new(&cloud(clip), window))
            .collect();
        let bands = in_parallel(0, clips.len(), |a| {
            let mut band = vec![f32::INFINITY; (first[a + 1] - first[a]) * side];
            for (b, other) in windows.iter().enumerate() {
                DistanceMap::new(&windows[a], other).for_each_row(|row, squared| {
                    let row = &mut band[row / step * side..][..side];
                    for (column, &squared) in squared.iter().enumerate() {
                        let cell = &mut row[first[b] + column / step];
                        *cell = cell.min(squared);
                    }
                });
            }
            band
        });
        let transitions = graph.edges().iter().filter_map(|edge| {
            let EdgeMotion::Transition { distance, .. } = edge.motion else {
                return None;
            };
            let (from, to) = (graph.node(edge.from), graph.node(edge.to));
            let start = to.frame.saturating_sub(edge.frames);
            let row = first[from.clip.index()] + from.frame as usize / step;
            Some((
                row,
                first[to.clip.index()] + start as usize / step,
                distance,
            ))
        });
        Self {
            side,
            least: bands.into_iter().flatten().map(f32::sqrt).collect(),
            transitions: transitions.collect(),
            first: first.clone(),
        }
    }

    /// Nearness of a cell: 0 for far, 1 for the same posture, `None` for a cell without distances.
    fn nearness(&self, cell: usize, threshold: f32) -> Option<f32> {
        let least = self.least[cell];
        let near = (1.0 - least / (FAR * threshold)).clamp(0.0, 1.0);
        least.is_finite().then_some(near)
    }
}

/// The distances between all frames of all clips, and the transitions.
pub(crate) struct DistanceFigure<'a> {
    pub(crate) graph: &'a MotionGraph,
    /// The threshold that the graph was built with, in metres.
    pub(crate) threshold: f32,
}

/// Pixels of the map's side, about.
const SIDE: usize = 900;
/// Pixels of a cell's side in a vector file, where each run of like cells is an element.
const COARSE: usize = 4;
/// Shades of distances.
const SHADES: f32 = 32.0;
/// Pixels left of the map and below it for the clips' names, above it for title and legend, and to its right.
const NAMES: usize = 200;
const HEAD: usize = 118;
const MARGIN: usize = 24;
/// Pixels of the smallest radius of a transition.
const DOT: usize = 2;
/// Pixels of the smallest clip that is named.
const NAMED: usize = 13;

/// A map and where it stands.
struct Placed {
    map: Overview,
    /// Pixels of a cell's side.
    cell: usize,
}

impl Placed {
    /// The corners of some cells of a row, in pixels.
    fn corners(&self, row: usize, columns: std::ops::Range<usize>) -> [(i32, i32); 2] {
        let pixel = |row, column| {
            let (x, y) = (NAMES + column * self.cell, HEAD + row * self.cell);
            (x as i32, y as i32)
        };
        [pixel(row, columns.start), pixel(row + 1, columns.end)]
    }
}

impl DistanceFigure<'_> {
    fn heat_map<DB: DrawingBackend>(&self, area: &Area<DB>, placed: &Placed) -> Drawn<DB> {
        let side = placed.map.side;
        for row in 0..side {
            let shade_of = |column: &usize| {
                let near = placed.map.nearness(row * side + column, self.threshold);
                near.map(|near| (near * near * SHADES).round() as u32)
            };
            let columns: Vec<usize> = (0..side).collect();
            for run in columns.chunk_by(|a, b| shade_of(a) == shade_of(b)) {
                let corners = placed.corners(row, run[0]..run[run.len() - 1] + 1);
                let fill = match shade_of(&run[0]) {
                    Some(shade) => grey(shade as f32 / SHADES),
                    None => rgb(NOT_COMPARED),
                };
                area.draw(&Rectangle::new(corners, fill.filled()))?;
            }
        }
        // Tight transitions last: they are fewer, and may share a cell with loose ones.
        let mut transitions = placed.map.transitions.clone();
        transitions.sort_by(|a, b| b.2.total_cmp(&a.2));
        for (row, column, distance) in transitions {
            let [from, to] = placed.corners(row, column..column + 1);
            let middle = ((from.0 + to.0) / 2, (from.1 + to.1) / 2);
            let radius = (placed.cell / 2).max(DOT) as i32;
            area.draw(&Circle::new(middle, radius, self.colour(distance).filled()))?;
        }
        Ok(())
    }

    fn colour(&self, distance: f32) -> RGBColor {
        rgb(if distance <= self.threshold {
            JOINED
        } else {
            LINKED
        })
    }

    /// Draws the legend of shades and dots.
    fn legend<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        let style = (FONT, 17).into_font().color(&INK);
        let title = "Distance between the frames of all clips, and the transitions";
        area.draw(&Text::new(
            title,
            (14, 10),
            (FONT, 22).into_font().color(&INK),
        ))?;
        let (left, top) = (NAMES as i32, 48);
        area.draw(&Text::new("0 m", (left - 36, top), style.clone()))?;
        for step in 0..=SHADES as i32 {
            let x = left + 5 * step;
            let fill = grey(1.0 - step as f32 / SHADES).filled();
            area.draw(&Rectangle::new([(x, top), (x + 5, top + 16)], fill))?;
        }
        let mut x = left + 5 * (SHADES as i32 + 1) + 8;
        let far = format!("{:.2} m or more", FAR * self.threshold);
        let tight = format!("transition below {:.2} m", self.threshold);
        let loose = "looser transition, to reach an evasion";
        area.draw(&Text::new(far.as_str(), (x, top), style.clone()))?;
        x += area.estimate_text_size(&far, &style)?.0 as i32 + 32;
        let square = [(x, top), (x + 16, top + 16)];
        area.draw(&Rectangle::new(square, rgb(NOT_COMPARED).filled()))?;
        area.draw(&Text::new(
            "not compared: a clip's end",
            (x + 22, top),
            style.clone(),
        ))?;
        let (mut x, top) = (left, top + 24);
        for (dot, text) in [(JOINED, tight.as_str()), (LINKED, loose)] {
            area.draw(&Circle::new((x + 6, top + 9), 5, rgb(dot).filled()))?;
            x += 20;
            area.draw(&Text::new(text, (x, top), style.clone()))?;
            x += area.estimate_text_size(text, &style)?.0 as i32 + 32;
        }
        Ok(())
    }

    /// The clips' names along both axes.
    fn names<DB: DrawingBackend>(&self, area: &Area<DB>, placed: &Placed) -> Drawn<DB> {
        let style = (FONT, 14).into_font().color(&INK);
        let right = style.pos(Pos::new(HPos::Right, VPos::Center));
        let turned = right.transform(FontTransform::Rotate270);
        let [low, end] = placed.corners(placed.map.side - 1, 0..placed.map.side);
        let bottom = end.1;
        for &first in &placed.map.first {
            let [(x, y), _] = placed.corners(first, first..first);
            area.draw(&PathElement::new([(x, bottom), (x, bottom + 5)], INK))?;
            area.draw(&PathElement::new([(low.0 - 5, y), (low.0, y)], INK))?;
        }
        for (clip, ends) in self.graph.clips().iter().zip(placed.map.first.windows(2)) {
            let [from, _] = placed.corners(ends[0], ends[0]..ends[1]);
            let [to, _] = placed.corners(ends[1], ends[1]..ends[1]);
            if to.0 - from.0 < NAMED as i32 {
                continue;
            }
            let name = shortened(&Clip::title(clip.name()), 24);
            let (across, down) = ((from.0 + to.0) / 2, (from.1 + to.1) / 2);
            area.draw(&Text::new(name.as_str(), (low.0 - 8, down), right.clone()))?;
            area.draw(&Text::new(name, (across, bottom + 8), turned.clone()))?;
        }
        let axes = (FONT, 17).into_font().color(&INK);
        area.draw(&Text::new(
            "from: rows",
            (14, HEAD as i32 - 22),
            axes.clone(),
        ))?;
        area.draw(&Text::new("to: columns", (14, bottom + 10), axes))
    }
}

impl Figure for DistanceFigure<'_> {
    fn size(&self) -> (u32, u32) {
        let width = NAMES + SIDE + MARGIN;
        (width as u32, (HEAD + SIDE + NAMES) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>, format: Format) -> Drawn<DB> {
        let fine = match format {
            Format::Png => 1,
            Format::Svg => COARSE,
        };
        let map = Overview::new(self.graph, SIDE / fine);
        let cell = (SIDE / map.side.max(1)).max(1);
        let placed = Placed { map, cell };
        self.heat_map(area, &placed)?;
        self.legend(area)?;
        self.names(area, &placed)
    }

    /// Two letters side by side for a cell.
    fn letters(&self, paint: Paint) -> String {
        let map = Overview::new(self.graph, LETTERS / 2);
        let mut joined = vec![false; map.side * map.side];
        for &(row, column, _) in &map.transitions {
            joined[row * map.side + column] = true;
        }
        let mut text = format!(
            "distance of postures, all clips against all: █ the same, · {:.2} m apart or more, blank where a clip's end is not compared; {} transitions\n",
            FAR * self.threshold,
            map.transitions.len(),
        );
        for row in 0..map.side {
            let cells = (0..map.side).map(|column| {
                let cell = row * map.side + column;
                let near = map.nearness(cell, self.threshold);
                let letter = near.map_or(BLANK, |near| shade(f64::from(near * near)));
                let letter = letter.to_string().repeat(2);
                let grey = (70.0 + 150.0 * near.unwrap_or(0.0)) as u8;
                let colour = if joined[cell] { JOINED } else { [grey; 3] };
                paint.on(colour, &letter)
            });
            text.extend(cells);
            text.push('\n');
        }
        text
    }
}

fn rgb([red, green, blue]: [u8; 3]) -> RGBColor {
    RGBColor(red, green, blue)
}

/// Dark for near, white for far.
fn grey(near: f32) -> RGBColor {
    let level = (255.0 - 205.0 * near) as u8;
    RGBColor(level, level, level)
}
