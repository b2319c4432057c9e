//! One picture as plain data.

use std::sync::Arc;

use glam::Vec3;

use super::{Camera, Skin, SkinnedBody};
use sabaki::maps::BitMap;
use sabaki::math::{Rigid2, Sphere};

/// The convex hull of two spheres. If both are equal, it is a sphere.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Capsule {
    /// Centre and radius of one end, in metres.
    pub a: [f32; 4],
    /// Centre and radius of the other end, in metres.
    pub b: [f32; 4],
    /// Linear red, green, blue, and alpha. Alpha may be below 1 only for ghosts.
    pub colour: [f32; 4],
}

impl Capsule {
    /// Creates a capsule from two spheres.
    #[must_use]
    pub fn new(a: Sphere, b: Sphere, colour: [f32; 4]) -> Self {
        let [a, b] = [a, b].map(|end| end.centre.extend(end.radius).to_array());
        Self { a, b, colour }
    }

    /// Creates a capsule that is a sphere.
    #[must_use]
    pub fn ball(sphere: Sphere, colour: [f32; 4]) -> Self {
        Self::new(sphere, sphere, colour)
    }
}

/// Sun, sky and fog. Colours are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Direction towards the sun.
    pub sunward: Vec3,
    /// Colour of the sun.
    pub sun: Vec3,
    /// Colour of the ambient light from above.
    pub above: Vec3,
    /// Colour of the ambient light from below.
    pub below: Vec3,
    /// Colour of the horizon and the fog.
    pub horizon: Vec3,
    /// Colour of the zenith.
    pub zenith: Vec3,
    /// Colour of the floor.
    pub floor: Vec3,
    /// Strength of the floor's grid lines, from 0 to 1.
    pub grid: f32,
    /// Distance at which the fog has reduced contrast to 1/e, in metres.
    pub fade: f32,
    /// Area with shadows.
    pub shadow: Sphere,
}

impl Default for Light {
    /// Bright light around the origin.
    fn default() -> Self {
        Self {
            sunward: Vec3::new(0.45, 1.0, 0.55),
            sun: Vec3::new(0.80, 0.75, 0.66),
            above: Vec3::new(0.52, 0.56, 0.62),
            below: Vec3::new(0.26, 0.25, 0.24),
            horizon: Vec3::new(0.70, 0.745, 0.80),
            zenith: Vec3::new(0.42, 0.52, 0.66),
            floor: Vec3::new(0.60, 0.62, 0.64),
            grid: 0.25,
            fade: 14.0,
            shadow: Sphere::new(Vec3::ZERO, 4.0),
        }
    }
}

/// A map that is drawn in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Texels of the map. The rectangle is relative to the origin of the map's frame.
    pub map: BitMap,
    /// Side of a texel, in metres.
    pub texel: f32,
    /// Transform from the map's frame to the world.
    pub placement: Rigid2,
    /// Height above the ground, in metres.
    pub height: f32,
    /// Linear red, green, blue, and alpha.
    pub colour: [f32; 4],
}

/// Description of one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Camera of the picture.
    pub camera: Camera,
    /// Light of the picture.
    pub light: Light,
    /// Opaque bodies and balls.
    pub solids: Vec<Capsule>,
    /// Capsules that only darken the floor beneath them, like the bones of a skinned body.
    pub occluders: Vec<Capsule>,
    /// Skinned bodies.
    pub skinned: Vec<SkinnedBody>,
    /// Translucent bodies. Only the front surface of ghosts is visible.
    pub ghosts: Vec<Capsule>,
    /// Maps, lowest first.
    pub layers: Vec<Layer>,
}

impl Shot {
    /// Shot of an empty floor.
    #[must_use]
    pub fn new(camera: Camera, light: Light) -> Self {
        Self {
            camera,
            light,
            solids: Vec::new(),
            occluders: Vec::new(),
            skinned: Vec::new(),
            ghosts: Vec::new(),
            layers: Vec::new(),
        }
    }
}

/// Mesh resolution of a crowd's bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// The resolution of a single fighter.
    Fine,
    /// Resolution for some tens of pixels.
    Medium,
    /// Resolution for a few pixels.
    Coarse,
    /// Resolution of meshes for fewer pixels.
    Tiny,
}

/// A character of a crowd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdMember {
    /// Index of the pose's first value in the crowd's output.
    pub first: u32,
    /// Distance between the pose's values in the crowd's output.
    pub stride: u32,
    /// Tint colour, and its weight from 0 to 1.
    pub tint: [f32; 4],
}

/// Members of a crowd that one draw call draws.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberGroup {
    /// Index in [`CrowdShot::skins`].
    pub skin: usize,
    /// Range of the members.
    pub members: std::ops::Range<u32>,
    /// Mesh resolution.
    pub detail: Detail,
    /// Whether the members cast shadows.
    pub casts: bool,
}

/// A crowd whose poses are in device memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CrowdShot {
    /// Meshes, one for each level of detail.
    pub skins: Vec<Arc<Skin>>,
    /// All members.
    pub members: Vec<CrowdMember>,
    /// Groups of members that are drawn.
    pub groups: Vec<MemberGroup>,
}
