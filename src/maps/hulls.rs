//! Spheres around the body all through short stretches of time: one around all of it, and ones around
//! its parts, which lie much closer.

use glam::Vec3;

/// Spheres of the body that one part is made of: they follow each other.
pub(crate) const PART: usize = 8;

/// Hulls that are looked at side by side.
const LANES: usize = 16;

/// X, y, z and radius of sixteen spheres.
pub(crate) type HullRows = [[f32; LANES]; 4];

/// The hulls of a track, stretch by stretch.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Hulls {
    /// Of the whole body: x, y, z and radius, the last one sixteen times.
    whole: [Vec<f32>; 4],
    stretches: usize,
    /// `[stretch][part / 16]`; where there is no part a sphere that nothing comes near.
    parts: Vec<HullRows>,
}

impl Hulls {
    /// Of stretches of so many spheres. `whole` are spheres around the whole body, `part` gives one around those of its spheres
    /// that are named, in a stretch.
    pub(super) fn new(
        spheres: usize,
        whole: &[(Vec3, f32)],
        part: impl Fn(usize, std::ops::Range<usize>) -> (Vec3, f32),
    ) -> Self {
        let mut hulls = Self {
            stretches: whole.len(),
            ..Self::default()
        };
        let last = whole.last().into_iter().cycle().take(LANES - 1);
        for &hull in whole.iter().chain(last) {
            for (row, value) in hulls.whole.iter_mut().zip(values(hull)) {
                row.push(value);
            }
        }
        for stretch in 0..whole.len() {
            for first in (0..spheres).step_by(PART * LANES) {
                let mut rows = [[0.0; LANES]; 4];
                rows[3] = [f32::NEG_INFINITY; LANES];
                let firsts = (first..spheres).step_by(PART).take(LANES);
                for (lane, first) in firsts.enumerate() {
                    let hull = part(stretch, first..(first + PART).min(spheres));
                    for (row, value) in rows.iter_mut().zip(values(hull)) {
                        row[lane] = value;
                    }
                }
                hulls.parts.push(rows);
            }
        }
        hulls
    }

    /// What a stretch takes in memory, bytes.
    pub(super) fn stretch_bytes(spheres: usize) -> usize {
        size_of::<(Vec3, f32)>() + spheres.div_ceil(PART * LANES) * size_of::<HullRows>()
    }

    /// Around the whole body.
    pub(super) fn whole(&self, stretch: usize) -> (Vec3, f32) {
        let [x, y, z, radius] = [0, 1, 2, 3].map(|row| self.whole[row][stretch]);
        (Vec3::new(x, y, z), radius)
    }

    /// The same of sixteen stretches that follow each other, and after the last one that again.
    pub(super) fn rows(&self, first: usize) -> HullRows {
        let first = first.min(self.stretches.saturating_sub(1));
        let mut rows = [[0.0; LANES]; 4];
        for (row, values) in rows.iter_mut().zip(&self.whole) {
            row.copy_from_slice(&values[first..first + LANES]);
        }
        rows
    }

    /// Around the body's parts, sixteen at a time.
    pub(super) fn parts(&self, stretch: usize) -> &[HullRows] {
        let each = self.parts.len() / self.stretches.max(1);
        let stretch = stretch.min(self.stretches.saturating_sub(1));
        &self.parts[stretch * each..(stretch + 1) * each]
    }
}

fn values((centre, radius): (Vec3, f32)) -> [f32; 4] {
    [centre.x, centre.y, centre.z, radius]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_and_each_stretch_has_its_own_hull() {
        let whole: Vec<(Vec3, f32)> = (0..5).map(|i| (Vec3::splat(i as f32), 0.5)).collect();
        // 131 spheres make 17 parts, the last one of three.
        let part = |stretch: usize, spheres: std::ops::Range<usize>| {
            let place = Vec3::new(stretch as f32, spheres.start as f32, spheres.len() as f32);
            (place, 1.0 + stretch as f32)
        };
        let hulls = Hulls::new(131, &whole, part);
        for first in 0..8 {
            let rows = hulls.rows(first);
            for lane in 0..LANES {
                let at = (first + lane).min(4);
                let expected = [at as f32, at as f32, at as f32, 0.5];
                assert_eq!(rows.map(|row| row[lane]), expected, "{first} {lane}");
            }
            let stretch = first.min(4);
            assert_eq!(hulls.whole(stretch), whole[stretch]);
            let parts = hulls.parts(first);
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
        let none = Hulls::new(0, &whole, part);
        assert!(none.parts(3).is_empty());
    }
}
