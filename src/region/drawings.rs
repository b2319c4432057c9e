//! What is drawn of an event: its spheres' discs, slab by slab.
//!
//! Source: Masaoka & Oshita, section 4.3. Differs: an attack is not drawn at its frames alone, between which a fist leaves
//! gaps, but in steps of half a radius.

use glam::Vec3;

use super::strike::attack_spheres;
use super::{Body, Disc, Drawing, MapGrid, MapRect, Slab};
use crate::anim::{Pose, forward_kinematics};
use crate::graph::{GraphEvent, MotionGraph};

/// The drawings of one event, slab by slab upwards.
pub(super) struct SlabDrawings {
    /// Of `drawings[0]`.
    pub first_slab: Slab,
    /// One for each slab.
    pub drawings: Vec<Drawing>,
}

/// Spheres at one moment: centres and radii.
type Moment = Vec<(Vec3, f32)>;

/// The body in every frame of an evasion, in the slabs and rectangles that its starting posture reaches.
pub(super) fn of_evasion(
    graph: &MotionGraph,
    body: &Body,
    event: &GraphEvent,
    grid: MapGrid,
) -> SlabDrawings {
    let frames = body_frames(graph, body, event);
    draw(&frames, &frames[..1], grid)
}

/// The attacking spheres on their way through an attack, in the slabs that they reach.
pub(super) fn of_attack(
    graph: &MotionGraph,
    body: &Body,
    event: &GraphEvent,
    grid: MapGrid,
) -> SlabDrawings {
    let mut moments = Vec::new();
    for sphere in attack_spheres(graph, body, event) {
        sphere.for_each_step(|centre, radius| moments.push(vec![(centre, radius)]));
    }
    draw(&moments, &moments, grid)
}

/// Draws `moments` in the slabs and rectangles around `extent`.
fn draw(moments: &[Moment], extent: &[Moment], grid: MapGrid) -> SlabDrawings {
    let reached = extent
        .iter()
        .flatten()
        .map(|&(centre, radius)| grid.slabs(centre, radius));
    let ends = reached.map(|slabs| (*slabs.start(), *slabs.end()));
    let (low, high) = ends
        .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
        .unwrap_or((0, -1));
    let in_slab = |moment: &Moment, slab| -> Vec<Disc> {
        moment
            .iter()
            .filter_map(|&(centre, radius)| grid.disc(centre, radius, slab))
            .collect()
    };
    let drawing = |number| {
        let slab = Slab(number);
        let around: Vec<Disc> = extent
            .iter()
            .flat_map(|moment| in_slab(moment, slab))
            .collect();
        let rect = MapRect::around(&around);
        let mut drawing = Drawing {
            rect,
            ..Drawing::default()
        };
        for moment in moments {
            let discs = in_slab(moment, slab);
            drawing
                .discs
                .extend(discs.iter().map(|disc| disc.relative_to(rect.u, rect.v)));
            drawing.frame_ends.push(drawing.discs.len() as u32);
        }
        drawing
    };
    // Beyond these a bake is refused, by the first slab or the last; no need to draw them all.
    let high = high.min(low.saturating_add(2 * MapGrid::HIGHEST_SLAB));
    SlabDrawings {
        first_slab: Slab(low),
        drawings: (low..=high).map(drawing).collect(),
    }
}

/// The body in each frame of an event, in the frame where it starts (root on the ground, facing +Z).
fn body_frames(graph: &MotionGraph, body: &Body, event: &GraphEvent) -> Vec<Moment> {
    let to_start = graph.placement(event.clip, event.first).inverse();
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let frames = event.first..=event.last;
    frames
        .map(|frame| {
            graph.clip(event.clip).pose(frame as usize, &mut pose);
            pose.place(to_start);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            body.spheres
                .iter()
                .map(|sphere| (sphere.centre(&joints), sphere.radius))
                .collect()
        })
        .collect()
}
