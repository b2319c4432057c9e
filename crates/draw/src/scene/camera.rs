//! Cameras, and the times of the pictures that they take for a film whose playback slows down.

use glam::camera::rh;
use glam::{Mat4, Vec2, Vec3};
use sabaki::math::Sphere;

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position in the world, in metres.
    pub eye: Vec3,
    /// Point at the centre of the picture.
    pub target: Vec3,
    /// Vertical field of view, in radians.
    pub field: f32,
}

/// Position of a camera relative to its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Point at the centre of the picture, in the world.
    pub target: Vec3,
    /// Heading from the target to the camera, in radians from +Z towards +X.
    pub around: f32,
    /// Angle above the horizon, in radians.
    pub up: f32,
    /// Distance from the target, in metres.
    pub distance: f32,
}

impl Camera {
    /// Distance of the near plane, in metres.
    pub const NEAR: f32 = 0.05;

    /// Camera on a sphere around a target, with a field of view of 35 degrees.
    #[must_use]
    pub fn orbit(orbit: Orbit) -> Self {
        let Orbit {
            target,
            around,
            up,
            distance,
        } = orbit;
        let out = Vec3::new(around.sin() * up.cos(), up.sin(), around.cos() * up.cos());
        Self {
            eye: target + out * distance,
            target,
            field: 35f32.to_radians(),
        }
    }

    /// Camera in the horizontal direction `out` from `place`, at an angle above the horizon, that shows spheres over the whole height above the
    /// ground. The picture has `share` of the width of the spheres beside its centre and `margin` metres around; the centre is `lift` metres
    /// above the middle.
    pub(super) fn framing(
        place: Vec3,
        out: Vec3,
        up: f32,
        seen: &[Sphere],
        aspect: f32,
        [share, margin, lift]: [f32; 3],
    ) -> Self {
        let right = Vec3::Y.cross(out);
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for Sphere { centre, radius } in seen {
            let at = Vec2::new(centre.dot(right), centre.y);
            low = low.min(at - *radius);
            high = high.max(at + *radius);
        }
        let middle = place.with_y(0.0);
        let aside = 0.5 * (low.x + high.x) - middle.dot(right);
        let half = (share * (high.x - low.x) / aspect).max(0.5 * high.y) + margin;
        let field = 30f32.to_radians();
        Self {
            field,
            ..Self::orbit(Orbit {
                target: middle + right * aside + Vec3::Y * (0.5 * high.y + lift),
                around: out.x.atan2(out.z),
                up,
                distance: half / (0.5 * field).tan(),
            })
        }
    }

    /// Transform from world to Vulkan's clip space: y points down, depth is 1 at [`Camera::NEAR`]
    /// and 0 at infinity. `aspect` is width divided by height.
    pub fn clip(&self, aspect: f32) -> Mat4 {
        let ahead = self.target - self.eye;
        let up = if ahead.x.hypot(ahead.z) < 1e-4 * ahead.y.abs() {
            Vec3::Z
        } else {
            Vec3::Y
        };
        let view = rh::view::look_at_mat4(self.eye, self.target, up);
        rh::proj::vulkan::perspective_infinite_reverse(self.field, aspect, Self::NEAR) * view
    }

    /// The camera, moved back from its target until spheres are inside of a picture whose width divided by its height is `aspect`. It does
    /// not come nearer.
    #[must_use]
    pub fn enclosing(self, spheres: impl IntoIterator<Item = Sphere>, aspect: f32) -> Self {
        let back = self.eye - self.target;
        let (out, distance) = (back.normalize_or(Vec3::Z), back.length());
        let right = Vec3::Y.cross(out).normalize_or(Vec3::X);
        let up = out.cross(right);
        let vertical = (0.5 * self.field).tan();
        let needed = spheres.into_iter().flat_map(|Sphere { centre, radius }| {
            let away = centre - self.target;
            let sides = [(right, vertical * aspect), (up, vertical)];
            sides.map(|(side, slope)| {
                let half = away.dot(side).abs() + radius * slope.hypot(1.0);
                away.dot(out) + half / slope
            })
        });
        Self {
            eye: self.target + out * needed.fold(distance, f32::max),
            ..self
        }
    }

    /// Pixel at which a place appears in a picture of `size` pixels, from the top left corner.
    /// Returns `None` for places behind the camera.
    pub fn pixel(&self, place: Vec3, size: [u32; 2]) -> Option<Vec2> {
        let size = Vec2::new(size[0] as f32, size[1] as f32);
        let clip = self.clip(size.x / size.y) * place.extend(1.0);
        let at = Vec2::new(clip.x, clip.y) / clip.w;
        (clip.w > Self::NEAR).then(|| (at * 0.5 + 0.5) * size)
    }

    /// Unit direction from the camera through a pixel.
    pub fn ray(&self, pixel: Vec2, size: [u32; 2]) -> Vec3 {
        let size = Vec2::new(size[0] as f32, size[1] as f32);
        let at = pixel / size * 2.0 - 1.0;
        let back = self.clip(size.x / size.y).inverse();
        (back.project_point3(at.extend(1.0)) - self.eye).normalize_or(Vec3::NEG_Z)
    }
}

/// Range of the number of pictures per second.
const RATE: [f32; 2] = [1.0, 1000.0];

/// The nearest value in a range. For NaN the least one.
pub(super) fn bounded(value: f32, [least, most]: [f32; 2]) -> f32 {
    value.max(least).min(most)
}

/// Times of the pictures in a span, with `rate` pictures per second. `pace` is the playback speed at a time.
pub(super) fn film_times([start, end]: [f32; 2], rate: f32, pace: impl Fn(f32) -> f32) -> Vec<f32> {
    let rate = f64::from(bounded(rate, RATE));
    let (mut times, mut t) = (Vec::new(), f64::from(start));
    while t < f64::from(end) {
        times.push(t as f32);
        t += f64::from(pace(t as f32)) / rate;
    }
    times
}
