//! `sabaki bake --plot`: the distances between all moments of all clips, and where they are joined.

use sabaki::graph::distance::{DistanceMap, Windows};
use sabaki::graph::{EdgeMotion, GraphSettings, MotionGraph, PointCloud};
use sabaki::math::in_parallel;

use super::picture::Picture;
use super::plot::{Paint, shade};

/// Pixels of the map's side, about.
const SIDE: usize = 900;
/// Letters of its side.
const LETTERS: usize = 72;
/// Pixels left of the map and above it.
const NAMES: usize = 190;
const HEAD: usize = 44;

/// Distances of this many times the threshold and more look alike.
const FAR: f32 = 5.0;

const JOINED: [u8; 3] = [250, 70, 50];
const LINKED: [u8; 3] = [255, 214, 60];

/// The least distance in each cell of a map of all clips, and the transitions by cell.
struct Overview {
    /// Cells of the side.
    side: usize,
    /// Metres, row by row.
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

    /// How near a cell comes, from 0 for far to 1 for the same posture.
    fn nearness(&self, cell: usize, threshold: f32) -> f32 {
        (1.0 - self.least[cell] / (FAR * threshold)).clamp(0.0, 1.0)
    }
}

/// Dark where postures lie far apart, light where they are alike; transitions in colours.
pub(crate) fn picture(graph: &MotionGraph, threshold: f32) -> Picture {
    let map = Overview::new(graph, SIDE);
    let mut picture = Picture::new(NAMES + map.side + 12, HEAD + map.side + 12);
    let title = "distance of postures: light is near. Rows: from; columns: to. Transitions:";
    picture.text(12, 8, title);
    let mut at = 12;
    for (name, colour) in [
        ("under the threshold", JOINED),
        ("looser, for evasions' sake", LINKED),
    ] {
        picture.fill((at, 26), (8, 8), colour);
        picture.text(at + 14, 26, name);
        at += 14 + 8 * name.len() + 24;
    }
    for row in 0..map.side {
        for column in 0..map.side {
            let near = map.nearness(row * map.side + column, threshold);
            let grey = (22.0 + 190.0 * near * near) as u8;
            picture.fill(
                (NAMES + column, HEAD + row),
                (1, 1),
                [grey, grey, grey.saturating_add(8)],
            );
        }
    }
    for &(row, column, distance) in &map.transitions {
        let colour = if distance <= threshold {
            JOINED
        } else {
            LINKED
        };
        picture.fill((NAMES + column, HEAD + row), (1, 1), colour);
    }
    for (clip, ends) in graph.clips().iter().zip(map.first.windows(2)) {
        let high = ends[1] - ends[0];
        picture.fill((NAMES - 4, HEAD + ends[0]), (4, 1), [120, 124, 132]);
        picture.fill((NAMES + ends[0], HEAD - 4), (1, 4), [120, 124, 132]);
        if high >= 9 {
            let name: String = clip.name().chars().take((NAMES - 20) / 8).collect();
            let start = NAMES - 8 - 8 * name.chars().count();
            picture.text(start, HEAD + ends[0] + high / 2 - 4, &name);
        }
    }
    picture
}

/// The same in letters, two of them side by side for a cell.
pub(crate) fn letters(graph: &MotionGraph, threshold: f32, paint: Paint) -> String {
    let map = Overview::new(graph, LETTERS / 2);
    let mut joined = vec![false; map.side * map.side];
    for &(row, column, _) in &map.transitions {
        joined[row * map.side + column] = true;
    }
    let mut text = format!(
        "distance of postures, all clips against all: █ the same, · {:.2} m apart; {} transitions\n",
        FAR * threshold,
        map.transitions.len(),
    );
    for row in 0..map.side {
        let cells = (0..map.side).map(|column| {
            let cell = row * map.side + column;
            let near = map.nearness(cell, threshold);
            let letter = shade(f64::from(near * near)).to_string().repeat(2);
            let grey = (70.0 + 150.0 * near) as u8;
            let colour = if joined[cell] { JOINED } else { [grey; 3] };
            paint.on(colour, &letter)
        });
        text.extend(cells);
        text.push('\n');
    }
    text
}
