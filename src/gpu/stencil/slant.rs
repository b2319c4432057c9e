//! The rectangle around the discs of a cell, along the direction in which the attack moves through it.
//!
//! A sphere that crosses a slab at an angle covers a band. The rectangle along the band is several times smaller than the one along the
//! axes, and so are the boxes that candidates are drawn in.

use crate::maps::{Disc, MapRect, SUB_TEXELS};

/// Margin around a rectangle, in texels. It covers the rounding of corners (here to quarters, on a device to sixteenths or finer) and the
/// error of single precision.
const MARGIN: f32 = 0.25;
/// Maximum ratio of the area of a rotated rectangle to that of the rectangle along the axes. Above it the latter is used.
const WORTH: f32 = 0.75;

/// A rectangle in texels of the attack's rectangle, in a frame that is turned by an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slant {
    pub(super) cos: f32,
    pub(super) sin: f32,
    /// Lowest coordinates along both turned axes.
    pub(super) low: [f32; 2],
    /// Highest coordinates along both turned axes.
    pub(super) high: [f32; 2],
}

impl Slant {
    /// A rectangle along the axes.
    pub(super) fn straight(rect: MapRect) -> Self {
        let [u, v] = [rect.u as f32, rect.v as f32];
        Self {
            cos: 1.0,
            sin: 0.0,
            low: [u, v],
            high: [u + rect.width as f32, v + rect.height as f32],
        }
    }

    /// The rotated rectangle around the part of some discs that lies in `rect`. `None` if it is not much smaller than `rect`.
    pub(super) fn around(discs: impl Iterator<Item = Disc> + Clone, rect: MapRect) -> Option<Self> {
        let (sin, cos) = angle(discs.clone()).sin_cos();
        let mut slant = Self {
            cos,
            sin,
            low: [f32::INFINITY; 2],
            high: [f32::NEG_INFINITY; 2],
        };
        for disc in discs {
            let [x, z, radius] = [disc.x, disc.z, disc.radius].map(texels);
            let middle = slant.turned([x, z]);
            for axis in [0, 1] {
                slant.low[axis] = slant.low[axis].min(middle[axis] - radius - MARGIN);
                slant.high[axis] = slant.high[axis].max(middle[axis] + radius + MARGIN);
            }
        }
        let [whole_low, whole_high] = slant.of_rect(rect);
        for axis in [0, 1] {
            slant.low[axis] = slant.low[axis].max(whole_low[axis]);
            slant.high[axis] = slant.high[axis].min(whole_high[axis]);
        }
        let area = (slant.high[0] - slant.low[0]) * (slant.high[1] - slant.low[1]);
        (area <= WORTH * (rect.width * rect.height) as f32).then_some(slant)
    }

    /// Coordinates along the turned axes.
    pub(super) fn turned(&self, [x, z]: [f32; 2]) -> [f32; 2] {
        [self.cos * x + self.sin * z, self.cos * z - self.sin * x]
    }

    /// The inverse of [`Slant::turned`].
    pub(super) fn back(&self, [along, across]: [f32; 2]) -> [f32; 2] {
        [
            self.cos * along - self.sin * across,
            self.sin * along + self.cos * across,
        ]
    }

    /// Rectangle around the intersection with a convex shape, which is given by its four corners in the order of its outline. `None` if they
    /// do not intersect.
    pub(super) fn shared(&self, outline: [[f32; 2]; 4]) -> Option<Self> {
        let mut shared = *self;
        let mut corners = outline.map(|corner| self.turned(corner));
        for axis in [0, 1] {
            let strip = [shared.low[1 - axis], shared.high[1 - axis]];
            let [low, high] = extent(&corners, strip);
            shared.low[axis] = shared.low[axis].max(low - MARGIN);
            shared.high[axis] = shared.high[axis].min(high + MARGIN);
            corners = corners.map(|[a, b]| [b, a]);
        }
        let is_empty = (0..2).any(|axis| shared.low[axis] >= shared.high[axis]);
        (!is_empty).then_some(shared)
    }

    /// The four corners.
    pub(super) fn corners(&self) -> [[f32; 2]; 4] {
        let ([a, b], [c, d]) = (self.low, self.high);
        [[a, b], [c, b], [a, d], [c, d]].map(|corner| self.back(corner))
    }

    /// Smallest rectangle of whole texels that contains this one.
    pub(super) fn bounds(&self) -> MapRect {
        let corners = self.corners();
        let of = |axis: usize| {
            let all = corners.iter().map(|corner| corner[axis]);
            let low = all.clone().fold(f32::INFINITY, f32::min);
            let high = all.fold(f32::NEG_INFINITY, f32::max);
            // Rounded corners lie less than half a texel further out.
            ((low - 0.5).floor() as i32, (high + 0.5).ceil() as i32)
        };
        let ((u, end_u), (v, end_v)) = (of(0), of(1));
        MapRect {
            u,
            v,
            width: (end_u - u) as u32,
            height: (end_v - v) as u32,
        }
    }

    /// Lowest and highest coordinates of a rectangle.
    fn of_rect(&self, rect: MapRect) -> [[f32; 2]; 2] {
        let [u, v] = [rect.u as f32, rect.v as f32];
        let [end_u, end_v] = [u + rect.width as f32, v + rect.height as f32];
        let corners = [[u, v], [end_u, v], [u, end_v], [end_u, end_v]].map(|at| self.turned(at));
        let by = |pick: fn(f32, f32) -> f32| {
            let both = |a: [f32; 2], b: [f32; 2]| [pick(a[0], b[0]), pick(a[1], b[1])];
            corners.into_iter().reduce(both).unwrap_or_default()
        };
        let (low, high) = (by(f32::min), by(f32::max));
        [low.map(|at| at - MARGIN), high.map(|at| at + MARGIN)]
    }
}

/// Lowest and highest first coordinate of the points of a convex shape whose second coordinate lies in a strip, or slightly outside.
fn extent(corners: &[[f32; 2]; 4], [low, high]: [f32; 2]) -> [f32; 2] {
    let (low, high) = (low - MARGIN, high + MARGIN);
    let mut extent = [f32::INFINITY, f32::NEG_INFINITY];
    for (index, from) in corners.iter().enumerate() {
        let to = corners[(index + 1) % corners.len()];
        let [along, across] = [to[0] - from[0], to[1] - from[1]];
        let (mut start, mut end) = (0.0, 1.0);
        if across.abs() > 1e-3 {
            let (a, b) = ((low - from[1]) / across, (high - from[1]) / across);
            (start, end) = (f32::max(start, a.min(b)), f32::min(end, a.max(b)));
        } else if from[1] < low || from[1] > high {
            continue;
        }
        if start <= end {
            for at in [start, end].map(|part| from[0] + part * along) {
                extent = [extent[0].min(at), extent[1].max(at)];
            }
        }
    }
    extent
}

fn texels(sub_texels: i32) -> f32 {
    sub_texels as f32 / SUB_TEXELS as f32
}

/// Angle of the line that the centres of some discs lie along, by their covariance.
fn angle(discs: impl Iterator<Item = Disc> + Clone) -> f32 {
    let centres = discs.map(|disc| [texels(disc.x), texels(disc.z)]);
    let (mut count, mut sum) = (0.0, [0.0; 2]);
    for [x, z] in centres.clone() {
        count += 1.0;
        sum = [sum[0] + x, sum[1] + z];
    }
    let mean = sum.map(|sum| sum / f32::max(count, 1.0));
    let (mut xx, mut xz, mut zz) = (0.0, 0.0, 0.0);
    for [x, z] in centres {
        let [x, z] = [x - mean[0], z - mean[1]];
        (xx, xz, zz) = (xx + x * x, xz + x * z, zz + z * z);
    }
    0.5 * f32::atan2(2.0 * xz, xx - zz)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(step: [i32; 2]) -> Vec<Disc> {
        let disc = |index: i32| Disc {
            x: 800 + index * step[0],
            z: 700 + index * step[1],
            radius: 80,
        };
        (0..40).map(disc).collect()
    }

    #[test]
    fn every_covered_texel_is_in_it() {
        for step in [[16, 16], [20, -9], [-7, 30], [3, 25]] {
            let discs = band(step);
            let rect = MapRect::around(&discs);
            let slant = Slant::around(discs.iter().copied(), rect).unwrap();
            let bounds = slant.bounds();
            for v in rect.v..rect.v + rect.height as i32 {
                for u in rect.u..rect.u + rect.width as i32 {
                    if !discs.iter().any(|disc| disc.covers(u, v)) {
                        continue;
                    }
                    let at = slant.turned([u as f32 + 0.5, v as f32 + 0.5]);
                    for axis in [0, 1] {
                        let within = slant.low[axis] + 0.2..=slant.high[axis] - 0.2;
                        assert!(within.contains(&at[axis]), "{step:?}: {u}, {v}");
                    }
                    assert!(
                        !bounds
                            .intersection(MapRect {
                                u,
                                v,
                                width: 1,
                                height: 1
                            })
                            .is_empty()
                    );
                }
            }
        }
    }

    #[test]
    fn what_lies_along_an_axis_stays() {
        for step in [[20, 0], [0, 20], [0, 0]] {
            let discs = band(step);
            let rect = MapRect::around(&discs);
            assert_eq!(Slant::around(discs.iter().copied(), rect), None);
        }
        assert_eq!(Slant::around(std::iter::empty(), MapRect::default()), None);
    }

    /// A point of the outline's inside is in the shared part.
    #[test]
    fn what_a_shape_covers_is_shared() {
        let discs = band([20, -9]);
        let slant = Slant::around(discs.iter().copied(), MapRect::around(&discs)).unwrap();
        let [middle_x, middle_z] =
            slant.back([0, 1].map(|axis| (slant.low[axis] + slant.high[axis]) / 2.0));
        let (mut some, mut none) = (0, 0);
        for step in 0..400 {
            let (sin, cos) = (step as f32).sin_cos();
            let [x, z] = [
                middle_x + (step % 37) as f32 - 18.0,
                middle_z + (step % 41) as f32 - 20.0,
            ];
            let (width, height) = (1.0 + (step % 13) as f32, 1.0 + (step % 7) as f32);
            let place = |[a, b]: [f32; 2]| [x + cos * a - sin * b, z + sin * a + cos * b];
            let outline = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            let shared = slant.shared(outline.map(|[a, b]| place([a * width, b * height])));
            for part in (0..121).map(|k| [(k % 11) as f32 / 5.0 - 1.0, (k / 11) as f32 / 5.0 - 1.0])
            {
                let at = slant.turned(place([part[0] * width, part[1] * height]));
                let inside =
                    (0..2).all(|axis| (slant.low[axis]..slant.high[axis]).contains(&at[axis]));
                if inside {
                    let shared = shared.unwrap();
                    for axis in [0, 1] {
                        assert!(
                            (shared.low[axis]..=shared.high[axis]).contains(&at[axis]),
                            "{step}"
                        );
                    }
                }
            }
            some += u32::from(shared.is_some());
            none += u32::from(shared.is_none());
        }
        assert!(some > 50 && none > 50, "{some} {none}");
    }

    #[test]
    fn a_band_is_cut_off_at_the_rectangle() {
        let discs = band([16, 16]);
        let rect = MapRect::around(&discs[..20]);
        let whole = Slant::around(discs.iter().copied(), MapRect::around(&discs)).unwrap();
        let slant = Slant::around(discs.iter().copied(), rect).unwrap();
        assert!(slant.high[0] < whole.high[0] - 10.0);
    }
}
