//! Compares the fast tests of cuts and layers with the played motion, sampled frame by frame.

use crate::anim::{Clip, ClipDesc, Envelope, JointId, Pose, Skeleton};
use crate::graph::build;
use crate::graph::{
    ClipPosition, ClipSource, EdgeMotion, Entry, GraphSettings, Layer, Motion, MotionGraph,
    rotation_vector,
};
use crate::maps::entries::examine::{Cut, Examiner};
use crate::maps::entries::frames::FrameSampler;
use crate::maps::entries::layers::LayerTest;
use crate::maps::entries::limits::{MotionLimits, departure, departures, head};
use crate::maps::entries::table::{LAYER_BLENDS, RATES};
use crate::maps::entries::targets::ClipFrame;
use crate::math::Rigid2;
use glam::{Quat, Vec3};
use sabaki_fixtures::clips::{biped, evasion, joints_of};

/// A body that sways with a period of two seconds: each joint by its own amplitude and phase.
fn clip(skeleton: &Skeleton, moves_joints: bool) -> Clip {
    let frames = 240;
    let phase = |frame: usize| std::f32::consts::TAU * frame as f32 / 60.0;
    let noise = |joint: usize, axis: usize| ((joint * 3 + axis) as f32 * 12.9898).sin();
    let rotation = |frame: usize, joint: usize| {
        let bend = |axis: usize| {
            let sway = (phase(frame) + 6.0 * noise(joint, axis)).sin();
            0.25 * noise(joint + 40, axis) * sway
        };
        Quat::from_scaled_axis(Vec3::new(0.2 + bend(0), bend(1), bend(2)))
    };
    let place = |frame: usize, joint: usize| {
        skeleton.joints()[joint].offset * (1.0 + 0.05 * (phase(frame) + joint as f32).sin())
    };
    let all = (0..frames).flat_map(|frame| (0..skeleton.len()).map(move |joint| (frame, joint)));
    let desc = ClipDesc {
        name: "sway".to_owned(),
        frame_rate: 30.0,
        roots: (0..frames)
            .map(|frame| Vec3::new(0.1 * phase(frame).sin(), 0.8, 0.2 * phase(frame).cos()))
            .collect(),
        rotations: all
            .clone()
            .map(|(frame, joint)| rotation(frame, joint))
            .collect(),
        translations: match moves_joints {
            true => all.map(|(frame, joint)| place(frame, joint)).collect(),
            false => Vec::new(),
        },
    };
    Clip::new(skeleton, desc).unwrap()
}

fn graph(moves_joints: bool) -> MotionGraph {
    let skeleton = biped();
    let clips = [clip(&skeleton, moves_joints)];
    let source = ClipSource {
        skeleton: &skeleton,
        clips: &clips,
        events: &[evasion(0, 3.0, 4.0)],
    };
    let settings = GraphSettings {
        compression: None,
        ..GraphSettings::default()
    };
    build(source, &settings).unwrap().0
}

/// Artificial limits. The limit that a cut exceeds first differs from cut to cut.
fn limits(joints: usize, scale: f32) -> MotionLimits {
    let rising = |from: f32, by: f32| {
        (0..joints)
            .map(|j| scale * (from + j as f32 * by))
            .collect()
    };
    MotionLimits {
        joint_speed: rising(9.0, 0.3),
        joint_acceleration: rising(200.0, 6.0),
        hip_departure: [0.12, 0.18].map(|limit| scale * limit),
        head_departure: [0.2, 0.28].map(|limit| scale * limit),
        toe_speed: scale * 1.5,
        slide: scale * 0.3,
    }
}

/// Evaluates the played motion frame by frame: the largest share of a limit that it reaches.
struct Played<'a> {
    graph: &'a MotionGraph,
    poses: Vec<Pose>,
}

impl Played<'_> {
    fn sampled(graph: &MotionGraph, frames: usize, sample: impl Fn(f32, &mut Pose)) -> Played<'_> {
        let rate = graph.frame_rate() as f32;
        let poses = (0..frames).map(|frame| {
            let mut pose = Pose::default();
            sample(frame as f32 / rate, &mut pose);
            pose
        });
        Played {
            graph,
            poses: poses.collect(),
        }
    }

    fn place(&self, frame: usize, joint: JointId) -> Vec3 {
        joints_of(self.graph.skeleton(), &self.poses[frame])[joint.index()].translation
    }

    fn joints(&self, limits: &MotionLimits, frames: usize) -> f32 {
        let rate = self.graph.frame_rate() as f32;
        let turn = |frame: usize, joint: usize| {
            let [from, to] = [frame, frame + 1].map(|at| self.poses[at].rotations[joint]);
            rotation_vector(to * from.conjugate())
        };
        let all =
            (1..frames - 1).flat_map(|at| (0..limits.joint_speed.len()).map(move |j| (at, j)));
        let shares = all.map(|(at, joint)| {
            let speed = turn(at, joint).length() * rate / limits.joint_speed[joint];
            let change = (turn(at, joint) - turn(at - 1, joint)).length() * rate * rate;
            speed.max(change / limits.joint_acceleration[joint])
        });
        shares.fold(0.0, f32::max)
    }

    fn departure(&self, joint: JointId, limits: [f32; 2], flat: bool) -> f32 {
        let frames = departures(self.graph.frame_rate() as f32);
        let shares = frames.into_iter().zip(limits).map(|(frames, limit)| {
            let ends = [0, 1, 1 + frames].map(|frame| self.place(frame, joint));
            let way = departure(ends, frames);
            let way = if flat { way.with_y(0.0) } else { way };
            way.length() / limit
        });
        shares.fold(0.0, f32::max)
    }

    fn toes(&self, limits: &MotionLimits, frames: usize) -> [f32; 2] {
        let rate = self.graph.frame_rate() as f32;
        let (mut fastest, mut slide) = (0.0_f32, 0.0);
        for frame in 1..frames - 1 {
            let ways = self.graph.feet().legs().iter().map(|leg| {
                let toe = leg.toe_or_foot();
                self.place(frame + 1, toe) - self.place(frame, toe)
            });
            let ways: Vec<Vec3> = ways.collect();
            let longest = ways.iter().map(|way| way.length()).fold(0.0, f32::max);
            fastest = fastest.max(longest * rate / limits.toe_speed);
            let slow = ways.iter().map(|way| way.with_y(0.0).length());
            slide += slow.fold(f32::INFINITY, f32::min);
        }
        [fastest, slide / limits.slide]
    }
}

/// Frames of the clip that the graph plays.
fn places(graph: &MotionGraph) -> Vec<ClipFrame> {
    let edges = graph.edge_ids().map(|id| (id, graph.edge(id)));
    let of_clips = edges.filter(|(_, edge)| edge.motion == EdgeMotion::Clip);
    let frames = of_clips.flat_map(|(id, edge)| (0..edge.frames).map(move |at| (id, at)));
    frames
        .map(|(id, at)| ClipFrame::new(graph, id, at))
        .collect()
}

/// The frames of a test: the one at which a motion is left, and the one at which a motion is entered.
fn ends(places: &[ClipFrame], number: u32) -> [ClipFrame; 2] {
    let number = number as usize;
    [number * 37, number * 23 + places.len() / 3].map(|at| places[at % places.len()])
}

#[test]
fn a_cut_is_plausible_within_the_limits_of_the_played_motion() {
    for moves_joints in [false, true] {
        let graph = graph(moves_joints);
        let (joints, rate) = (graph.skeleton().len(), 30.0);
        let mut sampler = FrameSampler::new(&graph);
        let mut examiner = Examiner::new(&graph);
        let (places, mut binding) = (places(&graph), Vec::new());
        for number in 0..60_u32 {
            let [now, target] = ends(&places, number);
            let blend = [0.15, 0.2, 0.25, 0.45][number as usize % 4];
            let entry = Entry {
                edge: target.edge,
                frame: target.edge_frame as f32,
                clip_to_world: Rigid2::new(0.02 * number as f32, 0.1, -0.01 * number as f32),
                rate: [1.0, 1.25, 1.5][number as usize % 3],
                blend,
            };
            let before = now.playhead();
            let mut motion = Motion::new(&graph, before, &[]);
            motion.enter(&graph, 1.0 / rate, &entry);
            motion.extend(&graph, 2.0);
            let frames = (blend * rate).ceil() as usize;
            let count = 1 + Examiner::frames(rate, frames);
            let played = Played::sampled(&graph, count, |t, pose| motion.sample(&graph, t, pose));
            let plain = limits(joints, 1.0);
            let [toes, slide] = played.toes(&plain, frames + 2);
            let shares = [
                played.joints(&plain, frames + 3),
                played.departure(JointId::ROOT, plain.hip_departure, true),
                played.departure(head(graph.skeleton()), plain.head_departure, false),
                toes,
                slide,
            ];
            let share = shares.into_iter().fold(0.0, f32::max);
            binding.push(shares.iter().position(|&one| one == share).unwrap());
            let left = sampler.left(before);
            let entered = sampler.entered(&target, entry.rate, count);
            let mut fits = |scale: f32| {
                let cut = Cut {
                    graph: &graph,
                    limits: &limits(joints, scale),
                    left: &left,
                    entered: &entered,
                    align: entry.clip_to_world,
                    stands: true,
                    toe_slows: false,
                };
                examiner.cut(cut).is_plausible(blend)
            };
            let is_sharp = fits(share * 1.005) && !fits(share * 0.995);
            assert!(is_sharp, "cut {number}, {moves_joints}: {shares:?}");
        }
        binding.sort_unstable();
        binding.dedup();
        assert!(binding.len() > 2, "{binding:?} alone decide");
    }
}

#[test]
fn a_layer_is_plausible_within_the_limits_of_the_played_motion() {
    let graph = graph(false);
    let (joints, rate) = (graph.skeleton().len(), 30.0);
    assert!(graph.rig().has_upper_body());
    let (places, mut test) = (places(&graph), LayerTest::new(&graph));
    for number in 0..60_u32 {
        let [now, target] = ends(&places, number);
        let index = number as usize % LAYER_BLENDS.len();
        let (blend, speed) = (LAYER_BLENDS[index], RATES[number as usize / 3 % 3]);
        let start = 1.0 / rate;
        let envelope = Envelope {
            start,
            full: start + blend,
            release: 2.0,
            end: 3.0,
        };
        let position = ClipPosition {
            clip: target.clip,
            frame: target.frame as f32,
        };
        let layer = Layer::new(position, speed, envelope);
        let before = now.playhead();
        let mut motion = Motion::new(&graph, before, &[]);
        motion.extend(&graph, 2.0);
        let frames = (blend * rate).ceil() as usize;
        let played = Played::sampled(&graph, 1 + Examiner::frames(rate, frames), |t, pose| {
            motion.sample(&graph, t, pose);
            layer.apply(&graph, t, pose);
        });
        let plain = limits(joints, 1.0);
        let joint_share = played.joints(&plain, frames + 3);
        let head = played.departure(head(graph.skeleton()), plain.head_departure, false);
        let share = joint_share.max(head);
        let wanted = LayerTest::wanted(&graph, target.node(), speed);
        let mut fits = |scale: f32| {
            let limits = limits(joints, scale);
            let base = test.base(before, &limits);
            test.is_plausible(&base, &wanted, index)
        };
        let is_sharp = fits(share * 1.005) && !fits(share * 0.995);
        assert!(is_sharp, "layer {number}: {joint_share} {head}");
    }
}
