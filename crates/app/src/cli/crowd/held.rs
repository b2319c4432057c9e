//! Measures the errors of held characters on the screen.

use glam::Vec3;
use sabaki::crowd::MemberId;
use sabaki::lod::View;

use super::cases::{Case, TimedWork};
use super::row::HeldError;
use super::scene::{PosedCrowd, Scene, WARM_UP};
use super::{Args, usage};
use crate::cli::Failure;

/// Number of frames that are compared.
const FRAMES: u32 = 8;
/// Minimum distance of a character from the camera, in metres. Nearer characters count as this far away.
const NEAREST: f32 = 1.0;
/// One in this many characters is compared.
const STRIDE: usize = 7;

impl Scene {
    /// Plays the case with and without hold side by side.
    pub(super) fn held_error(&self, args: &Args, case: Case) -> Result<HeldError, Failure> {
        let make = |case| {
            self.crowd(args, case)
                .map(|(crowd, _)| PosedCrowd::new(crowd))
        };
        let (mut held, mut free) = (make(case)?, make(Case { hold: 0, ..case })?);
        let (mut greatest, mut sum, mut count) = (0.0f64, 0.0, 0usize);
        for frame in 0..WARM_UP + FRAMES {
            for posed in [&mut held, &mut free] {
                self.step(posed, case, frame)?;
            }
            if frame < WARM_UP {
                continue;
            }
            let eye = match case.what {
                TimedWork::Frame(motion) => self.eye(motion, frame),
                TimedWork::Pose => Vec3::ZERO,
            };
            for (index, character) in self.characters.iter().enumerate().step_by(STRIDE) {
                let distance = eye.distance(character.placement.position()).max(NEAREST);
                let metres = difference(&held, &free, MemberId(index as u32))?;
                let off = metres * View::default().pixels_at_one_metre() / distance;
                greatest = greatest.max(f64::from(off));
                sum += f64::from(off);
                count += 1;
            }
        }
        Ok(HeldError {
            greatest_pixels: greatest,
            mean_pixels: sum / count.max(1) as f64,
        })
    }
}

/// Largest distance between the same joint of the same character in two crowds, in metres.
fn difference(held: &PosedCrowd, free: &PosedCrowd, id: MemberId) -> Result<f32, Failure> {
    let one = held.crowd.pose_slice(id).map_err(usage)?;
    let other = free.crowd.pose_slice(id).map_err(usage)?;
    let numbers = free.crowd.settings().output.form.position_numbers();
    let mut most = 0.0f32;
    for joint in 0..one.joints.min(other.joints) {
        let apart = numbers.map(|number| {
            one.number(&held.out, joint, number) - other.number(&free.out, joint, number)
        });
        most = most.max(Vec3::from_array(apart).length());
    }
    Ok(most)
}
