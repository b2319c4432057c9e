//! How near does an attack come? The exact answer, on which the final word rests.
//!
//! Source: Masaoka & Oshita, section 5.4, V_d: the smallest distance between any sphere of the body
//! and any of the attack at equal times. Differs: not at sampled times but between them as well.
//! The body's spheres are taken at [`SAMPLE_RATE`] and go in straight lines in between, the
//! attack's go in straight lines between their keys; the smallest distance of two such spheres is
//! found in closed form.

use glam::Vec3;

use super::Attack;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::Motion;
use crate::region::BakedGraph;

/// The body's spheres are taken this many times a second. In between a rotating limb leaves the
/// straight line by little: at 15 rad/s and 0.7 m from its joint, by 0.7 (1 - cos(15 / 240)) m =
/// 1.4 mm; it would be 0.34 mm at 240 a second.
pub const SAMPLE_RATE: f32 = 120.0;

/// How much of an attack is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All of it: the smallest distance, however deep.
    Whole,
    /// Up to the first hit that is found: whether there is one, not how deep it goes.
    UntilHit,
}

/// The smallest distance over an attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Between surfaces, metres; negative where they meet.
    pub metres: f32,
    /// When, seconds since the query.
    pub time: f32,
    /// Which of the body's spheres.
    pub body_sphere: usize,
}

/// The smallest distance between the body on `motion` and `attack`, both in one world; both clocks
/// start with the motion.
///
/// `motion` must last as long as the attack.
#[must_use]
pub fn clearance(
    baked: &BakedGraph,
    motion: &Motion,
    attack: &Attack,
    extent: Extent,
) -> Clearance {
    let mut track = BodyTrack::new(baked, motion);
    let mut best = Clearance {
        metres: f32::INFINITY,
        time: attack.start(),
        body_sphere: 0,
    };
    for sphere in attack.spheres() {
        let keys = sphere.keys();
        if let [only] = keys {
            let (tick, share) = BodyTrack::tick(only.t);
            let span = Span {
                tick,
                from: share,
                to: share,
            };
            track.meet(span, [only.center; 2], [only.radius; 2], &mut best);
        }
        for pair in keys.windows(2) {
            let (first, last) = (BodyTrack::tick(pair[0].t).0, BodyTrack::tick(pair[1].t).0);
            for tick in first..=last {
                if extent == Extent::UntilHit && best.metres < 0.0 {
                    return best;
                }
                let start = (tick as f32 / SAMPLE_RATE).max(pair[0].t);
                let end = ((tick + 1) as f32 / SAMPLE_RATE).min(pair[1].t);
                if end < start {
                    continue;
                }
                let (a, b) = (sphere.at(start), sphere.at(end));
                let share = |t: f32| (t * SAMPLE_RATE - tick as f32).clamp(0.0, 1.0);
                let span = Span {
                    tick,
                    from: share(start),
                    to: share(end),
                };
                track.meet(span, [a.center, b.center], [a.radius, b.radius], &mut best);
            }
        }
    }
    best
}

/// A part of the time from one sample of the body to the next.
#[derive(Clone, Copy)]
struct Span {
    tick: usize,
    /// Shares of the tick.
    from: f32,
    to: f32,
}

/// The body's sphere centres at the samples, made when they are first asked for.
struct BodyTrack<'a> {
    baked: &'a BakedGraph,
    motion: &'a Motion,
    roots: Vec<Option<Vec3>>,
    centres: Vec<Vec<Vec3>>,
    pose: Pose,
    joints: Vec<JointTransform>,
}

impl<'a> BodyTrack<'a> {
    fn new(baked: &'a BakedGraph, motion: &'a Motion) -> Self {
        Self {
            baked,
            motion,
            roots: Vec::new(),
            centres: Vec::new(),
            pose: Pose::default(),
            joints: Vec::new(),
        }
    }

    /// The sample at or before a time, and the share of the way to the next one.
    fn tick(t: f32) -> (usize, f32) {
        let tick = (t * SAMPLE_RATE).floor();
        (tick as usize, t * SAMPLE_RATE - tick)
    }

    fn root(&mut self, tick: usize) -> Vec3 {
        if self.roots.len() <= tick {
            self.roots.resize(tick + 1, None);
        }
        let motion = self.motion;
        *self.roots[tick]
            .get_or_insert_with(|| motion.root(self.baked.graph(), tick as f32 / SAMPLE_RATE))
    }

    fn make(&mut self, tick: usize) {
        if self.centres.len() <= tick {
            self.centres.resize(tick + 1, Vec::new());
        }
        if self.centres[tick].is_empty() {
            let graph = self.baked.graph();
            self.motion
                .sample(graph, tick as f32 / SAMPLE_RATE, &mut self.pose);
            forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
            self.baked
                .body()
                .centres(&self.joints, &mut self.centres[tick]);
        }
    }

    /// Lowers `best` where a sphere that goes from `centres[0]` to `centres[1]` within `span` comes
    /// nearer to the body.
    fn meet(&mut self, span: Span, centres: [Vec3; 2], radii: [f32; 2], best: &mut Clearance) {
        // The whole body lies within its reach of the root: often that is proof enough.
        let roots = [self.root(span.tick), self.root(span.tick + 1)];
        let apart = |ends: [Vec3; 2]| {
            [
                ends[0].lerp(ends[1], span.from) - centres[0],
                ends[0].lerp(ends[1], span.to) - centres[1],
            ]
        };
        let reach = self.baked.reach();
        if closest(apart(roots), radii.map(|radius| radius + reach)).1 >= best.metres {
            return;
        }
        self.make(span.tick);
        self.make(span.tick + 1);
        let ends = self.centres[span.tick]
            .iter()
            .zip(&self.centres[span.tick + 1]);
        let largest = radii[0].max(radii[1]);
        for (index, (body, (&from, &to))) in self.baked.body().spheres.iter().zip(ends).enumerate()
        {
            let apart = apart([from, to]);
            let limit = (best.metres + largest + body.radius).max(0.0);
            if stays_beyond(apart, limit) {
                continue;
            }
            let (share, metres) = closest(apart, radii.map(|radius| radius + body.radius));
            if metres < best.metres {
                let time =
                    (span.tick as f32 + span.from + (span.to - span.from) * share) / SAMPLE_RATE;
                *best = Clearance {
                    metres,
                    time,
                    body_sphere: index,
                };
            }
        }
    }
}

/// Whether two points surely stay at least `limit` apart on their straight ways: cheap, and true of
/// most.
///
/// The distance is never below |a| - |b - a|, and (x + y)² is never above 2x² + 2y².
fn stays_beyond(apart: [Vec3; 2], limit: f32) -> bool {
    apart[0].length_squared() >= 2.0 * (limit * limit + (apart[1] - apart[0]).length_squared())
}

/// The smallest distance of two spheres that both go straight: `apart` is the vector from one
/// centre to the other at the start and at the end, `radii` the sum of their radii then. Returns
/// when (0 at the start, 1 at the end) and the distance of the surfaces.
///
/// With d(t) = |a + t v| - (r + t k), a convex function, the smallest value lies at an end or where
/// d' = 0: `(v·a + t v·v)² = k² |a + t v|²`.
#[must_use]
pub fn closest(apart: [Vec3; 2], radii: [f32; 2]) -> (f32, f32) {
    let (start, motion) = (apart[0], apart[1] - apart[0]);
    let growth = radii[1] - radii[0];
    let distance = |t: f32| (start + motion * t).length() - (radii[0] + growth * t);
    let (vv, av, aa) = (
        motion.length_squared(),
        start.dot(motion),
        start.length_squared(),
    );
    let mut best = if distance(1.0) < distance(0.0) {
        (1.0, distance(1.0))
    } else {
        (0.0, distance(0.0))
    };
    if vv > growth * growth {
        // Along the line, the point nearest to the other centre lies at -av/vv; the growing radius
        // shifts the minimum by this much.
        let gap = (aa - av * av / vv).max(0.0);
        let shift = growth * (gap / (vv * (vv - growth * growth))).sqrt();
        let t = (shift - av / vv).clamp(0.0, 1.0);
        if distance(t) < best.1 {
            best = (t, distance(t));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-2.0f32..2.0).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn closest_is_no_further_than_any_sampled_moment(a in vector(), b in vector(), r in 0.01f32..0.5, s in 0.01f32..0.5) {
            let (t, metres) = closest([a, b], [r, s]);
            let at = |t: f32| a.lerp(b, t).length() - (r + (s - r) * t);
            prop_assert!((at(t) - metres).abs() < 1e-4);
            let sampled = (0..=2000).map(|i| at(i as f32 / 2000.0)).fold(f32::INFINITY, f32::min);
            prop_assert!(metres <= sampled + 1e-5, "{} > {}", metres, sampled);
            prop_assert!(metres >= sampled - 5e-3);
        }
    }
}
