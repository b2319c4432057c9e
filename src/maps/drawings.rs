//! What is drawn of an event: its spheres' discs, slab by slab and slice by slice.
//!
//! Source: Masaoka & Oshita, section 4.3. Differs: besides the paper's maps of a whole evasion there
//! are maps of slices of time, of two kinds. The inner one holds texels that surely lie within the
//! body all through the slice, the outer one all that the body may touch in it. An attack is not
//! drawn at its frames alone, between which a fist leaves gaps, but in steps of half a radius.
//!
//! Margins. A texel of an inner map is whole within the body's section: discs lose half of a texel's
//! diagonal, and what rounding their centres to sub-texels may move them. A point of the body lies
//! in the attack's texel, whose centre falls into a texel of the outer map: discs gain half of the
//! diagonal of either, that rounding, and what a turn in fixed point may be off. In time a drawn moment stands
//! for the times around it, half-way to its neighbours: spheres lose or gain the way that they go in
//! that time, and what motion between samples may bend.

use glam::Vec3;

use super::slab::Cut;
use super::strike::attack_spheres;
use super::{Body, BodyTrack, Disc, Drawing, MapGrid, MapRect, SUB_TEXELS, Section, Slab};
use crate::anim::{Pose, forward_kinematics};
use crate::graph::{EdgeId, GraphEvent, MotionGraph};
use crate::math::Rigid2;

/// Half of a texel's diagonal, sub-texels, rounded up.
pub(crate) const HALF_DIAGONAL: f32 = 0.7072 * SUB_TEXELS as f32;
/// How far rounding to whole sub-texels moves a disc's centre, and what single precision may lose
/// on top of it.
pub(crate) const ROUNDING: f32 = 0.7072 + 0.1;
/// A moment on the clock of one motion may be this much later or earlier on another one's, seconds:
/// what single precision and merged clocks lose.
pub(crate) const CLOCK_ERROR: f32 = 3e-5;
/// Most that a turn of an attack map with the most texels puts a texel's centre beside its place,
/// sub-texels of that map ([`MapTurn::error`](super::MapTurn::error)).
const MOST_TURN_ERROR: f32 = 1.1;

/// Moments that are drawn for each of a track's samples, in inner and in outer maps. The more, the
/// smaller the margins for what lies between them.
const INNER_RATE: f32 = 4.0 * BodyTrack::RATE;
const OUTER_RATE: f32 = 2.0 * BodyTrack::RATE;

/// Which map a drawing is of, within its event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Counted from the event's lowest slab.
    pub slab: usize,
    /// `None` for the event as a whole.
    pub slice: Option<u32>,
}

/// The drawings of one event; what is empty is left out.
#[derive(Clone, Debug, Default)]
pub(super) struct EventDrawings {
    /// The lowest slab and how many there are from it upwards.
    pub slabs: (i32, usize),
    /// Seconds from the event's start that its slices cover.
    pub seconds: f32,
    /// To be drawn by "every frame".
    pub every_frame: Vec<(Part, Drawing)>,
    /// To be drawn by "any frame".
    pub any_frame: Vec<(Part, Drawing)>,
}

/// Slabs beyond those that are counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooHigh {
    pub low: i32,
    pub high: i32,
}

/// A sphere at one moment.
type Ball = (Vec3, f32);

/// The body through an evasion and, where maps are timed, beyond it.
pub(super) fn of_evasion(
    graph: &MotionGraph,
    body: &Body,
    (edge, event): (EdgeId, &GraphEvent),
    grid: MapGrid,
) -> Result<EventDrawings, TooHigh> {
    let placement = graph.placement(event.clip, event.first);
    let frames = body_frames(graph, body, event, placement.inverse());
    let (slices, slice_seconds) = if grid.is_timed() {
        (grid.slices, grid.slice_seconds)
    } else {
        (1, graph.seconds(edge))
    };
    let seconds = slices as f32 * slice_seconds;
    let beyond = seconds + 3.0 / BodyTrack::RATE;
    let track = BodyTrack::along(graph, body, (edge, placement), beyond);
    let moving = MovingBody::new(body, &track);
    let outer: Vec<_> = (0..slices)
        .map(|slice| moving.through(slice, slice_seconds, OUTER_RATE))
        .map(|moments| balls(&moments, 1.0))
        .collect();
    let slabs = slab_range(outer.iter().chain([&frames]).flatten().flatten(), grid)?;
    let mut drawings = EventDrawings {
        slabs,
        seconds,
        ..EventDrawings::default()
    };
    let whole = in_slabs(&frames, (slabs, grid), Cut::Nearest);
    drawings.every_frame = place(whole, None, |drawing| MapRect::around(drawing.frame(0)));
    if grid.is_timed() {
        for slice in 0..slices {
            let moments = moving.through(slice, slice_seconds, INNER_RATE);
            let (moments, cut) = if grid.is_certain() {
                let cut = Cut::Inner(HALF_DIAGONAL + ROUNDING);
                (balls(&moments, -1.0), cut)
            } else {
                (balls(&moments, 0.0), Cut::Nearest)
            };
            let inner = in_slabs(&moments, (slabs, grid), cut);
            drawings
                .every_frame
                .extend(place(inner, Some(slice), shared_rect));
        }
    }
    let of_attack = grid.attack_pitch as f32 * (HALF_DIAGONAL + MOST_TURN_ERROR);
    let cut = Cut::Outer(HALF_DIAGONAL + ROUNDING + of_attack);
    for (outer, slice) in outer.iter().zip(0..) {
        let outer = in_slabs(outer, (slabs, grid), cut);
        let rect = |drawing: &Drawing| MapRect::around(&drawing.discs);
        drawings.any_frame.extend(place(outer, Some(slice), rect));
    }
    Ok(drawings)
}

/// The attacking spheres on their way through an attack, in the slabs that they reach: outlines
/// without time, whatever the evasions' maps are.
pub(super) fn of_attack(
    graph: &MotionGraph,
    body: &Body,
    event: &GraphEvent,
    grid: MapGrid,
) -> Result<EventDrawings, TooHigh> {
    let grid = MapGrid {
        section: Section::Outline,
        ..grid
    };
    let mut moments = Vec::new();
    for sphere in attack_spheres(graph, body, event) {
        sphere.for_each_step(|centre, radius| moments.push(vec![(centre, radius)]));
    }
    let slabs = slab_range(moments.iter().flatten(), grid)?;
    let all = in_slabs(&moments, (slabs, grid), Cut::Nearest);
    let rect = |drawing: &Drawing| MapRect::around(&drawing.discs);
    Ok(EventDrawings {
        slabs,
        any_frame: place(all, None, rect),
        ..EventDrawings::default()
    })
}

/// The lowest slab that is reached, and how many from there to the highest.
fn slab_range<'a>(
    balls: impl Iterator<Item = &'a Ball>,
    grid: MapGrid,
) -> Result<(i32, usize), TooHigh> {
    let reached = balls.map(|&(centre, radius)| grid.slabs(centre, radius));
    let ends = reached.map(|slabs| (*slabs.start(), *slabs.end()));
    let Some((low, high)) = ends.reduce(|(a, b), (c, d)| (a.min(c), b.max(d))) else {
        return Ok((0, 0));
    };
    let end = high.saturating_add(1);
    if low < -MapGrid::HIGHEST_SLAB || end > MapGrid::HIGHEST_SLAB {
        return Err(TooHigh { low, high: end });
    }
    Ok((low, (end - low) as usize))
}

/// A drawing of the moments in each of the slabs, counted from the frame's origin.
fn in_slabs(
    moments: &[Vec<Ball>],
    ((low, count), grid): ((i32, usize), MapGrid),
    cut: Cut,
) -> Vec<Drawing> {
    let mut drawings = vec![Drawing::default(); count];
    for moment in moments {
        for &(centre, radius) in moment {
            for slab in grid.slabs(centre, radius) {
                if let Some(disc) = grid.cut((centre, radius), Slab(slab), cut) {
                    drawings[(slab - low) as usize].discs.push(disc);
                }
            }
        }
        for drawing in &mut drawings {
            drawing.frame_ends.push(drawing.discs.len() as u32);
        }
    }
    drawings
}

/// Gives each slab's drawing its rectangle; those without a texel are left out.
fn place(
    drawings: Vec<Drawing>,
    slice: Option<u32>,
    rect: impl Fn(&Drawing) -> MapRect,
) -> Vec<(Part, Drawing)> {
    let mut placed = Vec::new();
    for (slab, mut drawing) in drawings.into_iter().enumerate() {
        if drawing.frames() == 0 {
            continue;
        }
        drawing.rect = rect(&drawing);
        if drawing.rect.is_empty() {
            continue;
        }
        let (u, v) = (drawing.rect.u, drawing.rect.v);
        for disc in &mut drawing.discs {
            *disc = disc.relative_to(u, v);
        }
        placed.push((Part { slab, slice }, drawing));
    }
    placed
}

/// What the rectangles of all frames share: no texel elsewhere is covered in every one.
fn shared_rect(drawing: &Drawing) -> MapRect {
    let around = |frame| -> MapRect {
        let discs: &[Disc] = drawing.frame(frame);
        MapRect::around(discs)
    };
    (1..drawing.frames()).fold(around(0), |rect, frame| rect.intersection(around(frame)))
}

/// The body in each frame of an event, where `to_start` takes the clip's space to the frame where
/// the event starts (root on the ground, facing +Z).
fn body_frames(
    graph: &MotionGraph,
    body: &Body,
    event: &GraphEvent,
    to_start: Rigid2,
) -> Vec<Vec<Ball>> {
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

/// A sphere at a moment, which stands for the times around it.
struct Moment {
    ball: Ball,
    /// Its centre is never further away in those times, metres.
    away: f32,
}

/// The moments' spheres, larger (1), smaller (-1) or as they are (0).
fn balls(moments: &[Vec<Moment>], growth: f32) -> Vec<Vec<Ball>> {
    let grown = |moment: &Moment| (moment.ball.0, moment.ball.1 + growth * moment.away);
    moments
        .iter()
        .map(|spheres| spheres.iter().map(grown).collect())
        .collect()
}

/// A body on its track, with bounds on how fast it goes.
struct MovingBody<'a> {
    body: &'a Body,
    track: &'a BodyTrack,
    /// From a sample to the next one, metres: `[tick][sphere]`.
    ways: Vec<f32>,
    /// How far the motion may be from the straight line to the next sample, metres.
    bends: Vec<f32>,
}

impl<'a> MovingBody<'a> {
    fn new(body: &'a Body, track: &'a BodyTrack) -> Self {
        let spheres = body.spheres.len();
        let last = track.ticks().saturating_sub(1);
        let centre = |tick: usize, sphere| track.centre(tick.min(last), sphere);
        // The change of velocity at a sample, as a way.
        let corner = |tick: usize, sphere| {
            let tick = tick.clamp(1, last.max(2) - 1);
            let (before, after) = (centre(tick - 1, sphere), centre(tick + 1, sphere));
            (before - 2.0 * centre(tick, sphere) + after).length()
        };
        let mut moving = Self {
            body,
            track,
            ways: Vec::with_capacity(last * spheres),
            bends: Vec::with_capacity(last * spheres),
        };
        for tick in 0..last {
            for sphere in 0..spheres {
                let way = centre(tick, sphere).distance(centre(tick + 1, sphere));
                // A corner somewhere between two samples shows in the changes at both; half-way its
                // tip is a quarter of the change away from the straight line.
                let bend = 0.25 * (corner(tick, sphere) + corner(tick + 1, sphere));
                moving.ways.push(way);
                moving.bends.push(bend);
            }
        }
        moving
    }

    /// The body at moments from a slice's start to its end, about `rate` a second.
    fn through(&self, slice: u32, slice_seconds: f32, rate: f32) -> Vec<Vec<Moment>> {
        let steps = (slice_seconds * rate - 1e-3).ceil().max(1.0);
        let step = slice_seconds / steps;
        let moment = |index: usize| {
            let share = index as f32 / steps;
            self.at((slice as f32 + share) * slice_seconds, 0.5 * step)
        };
        (0..=steps as usize).map(moment).collect()
    }

    /// The body at a time, for the times up to `around` before and after it.
    fn at(&self, time: f32, around: f32) -> Vec<Moment> {
        let last = self.track.ticks().saturating_sub(2);
        let tick = |time: f32| ((time * BodyTrack::RATE).max(0.0) as usize).min(last);
        let around = around + CLOCK_ERROR;
        let (now, ticks) = (tick(time), tick(time - around)..=tick(time + around));
        let share = time * BodyTrack::RATE - now as f32;
        let spheres = self.body.spheres.len();
        let most = |of: &[f32], sphere: usize| {
            let values = ticks.clone().map(|tick| of[tick * spheres + sphere]);
            values.fold(0.0, f32::max)
        };
        let sphere = |(index, sphere): (usize, &super::BodySphere)| {
            let ends = [now, now + 1].map(|tick| self.track.centre(tick, index));
            Moment {
                ball: (ends[0].lerp(ends[1], share), sphere.radius),
                away: most(&self.ways, index) * BodyTrack::RATE * around + most(&self.bends, index),
            }
        };
        self.body.spheres.iter().enumerate().map(sphere).collect()
    }
}
