//! Finds layered evasions: moments from which the upper body can play a part of an evasion while the legs continue.

use glam::{Quat, Vec3};

use super::finder::{Departed, Finder, Scratch};
use super::layer_test::{LayerBase, LayerTest};
use super::limits::{MotionLimits, head};
use super::search_basis::SearchBasis;
use super::spread::spread;
use super::targets::ClipFrame;
use super::{BLENDS, EntryTarget, EntryWay, KnownEntry, RATES};
use crate::anim::{JointId, Pose, forward_kinematics};
use crate::graph::{MotionGraph, Node, heading};
use crate::maps::regions::Evasion;
use crate::math::sort_rarely;

/// Minimum distance by which an evasion must move the head relative to the pelvis to be layered, in metres.
const LEANS: f32 = 0.12;

/// The evasions that can be layered, and the limits of motion.
pub(super) struct LayerSource<'a> {
    targets: &'a [EntryTarget],
    /// Poses of the clip from each target on, for each playback rate. Empty for evasions that cannot be layered.
    wanted: Vec<[Vec<Pose>; RATES.len()]>,
    /// For each evasion, whether its upper body leans or ducks relative to the pelvis.
    layerable: Vec<bool>,
    limits: MotionLimits,
}

impl<'a> LayerSource<'a> {
    pub(super) fn new(
        search: SearchBasis<'_>,
        evasions: &[Evasion],
        targets: &'a [EntryTarget],
    ) -> Self {
        let graph = search.graph;
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
        let mut limits = search.limits.clone();
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
            let from = ClipFrame::of(graph, target.edge, target.edge_frame).node();
            RATES.map(|rate| match layerable[usize::from(target.evasion)] {
                true => LayerTest::wanted(graph, from, rate),
                false => Vec::new(),
            })
        };
        Self {
            targets,
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
        let blend = (0..BLENDS.len()).find(|&blend| plausible(blend, 0));
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
    pub(super) fn layers(
        &self,
        from: &Departed,
        source: &LayerSource<'_>,
        scratch: &mut Scratch<'_>,
    ) -> Vec<KnownEntry> {
        let mut found = Vec::new();
        let test = &mut scratch.layers;
        let mut base = None;
        let own = from.at.before;
        for target in spread(source.targets.len()) {
            if found.len() == MOST {
                break;
            }
            let is_own = self.targets[target].clip == own.clip;
            let evasion = usize::from(source.targets[target].evasion);
            if is_own || !source.layerable[evasion] {
                continue;
            }
            let base = base.get_or_insert_with(|| test.base(own.playhead(), &source.limits));
            let way = source.tested(target, base, test);
            found.extend(way.map(|way| KnownEntry::new(target as u16, way)));
        }
        sort_rarely(&mut found, |a, b| a.target.cmp(&b.target));
        found
    }
}
