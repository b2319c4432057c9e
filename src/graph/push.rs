//! How hard a body pushes off the floor: the horizontal acceleration of its centre of mass.
//!
//! Not part of the papers. Joint by joint a blended motion may stay within the clips and yet throw the whole body further than legs can.
//! The acceleration is a second difference over [`PUSH_WINDOW`], in which the noise of captures is small.

use glam::{Vec2, Vec3, Vec3Swizzles};

use crate::graph::search::transition::{Transition, blend_weight};
use crate::graph::search::windows::PointCloud;
use crate::math::Rigid2;

/// Time over which accelerations are measured, in seconds.
pub(crate) const PUSH_WINDOW: f32 = 0.1;

/// 0.9 g, the friction of shoes on a dry floor.
const FRICTION: f32 = 8.8;

/// Horizontal acceleration of a point, from its places at three times [`PUSH_WINDOW`] apart, in metres per second squared.
pub(crate) fn acceleration([before, now, after]: [Vec2; 3]) -> f32 {
    (before - 2.0 * now + after).length() / (PUSH_WINDOW * PUSH_WINDOW)
}

/// Accelerations of a point, from its places at all frames.
pub(crate) fn accelerations(places: &[Vec2], frame_rate: f64) -> impl Iterator<Item = f32> {
    let window = window(frame_rate);
    let ways = places.windows(2 * window + 1);
    ways.map(move |way| acceleration([way[0], way[window], way[2 * window]]))
}

/// Accelerations in a clip. One that friction does not allow is the median of three frames: a frame that a capture got wrong says nothing of
/// the body.
pub(crate) fn pushes(places: &[Vec2], frame_rate: f64) -> Vec<f32> {
    let all: Vec<f32> = accelerations(places, frame_rate).collect();
    (0..all.len()).map(|frame| lasting(&all, frame)).collect()
}

fn lasting(all: &[f32], frame: usize) -> f32 {
    if all[frame] <= FRICTION {
        return all[frame];
    }
    let mut near = all[frame.saturating_sub(1)..(frame + 2).min(all.len())].to_vec();
    near.sort_by(f32::total_cmp);
    near[(near.len() - 1) / 2]
}

/// [`PUSH_WINDOW`] in frames.
pub(crate) fn window(frame_rate: f64) -> usize {
    ((f64::from(PUSH_WINDOW) * frame_rate).round() as usize).max(1)
}

/// The value that a share of some values do not exceed; `None` if there are none. It reorders the values.
pub(crate) fn quantile(values: &mut [f32], share: f32) -> Option<f32> {
    let last = values.len().checked_sub(1)?;
    let at = ((last as f32 * share).round() as usize).min(last);
    Some(*values.select_nth_unstable_by(at, f32::total_cmp).1)
}

/// The limit of an acceleration that the clips reach, with room for more: at least what a step needs, which a graph that only stands does
/// not have, and at most what friction allows, or what the clips themselves do.
pub(crate) fn humanly_possible(found: f32, room: f32) -> f32 {
    const STEP: f32 = 2.0;
    (room * found).min(FRICTION).max(found).max(STEP)
}

/// The largest acceleration that a composed motion may ask of the body: by a third more than 99.9% of the accelerations in the clips, within
/// what friction allows or the clips do.
pub(crate) fn push_limit(mut of_clips: Vec<f32>) -> f32 {
    /// The share of the frames that the limit exceeds, and the factor by which it does.
    const SHARE: f32 = 0.999;
    const ROOM: f32 = 1.3;
    humanly_possible(quantile(&mut of_clips, SHARE).unwrap_or(0.0), ROOM)
}

/// Finds transitions in which the body pushes harder than it may: those from a run into a stance, for example.
#[derive(Clone, Debug)]
pub(crate) struct PushTest {
    /// The middle of the body, for each frame of each clip.
    middles: Vec<Vec<Vec3>>,
    frame_rate: f64,
    limit: f32,
}

impl PushTest {
    pub(crate) fn new(clouds: &[PointCloud], frame_rate: f64) -> Self {
        let middles: Vec<Vec<Vec3>> = clouds.iter().map(PointCloud::middles).collect();
        let of_clips = middles.iter().flat_map(|middles| {
            let places: Vec<Vec2> = middles.iter().map(|middle| middle.xz()).collect();
            pushes(&places, frame_rate)
        });
        Self {
            limit: push_limit(of_clips.collect()),
            middles,
            frame_rate,
        }
    }

    /// Whether a transition is too hard. `align` leads from the space of its target to that of its source.
    pub(crate) fn is_too_hard(&self, transition: &Transition, align: Rigid2) -> bool {
        self.share(transition, align) > 1.0
    }

    /// How hard the body pushes in a transition, as a share of the limit.
    pub(crate) fn share(&self, transition: &Transition, align: Rigid2) -> f32 {
        let (source_frame, target_frame) = (transition.source_frame, transition.target_frame);
        let frames = transition.frames;
        let source = &self.middles[transition.source_clip];
        let target = &self.middles[transition.target_clip];
        let beside = 2 * window(self.frame_rate);
        let before = &source[(source_frame + 1).saturating_sub(beside)..=source_frame];
        let blended = (1..=frames).map(|frame| {
            let entered = align.point(target[target_frame - frames + frame]);
            let weight = blend_weight(frame as f32 / frames as f32);
            entered.lerp(source[source_frame + frame], weight)
        });
        let after = target[target_frame + 1..].iter().take(beside);
        let after = after.map(|&middle| align.point(middle));
        let way = before.iter().copied().chain(blended).chain(after);
        let way: Vec<Vec2> = way.map(|middle| middle.xz()).collect();
        accelerations(&way, self.frame_rate).fold(0.0, f32::max) / self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_sorted_values() {
        let mut values: Vec<f32> = (0..=1000).map(|value| (value * 8 % 1001) as f32).collect();
        assert_eq!(quantile(&mut values, 0.999), Some(999.0));
        assert_eq!(quantile(&mut values, 0.5), Some(500.0));
        assert_eq!(quantile(&mut values, 1.0), Some(1000.0));
        assert_eq!(quantile(&mut [], 0.99), None);
    }

    #[test]
    fn a_wrong_frame_raises_no_limit() {
        let all = [1.0, 1.0, 80.0, 1.0, 12.0, 14.0, 12.0, 10.0, 8.0];
        let kept = [1.0, 1.0, 1.0, 1.0, 12.0, 12.0, 12.0, 10.0, 8.0];
        let found: Vec<f32> = (0..all.len()).map(|frame| lasting(&all, frame)).collect();
        assert_eq!(found, kept);
    }

    #[test]
    fn a_point_that_gains_speed_steadily_has_that_acceleration() {
        let place = |t: f32| Vec2::new(1.0 + 2.0 * t + 0.5 * 3.0 * t * t, 0.5 * 4.0 * t * t);
        let found = acceleration([0.0, 1.0, 2.0].map(|windows| place(windows * PUSH_WINDOW)));
        assert!((found - 5.0).abs() < 1e-3, "{found}");
    }
}
