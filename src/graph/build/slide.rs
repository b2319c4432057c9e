//! Measures how far planted feet slide.
//!
//! The measure is that of Zhang, Starke, Komura & Saito, "Mode-Adaptive Neural Networks for
//! Quadruped Motion Control" (2018), section 7: the distance over the ground, weighted by the
//! foot's proximity to the ground. Differs: only planted feet count, by labels that do not depend
//! on the measured pose. The slower of a foot's two points counts, so that a foot that pivots or
//! rolls on its ball does not slide. Heights are relative to those of the foot in the clips.

use crate::anim::{Chain, JointId, Leg, Pose};
use crate::graph::ClipId;
use crate::graph::motion_graph::{Edge, EdgeId, EdgeMotion, MotionGraph};
use crate::graph::play::sample::Sides;
use crate::graph::search::transition::blend_weight;
use crate::math::in_parallel;
use glam::{Quat, Vec3};
use serde::Serialize;

/// Height above the clips' foot at which a foot does not count as sliding, in metres per metre of
/// leg length. Below it, the weight falls linearly. It is 2.5 cm for a person (Zhang et al.).
const LIFTED: f32 = 0.03;

/// Slide of planted feet in a graph's transitions, each played once, and in its clips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FootSlide {
    /// Number of measured transitions, evenly sampled from all.
    pub transitions: usize,
    /// Duration for which feet are planted in the transitions, summed over feet, in seconds. A foot
    /// counts as planted if the clips with more than half of the blend weight plant it.
    pub planted_seconds: f64,
    /// Slide in transitions without foot correction, in millimetres per planted second.
    pub blended: f64,
    /// Slide in transitions as they are played, in millimetres per planted second.
    pub kept: f64,
    /// Slide in the clips, in millimetres per planted second.
    pub clips: f64,
    /// Number of steps in place. A step lifts a foot from its position in the source to its
    /// position in the target.
    pub steps: usize,
    /// Distance between the places where source and target plant a foot that stands in both at the middle of a transition, in metres:
    /// the median, the 90th percentile and the largest. The foot goes from one to the other in a step in place.
    pub displacement: [f32; 3],
}

impl MotionGraph {
    /// Measures the slide of planted feet over at most `most` transitions.
    pub fn foot_slide(&self, most: usize) -> FootSlide {
        let is_blend = |&id: &EdgeId| self.edge(id).motion != EdgeMotion::Clip;
        let every = self.transitions().div_ceil(most.max(1)).max(1);
        let (mut blended, mut kept) = (Sum::default(), Sum::default());
        let (mut transitions, mut steps, mut ways) = (0, 0, Vec::new());
        for id in self.edge_ids().filter(is_blend).step_by(every) {
            transitions += 1;
            self.slide_of_transition(id, Self::sample_blend, &mut blended);
            self.slide_of_transition(id, Self::sample_edge, &mut kept);
            let legs = 0..self.feet.legs.len();
            let is_step = |leg: &usize| {
                let blend = self.feet.blend(id, *leg);
                blend.is_some_and(|blend| blend.lift > 0.0)
            };
            steps += legs.clone().filter(is_step).count();
            ways.extend(legs.filter_map(|leg| self.displacement(id, leg)));
        }
        ways.sort_by(f32::total_cmp);
        let at = |share: f64| {
            let last = ways.len().saturating_sub(1);
            ways.get((share * last as f64) as usize).copied()
        };
        FootSlide {
            transitions,
            planted_seconds: kept.seconds,
            blended: blended.rate(),
            kept: kept.rate(),
            clips: self.slide_of_clips().rate(),
            steps,
            displacement: [0.5, 0.9, 1.0].map(|share| at(share).unwrap_or_default()),
        }
    }

    /// Distance between the places where both clips plant a foot at the middle of a transition.
    fn displacement(&self, id: EdgeId, leg: usize) -> Option<f32> {
        let edge = self.edge(id);
        let (from, to) = (self.node(edge.from), self.node(edge.to));
        let middle = edge.frames / 2;
        let stands = self.feet.stands(from.clip, leg, from.frame + middle)
            && self
                .feet
                .stands(to.clip, leg, to.frame - edge.frames + middle);
        let sides = Sides::new(self, edge, middle as f32).filter(|_| stands)?;
        Some(sides.apart(self.feet.legs[leg].toe_or_foot()))
    }

    fn slide_of_transition(
        &self,
        id: EdgeId,
        sample: impl Fn(&Self, EdgeId, f32, &mut Pose),
        sum: &mut Sum,
    ) {
        let edge = self.edge(id);
        let mut pose = Pose::default();
        let mut before: Vec<Option<Contact>> = vec![None; self.feet.legs.len()];
        for frame in 0..=edge.frames {
            sample(self, id, frame as f32, &mut pose);
            let sides = Sides::new(self, edge, frame as f32);
            let chain = Chain::of(&self.skeleton, &pose);
            for (index, leg) in self.feet.legs.iter().enumerate() {
                let now = sides
                    .as_ref()
                    .filter(|_| self.stands_in_blend(edge, index, frame))
                    .map(|sides| Contact::new(&chain, leg, |point| sides.height(point)));
                if let (Some(before), Some(now)) = (before[index], now) {
                    let lifted = LIFTED * leg.length(&self.skeleton);
                    sum.add(before.slide(&now, lifted), self.frame_rate);
                }
                before[index] = now;
            }
        }
    }

    /// Whether the clips that plant the foot have more than half of the blend weight.
    fn stands_in_blend(&self, edge: &Edge, leg: usize, frame: u32) -> bool {
        let (from, to) = (self.node(edge.from), self.node(edge.to));
        let source = self.feet.stands(from.clip, leg, from.frame + frame);
        let target = self
            .feet
            .stands(to.clip, leg, to.frame - edge.frames + frame);
        let weight = blend_weight(frame as f32 / edge.frames as f32);
        let share = |stands: bool, weight: f32| if stands { weight } else { 0.0 };
        share(source, weight) + share(target, 1.0 - weight) > 0.5
    }

    fn slide_of_clips(&self) -> Sum {
        let legs = self.feet.legs.len();
        let of_clips = in_parallel(0, self.clips.len(), |clip| {
            let (clip, id) = (&self.clips[clip], ClipId(clip as u32));
            let (mut sum, mut pose) = (Sum::default(), Pose::default());
            let mut before: Vec<Option<Contact>> = vec![None; legs];
            for frame in 0..clip.frames() {
                clip.pose(frame, &mut pose);
                let chain = Chain::of(&self.skeleton, &pose);
                for (index, leg) in self.feet.legs.iter().enumerate() {
                    let stands = self.feet.stands(id, index, frame as u32);
                    let now = stands.then(|| Contact::new(&chain, leg, |_| f32::INFINITY));
                    if let (Some(before), Some(now)) = (before[index], now) {
                        sum.add(before.slide(&now, 1.0), self.frame_rate);
                    }
                    before[index] = now;
                }
            }
            sum
        });
        of_clips.into_iter().fold(Sum::default(), Sum::plus)
    }
}

/// The two points of a foot, each with its height in the clips.
#[derive(Clone, Copy)]
struct Contact {
    points: [(Vec3, f32); 2],
}

impl Contact {
    fn new<L: Fn(JointId) -> (Quat, Vec3)>(
        chain: &Chain<'_, L>,
        leg: &Leg,
        height: impl Fn(JointId) -> f32,
    ) -> Self {
        let point = |joint| (chain.global(joint).translation, height(joint));
        Self {
            points: [leg.foot, leg.toe_or_foot()].map(point),
        }
    }

    /// Distance that the slower point moves over the ground, weighted by its proximity to the
    /// ground, in metres.
    fn slide(&self, next: &Self, lifted: f32) -> f32 {
        let distance = |((a, a_height), (b, b_height)): (&(Vec3, f32), &(Vec3, f32))| {
            let above = 0.5 * ((a.y - a_height) + (b.y - b_height)).max(0.0);
            (b.x - a.x).hypot(b.z - a.z) * (1.0 - above / lifted).max(0.0)
        };
        let ways = self.points.iter().zip(&next.points).map(distance);
        ways.fold(f32::INFINITY, f32::min)
    }
}

#[derive(Clone, Copy, Default)]
struct Sum {
    metres: f64,
    seconds: f64,
}

impl Sum {
    fn plus(self, other: Self) -> Self {
        Self {
            metres: self.metres + other.metres,
            seconds: self.seconds + other.seconds,
        }
    }

    fn add(&mut self, metres: f32, frame_rate: f64) {
        self.metres += f64::from(metres);
        self.seconds += frame_rate.recip();
    }

    /// Slide in millimetres per second.
    fn rate(&self) -> f64 {
        if self.seconds > 0.0 {
            1e3 * self.metres / self.seconds
        } else {
            0.0
        }
    }
}
