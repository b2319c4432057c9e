//! How human are composed motions? Transitions, entries and warps, measured beside the clips that they are made of.
//!
//! Motions are sampled at the clips' frame rate, so that both are compared by the same differences. Angular velocity is the rotation of a
//! joint in its parent's frame between two samples; acceleration is the difference between two velocities.

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, JointId, JointTransform, Pose, forward_kinematics};
use sabaki::graph::{EdgeMotion, Motion};
use sabaki::maps::BakedGraph;
use sabaki::math::in_parallel;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};

use super::{LEGS, limb_of};
use sabaki_fixtures::throw::{ThrowSettings, throw};

/// Answers are measured for this time after the attack's end, in seconds.
pub const SEEN_ON: f32 = 0.5;

/// Measurements of many samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Quality {
    /// Angular velocities of the joints, radians per second.
    pub velocities: Vec<f32>,
    /// Angular accelerations of the joints, radians per second squared.
    pub accelerations: Vec<f32>,
    /// Horizontal accelerations of the centre of mass over a tenth of a second, metres per second squared.
    pub pushes: Vec<f32>,
    /// Speeds of the faster toe, metres per second.
    pub toes: Vec<f32>,
    /// Speeds of the slower foot over the ground, metres per second: it carries the body as long as that stands.
    pub slides: Vec<f32>,
    /// Heights of the lower toe, metres.
    pub heights: Vec<f32>,
    /// Maximum depth of two limbs in each other, in metres; negative if they are apart.
    pub overlaps: Vec<f32>,
}

impl Quality {
    /// Several measurements, one after the other.
    pub fn of_all(parts: Vec<Self>) -> Self {
        let mut all = Self::default();
        for mut part in parts {
            all.velocities.append(&mut part.velocities);
            all.accelerations.append(&mut part.accelerations);
            all.pushes.append(&mut part.pushes);
            all.toes.append(&mut part.toes);
            all.slides.append(&mut part.slides);
            all.heights.append(&mut part.heights);
            all.overlaps.append(&mut part.overlaps);
        }
        all
    }
}

/// Measures motions of a graph.
#[derive(Clone, Debug)]
pub struct QualityMeter<'a> {
    baked: &'a BakedGraph,
    /// Joints that touch the ground.
    toes: Vec<JointId>,
    /// The body's spheres of two limbs each, and the sum of their radii.
    pairs: Vec<(usize, usize, f32)>,
    /// Share of each of the body's spheres in its mass.
    masses: Vec<f32>,
    seconds: f32,
}

#[derive(Clone, Debug, Default)]
struct Sample {
    rotations: Vec<Quat>,
    toes: Vec<Vec3>,
    centre: Vec3,
    overlap: f32,
    is_composed: bool,
}

impl<'a> QualityMeter<'a> {
    /// Finds feet and limbs.
    pub fn new(baked: &'a BakedGraph) -> Self {
        let graph = baked.graph();
        let legs = graph.limbs()[..LEGS].iter().flatten();
        let spheres = &baked.body().spheres;
        let limb = |index: usize| limb_of(graph, spheres[index].joint);
        let of_limbs: Vec<(usize, usize)> = (0..spheres.len())
            .filter_map(|index| Some((index, limb(index)?)))
            .collect();
        let mut pairs = Vec::new();
        for (at, &(one, limb)) in of_limbs.iter().enumerate() {
            for &(other, _) in of_limbs[..at].iter().filter(|(_, it)| *it != limb) {
                pairs.push((one, other, spheres[one].radius + spheres[other].radius));
            }
        }
        Self {
            baked,
            toes: legs.map(|leg| leg.toe.unwrap_or(leg.foot)).collect(),
            pairs,
            masses: baked.body().masses(),
            seconds: (1.0 / graph.frame_rate()) as f32,
        }
    }

    /// All clips of the graph.
    pub fn clips(&self) -> Quality {
        let clips = self.baked.graph().clips();
        Quality::of_all(in_parallel(0, clips.len(), |index| {
            let (mut quality, mut pose) = (Quality::default(), Pose::default());
            let sample = |frame| {
                Clip::pose(&clips[index], frame, &mut pose);
                self.sample(&pose, true)
            };
            let own = self.baked.graph().own_frames(index);
            let samples: Vec<Sample> = own.map(sample).collect();
            self.add(&samples, &mut quality);
            quality
        }))
    }

    /// Poses that were played, one each `frame` seconds.
    pub fn played(&self, poses: &[Pose], frame: f32) -> Quality {
        let mut quality = Quality::default();
        let each = (self.seconds / frame).round().max(1.0) as usize;
        let poses = poses.iter().step_by(each);
        let samples: Vec<Sample> = poses.map(|pose| self.sample(pose, true)).collect();
        self.add(&samples, &mut quality);
        quality
    }

    /// Measures the composed parts of an answer's motion up to a time: transitions, an entry, a warp.
    pub fn add_answer(&self, answer: &Answer, until: f32, quality: &mut Quality) {
        let (graph, motion) = (self.baked.graph(), &answer.motion);
        let mut pose = Pose::default();
        let count = (until.min(motion.duration()) / self.seconds) as usize;
        let sample = |number: usize| {
            let seconds = number as f32 * self.seconds;
            motion.sample(graph, seconds, &mut pose);
            self.sample(&pose, self.is_composed(motion, seconds))
        };
        let samples: Vec<Sample> = (0..count).map(sample).collect();
        self.add(&samples, quality);
    }

    /// Measures the composed motions in the answers to `attacks` random throws, with the default settings.
    pub fn answers(&self, attacks: u64, seed: u64) -> Quality {
        let settings = QuerySettings::default();
        let query = Query::new(self.baked, &settings);
        Quality::of_all(in_parallel(0, attacks as usize, |index| {
            let mut quality = Quality::default();
            let thrown = throw(self.baked, &ThrowSettings::default(), seed, index as u64);
            if let Ok(throw) = thrown {
                let (mut context, mut answer) = (QueryContext::default(), Answer::default());
                query.answer(throw.request(), &mut context, &mut answer);
                self.add_answer(&answer, throw.attack.end() + SEEN_ON, &mut quality);
            }
            quality
        }))
    }

    fn is_composed(&self, motion: &Motion, seconds: f32) -> bool {
        let graph = self.baked.graph();
        let edge = graph.edge(motion.playhead(graph, seconds).edge);
        let is_warped = motion
            .warp()
            .is_some_and(|warp| warp.envelope.weight(seconds) > 0.0);
        let is_mixed = motion.is_blending(seconds) || motion.is_layered(seconds);
        edge.motion != EdgeMotion::Clip || is_mixed || is_warped
    }

    fn sample(&self, pose: &Pose, is_composed: bool) -> Sample {
        let skeleton = self.baked.graph().skeleton();
        let (mut joints, mut centres): (Vec<JointTransform>, _) = (Vec::new(), Vec::new());
        forward_kinematics(skeleton, pose, &mut joints);
        self.baked.body().centres(&joints, &mut centres);
        Sample {
            rotations: pose.rotations[1..].to_vec(),
            toes: self
                .toes
                .iter()
                .map(|toe| joints[toe.index()].translation)
                .collect(),
            centre: centres
                .iter()
                .zip(&self.masses)
                .map(|(centre, mass)| *centre * *mass)
                .sum(),
            overlap: self.overlap(&centres),
            is_composed,
        }
    }

    /// Depth of two limbs in each other, in metres; negative if they are apart.
    fn overlap(&self, centres: &[Vec3]) -> f32 {
        let depths = self.pairs.iter();
        let depths = depths.map(|&(a, b, radii)| radii - centres[a].distance(centres[b]));
        depths.fold(f32::NEG_INFINITY, f32::max)
    }

    /// Adds what is composed among samples that follow each other.
    fn add(&self, samples: &[Sample], quality: &mut Quality) {
        let turned = |from: &Sample, to: &Sample| -> Vec<Vec3> {
            let pairs = from.rotations.iter().zip(&to.rotations);
            pairs
                .map(|(a, b)| shorter(a.conjugate() * *b).to_scaled_axis() / self.seconds)
                .collect()
        };
        let turns: Vec<Vec<Vec3>> = samples
            .windows(2)
            .map(|pair| turned(&pair[0], &pair[1]))
            .collect();
        self.add_pushes(samples, quality);
        for (at, pair) in samples.windows(2).enumerate() {
            if !(pair[0].is_composed || pair[1].is_composed) {
                continue;
            }
            quality
                .velocities
                .extend(turns[at].iter().map(|turn| turn.length()));
            if let Some(next) = turns.get(at + 1) {
                let pairs = turns[at].iter().zip(next);
                quality
                    .accelerations
                    .extend(pairs.map(|(a, b)| (*b - *a).length() / self.seconds));
            }
            self.add_feet(pair, quality);
            quality.overlaps.push(pair[1].overlap);
        }
    }

    /// Adds the accelerations of the centre of mass where something is composed.
    fn add_pushes(&self, samples: &[Sample], quality: &mut Quality) {
        let window = (0.1 / self.seconds).round().max(1.0) as usize;
        for way in samples.windows(2 * window + 1) {
            if way.iter().any(|sample| sample.is_composed) {
                let [before, now, after] = [0, window, 2 * window].map(|at| way[at].centre);
                let change = (before - 2.0 * now + after).with_y(0.0);
                quality
                    .pushes
                    .push(change.length() / (window as f32 * self.seconds).powi(2));
            }
        }
    }

    fn add_feet(&self, pair: &[Sample], quality: &mut Quality) {
        let ways: Vec<Vec3> = pair[0]
            .toes
            .iter()
            .zip(&pair[1].toes)
            .map(|(a, b)| (*b - *a) / self.seconds)
            .collect();
        let fold =
            |values: &mut dyn Iterator<Item = f32>, of: fn(f32, f32) -> f32| values.reduce(of);
        quality
            .toes
            .extend(fold(&mut ways.iter().map(|way| way.length()), f32::max));
        quality.slides.extend(fold(
            &mut ways.iter().map(|way| way.with_y(0.0).length()),
            f32::min,
        ));
        quality
            .heights
            .extend(fold(&mut pair[1].toes.iter().map(|toe| toe.y), f32::min));
    }
}

/// The same rotation as an angle of at most half a turn.
fn shorter(rotation: Quat) -> Quat {
    match rotation.w < 0.0 {
        true => -rotation,
        false => rotation,
    }
}
