//! Searches the coarsest step of each joint that holds the error.
//!
//! Source: N. Frechette, "Animation Compression: Variable Bit Rates" (2017): the bit rate of each track is the least that holds an error in model space.
//! Differs: steps need not be powers of two, and those of all joints are changed together, each by the error of what it carries.

use super::CompressionSettings;
use super::quantiser::{Quantised, SKIN, Truth};
use crate::anim::JointKind;

/// Number of times that each step is made coarser or finer by the error.
const ROUNDS: usize = 3;

/// Number of times after these that steps are made finer where the error is too large.
const FINER: usize = 9;

/// Share of the error that is aimed at. The rest is for single precision.
const SHARE: f64 = 0.995;

/// Steps of rotations: the smallest that leaves room for 16 bits, and one that is coarse for any joint.
const STEPS: [f64; 2] = [1.0 / 32766.0, 1.0 / 32.0];

/// The clip with the coarsest steps found that hold the error, or `None` if none do.
pub(super) fn tuned(truth: &Truth<'_>, settings: &CompressionSettings) -> Option<Quantised> {
    let bounds = [settings.joint_error, settings.end_error].map(|bound| SHARE * f64::from(bound));
    let tuning = Tuning { truth, bounds };
    let mut steps = tuning.first();
    let mut best: Option<(f64, Quantised)> = None;
    for round in 0..ROUNDS + FINER {
        let Some(found) = truth.quantised(&steps) else {
            break;
        };
        let loads = tuning.loads(&found);
        let coarseness: f64 = steps.iter().map(|step| step.log2()).sum();
        if loads.iter().all(|load| *load <= 1.0) {
            if best.as_ref().is_none_or(|(most, _)| coarseness > *most) {
                best = Some((coarseness, found));
            }
            if round >= ROUNDS {
                break;
            }
        }
        for (step, load) in steps.iter_mut().zip(&loads) {
            *step *= match round < ROUNDS {
                true => (0.9 / load.max(1e-3)).clamp(0.6, 1.5),
                false if *load > 1.0 => 0.9 / load.min(2.0),
                false => 1.0,
            };
            *step = step.clamp(STEPS[0], STEPS[1]);
        }
    }
    best.map(|(_, found)| found)
}

struct Tuning<'a> {
    truth: &'a Truth<'a>,
    /// Errors at the joints and at the ends, in metres.
    bounds: [f64; 2],
}

impl Tuning<'_> {
    /// First steps: each joint's own error is about the largest that the joints and points it carries allow.
    fn first(&self) -> Vec<f64> {
        let mut steps = vec![self.bounds[1] / (2.0 * SKIN); self.truth.skeleton.len()];
        for (joint, &bone) in self.truth.skeleton.joints().iter().zip(&self.truth.bones) {
            if let Some(parent) = joint.parent {
                let step = &mut steps[parent.index()];
                *step = step.min(self.bound(joint.kind) / (2.0 * bone.max(1e-3)));
            }
        }
        let range = |step: f64| step.clamp(STEPS[0], STEPS[1]);
        steps.into_iter().map(range).collect()
    }

    fn bound(&self, kind: JointKind) -> f64 {
        match kind {
            JointKind::Moving => self.bounds[0],
            JointKind::EndSite => self.bounds[1],
        }
    }

    /// Largest error of the joints and points that each joint carries, as a share of the allowed error.
    fn loads(&self, found: &Quantised) -> Vec<f64> {
        let mut loads = vec![0.0; found.errors.len()];
        for (index, (joint, error)) in self
            .truth
            .skeleton
            .joints()
            .iter()
            .zip(&found.errors)
            .enumerate()
        {
            if joint.kind == JointKind::Moving {
                loads[index] = f64::max(loads[index], error.skin / self.bounds[1]);
            }
            let load = error.place / self.bound(joint.kind);
            let carrier = joint.parent.map_or(0, |parent| parent.index());
            loads[carrier] = loads[carrier].max(load);
        }
        loads
    }
}
