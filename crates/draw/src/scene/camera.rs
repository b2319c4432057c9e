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

    /// Transform from world to Vulkan's clip space: y points down, depth is 1 at [`Camera::NEAR`]
    /// and 0 at infinity. `aspect` is width divided by height.
    #[must_use]
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
    #[must_use]
    pub fn pixel(&self, place: Vec3, size: [u32; 2]) -> Option<Vec2> {
        let size = Vec2::new(size[0] as f32, size[1] as f32);
        let clip = self.clip(size.x / size.y) * place.extend(1.0);
        let at = Vec2::new(clip.x, clip.y) / clip.w;
        (clip.w > Self::NEAR).then(|| (at * 0.5 + 0.5) * size)
    }

    /// Unit direction from the camera through a pixel.
    #[must_use]
    pub fn ray(&self, pixel: Vec2, size: [u32; 2]) -> Vec3 {
        let size = Vec2::new(size[0] as f32, size[1] as f32);
        let at = pixel / size * 2.0 - 1.0;
        let back = self.clip(size.x / size.y).inverse();
        (back.project_point3(at.extend(1.0)) - self.eye).normalize_or(Vec3::NEG_Z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enclosed_spheres_are_inside_of_the_picture_and_one_of_them_touches_its_edge() {
        let camera = Camera::orbit(Orbit {
            target: Vec3::new(0.3, 1.0, -0.2),
            around: 0.7,
            up: 0.2,
            distance: 0.5,
        });
        let places = [
            Vec3::ZERO,
            Vec3::new(1.5, 1.8, 1.0),
            Vec3::new(-2.0, 1.0, 0.6),
        ];
        let size = [600, 400];
        let near = camera.enclosing(places.map(|place| Sphere::new(place, 0.0)), 1.5);
        let edge = places.map(|place| {
            let at = near.pixel(place, size).unwrap();
            (at.min(Vec2::new(600.0, 400.0) - at)).min_element()
        });
        let least = edge.into_iter().fold(f32::MAX, f32::min);
        assert!(least.abs() < 0.1, "{edge:?}");
        let far = camera.enclosing(places.map(|place| Sphere::new(place, 0.3)), 1.5);
        assert!(far.eye.distance(far.target) > near.eye.distance(near.target) + 0.3);
        assert_eq!(far.enclosing([Sphere::new(Vec3::ZERO, 0.1)], 1.5), far);
    }

    #[test]
    fn a_pixel_is_seen_where_its_ray_goes() {
        let camera = Camera::orbit(Orbit {
            target: Vec3::new(0.3, 1.0, -0.2),
            around: 0.7,
            up: 0.3,
            distance: 4.0,
        });
        let size = [640, 360];
        let middle = camera.pixel(camera.target, size).unwrap();
        assert!(middle.distance(Vec2::new(320.0, 180.0)) < 1e-2, "{middle}");
        let place = Vec3::new(-0.5, 0.2, 0.4);
        let pixel = camera.pixel(place, size).unwrap();
        let ray = camera.ray(pixel, size);
        let along = (place - camera.eye).dot(ray);
        assert!((camera.eye + along * ray).distance(place) < 1e-3);
        // Higher places are closer to the top edge, and places behind the camera are not visible.
        assert!(camera.pixel(place + Vec3::Y, size).unwrap().y < pixel.y);
        assert_eq!(camera.pixel(2.0 * camera.eye - camera.target, size), None);
    }
}
