//! How far a point jumps on the screen where levels are switched.
//!
//! A camera comes from where the coarsest level is drawn to the character and goes away again, while the clip plays. In each frame
//! of the screen what is drawn is compared with what the choice of the frame before would draw of the same pose: what is
//! left is the switch alone, without the motion of the character or the camera.

use glam::{Affine3A, Vec3};

use super::motion::check;
use super::samples::Samples;
use super::{Choice, Levels, LodError, SwitchSettings, Switching, affine};
use crate::anim::{Clip, JointId, Pose, Skeleton, forward_kinematics};

/// The camera comes no nearer to the body than this, metres.
const NEAREST: f32 = 0.5;

impl Levels {
    /// The matrices of all joints of the full skeleton as they are drawn, in the space of the motion, into `out`; `joints` are those of
    /// the full skeleton.
    fn draw(&self, choice: Choice, joints: &[Affine3A], out: &mut Vec<Affine3A>) {
        let level = &self.levels[choice.level.index()];
        let mut kept: Vec<Affine3A> = level.kept.iter().map(|id| joints[id.index()]).collect();
        if let Some(blend) = self.blend(choice.level)
            && choice.blend > 0.0
        {
            blend.apply(choice.blend, &mut kept);
        }
        let seated = |seat: &super::Seated| kept[usize::from(seat.carrier)] * affine(&seat.offset);
        out.clear();
        out.extend(level.seats.iter().map(seated));
    }

    /// The largest step of any point of the body when levels are switched, pixels: for a camera of the settings' view that looks at the
    /// root from its height, at the speed and frame rate of the settings' blending (those of its default where there is none).
    ///
    /// # Errors
    /// A clip that is not of this skeleton, settings that make no sense.
    pub fn largest_step(
        &self,
        (skeleton, clip): (&Skeleton, &Clip),
        settings: &SwitchSettings,
    ) -> Result<f32, LodError> {
        check(skeleton, clip)?;
        let switching = Switching::new(self, settings)?;
        let camera = settings.blend.unwrap_or_default();
        let points = Samples::of(skeleton, std::slice::from_ref(clip), (500, self.skin));
        let travel = camera.speed / camera.frame_rate;
        let (near, far) = (self.reach + NEAREST, switching.furthest() + 2.0 * travel);
        let steps = ((far - near) / travel).max(0.0) as usize;
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        let (mut old, mut new) = (Vec::new(), Vec::new());
        let mut before = switching.choose(far, None);
        let mut largest = 0.0f32;
        for step in 0..2 * steps {
            let distance = far - travel * step.min(2 * steps - step) as f32;
            let now = switching.choose(distance, Some(before.level));
            if now != before {
                let frame = step as f64 / f64::from(camera.frame_rate) * clip.frame_rate();
                clip.pose(frame as usize % clip.frames(), &mut pose);
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
            before = now;
        }
        Ok(largest)
    }
}
