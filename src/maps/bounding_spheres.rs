//! Bounding spheres of the body over short intervals of time: one of the whole body, and tighter
//! ones of its parts.

use crate::math::Sphere;
use glam::Vec3;

/// Number of consecutive spheres of the body in one part.
pub(crate) const PART: usize = 8;

/// Number of bounding spheres that are tested together.
const LANES: usize = 16;

/// X, y, z and radius of 16 spheres.
pub(crate) type SphereRows = [[f32; LANES]; 4];

/// The bounding spheres of a track in each interval.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BoundingSpheres {
    /// Bounding spheres of the whole body, as rows of x, y, z and radius. The last bounding sphere is repeated 15 times.
    body: [Vec<f32>; 4],
    stretches: usize,
    /// Bounding spheres of the parts, `[stretch][part / 16]`. Unused lanes have a radius of −∞.
    parts: Vec<SphereRows>,
}

impl BoundingSpheres {
    /// Creates the bounding spheres of a body with `spheres` spheres. `body` holds the bounding sphere of the body in
    /// each interval; `part` returns the bounding sphere of a range of spheres in an interval.
    pub(super) fn new(
        spheres: usize,
        body: &[Sphere],
        part: impl Fn(usize, std::ops::Range<usize>) -> Sphere,
    ) -> Self {
        let mut bounds = Self {
            stretches: body.len(),
            ..Self::default()
        };
        let last = body.last().into_iter().cycle().take(LANES - 1);
        for &bound in body.iter().chain(last) {
            for (row, value) in bounds.body.iter_mut().zip(values(bound)) {
                row.push(value);
            }
        }
        for stretch in 0..body.len() {
            for first in (0..spheres).step_by(PART * LANES) {
                let mut rows = [[0.0; LANES]; 4];
                rows[3] = [f32::NEG_INFINITY; LANES];
                let firsts = (first..spheres).step_by(PART).take(LANES);
                for (lane, first) in firsts.enumerate() {
                    let bound = part(stretch, first..(first + PART).min(spheres));
                    for (row, value) in rows.iter_mut().zip(values(bound)) {
                        row[lane] = value;
                    }
                }
                bounds.parts.push(rows);
            }
        }
        bounds
    }

    /// Memory of one interval, in bytes.
    pub(super) fn stretch_bytes(spheres: usize) -> usize {
        size_of::<Sphere>() + spheres.div_ceil(PART * LANES) * size_of::<SphereRows>()
    }

    /// Bounding sphere of the whole body in an interval.
    pub(super) fn body(&self, stretch: usize) -> Sphere {
        let [x, y, z, radius] = [0, 1, 2, 3].map(|row| self.body[row][stretch]);
        Sphere::new(Vec3::new(x, y, z), radius)
    }

    /// Bounding spheres of the whole body in 16 consecutive intervals. The last interval is repeated past the
    /// end.
    pub(super) fn rows(&self, first: usize) -> SphereRows {
        let first = first.min(self.stretches.saturating_sub(1));
        let mut rows = [[0.0; LANES]; 4];
        for (row, values) in rows.iter_mut().zip(&self.body) {
            row.copy_from_slice(&values[first..first + LANES]);
        }
        rows
    }

    /// Bounding spheres of the body's parts in an interval, 16 to an entry.
    pub(super) fn parts(&self, stretch: usize) -> &[SphereRows] {
        let each = self.parts.len() / self.stretches.max(1);
        let stretch = stretch.min(self.stretches.saturating_sub(1));
        &self.parts[stretch * each..(stretch + 1) * each]
    }
}

fn values(sphere: Sphere) -> [f32; 4] {
    let [x, y, z] = sphere.centre.to_array();
    [x, y, z, sphere.radius]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_and_each_stretch_has_its_own_bound() {
        let body: Vec<Sphere> = (0..5)
            .map(|i| Sphere::new(Vec3::splat(i as f32), 0.5))
            .collect();
        // 131 spheres form 17 parts; the last part has three spheres.
        let part = |stretch: usize, spheres: std::ops::Range<usize>| {
            let place = Vec3::new(stretch as f32, spheres.start as f32, spheres.len() as f32);
            Sphere::new(place, 1.0 + stretch as f32)
        };
        let bounds = BoundingSpheres::new(131, &body, part);
        for first in 0..8 {
            let rows = bounds.rows(first);
            for lane in 0..LANES {
                let at = (first + lane).min(4);
                let expected = [at as f32, at as f32, at as f32, 0.5];
                assert_eq!(rows.map(|row| row[lane]), expected, "{first} {lane}");
            }
            let stretch = first.min(4);
            assert_eq!(bounds.body(stretch), body[stretch]);
            let parts = bounds.parts(first);
            assert_eq!(parts.len(), 2);
            for at in 0..2 * LANES {
                let [x, y, z, radius] = parts[at / LANES].map(|row| row[at % LANES]);
                if at > 16 {
                    assert_eq!(radius, f32::NEG_INFINITY);
                    continue;
                }
                let size = if at == 16 { 3.0 } else { 8.0 };
                assert_eq!([x, y, z], [stretch as f32, 8.0 * at as f32, size]);
                assert_eq!(radius, 1.0 + stretch as f32);
            }
        }
        let none = BoundingSpheres::new(0, &body, part);
        assert!(none.parts(3).is_empty());
    }
}
