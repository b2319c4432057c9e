//! The largest step of a point on the screen when levels are switched.
//!
//! A camera approaches the character from beyond the last band and returns, while the clip plays. Each frame is compared with the same
//! pose drawn at the previous frame's level and blend. The difference is the switch alone, without the motion of the character or the
//! camera.

use glam::{Affine3A, Vec3};

use super::level::Attachment;
use super::motion::check;
use super::samples::{SampleSettings, Samples};
use super::switching::Band;
use super::{Choice, LevelId, Levels, LodError, SwitchSettings, Switching, affine};
use crate::anim::{Clip, JointId, Pose, Skeleton, forward_kinematics};

/// Smallest distance of the camera from the body, in metres.
const NEAREST: f32 = 0.5;
/// Largest number of compared frames times joints. Of a longer walk, evenly spread frames are compared.
const MOST_PLACED: u64 = 1 << 24;
/// Largest number of frames of the walk in one direction.
const MOST_FRAMES: u64 = 1 << 40;

/// The camera's path to the character and back.
struct Walk<'a> {
    switching: &'a Switching,
    /// Distance at its start and end, in metres.
    far: f32,
    /// Distance per frame, in metres.
    travel: f32,
    /// The frame in which the camera turns back.
    turn: u64,
}

impl Walk<'_> {
    fn distance(&self, frame: u64) -> f32 {
        self.far - self.travel * frame.min(2 * self.turn - frame) as f32
    }

    /// The level and blend in a frame. By the hysteresis, an approaching camera keeps the coarser level as long as possible and a
    /// departing one the finer level.
    fn choice(&self, frame: u64) -> Choice {
        /// A level that is at least as coarse as any other.
        const COARSEST: LevelId = LevelId(u16::MAX);
        let before = if frame <= self.turn {
            COARSEST
        } else {
            let nearest = self.distance(self.turn);
            self.switching.choose(nearest, Some(COARSEST)).level
        };
        self.switching.choose(self.distance(frame), Some(before))
    }

    /// The frames of the approach in which a band changes the image, as inclusive ranges.
    fn frames_of_bands(&self) -> Vec<[u64; 2]> {
        let frame = |distance: f64| {
            let frames = (f64::from(self.far) - distance) / f64::from(self.travel);
            (frames as u64).clamp(1, self.turn)
        };
        if self.turn == 0 {
            return Vec::new();
        }
        let margin = 2.0 * f64::from(self.travel);
        let mut ranges: Vec<[u64; 2]> = Vec::new();
        let reaches_in = |band: &&Band| band.end + 2.0 * self.travel >= self.distance(self.turn);
        for band in self.switching.bands().iter().rev().filter(reaches_in) {
            let first = frame(f64::from(band.end) + margin);
            let last = frame(f64::from(band.start) - margin);
            match ranges.last_mut() {
                Some(range) if first <= range[1] + 1 => range[1] = range[1].max(last),
                _ => ranges.push([first, last]),
            }
        }
        ranges
    }

    /// At most `most` frames, of the approach and the return, to be compared with their predecessors.
    fn frames(&self, most: u64) -> impl Iterator<Item = u64> + '_ {
        let ranges = self.frames_of_bands();
        let count: u64 = ranges.iter().map(|[first, last]| last - first + 1).sum();
        let stride = (2 * count).div_ceil(most.max(1)).max(1) as usize;
        let there = ranges
            .into_iter()
            .flat_map(move |[first, last]| (first..=last).step_by(stride));
        there.flat_map(|frame| [frame, 2 * self.turn - frame + 1])
    }
}

impl Levels {
    /// Writes the model space matrices of all joints as they are drawn to `out`. `joints` are the matrices of the full skeleton.
    fn draw(&self, choice: Choice, joints: &[Affine3A], out: &mut Vec<Affine3A>) {
        let level = &self.levels[choice.level.index()];
        let mut kept: Vec<Affine3A> = level.kept.iter().map(|id| joints[id.index()]).collect();
        if let Some(blend) = self.blend(choice.level)
            && choice.blend > 0.0
        {
            blend.apply(choice.blend, &mut kept);
        }
        let drawn = |attachment: &Attachment| {
            kept[usize::from(attachment.carrier)] * affine(&attachment.offset)
        };
        out.clear();
        out.extend(level.attachments.iter().map(drawn));
    }

    /// The largest step of any point of the body on the screen when levels are switched, in pixels. The camera has the settings' view,
    /// looks at the root from the root's height, and moves at the settings' speed and frame rate.
    ///
    /// # Errors
    /// A clip of another skeleton, settings out of range.
    pub fn largest_step(
        &self,
        skeleton: &Skeleton,
        clip: &Clip,
        settings: &SwitchSettings,
    ) -> Result<f32, LodError> {
        check(skeleton, clip)?;
        let switching = Switching::new(self, settings)?;
        let sampling = SampleSettings {
            frames: 500,
            skin: self.skin,
        };
        let points = Samples::of(skeleton, std::slice::from_ref(clip), sampling);
        let travel = settings.travel();
        let (near, far) = (self.reach + NEAREST, switching.furthest() + 2.0 * travel);
        let walk = Walk {
            switching: &switching,
            far,
            travel,
            turn: (((far - near) / travel).max(0.0) as u64).min(MOST_FRAMES),
        };
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        let (mut old, mut new) = (Vec::new(), Vec::new());
        let mut largest = 0.0f32;
        for frame in walk.frames(MOST_PLACED / skeleton.len() as u64) {
            let (before, now) = (walk.choice(frame - 1), walk.choice(frame));
            if now == before || frame >= 2 * walk.turn {
                continue;
            }
            let distance = walk.distance(frame);
            let of_clip = frame as f64 / f64::from(settings.frame_rate) * clip.frame_rate();
            clip.pose(of_clip as usize % clip.frames(), &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            let matrices: Vec<Affine3A> = joints.iter().map(affine).collect();
            self.draw(before, &matrices, &mut old);
            self.draw(now, &matrices, &mut new);
            let root = Vec3::from(matrices[0].translation);
            let pixel = |matrix: &Affine3A, point: Vec3| {
                let place = matrix.transform_point3(point) - root;
                settings.view.pixels_at_one_metre() * place.truncate() / (distance - place.z)
            };
            for (joint, (old, new)) in old.iter().zip(&new).enumerate() {
                for point in points.points(JointId(joint as u16)) {
                    let point = point.as_vec3();
                    largest = largest.max(pixel(old, point).distance(pixel(new, point)));
                }
            }
        }
        Ok(largest)
    }
}
