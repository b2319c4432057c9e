//! What becomes of the skin of a removed joint: it rides on a joint that is kept, rigidly.
//!
//! The paper leaves it open: its figures are of bones alone, and a removed joint's bones become one straight line.
//! Here the removed joint's points are held where they are in the mean as seen from the kept joint, which is the rigid placement that
//! displaces them least (least squares over frames and points). It rides on the nearest kept joint above, or on one of
//! those below, whichever displaces them less: a forearm goes rather with the hand than with the upper arm.
//!
//! What rode on a joint rides on after it: placements are put together, not fitted anew, so that two
//! neighbouring levels differ in the placement of one joint, and it alone need be blended.
//!
//! Source of the fit: Horn, "Closed-form solution of absolute orientation using unit quaternions" (1987), section 4.

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};

use super::frames::Place;
use super::samples::Samples;
use crate::anim::JointId;

/// Where the joints are drawn: removed ones on kept ones.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Riders {
    /// Of each joint of the skeleton the kept one that it rides on, and how; a kept one rides on itself.
    pub(super) seats: Vec<(JointId, Place)>,
}

/// A placement of a joint, and all that rides on it, on another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seat {
    pub(super) carrier: JointId,
    pub(super) offset: Place,
    /// Sum over frames and points of the squared distance from where they truly are.
    pub(super) squares: f64,
}

/// Points of one joint and of its riders, each with where it is in the mean as seen from the carrier.
struct Pairs {
    /// In the joint's frame, and in the carrier's.
    pairs: Vec<(DVec3, DVec3)>,
    /// Sum of the squared distance of all frames' points from their means.
    spread: f64,
    frames: f64,
}

impl Riders {
    /// Every joint on itself.
    pub(super) fn none(joints: usize) -> Self {
        let seats = (0..joints as u16).map(|id| (JointId(id), Place::IDENTITY));
        Self {
            seats: seats.collect(),
        }
    }

    /// Those that ride on `joint`, with itself.
    pub(super) fn on(&self, joint: JointId) -> impl Iterator<Item = (JointId, Place)> + '_ {
        let seats = self.seats.iter().enumerate();
        seats.filter_map(move |(rider, &(carrier, offset))| {
            (carrier == joint).then_some((JointId(rider as u16), offset))
        })
    }

    /// Takes `joint` out: it and its riders ride as the seat says.
    pub(super) fn remove(&mut self, joint: JointId, seat: (JointId, Place)) {
        for (carrier, offset) in &mut self.seats {
            if *carrier == joint {
                *carrier = seat.0;
                *offset = seat.1.after(offset);
            }
        }
    }

    /// The best placement of `joint` on `carrier`.
    pub(super) fn fit(&self, samples: &Samples, joint: JointId, carrier: JointId) -> Seat {
        let pairs = self.pairs(samples, joint, carrier);
        let offset = pairs.best();
        Seat {
            carrier,
            offset,
            squares: pairs.squares(&offset),
        }
    }

    /// How far the riders of `joint` are from where they truly are now: sum of squares.
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
        for (rider, offset) in self.on(joint) {
            let points = samples.points(rider);
            let mut means = vec![DVec3::ZERO; points.len()];
            let mut squares = 0.0;
            for frame in samples.frames() {
                let seen = frame[carrier.index()].sees(&frame[rider.index()]);
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

    /// The rigid placement that takes the points nearest to their means.
    fn best(&self) -> Place {
        let count = self.pairs.len() as f64;
        let sums = { self.pairs.iter() }.fold((DVec3::ZERO, DVec3::ZERO), |sums, pair| {
            (sums.0 + pair.0, sums.1 + pair.1)
        });
        let (from, to) = (sums.0 / count, sums.1 / count);
        let mut covariance = DMat3::ZERO;
        for &(point, mean) in &self.pairs {
            let (p, q) = (point - from, mean - to);
            covariance += DMat3::from_cols(p * q.x, p * q.y, p * q.z);
        }
        let rotation = turn_of(covariance);
        Place {
            rotation,
            translation: to - rotation * from,
        }
    }
}

/// The rotation that Horn's matrix of the covariance (rows: from, columns: to) has as its greatest eigenvector.
fn turn_of(s: DMat3) -> DQuat {
    /// Powers double: enough for eigenvalues that differ by a millionth.
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
    let norm = |m: &DMat4| {
        { m.to_cols_array() }
            .iter()
            .map(|v| v * v)
            .sum::<f64>()
            .sqrt()
    };
    let size = norm(&n);
    if size <= 0.0 {
        return DQuat::IDENTITY;
    }
    // No eigenvalue is negative then, and the greatest stays the greatest.
    n += DMat4::IDENTITY * size;
    for _ in 0..SQUARINGS {
        n = n * n;
        n *= 1.0 / norm(&n);
    }
    let columns = [n.x_axis, n.y_axis, n.z_axis, n.w_axis];
    let longest = { columns.into_iter() }.fold(DVec4::ZERO, |longest, column| {
        if column.length_squared() > longest.length_squared() {
            column
        } else {
            longest
        }
    });
    DQuat::from_xyzw(longest.y, longest.z, longest.w, longest.x).normalize()
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
