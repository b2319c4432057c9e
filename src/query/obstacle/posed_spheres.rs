//! The body's spheres at the samples of a motion, and how far they reach from the axis of its column.
//!
//! Centres come in rows, of which extents are measured many at a time. An extent is rounded up a little, so that it is a bound of what a
//! sphere's exact centre, which its joint gives, shows.

use std::ops::Range;

use glam::Vec2;
use rustc_hash::FxHashMap;

use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::MotionMoment;
use crate::maps::{BakedGraph, BodyTrack};
use crate::math::Isa;
use crate::query::clearance::PoseKey;

/// Number of spheres of a block.
const LANES: usize = BodyTrack::LANES;

/// The body in the poses that several motions have in common.
#[derive(Clone, Debug, Default)]
pub(super) struct PosedSpheres {
    pose: Pose,
    /// The pose of a moment that no other motion has.
    joints: Vec<JointTransform>,
    rows: Vec<f32>,
    /// Numbers of the poses.
    known: FxHashMap<PoseKey, usize>,
    /// Joints and rows of all poses.
    known_joints: Vec<JointTransform>,
    known_rows: Vec<f32>,
}

/// A posed body.
#[derive(Clone, Copy, Debug)]
pub(super) struct PosedBody<'a> {
    /// Transforms of the joints to the world.
    pub joints: &'a [JointTransform],
    /// Centres of the spheres: a row of each axis, padded.
    rows: &'a [f32],
}

/// How far each sphere of a body reaches from an axis, in metres.
#[derive(Clone, Debug, Default)]
pub(super) struct Extents {
    /// Distance of each sphere's far side from the axis, in metres, padded to whole blocks.
    pub all: Vec<f32>,
    /// The largest of each block.
    pub widest: Vec<f32>,
}

impl PosedSpheres {
    /// Number of poses that are kept.
    const MOST: usize = 1024;

    /// The body at a moment.
    pub(super) fn at(&mut self, baked: &BakedGraph, moment: MotionMoment<'_>) -> PosedBody<'_> {
        let MotionMoment { motion, seconds } = moment;
        if motion.is_composed(seconds) {
            self.pose(baked, moment);
            return PosedBody {
                joints: &self.joints,
                rows: &self.rows,
            };
        }
        let key = PoseKey::of(motion.playhead(baked.graph(), seconds));
        let number = match self.known.get(&key) {
            Some(&number) => number,
            None => {
                if self.known.len() == Self::MOST {
                    self.forget();
                }
                self.pose(baked, moment);
                let number = self.known.len();
                self.known_joints.extend_from_slice(&self.joints);
                self.known_rows.extend_from_slice(&self.rows);
                self.known.insert(key, number);
                number
            }
        };
        let joints = baked.graph().skeleton().len();
        let rows = 3 * baked.body_rows().radii().len();
        PosedBody {
            joints: &self.known_joints[number * joints..][..joints],
            rows: &self.known_rows[number * rows..][..rows],
        }
    }

    pub(super) fn forget(&mut self) {
        self.known.clear();
        self.known_joints.clear();
        self.known_rows.clear();
    }

    fn pose(&mut self, baked: &BakedGraph, moment: MotionMoment<'_>) {
        let graph = baked.graph();
        moment.motion.sample(graph, moment.seconds, &mut self.pose);
        forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
        self.rows.clear();
        baked.body_rows().push(&self.joints, &mut self.rows);
    }
}

impl Extents {
    /// Measures from a vertical axis.
    pub(super) fn measure(&mut self, baked: &BakedGraph, body: &PosedBody<'_>, axis: Vec2) {
        let radii = baked.body_rows().radii();
        self.all.resize(radii.len(), 0.0);
        self.widest.resize(radii.len() / LANES, 0.0);
        let [x, z] = [0, 2].map(|axis| &body.rows[axis * radii.len()..][..radii.len()]);
        Isa::best().run(
            #[inline(always)]
            || self.measure_rows([x, z, radii], axis),
        );
    }

    /// The spheres of a block, without the padding.
    pub(super) fn of_block(&self, block: usize, spheres: usize) -> Range<usize> {
        block * LANES..((block + 1) * LANES).min(spheres)
    }

    #[inline(always)]
    fn measure_rows(&mut self, rows: [&[f32]; 3], axis: Vec2) {
        // Rounding of centres and of their distances, in metres, and as a share of the axis's coordinates.
        const ROUNDING: (f32, f32) = (1e-4, 1e-6);
        let slack = ROUNDING.0 + ROUNDING.1 * axis.abs().max_element();
        let [x, z, radii] = rows.map(|row| row.as_chunks::<LANES>().0);
        let all = self.all.as_chunks_mut::<LANES>().0;
        for (block, (extents, widest)) in all.iter_mut().zip(&mut self.widest).enumerate() {
            for lane in 0..LANES {
                let (x, z) = (x[block][lane] - axis.x, z[block][lane] - axis.y);
                extents[lane] = (x * x + z * z).sqrt() + radii[block][lane] + slack;
            }
            *widest = extents.iter().copied().fold(0.0, f32::max);
        }
    }
}
