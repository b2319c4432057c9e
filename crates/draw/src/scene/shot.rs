use glam::Vec3;

use super::{Camera, Figure};
use sabaki::maps::BitMap;
use sabaki::math::Rigid2;

/// Two spheres and everything between them, or one sphere, where both ends are the same.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Capsule {
    /// Centre and radius of one end, metres.
    pub a: [f32; 4],
    /// Of the other.
    pub b: [f32; 4],
    /// Linear red, green, blue, and alpha: below 1 only among ghosts.
    pub colour: [f32; 4],
}

impl Capsule {
    /// Between two spheres, each its centre and radius.
    #[must_use]
    pub fn new((a, radius_a): (Vec3, f32), (b, radius_b): (Vec3, f32), colour: [f32; 4]) -> Self {
        Self {
            a: a.extend(radius_a).to_array(),
            b: b.extend(radius_b).to_array(),
            colour,
        }
    }

    /// One sphere.
    #[must_use]
    pub fn ball(centre: Vec3, radius: f32, colour: [f32; 4]) -> Self {
        Self::new((centre, radius), (centre, radius), colour)
    }
}

/// Sun and sky, and what the distance fades into. Colours are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Towards the sun.
    pub sunward: Vec3,
    /// Of the sun.
    pub sun: Vec3,
    /// From above.
    pub above: Vec3,
    /// From below.
    pub below: Vec3,
    /// What the distance fades into.
    pub horizon: Vec3,
    /// The sky high up.
    pub zenith: Vec3,
    /// Of the floor.
    pub floor: Vec3,
    /// How dark the lines of its grid are, from 0 to 1.
    pub grid: f32,
    /// Metres at which things have faded to 1/e.
    pub fade: f32,
    /// The middle of where shadows fall, on the ground, and how far from there, metres.
    pub shadow: (Vec3, f32),
}

impl Default for Light {
    /// A light room around the origin.
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
            shadow: (Vec3::ZERO, 4.0),
        }
    }
}

/// A map of texels that lies in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The texels; their rectangle counts them from the frame's origin.
    pub map: BitMap,
    /// Side of a texel, metres.
    pub texel: f32,
    /// Takes the map's frame to the world.
    pub placement: Rigid2,
    /// Above the ground, metres.
    pub height: f32,
    /// Linear red, green, blue, and alpha.
    pub colour: [f32; 4],
}

/// How finely bodies of a crowd are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// As a single fighter is.
    Fine,
    /// For some tens of pixels.
    Medium,
    /// For a few pixels.
    Coarse,
}

/// One character of a crowd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdMember {
    /// Where the first number of its pose stands in the crowd's output.
    pub first: u32,
    /// How far apart its numbers stand.
    pub stride: u32,
    /// A colour, and how much of it shows, from 0 to 1.
    pub tint: [f32; 4],
}

/// Members of a crowd that are drawn alike.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberGroup {
    /// Which of [`CrowdShot::figures`] they have.
    pub figure: usize,
    /// Positions among the members.
    pub members: std::ops::Range<u32>,
    /// How finely.
    pub detail: Detail,
    /// Whether they cast shadows.
    pub casts: bool,
}

/// A crowd whose poses are where the device reads them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CrowdShot {
    /// What bodies are made of: one for each level of detail.
    pub figures: Vec<Figure>,
    /// Everybody.
    pub members: Vec<CrowdMember>,
    /// Those that are drawn.
    pub groups: Vec<MemberGroup>,
}

/// One picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// From where.
    pub camera: Camera,
    /// In which light.
    pub light: Light,
    /// Bodies and balls.
    pub solids: Vec<Capsule>,
    /// What one can look through, before which nothing of its own kind is seen.
    pub ghosts: Vec<Capsule>,
    /// Maps, the lowest first.
    pub layers: Vec<Layer>,
}

impl Shot {
    /// An empty floor.
    #[must_use]
    pub fn new(camera: Camera, light: Light) -> Self {
        Self {
            camera,
            light,
            solids: Vec::new(),
            ghosts: Vec::new(),
            layers: Vec::new(),
        }
    }
}
