//! The rigid attachment of a removed joint to a kept one, its carrier, so that skin bound to the removed joint is still drawn.
//!
//! The paper draws bones alone, so it does not say what happens to the skin. Here the removed joint's points are placed relative to the
//! carrier by the rigid transform with the least squared displacement over all sampled frames. The carrier is the nearest kept ancestor
//! or one of the nearest kept descendants, whichever displaces the points less: a forearm usually moves with the hand rather than with
//! the upper arm.
//!
//! When a carrier is itself removed, the transforms are concatenated and not fitted again. Two neighbouring levels then differ in the
//! placement of one joint, and only this joint must be blended between them.
//!
//! Source of the fit: Horn, "Closed-form solution of absolute orientation using unit quaternions" (1987), section 4.

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};

use crate::anim::{Clip, JointId, Place, Skeleton, place_all};

/// The attachments of all joints on one level.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Attachments {
    /// Carrier and offset of each joint of the skeleton. A kept joint is its own carrier.
    pub(super) by_joint: Vec<(JointId, Place)>,
}

/// The best attachment of a joint, and of all joints attached to it, to a carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FittedAttachment {
    pub(super) carrier: JointId,
    pub(super) offset: Place,
    /// Sum over frames and points of the squared displacement, in square metres.
    pub(super) squares: f64,
}

/// The points of a joint and of the joints attached to it, each with its mean position in the carrier's frame.
struct Pairs {
    /// Position in the joint's frame, and mean position in the carrier's frame.
    pairs: Vec<(DVec3, DVec3)>,
    /// Sum over frames of the squared distances of the points from their means.
    spread: f64,
    frames: f64,
}

impl Attachments {
    /// Attachments of a level that removes no joint.
    pub(super) fn none(joints: usize) -> Self {
        let own = (0..joints as u16).map(|id| (JointId(id), Place::IDENTITY));
        Self {
            by_joint: own.collect(),
        }
    }

    /// The joints attached to `joint`, including itself, with their offsets.
    pub(super) fn attached_to(
        &self,
        joint: JointId,
    ) -> impl Iterator<Item = (JointId, Place)> + '_ {
        let by_joint = self.by_joint.iter().enumerate();
        by_joint.filter_map(move |(attached, &(carrier, offset))| {
            (carrier == joint).then_some((JointId(attached as u16), offset))
        })
    }

    /// Removes `joint`: it and the joints attached to it are attached to `attachment.carrier`.
    pub(super) fn remove(&mut self, joint: JointId, attachment: &FittedAttachment) {
        for (carrier, offset) in &mut self.by_joint {
            if *carrier == joint {
                *carrier = attachment.carrier;
                *offset = attachment.offset.after(offset);
            }
        }
    }

    /// Fits the attachment of `joint` to `carrier`.
    pub(super) fn fit(
        &self,
        samples: &Samples,
        joint: JointId,
        carrier: JointId,
    ) -> FittedAttachment {
        let pairs = self.pairs(samples, joint, carrier);
        let offset = pairs.best();
        FittedAttachment {
            carrier,
            offset,
            squares: pairs.squares(&offset),
        }
    }

    /// Sum of the squared displacements of the joints attached to `joint`, before it is removed.
    pub(super) fn squares(&self, samples: &Samples, joint: JointId) -> f64 {
        let pairs = self.pairs(samples, joint, joint);
        pairs.squares(&Place::IDENTITY)
    }

    fn pairs(&self, samples: &Samples, joint: JointId, carrier: JointId) -> Pairs {
        let mut found = Pairs {
            pairs: Vec::new(),
            spread: 0.0,
            frames: samples.frames().count() as f64,
        };
        for (attached, offset) in self.attached_to(joint) {
            let points = samples.points(attached);
            let mut means = vec![DVec3::ZERO; points.len()];
            let mut squares = 0.0;
            for frame in samples.frames() {
                let seen = frame[carrier.index()].sees(&frame[attached.index()]);
                for (mean, point) in means.iter_mut().zip(points) {
                    let at = seen.point(*point);
                    *mean += at;
                    squares += at.length_squared();
                }
            }
            for (mean, point) in means.iter_mut().zip(points) {
                *mean /= found.frames;
                squares -= found.frames * mean.length_squared();
                found.pairs.push((offset.point(*point), *mean));
            }
            found.spread += squares.max(0.0);
        }
        found
    }
}

impl Pairs {
    fn squares(&self, offset: &Place) -> f64 {
        let missed = |&(point, mean): &(DVec3, DVec3)| offset.point(point).distance_squared(mean);
        self.spread + self.frames * self.pairs.iter().map(missed).sum::<f64>()
    }

    /// The rigid transform that minimizes the squared distances of the points from their means.
    fn best(&self) -> Place {
        let count = self.pairs.len() as f64;
        let sums = self
            .pairs
            .iter()
            .fold((DVec3::ZERO, DVec3::ZERO), |sums, pair| {
                (sums.0 + pair.0, sums.1 + pair.1)
            });
        let (from, to) = (sums.0 / count, sums.1 / count);
        let mut covariance = DMat3::ZERO;
        for &(point, mean) in &self.pairs {
            let (p, q) = (point - from, mean - to);
            covariance += DMat3::from_cols(p * q.x, p * q.y, p * q.z);
        }
        let rotation = largest_eigenvector(covariance);
        Place {
            rotation,
            translation: to - rotation * from,
        }
    }
}

/// The rotation that maximizes the covariance: the eigenvector of Horn's matrix with the largest eigenvalue. Rows of the covariance
/// belong to the source points, columns to the target points.
fn largest_eigenvector(s: DMat3) -> DQuat {
    /// Each squaring doubles the power. This many separate eigenvalues that differ by a millionth.
    const SQUARINGS: usize = 32;
    let [x, y, z] = [s.row(0), s.row(1), s.row(2)];
    let (a, b, c) = (y.z - z.y, z.x - x.z, x.y - y.x);
    let (xy, yz, zx) = (x.y + y.x, y.z + z.y, z.x + x.z);
    let mut n = DMat4::from_cols(
        DVec4::new(x.x + y.y + z.z, a, b, c),
        DVec4::new(a, x.x - y.y - z.z, xy, zx),
        DVec4::new(b, xy, y.y - x.x - z.z, yz),
        DVec4::new(c, zx, yz, z.z - x.x - y.y),
    );
    let norm = |m: &DMat4| m.to_cols_array().iter().map(|v| v * v).sum::<f64>().sqrt();
    let size = norm(&n);
    if size <= 0.0 {
        return DQuat::IDENTITY;
    }
    // The shift makes all eigenvalues positive and keeps their order.
    n += DMat4::IDENTITY * size;
    for _ in 0..SQUARINGS {
        n = n * n;
        n *= 1.0 / norm(&n);
    }
    let columns = [n.x_axis, n.y_axis, n.z_axis, n.w_axis];
    let longest = columns.into_iter().fold(DVec4::ZERO, |longest, column| {
        if column.length_squared() > longest.length_squared() {
            column
        } else {
            longest
        }
    });
    DQuat::from_xyzw(longest.y, longest.z, longest.w, longest.x).normalize()
}

/// Length below which a bone has no direction, in metres.
const NO_BONE: f64 = 1e-4;

/// Evenly spread frames of the clips, and the points of the body at which displacements are measured.
pub(super) struct Samples {
    joints: usize,
    /// Joint transforms, `[frame][joint]`.
    places: Vec<Place>,
    /// Points of each joint, in the joint's frame.
    points: Vec<Vec<DVec3>>,
}

impl Samples {
    /// Samples at most `frames` frames of the clips. `skin` is the distance from the bones to the surface of the body, in metres.
    pub(super) fn new(skeleton: &Skeleton, clips: &[Clip], frames: usize, skin: f32) -> Self {
        let total: usize = clips.iter().map(Clip::frames).sum();
        let count = total.min(frames.max(1));
        let (mut places, mut frame_places) = (Vec::new(), Vec::new());
        let (mut clip, mut first) = (0, 0);
        for sample in 0..count {
            let at = (sample * total + total / 2) / count;
            while at - first >= clips[clip].frames() {
                first += clips[clip].frames();
                clip += 1;
            }
            let moment = clips[clip].at((at - first) as f32);
            place_all(skeleton, moment, &mut frame_places);
            places.extend_from_slice(&frame_places);
        }
        let mut samples = Self {
            joints: skeleton.len(),
            places,
            points: Vec::new(),
        };
        samples.points = skeleton
            .ids()
            .map(|id| samples.points_of(skeleton, id, f64::from(skin)))
            .collect();
        samples
    }

    /// The joint transforms of each frame.
    pub(super) fn frames(&self) -> impl Iterator<Item = &[Place]> {
        self.places.chunks_exact(self.joints)
    }

    /// Points of a joint in the joint's frame, in metres.
    pub(super) fn points(&self, joint: JointId) -> &[DVec3] {
        &self.points[joint.index()]
    }

    /// The joint itself, and for each bone that starts there the mean position of its far end and the corners of the box that contains
    /// everything within `skin` of the bone. A rigid displacement is largest at a corner.
    fn points_of(&self, skeleton: &Skeleton, joint: JointId, skin: f64) -> Vec<DVec3> {
        let mut points = vec![DVec3::ZERO];
        let frames = self.frames().count() as f64;
        for child in skeleton.children(joint) {
            let seen =
                |frame: &[Place]| frame[joint.index()].sees(&frame[child.index()]).translation;
            // Rounded to a micrometre, so that rounding errors do not decide the box's rotation about the bone.
            let end = self.frames().map(seen).sum::<DVec3>() / frames;
            let end = (end * 1e6).round() * 1e-6 + DVec3::ZERO;
            if end.length() > NO_BONE {
                points.push(end);
                points.extend(corners(end, end.normalize(), skin));
            }
        }
        if points.len() == 1 {
            points.extend(corners(DVec3::ZERO, DVec3::X, skin));
        }
        points
    }
}

/// The corners of a box along a bone from the origin to `end`, `skin` away from it on all sides.
fn corners(end: DVec3, along: DVec3, skin: f64) -> impl Iterator<Item = DVec3> {
    let (u, v) = along.any_orthonormal_pair();
    let ends = [-skin * along, end + skin * along];
    let sides = [u + v, u - v, v - u, -u - v];
    ends.into_iter()
        .flat_map(move |end| sides.map(|side| end + skin * side))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turns() -> impl Iterator<Item = DQuat> {
        (0..200).map(|index| {
            let t = f64::from(index);
            let axis = DVec3::new((t * 0.7).sin(), (t * 1.3).cos(), (t * 2.9).sin());
            DQuat::from_axis_angle(axis.normalize(), t * 0.11)
        })
    }

    #[test]
    fn a_rigid_placement_is_found_again() {
        let points = [
            DVec3::ZERO,
            DVec3::new(0.3, 0.0, 0.02),
            DVec3::new(0.1, 0.05, 0.0),
            DVec3::new(0.1, 0.0, -0.05),
        ];
        for rotation in turns() {
            let place = Place {
                rotation,
                translation: DVec3::new(0.1, -2.0, 0.4),
            };
            let found = Pairs {
                pairs: points.map(|point| (point, place.point(point))).to_vec(),
                spread: 0.0,
                frames: 1.0,
            };
            let best = found.best();
            assert!(found.squares(&best) < 1e-20, "{place:?} {best:?}");
        }
    }

    #[test]
    fn no_neighbouring_placement_is_better() {
        for (index, rotation) in turns().enumerate() {
            let skew = DVec3::new(0.03, -0.05, 0.02) * (index % 5) as f64;
            let pairs = [
                (DVec3::X, rotation * DVec3::X + skew),
                (DVec3::Y, rotation * DVec3::Y - skew),
                (DVec3::Z, rotation * DVec3::new(0.1, 0.2, 0.9)),
                (DVec3::ONE, rotation * DVec3::ONE),
            ];
            let found = Pairs {
                pairs: pairs.to_vec(),
                spread: 0.0,
                frames: 1.0,
            };
            let best = found.best();
            for axis in DVec3::AXES {
                for size in [-1e-3, 1e-3] {
                    let turned = Place {
                        rotation: DQuat::from_axis_angle(axis, size) * best.rotation,
                        ..best
                    };
                    let moved = Place {
                        translation: best.translation + size * axis,
                        ..best
                    };
                    assert!(found.squares(&turned) > found.squares(&best));
                    assert!(found.squares(&moved) > found.squares(&best));
                }
            }
        }
    }
}
