//! The moments of the clips that a character may be steered to.
//!
//! Source: Clavet, "Motion Matching and The Road to Next-Gen Animation" (GDC 2016): each moment of the clips has a row of features
//! (where the root goes, how the body turns, where the feet are and how they move), and the moment with the nearest row is played.
//! Differs: only upright moments without labelled events are in the table, so that a query can start from each of them. Beyond the end of
//! a run of frames the body is taken to go on as it goes there. Rows that follow each other are alike, so a search looks at the boxes around
//! some of them first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{Vec2, Vec3, Vec3Swizzles};

use crate::anim::{Facing, JointId, JointTransform, Limbs, Pose, forward_kinematics};
use crate::character::goal::wrapped;
use crate::graph::push::{acceleration, accelerations, humanly_possible, quantile, window};
use crate::graph::{ClipId, EdgeId, EdgeMotion, MotionGraph, Playhead};
use crate::maps::{BakedGraph, Stance, head};
use crate::math::Rigid2;

/// Number of features of a moment, padded to whole vectors.
pub(super) const FEATURES: usize = 32;

/// Features of one moment, each multiplied by its weight.
pub(super) type Row = [f32; FEATURES];

/// Number of rows in a box.
const BOXED: usize = 16;

/// Boxes of rows with lower bounds of their distances, as bits, the least first.
pub(super) type BoxOrder = BinaryHeap<Reverse<(u32, usize)>>;

/// Times at which the way ahead is looked at, in seconds.
pub(super) const AHEAD: [f32; 3] = [0.2, 0.4, 0.8];

/// Half of the time over which a stride's sway is averaged, in seconds.
const STRIDE: f32 = 0.5;

/// Speed below which a hand rests, in metres per second.
const RESTING: f32 = 0.5;

/// Inverse of the difference that counts as 1, for: displacement and turn at each of [`AHEAD`], position and velocity of a foot, velocity
/// and height of the root.
const WEIGHTS: ([f32; 3], [f32; 3], f32, f32, f32, f32) =
    ([12.0, 8.0, 9.0], [4.0, 3.0, 2.0], 8.0, 1.0, 1.5, 10.0);

/// Time after a moment in which a blend into it adds to what the clip accelerates, in seconds.
const BLENDED: f32 = 0.3;

/// A moment of a clip that can be played.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub edge: EdgeId,
    /// Frames since the edge's start.
    pub edge_frame: u32,
    pub clip: ClipId,
    /// Frame of the clip.
    pub frame: u32,
    /// Time until the table ends in this clip, in seconds.
    pub left: f32,
    /// Velocity over the ground, averaged over a stride, in the space of the clip, in metres per second.
    pub velocity: Vec2,
    /// Mean speed over the ground from here to the last of [`AHEAD`], in metres per second.
    pub ahead: f32,
    /// Heading averaged over a stride, in the space of the clip, in radians.
    pub heading: f32,
    /// Heading in this frame, in the space of the clip, in radians.
    pub facing: f32,
    /// Centre of mass in the space of the clip (x, z).
    pub centre: Vec2,
    /// Velocity of the centre of mass in this frame, in the character's frame (x, z), in metres per second.
    pub pace: Vec2,
    /// Velocity of the root, likewise.
    pub root_pace: Vec2,
    /// From the root to the centre of mass, in the character's frame (x, z), in metres.
    pub lean: Vec2,
    /// Largest horizontal acceleration of the centre of mass from here on, while a blend into the moment lasts, in metres per second squared.
    pub push: f32,
    /// Position of the root in the space of the clip (x, z).
    pub root: Vec2,
    /// Positions of the toes in the space of the clip (x, z).
    pub toes: [Vec2; Stance::LEGS],
    /// For each leg whose foot stands, the time until it is lifted, in seconds.
    pub standing: [Option<f32>; Stance::LEGS],
    /// Time for which the body stands with hands at rest from here on, in seconds; 0 if it does not.
    pub calm_for: f32,
}

impl Moment {
    /// Whether each foot stands.
    pub(super) fn stands(&self) -> [bool; Stance::LEGS] {
        self.standing.map(|time| time.is_some())
    }

    pub(super) fn is_calm(&self) -> bool {
        self.calm_for > 0.0
    }
}

/// All moments, by clip and frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub moments: Vec<Moment>,
    pub rows: Vec<Row>,
    /// Least and largest features of each [`BOXED`] rows.
    boxes: Vec<[Row; 2]>,
    /// Number of efforts after which a search ends. Most find the nearest moment long before.
    most_efforts: usize,
    /// Time for which the clips stand with hands at rest, in seconds.
    pub calm: f32,
    /// Horizontal acceleration that the clips reach where they stand, walk and run, in metres per second squared.
    pub limit: f32,
    /// The hardest push: the horizontal acceleration of the centre of mass that few frames exceed, in metres per second squared.
    pub hardest: f32,
    /// The highest of the moments' speeds, in metres per second.
    fastest: f32,
    frame_rate: f32,
    /// Centres of mass of each clip's frames (x, z), from the clip's first on.
    centres: Vec<Vec2>,
    /// Index of each clip frame's moment, from the clip's first on; `u32::MAX` for none.
    index: Vec<u32>,
    first: Vec<u32>,
}

/// Features of the way ahead and of the body at a moment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Features {
    /// Displacement of the root at each of [`AHEAD`], in the character's frame (x, z).
    pub ways: [Vec2; 3],
    /// Change of heading at each of [`AHEAD`], in radians.
    pub turns: [f32; 3],
    /// Feet in the character's frame, and their velocities.
    pub feet: [[Vec3; 2]; 2],
    /// Velocity of the root in the character's frame.
    pub velocity: Vec3,
    /// Height of the root.
    pub height: f32,
}

impl Features {
    /// Feet, velocity and height of a body at `now`, without the way ahead. It moves as between two stances that are `seconds` apart.
    pub(super) fn from_body(now: &Stance, [from, to]: [&Stance; 2], seconds: f32) -> Self {
        let inverse = now.placement.inverse();
        let velocity = |from: Vec3, to: Vec3| inverse.vector(to - from) / seconds;
        let foot = |leg: usize| {
            [
                inverse.point(now.ankles[leg]),
                velocity(from.ankles[leg], to.ankles[leg]),
            ]
        };
        Self {
            feet: [foot(0), foot(1)],
            velocity: velocity(from.root, to.root),
            height: now.root.y,
            ..Self::default()
        }
    }

    pub(super) fn row(&self) -> Row {
        let (way, turn, foot, foot_velocity, velocity, height) = WEIGHTS;
        let ahead = (0..AHEAD.len()).flat_map(|step| {
            let moved = self.ways[step] * way[step];
            [moved.x, moved.y, self.turns[step] * turn[step]]
        });
        let feet = self.feet.iter().flat_map(|&[place, speed]| {
            [place * foot, speed * foot_velocity].map(|vector| vector.to_array())
        });
        let root = (self.velocity * velocity).to_array();
        let all = ahead.chain(feet.flatten()).chain(root);
        let mut row = [0.0; FEATURES];
        for (value, feature) in row.iter_mut().zip(all.chain([self.height * height])) {
            *value = feature;
        }
        row
    }
}

/// Squared distance of two rows.
pub(super) fn distance(a: &Row, b: &Row) -> f32 {
    sum_of_squares(|feature| a[feature] - b[feature])
}

/// Lower bound of the [`distance`] of a row from all in a box, also as rounded.
fn distance_to_box([least, most]: &[Row; 2], row: &Row) -> f32 {
    sum_of_squares(|feature| {
        let below = least[feature] - row[feature];
        below.max(row[feature] - most[feature]).max(0.0)
    })
}

#[inline(always)]
fn sum_of_squares(feature: impl Fn(usize) -> f32) -> f32 {
    const LANES: usize = 8;
    let mut sums = [0.0f32; LANES];
    for first in (0..FEATURES).step_by(LANES) {
        for (lane, sum) in sums.iter_mut().enumerate() {
            let apart = feature(first + lane);
            *sum += apart * apart;
        }
    }
    sums.iter().sum()
}

fn box_around(rows: &[Row]) -> [Row; 2] {
    let bound = |of: fn(f32, f32) -> f32| {
        let feature = |feature: usize| rows.iter().map(|row| row[feature]).reduce(of);
        std::array::from_fn(|index| feature(index).unwrap_or(0.0))
    };
    [bound(f32::min), bound(f32::max)]
}

impl Table {
    /// All moments of a graph.
    pub(super) fn new(baked: &BakedGraph) -> Self {
        let graph = baked.graph();
        let mut table = Self {
            frame_rate: graph.frame_rate() as f32,
            most_efforts: 256,
            ..Self::default()
        };
        let (mut accelerations, mut pushes, mut hands) = (Vec::new(), Vec::new(), Vec::new());
        for (clip, edges) in (0..).map(ClipId).zip(&edges_by_clip(graph)) {
            let found = [&mut accelerations, &mut pushes];
            table.add_clip(baked, clip, edges, found, &mut hands);
        }
        table.boxes = table.rows.chunks(BOXED).map(box_around).collect();
        table.limit = limit(accelerations, 0.98);
        table.hardest = limit(pushes, 0.999);
        let speeds = table.moments.iter().map(|moment| moment.ahead);
        table.fastest = speeds.fold(0.0, f32::max);
        table.add_calm_times(&hands, (1.0 / graph.frame_rate()) as f32);
        table
    }

    /// Sets for how long the body stands calmly from each moment on, given the speeds of the hands where it stands. Moments whose hands
    /// rest are calm, if the clips have enough of them, else all that stand. `frame` is the time of a frame, in seconds.
    fn add_calm_times(&mut self, hands: &[Option<f32>], frame: f32) {
        /// Time that is enough, in seconds.
        const ENOUGH: f32 = 60.0;
        let time = |most: f32| {
            hands
                .iter()
                .flatten()
                .filter(|&&speed| speed < most)
                .count() as f32
                * frame
        };
        let most = if time(RESTING) < ENOUGH {
            f32::INFINITY
        } else {
            RESTING
        };
        self.calm = time(most);
        for at in (0..hands.len()).rev() {
            if hands[at].is_none_or(|speed| speed >= most) {
                continue;
            }
            let now = &self.moments[at];
            let next = self.moments.get(at + 1);
            let next = next.filter(|next| next.clip == now.clip && next.frame == now.frame + 1);
            self.moments[at].calm_for = frame + next.map_or(0.0, |next| next.calm_for);
        }
    }

    /// The nearest of the allowed moments, and its distance with its effort, which is below `within`. An effort that is not below the number that
    /// it is asked for need not be known. After [`Table::most_efforts`] of them, the nearest so far is returned. `order` is memory.
    pub(super) fn nearest(
        &self,
        wanted: &Row,
        within: f32,
        order: &mut BoxOrder,
        allowed: impl Fn(&Moment) -> bool,
        effort: impl Fn(&Moment, f32) -> Option<f32>,
    ) -> Option<(usize, f32)> {
        // Least bounds first: what is found early leaves out most of the rest.
        let bounds = (0..).zip(&self.boxes).filter_map(|(index, boxed)| {
            let bound = distance_to_box(boxed, wanted);
            (bound < within).then_some(Reverse((bound.to_bits(), index)))
        });
        order.clear();
        order.extend(bounds);
        let (mut best, mut least, mut efforts) = (None, within, 0);
        while let Some(Reverse((bound, boxed))) = order.pop() {
            if f32::from_bits(bound) >= least {
                break;
            }
            for (index, row) in self.rows.iter().enumerate().skip(boxed * BOXED).take(BOXED) {
                let moment = &self.moments[index];
                let apart = distance(row, wanted);
                if apart >= least || !allowed(moment) {
                    continue;
                }
                if efforts == self.most_efforts {
                    return best;
                }
                efforts += 1;
                let effort = effort(moment, least - apart);
                if let Some(apart) = effort.map(|effort| apart + effort).filter(|&it| it < least) {
                    (best, least) = (Some((index, apart)), apart);
                }
            }
        }
        best
    }

    /// The speed that is wanted, as far as the clips have it, in metres per second.
    pub(super) fn speed(&self, wanted: Vec2) -> f32 {
        wanted.length().min(self.fastest)
    }

    /// Where the centre of mass goes from a moment on, in the character's frame (x, z), by the time in seconds of the clip. Beyond the end of the
    /// clip it goes on as there.
    pub(super) fn track<'a>(&'a self, moment: &Moment) -> impl Fn(f32) -> Vec2 + 'a {
        let first = self.first[moment.clip.index()] as usize;
        let last = self.first.get(moment.clip.index() + 1);
        let last = last.map_or(self.centres.len(), |&next| next as usize) - 1;
        let start = first + moment.frame as usize;
        let inverse = Rigid2::new(-moment.facing, 0.0, 0.0);
        let (centres, frame_rate) = (&self.centres, self.frame_rate);
        move |seconds| {
            let at = start as f32 + seconds * frame_rate;
            let from = (at as usize).min(last.saturating_sub(1));
            let [from_centre, to] = [from, (from + 1).min(last)].map(|frame| centres[frame]);
            let way = from_centre + (to - from_centre) * (at - from as f32) - centres[start];
            turned(inverse, way)
        }
    }

    /// The moment at a playhead, or `None` if the table has none there.
    pub(super) fn at(&self, graph: &MotionGraph, playhead: Playhead) -> Option<usize> {
        let edge = graph.edge(playhead.edge);
        if edge.motion != EdgeMotion::Clip {
            return None;
        }
        let node = graph.node(edge.from);
        let frame = node.frame as usize + playhead.frame.round() as usize;
        let first = *self.first.get(node.clip.index())? as usize;
        let index = *self.index.get(first + frame)?;
        (index != u32::MAX).then_some(index as usize)
    }

    /// Adds the moments of a clip, given the edge that plays each frame of it, the accelerations of its root and of the centre of mass, and for
    /// each moment at which the body stands for a while, the speed of the faster hand.
    fn add_clip(
        &mut self,
        baked: &BakedGraph,
        clip: ClipId,
        edges: &PlayedBy,
        [of_roots, of_centres]: [&mut Vec<f32>; 2],
        hands: &mut Vec<Option<f32>>,
    ) {
        let graph = baked.graph();
        let frames = graph.clip(clip).frames();
        self.first.push(self.index.len() as u32);
        let start = self.index.len();
        self.index.resize(start + frames, u32::MAX);
        let bodies = Bodies::of_clip(baked, clip);
        let frame_rate = graph.frame_rate() as f32;
        let least = (AHEAD[1] * frame_rate).round() as usize;
        let window = window(graph.frame_rate());
        let pushes: Vec<f32> = accelerations(&bodies.centres, graph.frame_rate()).collect();
        self.centres.extend(&bodies.centres);
        let blended = (BLENDED * frame_rate).round() as usize;
        let mut run = 0..0;
        for frame in 0..frames {
            let Some((edge, edge_frame)) = edges[frame] else {
                continue;
            };
            if frame >= run.end {
                let played = edges[frame..].iter().take_while(|edge| edge.is_some());
                run = frame..frame + played.count();
            }
            let left = (run.end - frame).min(frames - 1 - frame);
            if left < least + 1 || !bodies.is_upright[frame] {
                continue;
            }
            let posed = &bodies.stances;
            let features = features(&posed[..=frame + left], frame, frame_rate);
            let half = (STRIDE * frame_rate).round() as usize;
            let from = frame.saturating_sub(half).max(run.start);
            let to = (frame + half).min(frame + left);
            let (velocity, heading) = stride(&posed[from..=to], frame_rate);
            let stands = features.ways[1].length() < 0.08
                && velocity.length() < 0.15
                && features.turns[1].abs() < 0.15;
            hands.push(stands.then(|| bodies.hand_speed(frame, frame_rate)));
            let ends = [frame, frame + window, frame + 2 * window];
            if ends[2] <= frame + left {
                of_roots.push(acceleration(ends.map(|at| posed[at].root.xz())));
                of_centres.push(pushes[frame]);
            }
            let placement = posed[frame].placement;
            let root = posed[frame].root.xz();
            let lean = bodies.centres[frame] - root;
            self.index[start + frame] = self.moments.len() as u32;
            self.rows.push(features.row());
            self.moments.push(Moment {
                edge,
                edge_frame,
                clip,
                frame: frame as u32,
                left: (left - least) as f32 / frame_rate,
                velocity,
                ahead: features.ways[AHEAD.len() - 1].length() / AHEAD[AHEAD.len() - 1],
                heading,
                facing: placement.heading(),
                root_pace: features.velocity.xz(),
                lean: turned(placement.inverse(), lean),
                centre: bodies.centres[frame],
                pace: pace(
                    &posed[frame],
                    [frame, frame + 1].map(|at| bodies.centres[at]),
                    1.0 / frame_rate,
                ),
                push: pushes[frame.min(pushes.len())..]
                    .iter()
                    .take(blended)
                    .fold(0.0, |most, push| push.max(most)),
                root,
                toes: posed[frame].toes.map(|toe| Vec2::new(toe.x, toe.z)),
                standing: standing(graph, clip, frame as u32),
                calm_for: 0.0,
            });
        }
    }
}

/// Position of the centre of mass over the ground (x, z). `axes` is memory.
pub(super) fn centre_of_mass(
    baked: &BakedGraph,
    joints: &[JointTransform],
    axes: &mut Vec<f32>,
) -> Vec2 {
    axes.clear();
    baked.body_rows().push(joints, axes);
    baked.body_rows().centre_of_mass(axes).xz()
}

/// Velocity between two places over the ground that are `seconds` apart, in the frame of a body (x, z), in metres per second.
pub(super) fn pace(body: &Stance, [from, to]: [Vec2; 2], seconds: f32) -> Vec2 {
    turned(body.placement.inverse(), to - from) / seconds
}

/// A vector over the ground (x, z), turned.
pub(super) fn turned(by: Rigid2, vector: Vec2) -> Vec2 {
    by.vector(Vec3::new(vector.x, 0.0, vector.y)).xz()
}

/// For each leg whose foot stands at a frame of a clip, the time until it is lifted, in seconds.
pub(super) fn standing(
    graph: &MotionGraph,
    clip: ClipId,
    frame: u32,
) -> [Option<f32>; Stance::LEGS] {
    let feet = graph.feet();
    std::array::from_fn(|leg| {
        let is_leg = leg < feet.legs().len();
        let frames = is_leg.then(|| feet.stands_for(clip, leg, frame))?;
        (frames > 0).then(|| frames as f32 / graph.frame_rate() as f32)
    })
}

/// The edge that plays each frame of a clip without an event, and its frame.
pub(super) type PlayedBy = Vec<Option<(EdgeId, u32)>>;

pub(super) fn edges_by_clip(graph: &MotionGraph) -> Vec<PlayedBy> {
    let clips = graph.clips().iter();
    let mut edges: Vec<PlayedBy> = clips.map(|clip| vec![None; clip.frames()]).collect();
    for id in graph.natural_edges() {
        let edge = graph.edge(id);
        let from = graph.node(edge.from);
        for ahead in 0..edge.frames {
            edges[from.clip.index()][(from.frame + ahead) as usize] = Some((id, ahead));
        }
    }
    edges
}

/// The bodies of a clip, frame by frame.
struct Bodies {
    stances: Vec<Stance>,
    /// Centres of mass (x, z).
    centres: Vec<Vec2>,
    /// Whether the head is above the root, as when a body stands, walks or crouches.
    is_upright: Vec<bool>,
    hands: Vec<Vec<Vec3>>,
}

impl Bodies {
    fn of_clip(baked: &BakedGraph, clip: ClipId) -> Self {
        /// Least cosine of the angle of the trunk with the vertical.
        const UPRIGHT: f32 = 0.7;
        let graph = baked.graph();
        let skeleton = graph.skeleton();
        let (facing, head, limbs) = (Facing::of(skeleton), head(skeleton), Limbs::of(skeleton));
        let (mut pose, mut joints, mut axes) = (Pose::default(), Vec::new(), Vec::new());
        let mut bodies = Self {
            stances: Vec::new(),
            centres: Vec::new(),
            is_upright: Vec::new(),
            hands: Vec::new(),
        };
        for frame in 0..graph.clip(clip).frames() {
            graph.clip(clip).pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            let place = |joint: JointId| joints[joint.index()].translation;
            let trunk = place(head) - place(JointId::ROOT);
            bodies.is_upright.push(trunk.y >= UPRIGHT * trunk.length());
            bodies
                .hands
                .push(limbs.hands.iter().map(|&hand| place(hand)).collect());
            bodies
                .stances
                .push(Stance::from_joints(graph, facing, &joints));
            bodies
                .centres
                .push(centre_of_mass(baked, &joints, &mut axes));
        }
        bodies
    }

    /// Speed of the faster hand at a frame that is not the last, in metres per second.
    fn hand_speed(&self, frame: usize, frame_rate: f32) -> f32 {
        let hands = self.hands[frame].iter().zip(&self.hands[frame + 1]);
        hands.fold(0.0, |most, (from, to)| {
            f32::max(most, from.distance(*to) * frame_rate)
        })
    }
}

/// The acceleration that a share of some accelerations does not exceed, within what friction allows, in metres per second squared.
fn limit(mut accelerations: Vec<f32>, share: f32) -> f32 {
    humanly_possible(quantile(&mut accelerations, share).unwrap_or(0.0), 1.0)
}

/// Features of a frame of a run, which has at least one frame more. Beyond its end the body goes on as in the time of the first of
/// [`AHEAD`] before it.
fn features(posed: &[Stance], frame: usize, frame_rate: f32) -> Features {
    let [now, next] = [&posed[frame], &posed[frame + 1]];
    let inverse = now.placement.inverse();
    let last = posed.len() - 1;
    let step = (AHEAD[0] * frame_rate).round() as usize;
    // A place and the turn to it.
    let at = |frame: usize| {
        let moved = inverse.vector(posed[frame].root - now.root);
        let turned = posed[frame].placement.heading() - now.placement.heading();
        (Vec2::new(moved.x, moved.z), wrapped(turned))
    };
    let ahead = AHEAD.map(|seconds| {
        let there = frame + (seconds * frame_rate).round() as usize;
        if there <= last {
            return at(there);
        }
        let (end, before) = (at(last), at(last - step));
        let steps = (there - last) as f32 / step as f32;
        (
            end.0 + (end.0 - before.0) * steps,
            end.1 + wrapped(end.1 - before.1) * steps,
        )
    });
    Features {
        ways: ahead.map(|(way, _)| way),
        turns: ahead.map(|(_, turn)| turn),
        ..Features::from_body(now, [now, next], 1.0 / frame_rate)
    }
}

/// Mean velocity and heading of some frames that follow each other.
fn stride(posed: &[Stance], frame_rate: f32) -> (Vec2, f32) {
    let moved = match posed {
        [first, .., last] => last.root - first.root,
        _ => Vec3::ZERO,
    };
    let seconds = (posed.len() - 1).max(1) as f32 / frame_rate;
    let facing = posed
        .iter()
        .map(|stance| Vec2::new(stance.placement.sin(), stance.placement.cos()));
    let facing = facing.sum::<Vec2>();
    (
        Vec2::new(moved.x, moved.z) / seconds,
        facing.x.atan2(facing.y),
    )
}

#[cfg(test)]
mod tests {
    use sabaki_fixtures::random::Random;

    use super::*;
    use crate::query::fixture::baked;

    #[test]
    fn boxes_leave_out_no_row_that_is_nearest() {
        let table = Table {
            most_efforts: usize::MAX,
            ..Table::new(baked())
        };
        let (mut random, mut order) = (Random::new(5), BoxOrder::new());
        let count = table.rows.len();
        assert!(count > 10 * BOXED);
        for round in 0..200 {
            let spread = [0.0, 0.5, 5.0][round % 3];
            let wanted =
                table.rows[random.below(count)].map(|it| it + random.float(-1.0, 1.0) * spread);
            let from = random.below(count) as u32;
            let far = |moment: &Moment| moment.frame.abs_diff(from);
            let allowed = |moment: &Moment| !far(moment).is_multiple_of(3);
            let effort = |moment: &Moment, room: f32| {
                Some(0.01 * far(moment) as f32).filter(|&effort| effort < room)
            };
            let all = table.rows.iter().zip(&table.moments).enumerate();
            let naive = all
                .filter(|(_, (_, moment))| allowed(moment))
                .filter_map(|(index, (row, moment))| {
                    Some((
                        index,
                        distance(row, &wanted) + effort(moment, f32::INFINITY)?,
                    ))
                })
                .min_by(|a, b| a.1.total_cmp(&b.1));
            let nearest = table.nearest(&wanted, f32::INFINITY, &mut order, allowed, effort);
            assert_eq!(nearest, naive);
        }
    }
}
