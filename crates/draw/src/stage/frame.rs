//! Converts camera and light to the uniform buffer of the shaders.

use glam::camera::rh;
use glam::{Mat4, Vec3, Vec4};

use crate::scene::{Light, Shot};
use crate::shaders::FrameData;
use sabaki::math::Sphere;

/// Properties of the stage that shaders need.
#[derive(Clone, Copy)]
pub(super) struct FrameSettings {
    /// Width and height of the target, in pixels.
    pub(super) side: [u32; 2],
    /// Whether the shaders must encode sRGB.
    pub(super) encodes: bool,
    pub(super) shadow_side: u32,
}

/// Maximum number of capsules that darken the floor beneath them: enough for a fighter and a ball.
const MOST_OCCLUDERS: usize = 48;

pub(super) fn frame_data(shot: &Shot, settings: FrameSettings) -> FrameData {
    let Light { shadow, .. } = shot.light;
    let [width, height] = settings.side;
    let camera = shot.camera.clip(width as f32 / height as f32);
    let sunward = shot.light.sunward.normalize_or(Vec3::Y);
    let texel = 2.0 * shadow.radius / settings.shadow_side as f32;
    let colour = |colour: Vec3, w: f32| colour.extend(w).to_array();
    let occluders = match shot.solids.len() + shot.occluders.len() {
        count if count <= MOST_OCCLUDERS => count,
        _ => 0,
    };
    FrameData {
        camera: camera.to_cols_array(),
        sun: sun(sunward, shadow).to_cols_array(),
        unproject: camera.inverse().to_cols_array(),
        eye: colour(shot.camera.eye, f32::from(u8::from(settings.encodes))),
        sunward: colour(sunward, 1.5 * texel),
        sunlight: colour(shot.light.sun, 0.0),
        above: colour(shot.light.above, 0.0),
        below: colour(shot.light.below, 0.0),
        horizon: colour(shot.light.horizon, shot.light.fade),
        zenith: colour(shot.light.zenith, 0.0),
        ground: colour(shot.light.floor, shot.light.grid),
        shade: Vec4::new(shadow.centre.x, shadow.centre.z, shadow.radius, 0.0).to_array(),
        counts: [occluders as u32, 0, 0, 0],
    }
}

/// Transform from world to the clip space of the shadow map: a box along the sun's rays.
fn sun(sunward: Vec3, area: Sphere) -> Mat4 {
    let Sphere { centre, radius } = area;
    let up = if sunward.y.abs() > 0.99 {
        Vec3::Z
    } else {
        Vec3::Y
    };
    // Height that the box covers above the ground, with a margin for rays at a low angle.
    let deep = 2.0 * radius + 4.0;
    let view = rh::view::look_at_mat4(centre + sunward * deep, centre, up);
    rh::proj::vulkan::orthographic(-radius, radius, -radius, radius, 0.0, 2.0 * deep) * view
}
