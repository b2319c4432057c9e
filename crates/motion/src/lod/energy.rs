//! The kinetic energy of joints.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1, equations 1 to 3:
//! E_j = mean over frames of 1/2 I w² W, W = a / theta, a = pi/2.
//!
//! - w: angular speed of the local rotation between the previous frame and this one. Over several clips the mean is over their time.
//! - I: moment of inertia of everything below the joint, about the joint, in this frame: the sum of mass times squared
//!   distance, for every axis of rotation ([`Masses`](super::Masses)).
//! - theta: inner angle between the bone to the parent and the bone to a child; pi when they lie in a line. Of several children, the
//!   straightest continuation in the frame; bones without length are ignored.
//!
//! Differs: by the text, W *raises* the energy of a joint that is bent beyond the threshold. So the default is max(1, W); the equation to
//! the letter is [`Flexion::Literal`]. A smallest theta bounds W.

use std::f64::consts::PI;

use glam::DVec3;

use super::level::check;
use super::mass::{Moments, moments_below};
use super::settings::{Flexion, LevelSettings};
use super::{Level, LodError};
use crate::anim::{Clip, Place, Skeleton, place_all};

impl LevelSettings {
    /// Factor of a joint's energy by its bend.
    fn weight(&self, theta: f64) -> f64 {
        let weight = f64::from(self.bend_threshold) / theta.max(f64::from(self.least_angle));
        match self.flexion {
            Flexion::Raised => weight.max(1.0),
            Flexion::Literal => weight,
        }
    }
}

impl Level {
    /// The energies of the kept joints, in their order, in joules, as this level plays the clips. The mass of a removed joint
    /// counts for its nearest kept ancestor. Clips of one frame have energies of 0.
    ///
    /// The root and the ends count as straight.
    ///
    /// # Errors
    /// Settings out of range, a clip or a level of another skeleton.
    pub fn joint_energies(
        &self,
        skeleton: &Skeleton,
        clips: &[Clip],
        settings: &LevelSettings,
    ) -> Result<Vec<f32>, LodError> {
        self.check(skeleton)?;
        settings.check_angles()?;
        clips.iter().try_for_each(|clip| check(skeleton, clip))?;
        let mut children = vec![Vec::new(); self.kept.len()];
        for (child, parent) in self.bones() {
            children[parent].push(child);
        }
        let mut pass = Pass {
            level: self,
            settings,
            masses: settings.masses.on_level(skeleton, self)?,
            moments: Vec::new(),
            children,
            sums: vec![0.0; self.kept.len()],
        };
        let (mut before, mut now) = (Vec::new(), Vec::new());
        for clip in clips {
            place_all(skeleton, clip.at(0.0), &mut before);
            for frame in 1..clip.frames() {
                place_all(skeleton, clip.at(frame as f32), &mut now);
                pass.add([&before, &now], 1.0 / clip.frame_rate());
                std::mem::swap(&mut before, &mut now);
            }
        }
        let seconds: f64 = clips.iter().map(Clip::duration).sum();
        let mean = |sum| if seconds > 0.0 { sum / seconds } else { 0.0 };
        Ok(pass.sums.into_iter().map(|sum| mean(sum) as f32).collect())
    }
}

/// One pass over the frames, for one level.
struct Pass<'a> {
    level: &'a Level,
    settings: &'a LevelSettings,
    masses: Vec<f64>,
    moments: Vec<Moments>,
    /// Children of each kept joint, as indices into the kept joints.
    children: Vec<Vec<usize>>,
    /// Sum over frames of energy times frame time, for each kept joint.
    sums: Vec<f64>,
}

impl Pass<'_> {
    /// Adds the energies between two frames.
    fn add(&mut self, [before, now]: [&[Place]; 2], seconds: f64) {
        let origin = now[0].translation;
        moments_below(self.level, &self.masses, now, origin, &mut self.moments);
        for (index, id) in self.level.kept.iter().enumerate() {
            let at = now[id.index()].translation - origin;
            let speed = self.turn(index, [before, now]) / seconds;
            let weight = self.settings.weight(self.bend(index, now));
            let inertia = self.moments[index].about_point(at);
            self.sums[index] += 0.5 * inertia * speed * speed * weight * seconds;
        }
    }

    /// The angle by which a joint turns between two frames, in radians.
    fn turn(&self, index: usize, [before, now]: [&[Place]; 2]) -> f64 {
        let id = self.level.kept[index];
        let above = self.level.parents[index].map(|parent| self.level.kept[usize::from(parent)]);
        let local = |places: &[Place]| match above {
            Some(above) => places[above.index()].sees(&places[id.index()]).rotation,
            None => places[id.index()].rotation,
        };
        let turn = local(before).conjugate() * local(now);
        2.0 * turn.xyz().length().atan2(turn.w.abs())
    }

    /// The inner angle at a joint, in radians.
    fn bend(&self, joint: usize, now: &[Place]) -> f64 {
        let at = |index: usize| now[self.level.kept[index].index()].translation;
        let Some(parent) = self.level.parents[joint].map(usize::from) else {
            return PI;
        };
        // The straightest continuation: a chest is not bent because arms leave it sideways.
        let mut straightest: Option<f64> = None;
        for &child in &self.children[joint] {
            let angle = angle_between(at(parent) - at(joint), at(child) - at(joint));
            if let Some(angle) = angle
                && straightest.is_none_or(|other| angle > other)
            {
                straightest = Some(angle);
            }
        }
        straightest.unwrap_or(PI)
    }
}

/// The angle between two vectors in radians; `None` if one of them has no length.
fn angle_between(a: DVec3, b: DVec3) -> Option<f64> {
    /// Length below which a vector has no direction, in metres.
    const NO_LENGTH: f64 = 1e-6;
    if a.length() < NO_LENGTH || b.length() < NO_LENGTH {
        return None;
    }
    Some(a.cross(b).length().atan2(a.dot(b)))
}
