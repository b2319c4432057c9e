//! Prepares the drawings of an event: the discs of its spheres, for each slab and slice.
//!
//! Source: Masaoka & Oshita, section 4.3. Differs: in addition to the paper's map of a whole
//! evasion, there are two maps for each slice of time. The inner map holds the texels that are
//! certainly inside the body during the whole slice. The outer map holds all texels that the body
//! may touch during the slice. An attack is not only drawn at its frames, which would leave gaps
//! between the positions of a fast fist, but in steps of half a radius.
//!
//! Margins. A texel of an inner map must lie completely inside the body's section. Its discs shrink
//! by half a texel's diagonal and by the rounding of disc centres to sub-texels. For outer maps, a
//! point of the body lies in some texel of the attack, whose centre falls into a texel of the outer
//! map. Discs grow by half the diagonal of both texels, the rounding of disc centres, and the error
//! of the fixed-point rotation. Each drawn moment represents the times up to half-distance to its
//! neighbours. Its spheres shrink or grow by the distance that they travel in that time, and by the
//! deviation of the motion from a straight line between samples.

use super::settings::BakeError;
use crate::anim::{Pose, forward_kinematics};
use crate::graph::{EdgeId, GraphEvent, MotionGraph, Playhead};
use crate::maps::regions::{
    Body, BodySphere, BodyTrack, Cut, Drawing, HALF_DIAGONAL, MapGrid, MapRect, ROUNDING, Section,
    Slab, TIME_ERROR, attack_spheres,
};
use crate::math::{Rigid2, Sphere};

/// Maximum error of a texel's centre under a fixed-point transform, for the largest attack map, in
/// sub-texels of that map ([`FixedTransform2::error`](crate::maps::FixedTransform2::error)).
const MAX_TRANSFORM_ERROR: f32 = 1.1;

/// Moments drawn per second in inner maps and in outer maps. More moments give smaller margins for
/// the motion between them.
const INNER_RATE: f32 = 4.0 * BodyTrack::RATE;
const OUTER_RATE: f32 = 2.0 * BodyTrack::RATE;

/// Position of a drawing within its event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Index of the slab, counted from the event's lowest slab.
    pub slab: usize,
    /// Index of the slice, or `None` for the drawing of the whole event.
    pub slice: Option<u32>,
}

/// The drawings of one event, each with its part. Empty drawings are left out.
#[derive(Clone, Debug, Default)]
pub(super) struct EventDrawings {
    /// Slabs that the event reaches.
    pub slabs: SlabRange,
    /// Time from the event's start that the slices cover, in seconds.
    pub seconds: f32,
    /// Drawings for [`every_frame`](crate::maps::raster::every_frame).
    pub every_frame: (Vec<Part>, Vec<Drawing>),
    /// Drawings for [`any_frame`](crate::maps::raster::any_frame).
    pub any_frame: (Vec<Part>, Vec<Drawing>),
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SlabRange {
    /// Lowest slab.
    pub low: i32,
    /// Number of slabs.
    pub count: usize,
}

/// Prepares the drawings of an evasion, and of the motion after it if the maps are timed.
pub(super) fn evasion_drawings(
    graph: &MotionGraph,
    body: &Body,
    grid: MapGrid,
    edge: EdgeId,
    event: &GraphEvent,
) -> Result<EventDrawings, BakeError> {
    let placement = graph.placement(event.clip, event.first);
    let frames = body_frames(graph, body, event, placement.inverse());
    let (slices, slice_seconds) = match grid.is_timed() {
        true => (grid.slices, grid.slice_seconds),
        false => (1, graph.seconds(edge)),
    };
    let seconds = slices as f32 * slice_seconds;
    let playhead = Playhead {
        edge,
        frame: 0.0,
        clip_to_world: placement.inverse(),
    };
    let track = BodyTrack::along(graph, body, playhead, seconds + 3.0 / BodyTrack::RATE);
    let moving = MovingBody::new(body, &track);
    let outer: Vec<_> = (0..slices)
        .map(|slice| moving.through(slice, slice_seconds, OUTER_RATE))
        .map(|moments| grown_spheres(&moments, 1.0))
        .collect();
    let spheres = outer.iter().chain([&frames]).flatten().flatten();
    let slabs = slab_range(graph, event, spheres, grid)?;
    let mut drawings = EventDrawings {
        slabs,
        seconds,
        ..EventDrawings::default()
    };
    let whole = in_slabs(&frames, slabs, grid, Cut::Nearest);
    let whole = place(whole, None, |drawing| MapRect::around(drawing.frame(0)));
    drawings.every_frame.extend(whole);
    if grid.is_timed() {
        for slice in 0..slices {
            let moments = moving.through(slice, slice_seconds, INNER_RATE);
            let (moments, cut) = if grid.is_certain() {
                let cut = Cut::Inner(HALF_DIAGONAL + ROUNDING);
                (grown_spheres(&moments, -1.0), cut)
            } else {
                (grown_spheres(&moments, 0.0), Cut::Nearest)
            };
            let inner = in_slabs(&moments, slabs, grid, cut);
            let inner = place(inner, Some(slice), shared_rect);
            drawings.every_frame.extend(inner);
        }
    }
    let of_attack = HALF_DIAGONAL + MAX_TRANSFORM_ERROR;
    let cut = Cut::Outer(HALF_DIAGONAL + ROUNDING + of_attack);
    for (outer, slice) in outer.iter().zip(0..) {
        let outer = in_slabs(outer, slabs, grid, cut);
        let rect = |drawing: &Drawing| MapRect::around(&drawing.discs);
        drawings.any_frame.extend(place(outer, Some(slice), rect));
    }
    drawings.checked(graph, event)
}

/// Prepares the drawings of an attack. Attacks are always drawn as outlines, without time.
pub(super) fn attack_drawings(
    graph: &MotionGraph,
    body: &Body,
    grid: MapGrid,
    event: &GraphEvent,
) -> Result<EventDrawings, BakeError> {
    let grid = MapGrid {
        section: Section::Outline,
        ..grid
    };
    let mut moments = Vec::new();
    for sphere in attack_spheres(graph, body, event) {
        sphere.for_each_step(|ball| moments.push(vec![ball]));
    }
    let slabs = slab_range(graph, event, moments.iter().flatten(), grid)?;
    let all = in_slabs(&moments, slabs, grid, Cut::Nearest);
    let rect = |drawing: &Drawing| MapRect::around(&drawing.discs);
    let drawings = EventDrawings {
        slabs,
        any_frame: place(all, None, rect).into_iter().unzip(),
        ..EventDrawings::default()
    };
    drawings.checked(graph, event)
}

impl EventDrawings {
    /// Returns an error if the drawings do not fit fixed-point maps.
    fn checked(self, graph: &MotionGraph, event: &GraphEvent) -> Result<Self, BakeError> {
        let mut all = self.every_frame.1.iter().chain(&self.any_frame.1);
        match all.find(|drawing| !drawing.rect.fits()) {
            None => Ok(self),
            Some(large) => Err(BakeError::MapTooLarge {
                event: graph.describe_event(event),
                width: large.rect.width,
                height: large.rect.height,
            }),
        }
    }
}

/// Lowest slab that the spheres reach, and number of slabs up to the highest.
fn slab_range<'a>(
    graph: &MotionGraph,
    event: &GraphEvent,
    spheres: impl Iterator<Item = &'a Sphere>,
    grid: MapGrid,
) -> Result<SlabRange, BakeError> {
    let reached = spheres.map(|sphere| grid.slabs(sphere.centre, sphere.radius));
    let ends = reached.map(|slabs| (*slabs.start(), *slabs.end()));
    let Some((low, high)) = ends.reduce(|(a, b), (c, d)| (a.min(c), b.max(d))) else {
        return Ok(SlabRange::default());
    };
    let end = high.saturating_add(1);
    if low < -MapGrid::HIGHEST_SLAB || end > MapGrid::HIGHEST_SLAB {
        return Err(BakeError::TooHigh {
            event: graph.describe_event(event),
            low,
            high: end,
        });
    }
    Ok(SlabRange {
        low,
        count: (end - low) as usize,
    })
}

/// Cuts the spheres of all moments into the drawings of the slabs. Discs are relative to the
/// frame's origin.
fn in_slabs(moments: &[Vec<Sphere>], slabs: SlabRange, grid: MapGrid, cut: Cut) -> Vec<Drawing> {
    let mut drawings = vec![Drawing::default(); slabs.count];
    for moment in moments {
        for &sphere in moment {
            for slab in grid.slabs(sphere.centre, sphere.radius) {
                if let Some(disc) = grid.cut(sphere, Slab(slab), cut) {
                    drawings[(slab - slabs.low) as usize].discs.push(disc);
                }
            }
        }
        for drawing in &mut drawings {
            drawing.frame_ends.push(drawing.discs.len() as u32);
        }
    }
    drawings
}

/// Sets the rectangle of each slab's drawing and leaves out the empty ones.
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

/// Intersection of the rectangles of all frames. No texel outside it is covered in every frame.
fn shared_rect(drawing: &Drawing) -> MapRect {
    let around = |frame| MapRect::around(drawing.frame(frame));
    (1..drawing.frames()).fold(around(0), |rect, frame| rect.intersection(around(frame)))
}

/// Spheres of the body in each frame of an event. `to_start` transforms the clip's space to the
/// character's frame at the event's start (root on the ground, facing +Z).
fn body_frames(
    graph: &MotionGraph,
    body: &Body,
    event: &GraphEvent,
    to_start: Rigid2,
) -> Vec<Vec<Sphere>> {
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let spheres = |frame: u32| {
        graph.clip(event.clip).pose(frame as usize, &mut pose);
        pose.place(to_start);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        let place = |sphere: &BodySphere| Sphere::new(sphere.centre(&joints), sphere.radius);
        body.spheres.iter().map(place).collect()
    };
    (event.first..=event.last).map(spheres).collect()
}

/// A sphere at one moment, with a bound on its motion around that moment.
struct Moment {
    sphere: Sphere,
    /// Maximum distance of the centre from this position in the times that the moment represents,
    /// in metres.
    drift: f32,
}

/// Spheres of the moments with their bounds added (`growth` 1), subtracted (-1) or ignored (0).
fn grown_spheres(moments: &[Vec<Moment>], growth: f32) -> Vec<Vec<Sphere>> {
    let grown = |moment: &Moment| Sphere {
        radius: moment.sphere.radius + growth * moment.drift,
        ..moment.sphere
    };
    moments
        .iter()
        .map(|spheres| spheres.iter().map(grown).collect())
        .collect()
}

/// A body on its track, with bounds on its motion.
struct MovingBody<'a> {
    body: &'a Body,
    track: &'a BodyTrack,
    /// Distance from each sample to the next, in metres: `[tick][sphere]`.
    distances: Vec<f32>,
    /// Maximum deviation of the motion from the straight line between two samples, in metres:
    /// `[tick][sphere]`.
    deviations: Vec<f32>,
}

impl<'a> MovingBody<'a> {
    fn new(body: &'a Body, track: &'a BodyTrack) -> Self {
        let spheres = body.spheres.len();
        let last = track.ticks().saturating_sub(1);
        let centre = |tick: usize, sphere| track.centre(tick.min(last), sphere);
        // Second difference of the position at a sample, in metres.
        let corner = |tick: usize, sphere| {
            let tick = tick.clamp(1, last.max(2) - 1);
            let (before, after) = (centre(tick - 1, sphere), centre(tick + 1, sphere));
            (before - 2.0 * centre(tick, sphere) + after).length()
        };
        let mut moving = Self {
            body,
            track,
            distances: Vec::with_capacity(last * spheres),
            deviations: Vec::with_capacity(last * spheres),
        };
        for tick in 0..last {
            for sphere in 0..spheres {
                let distance = centre(tick, sphere).distance(centre(tick + 1, sphere));
                // A corner between two samples changes the second difference at both. Its tip
                // deviates by at most a quarter of the change from the straight line.
                let deviation = 0.25 * (corner(tick, sphere) + corner(tick + 1, sphere));
                moving.distances.push(distance);
                moving.deviations.push(deviation);
            }
        }
        moving
    }

    /// Body at moments from the slice's start to its end, at about `rate` moments per second.
    fn through(&self, slice: u32, slice_seconds: f32, rate: f32) -> Vec<Vec<Moment>> {
        let steps = (slice_seconds * rate - 1e-3).ceil().max(1.0);
        let step = slice_seconds / steps;
        let moment = |index: usize| {
            let share = index as f32 / steps;
            self.at((slice as f32 + share) * slice_seconds, 0.5 * step)
        };
        (0..=steps as usize).map(moment).collect()
    }

    /// Body at `time`, with bounds for the times up to `around` seconds before and after.
    fn at(&self, time: f32, around: f32) -> Vec<Moment> {
        let last = self.track.ticks().saturating_sub(2);
        let tick = |time: f32| ((time * BodyTrack::RATE).max(0.0) as usize).min(last);
        let around = around + TIME_ERROR;
        let (now, ticks) = (tick(time), tick(time - around)..=tick(time + around));
        let share = time * BodyTrack::RATE - now as f32;
        let spheres = self.body.spheres.len();
        let most = |of: &[f32], sphere: usize| {
            let values = ticks.clone().map(|tick| of[tick * spheres + sphere]);
            values.fold(0.0, f32::max)
        };
        let sphere = |(index, sphere): (usize, &BodySphere)| {
            let ends = [now, now + 1].map(|tick| self.track.centre(tick, index));
            Moment {
                sphere: Sphere::new(ends[0].lerp(ends[1], share), sphere.radius),
                drift: most(&self.distances, index) * BodyTrack::RATE * around
                    + most(&self.deviations, index),
            }
        };
        self.body.spheres.iter().enumerate().map(sphere).collect()
    }
}
