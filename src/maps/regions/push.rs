//! How hard a body pushes off the floor: the horizontal acceleration of its centre of mass.
//!
//! Not part of the papers. Joint by joint a blended motion may stay within the clips and yet throw the whole body further than legs can.
//! The acceleration is a second difference over [`PUSH_WINDOW`], in which the noise of captures is small.

use glam::{Vec2, Vec3Swizzles};

use super::body::Body;
use super::body_rows::BodyRows;
use crate::anim::{Pose, forward_kinematics};
use crate::graph::MotionGraph;
use crate::math::in_parallel;

/// Time over which accelerations are measured, in seconds.
pub(crate) const PUSH_WINDOW: f32 = 0.1;

/// Horizontal acceleration of a point, from its places at three times [`PUSH_WINDOW`] apart, in metres per second squared.
pub(crate) fn acceleration([before, now, after]: [Vec2; 3]) -> f32 {
    (before - 2.0 * now + after).length() / (PUSH_WINDOW * PUSH_WINDOW)
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
    /// 0.9 g, the friction of shoes on a dry floor.
    const FRICTION: f32 = 8.8;
    (room * found).min(FRICTION).max(found).max(STEP)
}

/// The largest acceleration that a motion of a graph may ask of the body, in metres per second squared: by a third more than 99.9% of
/// the clips' frames, within what friction allows or the clips do.
pub(crate) fn push_limit(graph: &MotionGraph, body: &Body, threads: usize) -> f32 {
    /// The share of the frames that the limit exceeds, and the factor by which it does.
    const SHARE: f32 = 0.999;
    const ROOM: f32 = 1.3;
    let rows = BodyRows::new(body);
    let window = (PUSH_WINDOW * graph.frame_rate() as f32).round().max(1.0) as usize;
    let of_clips = in_parallel(threads, graph.clips().len(), |index| {
        let clip = &graph.clips()[index];
        let (mut pose, mut joints, mut axes) = (Pose::default(), Vec::new(), Vec::new());
        let centre = |frame| {
            clip.pose(frame, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            axes.clear();
            rows.push(&joints, &mut axes);
            rows.centre_of_mass(&axes).xz()
        };
        let centres: Vec<Vec2> = graph.own_frames(index).map(centre).collect();
        let windows = centres.windows(2 * window + 1);
        let accelerations = windows.map(|way| acceleration([way[0], way[window], way[2 * window]]));
        accelerations.collect::<Vec<f32>>()
    });
    let found = quantile(&mut of_clips.concat(), SHARE).unwrap_or(0.0);
    humanly_possible(found, ROOM)
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
    fn a_point_that_gains_speed_steadily_has_that_acceleration() {
        let place = |t: f32| Vec2::new(1.0 + 2.0 * t + 0.5 * 3.0 * t * t, 0.5 * 4.0 * t * t);
        let found = acceleration([0.0, 1.0, 2.0].map(|windows| place(windows * PUSH_WINDOW)));
        assert!((found - 5.0).abs() < 1e-3, "{found}");
    }
}
