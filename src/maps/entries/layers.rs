//! Finds layered evasions: moments from which the upper body can play a part of an evasion while the legs continue.

use crate::anim::{Envelope, JointId, Pose, forward_kinematics, slerp};
use crate::graph::{MotionGraph, Node, Playhead, heading, layer_tilt};
use crate::maps::entries::examine::{Examiner, JointLimits, JointSteps};
use crate::maps::entries::finder::{Departed, Finder, spread};
use crate::maps::entries::frames::FrameSampler;
use crate::maps::entries::limits::{MotionLimits, goes_on, head, limited, turns};
use crate::maps::entries::table::{EntryTarget, EntryWay, KnownEntry, LAYER_BLENDS, RATES};
use crate::maps::entries::targets::ClipFrame;
use crate::maps::regions::Evasion;
use glam::{Quat, Vec3};

/// Minimum distance by which an evasion must move the head relative to the pelvis to be layered, in metres.
const LEANS: f32 = 0.12;

/// The evasions that can be layered, and the limits of motion.
pub(crate) struct LayerSource {
    evasions: Vec<u16>,
    /// Poses of the clip from each target on, for each playback rate. Empty for evasions that cannot be layered.
    wanted: Vec<[Vec<Pose>; RATES.len()]>,
    /// For each evasion, whether its upper body leans or ducks relative to the pelvis.
    layerable: Vec<bool>,
    limits: MotionLimits,
}

impl LayerSource {
    pub(crate) fn new(
        graph: &MotionGraph,
        limits: &MotionLimits,
        evasions: &[Evasion],
        targets: &[EntryTarget],
    ) -> Self {
        let leans = |evasion: &Evasion| {
            let edge = graph.edge(evasion.edge);
            let start = graph.node(edge.from);
            let at = |frame: u32| {
                let frame = start.frame + frame;
                head_over_pelvis(graph, Node { frame, ..start })
            };
            let first = at(0);
            (1..=edge.frames).any(|frame| at(frame).distance(first) > LEANS)
        };
        let has_upper_body = graph.rig().has_upper_body();
        // All joints of the spine share a tilt, including joints that the clips do not move.
        let mut limits = limits.clone();
        for values in [&mut limits.joint_speed, &mut limits.joint_acceleration] {
            let spine = graph.rig().spine();
            let most = spine.iter().map(|joint| values[joint.index()]);
            let most = most.fold(0.0, f32::max);
            spine.iter().for_each(|joint| values[joint.index()] = most);
        }
        let layerable: Vec<bool> = evasions
            .iter()
            .map(|evasion| has_upper_body && leans(evasion))
            .collect();
        let wanted = |target: &EntryTarget| {
            let from = ClipFrame::new(graph, target.edge, target.edge_frame).node();
            RATES.map(|rate| match layerable[usize::from(target.evasion)] {
                true => LayerTest::wanted(graph, from, rate),
                false => Vec::new(),
            })
        };
        Self {
            evasions: targets.iter().map(|target| target.evasion).collect(),
            wanted: targets.iter().map(wanted).collect(),
            layerable,
            limits,
        }
    }

    /// How a target can be layered; `None` if it is not plausible.
    fn tested(
        &self,
        target: usize,
        base: &LayerBase<'_>,
        test: &mut LayerTest<'_>,
    ) -> Option<EntryWay> {
        let mut plausible =
            |blend: usize, rate: usize| test.is_plausible(base, &self.wanted[target][rate], blend);
        let blend = (0..LAYER_BLENDS.len()).find(|&blend| plausible(blend, 0));
        blend.map(|blend| {
            let faster = (1..RATES.len()).take_while(|&rate| plausible(blend, rate));
            EntryWay {
                blend,
                rate: faster.last().unwrap_or(0),
                pin: None,
            }
        })
    }
}

/// Position of the head relative to the pelvis, in a frame with the heading of the pelvis.
fn head_over_pelvis(graph: &MotionGraph, at: Node) -> Vec3 {
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    graph.clip(at.clip).pose(at.frame as usize, &mut pose);
    forward_kinematics(graph.skeleton(), &pose, &mut joints);
    let turn: Quat = heading(pose.rotations[JointId::ROOT.index()]);
    let over = joints[head(graph.skeleton()).index()].translation - pose.root;
    turn.conjugate() * over
}

/// Maximum number of layered evasions of a moment.
const MOST: usize = 32;

impl Finder<'_> {
    /// Finds the layered evasions of a frame of a clip, among the targets of the evasions that can be layered.
    pub(crate) fn layers(
        &self,
        from: &Departed,
        source: &LayerSource,
        test: &mut LayerTest<'_>,
    ) -> Vec<KnownEntry> {
        let mut found = Vec::new();
        let mut base = None;
        let own = from.before;
        for target in spread(source.evasions.len()) {
            if found.len() == MOST {
                break;
            }
            let is_own = self.targets[target].clip == own.clip;
            let evasion = usize::from(source.evasions[target]);
            if is_own || !source.layerable[evasion] {
                continue;
            }
            let base = base.get_or_insert_with(|| test.base(own.playhead(), &source.limits));
            let way = source.tested(target, base, test);
            found.extend(way.map(|way| KnownEntry::new(target as u16, way)));
        }
        found.sort_by_key(|found| found.target);
        found
    }
}

// The test of layers against the limits of plausible motion.
//
// The played motion is that of [`Layer`](crate::graph::Layer). The joints that the layer does not move are those of the motion without it,
// and are tested once.

/// Scratch of the test of layers in one graph.
pub(crate) struct LayerTest<'a> {
    graph: &'a MotionGraph,
    rate: f32,
    head_chain: Vec<JointId>,
    /// Joints with limits that a layer moves, without the spine.
    free: Vec<JointId>,
    /// Joints with limits that a layer does not move.
    kept: Vec<JointId>,
    sampler: FrameSampler<'a>,
    /// Poses whose spine has been computed.
    poses: Vec<Pose>,
}

/// The motion that continues after a frame, without a layer.
pub(crate) struct LayerBase<'a> {
    limits: &'a MotionLimits,
    /// Frame rate, in frames per second.
    rate: f32,
    poses: Vec<Pose>,
    /// Rotation vector of each joint between the first two frames.
    turns: Vec<Vec3>,
    /// For each of [`LAYER_BLENDS`], whether the joints that a layer does not move are plausible.
    fits: [bool; LAYER_BLENDS.len()],
}

/// One layer on a motion.
#[derive(Clone, Copy)]
struct Layered<'a> {
    base: &'a LayerBase<'a>,
    /// Poses of the layered clip, from the second frame of the base on.
    wanted: &'a [Pose],
    envelope: Envelope,
}

/// Number of frames whose joints are tested before the head.
const FIRST: usize = 4;

impl<'a> LayerTest<'a> {
    pub(crate) fn new(graph: &'a MotionGraph) -> Self {
        let (skeleton, rig) = (graph.skeleton(), graph.rig());
        let is_kept = |id: &JointId| !rig.part(*id).is_above_pelvis();
        let limited = limited(skeleton);
        let tested = skeleton.ids().filter(|id| limited[id.index()]);
        let (kept, mut moved): (Vec<JointId>, Vec<JointId>) = tested.partition(is_kept);
        moved.retain(|id| !rig.spine().contains(id));
        let mut head_chain: Vec<JointId> = skeleton.ancestry(head(skeleton)).collect();
        head_chain.reverse();
        Self {
            graph,
            rate: graph.frame_rate() as f32,
            head_chain,
            free: moved,
            kept,
            sampler: FrameSampler::new(graph),
            poses: Vec::new(),
        }
    }

    /// Number of frames of the motion without a layer that the test of the longest blend reads.
    fn frames(rate: f32) -> usize {
        let longest = LAYER_BLENDS.into_iter().fold(0.0, f32::max);
        1 + Examiner::frames(rate, (longest * rate).ceil() as usize)
    }

    /// Poses of a clip from a frame on, at a playback rate.
    pub(crate) fn wanted(graph: &MotionGraph, from: Node, rate: f32) -> Vec<Pose> {
        let poses = (1..Self::frames(graph.frame_rate() as f32)).map(|after| {
            let mut pose = Pose::default();
            let at = from.frame as f32 + (after - 1) as f32 * rate;
            graph.clip(from.clip).sample(at, &mut pose);
            pose
        });
        poses.collect()
    }

    /// Samples the motion that continues after a frame, without a layer.
    pub(crate) fn base<'l>(&mut self, before: Playhead, limits: &'l MotionLimits) -> LayerBase<'l> {
        let rate = self.rate;
        let poses = self.sampler.goes_on(before, Self::frames(rate));
        let mut base = LayerBase {
            limits,
            rate,
            turns: turns(&poses[0], &poses[1]),
            poses,
            fits: Default::default(),
        };
        base.fits = LAYER_BLENDS.map(|blend| {
            let frames = self.tested(blend);
            self.kept.iter().all(|&joint| {
                let rotation = |frame: usize| base.poses[frame].rotations[joint.index()];
                base.fits(joint, (2..frames).map(rotation))
            })
        });
        base
    }

    /// Number of frames whose joints are tested for a blend of `blend` seconds.
    fn tested(&self, blend: f32) -> usize {
        (blend * self.rate).ceil() as usize + 3
    }

    /// Whether the joints and the departure of the head of a layer are plausible. The layer fades in within the blend of an index of
    /// [`LAYER_BLENDS`].
    pub(crate) fn is_plausible(
        &mut self,
        base: &LayerBase<'_>,
        wanted: &[Pose],
        blend: usize,
    ) -> bool {
        let start = 1.0 / self.rate;
        let layered = Layered {
            base,
            wanted,
            envelope: Envelope {
                start,
                full: start + LAYER_BLENDS[blend],
                release: 2.0,
                end: 3.0,
            },
        };
        let frames = self.tested(LAYER_BLENDS[blend]);
        base.fits[blend]
            && self.joints_fit(layered, FIRST)
            && self.head_goes_on(layered)
            && self.joints_fit(layered, frames)
    }

    /// Whether the joints that the layer moves are plausible in the first frames.
    fn joints_fit(&mut self, layered: Layered<'_>, frames: usize) -> bool {
        let failed = self.free.iter().position(|&joint| {
            let rotations = (2..frames).map(|frame| layered.rotation(joint, frame));
            !layered.base.fits(joint, rotations)
        });
        if let Some(failed) = failed {
            // Tested first the next time, because it often fails again.
            self.free[..=failed].rotate_right(1);
            return false;
        }
        (2..frames).for_each(|frame| self.bend_spine(layered, frame));
        let poses = &self.poses;
        self.graph.rig().spine().iter().all(|&joint| {
            let rotations = (2..frames).map(|frame| poses[frame].rotations[joint.index()]);
            layered.base.fits(joint, rotations)
        })
    }

    fn bend_spine(&mut self, layered: Layered<'_>, frame: usize) {
        let joints = self.graph.skeleton().len();
        if self.poses.len() <= frame {
            self.poses.resize_with(frame + 1, Pose::default);
        }
        let (rig, pose) = (self.graph.rig(), &mut self.poses[frame]);
        pose.rotations.resize(joints, Quat::IDENTITY);
        for &joint in rig.spine() {
            pose.rotations[joint.index()] = layered.rotation(joint, frame);
        }
        let root = JointId::ROOT.index();
        let pelvis = layered.base.poses[frame].rotations[root];
        pose.rotations[root] = pelvis;
        if let Some(wanted) = layered.wanted(frame) {
            let weight = layered.weight(frame);
            let tilt = layer_tilt(pelvis, wanted.rotations[root]) * weight;
            rig.turn_spine(tilt, pose);
        }
    }

    fn head_goes_on(&mut self, layered: Layered<'_>) -> bool {
        let limits = layered.base.limits.head_departure;
        goes_on(limits, self.rate, |frame| self.head(layered, frame))
    }

    fn head(&mut self, layered: Layered<'_>, frame: usize) -> Vec3 {
        self.bend_spine(layered, frame);
        let (skeleton, rig) = (self.graph.skeleton(), self.graph.rig());
        let mut point = Vec3::ZERO;
        for &joint in self.head_chain.iter().rev() {
            let (own, place) = layered.base.poses[frame].local(skeleton, joint);
            let rotation = match rig.part(joint).is_above_pelvis() {
                true if rig.spine().contains(&joint) => self.poses[frame].rotations[joint.index()],
                true => layered.rotation(joint, frame),
                false => own,
            };
            point = rotation * point + place;
        }
        point
    }
}

impl LayerBase<'_> {
    /// Whether a joint is plausible, given its rotations from the third frame on.
    fn fits(&self, joint: JointId, mut rotations: impl Iterator<Item = Quat>) -> bool {
        let mut steps = JointSteps {
            before: self.poses[1].rotations[joint.index()],
            turn: self.turns[joint.index()],
        };
        let limits = JointLimits::new(self.limits, joint, self.rate);
        rotations.all(|rotation| steps.fits(rotation, limits))
    }
}

impl<'a> Layered<'a> {
    fn weight(&self, frame: usize) -> f32 {
        self.envelope.weight(frame as f32 / self.base.rate)
    }

    fn wanted(&self, frame: usize) -> Option<&'a Pose> {
        self.wanted.get(frame.checked_sub(1)?)
    }

    /// Rotation of a joint that the layer moves, before the spine takes over the tilt of the pelvis.
    fn rotation(&self, joint: JointId, frame: usize) -> Quat {
        let own = self.base.poses[frame].rotations[joint.index()];
        match (self.wanted(frame), self.weight(frame)) {
            (Some(wanted), weight) if weight > 0.0 => {
                slerp(own, wanted.rotations[joint.index()], weight)
            }
            _ => own,
        }
    }
}
