use crate::math::Sphere;

use crate::anim::{JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::Playhead;
use crate::maps::{BakedGraph, BodySphere};

/// The spheres of trunk and head. Two fighters keep these apart; limbs may touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Trunk {
    spheres: Vec<BodySphere>,
    /// Targets of attacks: trunk, head, and the first bone of each limb.
    pub(super) targets: Vec<BodySphere>,
}

impl Trunk {
    /// Finds the spheres of joints without a mirrored joint, or those of the root if joint names do not tell left from right.
    #[must_use]
    pub fn new(baked: &BakedGraph) -> Self {
        let skeleton = baked.graph().skeleton();
        let middle = |sphere: &&BodySphere| skeleton.mirror(sphere.joint).is_none();
        let has_sides = skeleton.ids().any(|id| skeleton.mirror(id).is_some());
        let first = |sphere: &&BodySphere| {
            let sided = |id: &JointId| skeleton.mirror(*id).is_some();
            skeleton.ancestry(sphere.joint).take_while(sided).count() <= 1
        };
        let root = |sphere: &&BodySphere| sphere.joint == JointId::ROOT;
        let all = baked.body().spheres.iter();
        let spheres = match has_sides {
            true => all.filter(middle).copied().collect(),
            false => all.filter(root).copied().collect(),
        };
        let targets = baked.body().spheres.iter().filter(first);
        Self {
            spheres,
            targets: targets.copied().collect(),
        }
    }

    /// The spheres of trunk and head.
    #[must_use]
    pub fn spheres(&self) -> &[BodySphere] {
        &self.spheres
    }

    /// Writes the centres and radii at a position of the graph, in the world.
    pub fn at(&self, baked: &BakedGraph, playhead: Playhead, out: &mut Vec<Sphere>) {
        let (mut pose, mut joints): (Pose, Vec<JointTransform>) = Default::default();
        playhead.pose(baked.graph(), &mut pose);
        forward_kinematics(baked.graph().skeleton(), &pose, &mut joints);
        out.clear();
        let spheres = self.spheres.iter();
        out.extend(spheres.map(|sphere| Sphere::new(sphere.centre(&joints), sphere.radius)));
    }

    /// Smallest distance between the surfaces of two bodies' trunks, in metres. It is negative if they overlap.
    #[must_use]
    pub fn distance(&self, baked: &BakedGraph, playheads: [Playhead; 2]) -> f32 {
        let [mut a, mut b] = [Vec::new(), Vec::new()];
        self.at(baked, playheads[0], &mut a);
        self.at(baked, playheads[1], &mut b);
        let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
        pairs
            .map(|(a, b)| a.centre.distance(b.centre) - a.radius - b.radius)
            .fold(f32::INFINITY, f32::min)
    }
}
