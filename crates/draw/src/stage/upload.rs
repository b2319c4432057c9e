//! Writes a shot into the buffers of a slot.

use std::ops::Range;

use ash::vk;
use glam::camera::rh;
use glam::{Mat3, Mat4, Vec3, Vec4};

use super::meshes::Skins;
use super::slot::{MOST_SKINNED_GROUPS, POSE_NUMBERS, write};
use super::{Picture, Stage, Target};
use crate::scene::{Capsule, CrowdShot, Detail, Layer, Light, Mesh, Shot, Skin, SkinnedBody};
use crate::shaders::{Bone, Character, DrawCommand, DrawLayer, DrawSkin, FrameData};
use sabaki::gpu::GpuError;
use sabaki::gpu::internal::within;
use sabaki::math::{F32x16, Sphere};

/// Numbers of a joint of a crowd: three rows of its frame.
const MATRIX_NUMBERS: u64 = 12;

/// Contents of a slot's buffers.
pub(super) struct Draws {
    /// Image that is drawn into.
    pub(super) target: Target,
    pub(super) solids: u32,
    pub(super) occluders: u32,
    pub(super) ghosts: u32,
    pub(super) layers: Vec<DrawLayer>,
    pub(super) skins: Vec<SkinDraw>,
}

/// Instances of a mesh that one draw call draws, by the command of the same index.
#[derive(Clone, Copy)]
pub(super) struct SkinDraw {
    pub(super) constants: DrawSkin,
    pub(super) is_ghost: bool,
    pub(super) casts: bool,
}

impl Stage {
    /// Writes a picture into a slot's buffers.
    pub(super) fn upload(&self, slot: u32, picture: &Picture<'_>) -> Result<Draws, GpuError> {
        let (context, desc) = (&self.context, &self.desc);
        let (shot, target) = (picture.shot, picture.target);
        let slots = self.parts.slots.len() as u32;
        let found = self.parts.slots.get(slot as usize);
        let slot = found.ok_or(GpuError::NoSuchSlot { slot, slots })?;
        let fits = |name, needed: usize, most: u32| within(name, needed as u64, most.into());
        let (encodes, shadow_side) = (!is_srgb(desc.format), desc.shadow_side.max(1));
        let frame = frame_data(shot, target.size, encodes, shadow_side);
        write(context, &slot.frame, &[frame])?;
        let capsules = shot.solids.iter().chain(&shot.occluders);
        let capsules: Vec<Capsule> = capsules.chain(&shot.ghosts).copied().collect();
        fits("StageDesc::max_capsules", capsules.len(), desc.max_capsules)?;
        write(context, &slot.capsules, &capsules)?;
        let (layers, words) = layers(&shot.layers);
        fits("StageDesc::max_map_words", words.len(), desc.max_map_words)?;
        write(context, &slot.words, &words)?;
        let mut skinned = Skinned::new(&self.parts.skins, slot.first_skinned_number());
        if let Some(crowd) = picture.crowd {
            check_poses(crowd, slot.crowd_numbers())?;
            skinned
                .members
                .extend(crowd.members.iter().map(|member| Character {
                    place: [
                        slot.first_number.wrapping_add(member.first),
                        member.stride,
                        u32::MAX,
                        1f32.to_bits(),
                    ],
                    tint: member.tint,
                }));
            let count = skinned.members.len();
            fits("StageDesc::max_members", count, desc.max_members)?;
            slot.flush_poses(context)?;
            skinned.add_crowd(crowd)?;
        }
        let bodies = shot.skinned.len();
        fits("StageDesc::max_skinned", bodies, desc.max_skinned)?;
        for body in &shot.skinned {
            skinned.add_body(body)?;
        }
        let joints = skinned.numbers.len() / POSE_NUMBERS;
        let most = desc.max_skinned_joints;
        fits("StageDesc::max_skinned_joints", joints, most)?;
        fits("StageDesc::max_bones", skinned.bones.len(), desc.max_bones)?;
        write(context, &slot.members, &skinned.members)?;
        write(context, &slot.bones, &skinned.bones)?;
        write(context, &slot.commands, &skinned.commands)?;
        slot.write_skinned(context, &skinned.numbers)?;
        Ok(Draws {
            target,
            solids: shot.solids.len() as u32,
            occluders: shot.occluders.len() as u32,
            ghosts: shot.ghosts.len() as u32,
            layers,
            skins: skinned.draws,
        })
    }
}

/// Whether the groups of a crowd have the members and skins that they refer to, and whether the poses of all their members are
/// within the first `numbers` of the memory.
fn check_poses(crowd: &CrowdShot, numbers: u64) -> Result<(), GpuError> {
    let joints = crowd.skins.iter().map(|skin| joints_of_skin(skin));
    let joints: Vec<u64> = joints.collect();
    let members = crowd.members.len() as u64;
    for group in &crowd.groups {
        within("members of a CrowdShot", group.members.end.into(), members)?;
        within(
            "skins of a CrowdShot",
            group.skin as u64 + 1,
            joints.len() as u64,
        )?;
        let Some(last) = (MATRIX_NUMBERS * joints[group.skin]).checked_sub(1) else {
            continue;
        };
        let range = group.members.start as usize..group.members.end as usize;
        for member in crowd.members.get(range).unwrap_or_default() {
            let needed = u64::from(member.first) + u64::from(member.stride) * last + 1;
            let lanes = F32x16::LANES as u64;
            let (needed, most) = (needed.div_ceil(lanes), numbers / lanes);
            within("StageDesc::max_crowd_len", needed, most)?;
        }
    }
    Ok(())
}

fn is_srgb(format: vk::Format) -> bool {
    use vk::Format as F;
    matches!(
        format,
        F::R8G8B8A8_SRGB
            | F::B8G8R8A8_SRGB
            | F::A8B8G8R8_SRGB_PACK32
            | F::R8G8B8_SRGB
            | F::B8G8R8_SRGB
    )
}

/// Push constants of each layer, and the words of all layers.
fn layers(layers: &[Layer]) -> (Vec<DrawLayer>, Vec<u32>) {
    let mut words = Vec::new();
    let draws = layers.iter().map(|layer| {
        let (rect, first) = (layer.map.rect(), words.len() as u32);
        words.extend_from_slice(layer.map.words());
        DrawLayer {
            placement: [
                layer.placement.cos(),
                layer.placement.sin(),
                layer.placement.x,
                layer.placement.z,
            ],
            grid: [rect.u as f32, rect.v as f32, layer.texel, layer.height],
            colour: layer.colour,
            extent: [
                rect.width,
                rect.height,
                first,
                layer.map.words_per_row() as u32,
            ],
        }
    });
    let draws = draws.collect();
    (draws, words)
}

/// The data that is written for skinned bodies and a crowd.
struct Skinned<'a> {
    meshes: &'a Skins,
    members: Vec<Character>,
    bones: Vec<Bone>,
    /// Poses of single bodies.
    numbers: Vec<f32>,
    /// Index of the first of these numbers in the buffer.
    first_number: u32,
    draws: Vec<SkinDraw>,
    commands: Vec<DrawCommand>,
}

impl<'a> Skinned<'a> {
    fn new(meshes: &'a Skins, first_number: u32) -> Self {
        Self {
            meshes,
            members: Vec::new(),
            bones: Vec::new(),
            numbers: Vec::new(),
            first_number,
            draws: Vec::new(),
            commands: Vec::new(),
        }
    }

    fn add_bones(&mut self, skin: &Skin) -> u32 {
        let first = self.bones.len() as u32;
        self.bones.extend(skin.bones.iter().map(|bone| Bone {
            joint: [u32::from(bone.joint.0), 0, 0, 0],
            rotation: bone.bind.rotation.to_array(),
            translation: bone.bind.translation.extend(0.0).to_array(),
            unused: [0.0; 4],
        }));
        first
    }

    /// Adds a crowd whose members have been added: a draw for each group.
    fn add_crowd(&mut self, crowd: &CrowdShot) -> Result<(), GpuError> {
        let groups = crowd.groups.len() as u64;
        within("groups of a CrowdShot", groups, MOST_SKINNED_GROUPS.into())?;
        let firsts = crowd.skins.iter().map(|skin| self.add_bones(skin));
        let firsts: Vec<u32> = firsts.collect();
        for group in &crowd.groups {
            let (skin, members) = (&crowd.skins[group.skin], group.members.clone());
            let is_dual = group.detail == Detail::Fine;
            let detail = (group.detail as usize).min(Mesh::DETAILS - 1);
            let draw = self.add(skin, detail, members, firsts[group.skin], is_dual)?;
            draw.casts = group.casts;
        }
        Ok(())
    }

    /// Adds a draw of members with the bones from `first_bone` on, which casts shadows.
    fn add(
        &mut self,
        skin: &Skin,
        detail: usize,
        members: Range<u32>,
        first_bone: u32,
        is_dual: bool,
    ) -> Result<&mut SkinDraw, GpuError> {
        let places = &self.meshes.places;
        within(
            "StageDesc::meshes",
            skin.mesh as u64 + 1,
            places.len() as u64,
        )?;
        let place = &places[skin.mesh];
        within(
            "bones of a Skin",
            place.bones.into(),
            skin.bones.len() as u64,
        )?;
        let (first_index, index_count) = place.details[detail];
        self.commands.push(DrawCommand {
            index_count,
            instance_count: members.len() as u32,
            first_index,
            vertex_offset: place.first_vertex,
            first_instance: 0,
        });
        let index = self.draws.len();
        self.draws.push(SkinDraw {
            constants: DrawSkin {
                sun: 0,
                first_character: members.start,
                first_bone,
                dual: is_dual.into(),
                texture_place: place.texture,
            },
            is_ghost: false,
            casts: true,
        });
        Ok(&mut self.draws[index])
    }

    fn add_body(&mut self, body: &SkinnedBody) -> Result<(), GpuError> {
        let (needed, joints) = (joints_of_skin(&body.skin), body.joints.len() as u64);
        within("joints of a SkinnedBody", needed, joints)?;
        let first = self.first_number + self.numbers.len() as u32;
        for joint in &body.joints {
            let (turn, at) = (Mat3::from_quat(joint.rotation), joint.translation);
            for row in 0..3 {
                let row = turn.row(row).extend(at[row]);
                self.numbers.extend(row.to_array());
            }
        }
        let weights = self.first_number + self.numbers.len() as u32;
        let all = if body.tinted.is_empty() { 1.0 } else { 0.0 };
        let tinted = |joint: usize| body.tinted.get(joint).copied().unwrap_or(all);
        self.numbers.extend((0..body.joints.len()).map(tinted));
        let first_bone = self.add_bones(&body.skin);
        let member = self.members.len() as u32;
        let draw = self.add(&body.skin, 0, member..member + 1, first_bone, true)?;
        draw.is_ghost = body.alpha < 1.0;
        self.members.push(Character {
            place: [first, 1, weights, body.alpha.to_bits()],
            tint: body.tint,
        });
        Ok(())
    }
}

/// Number of joints up to the last one that a skin refers to.
fn joints_of_skin(skin: &Skin) -> u64 {
    let joints = skin.bones.iter().map(|bone| u64::from(bone.joint.0) + 1);
    joints.max().unwrap_or_default()
}

/// Maximum number of capsules that darken the floor beneath them: enough for a fighter and a ball.
const MOST_OCCLUDERS: usize = 48;

/// Camera and light as the shaders read them. `encodes`: whether the shaders must encode sRGB.
fn frame_data(shot: &Shot, side: [u32; 2], encodes: bool, shadow_side: u32) -> FrameData {
    let Light { shadow, .. } = shot.light;
    let [width, height] = side;
    let camera = shot.camera.clip(width as f32 / height as f32);
    let sunward = shot.light.sunward.normalize_or(Vec3::Y);
    let texel = 2.0 * shadow.radius / shadow_side as f32;
    let colour = |colour: Vec3, w: f32| colour.extend(w).to_array();
    let occluders = match shot.solids.len() + shot.occluders.len() {
        count if count <= MOST_OCCLUDERS => count,
        _ => 0,
    };
    FrameData {
        camera: camera.to_cols_array(),
        sun: sun(sunward, shadow).to_cols_array(),
        unproject: camera.inverse().to_cols_array(),
        eye: colour(shot.camera.eye, f32::from(u8::from(encodes))),
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
