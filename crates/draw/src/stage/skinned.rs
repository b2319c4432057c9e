//! Writes and draws skinned bodies and crowds.

use ash::vk;
use glam::Mat3;

use super::Stage;
use super::pipelines::Draw;
use super::skins::bones;
use super::slot::{MOST_SKINNED_GROUPS, POSE_NUMBERS, write};
use crate::scene::{CrowdShot, Detail, Mesh, Skin, SkinnedBody};
use crate::shaders::{CrowdCharacter, CrowdPart, DrawCommand, DrawSkin};
use sabaki::gpu::GpuError;
use sabaki::gpu::internal::within;

/// Instances of a mesh that one draw call draws.
#[derive(Clone, Copy)]
pub(super) struct SkinDraw {
    mesh: usize,
    detail: usize,
    instances: u32,
    /// Number of the skin's bones.
    bones: usize,
    constants: DrawSkin,
    pub(super) is_ghost: bool,
    pub(super) casts: bool,
    /// Index of the command.
    command: u32,
}

/// Bodies of a pass that are drawn from the commands of a slot.
pub(super) struct SkinPass {
    pub(super) draw: Draw,
    pub(super) commands: vk::Buffer,
}

/// The data that is written for skinned bodies and a crowd.
pub(super) struct Skinned {
    pub(super) members: Vec<CrowdCharacter>,
    /// Parts of figures, then bones of skins.
    pub(super) parts: Vec<CrowdPart>,
    /// Poses of single bodies.
    numbers: Vec<f32>,
    /// Index of the first of these numbers in the buffer.
    first_number: u32,
    draws: Vec<SkinDraw>,
}

impl Skinned {
    pub(super) fn new(first_number: u32) -> Self {
        Self {
            members: Vec::new(),
            parts: Vec::new(),
            numbers: Vec::new(),
            first_number,
            draws: Vec::new(),
        }
    }

    /// Adds the bones of a skin and returns the index of the first.
    fn add_bones(&mut self, skin: &Skin) -> u32 {
        let first = self.parts.len() as u32;
        self.parts
            .extend(bones(skin).map(bytemuck::cast::<_, CrowdPart>));
        first
    }

    /// Adds a crowd whose members have been added: a draw for each group.
    pub(super) fn add_crowd(&mut self, crowd: &CrowdShot) -> Result<(), GpuError> {
        let groups = crowd.groups.len() as u64;
        within("groups of a CrowdShot", groups, MOST_SKINNED_GROUPS.into())?;
        let firsts: Vec<u32> = crowd
            .skins
            .iter()
            .map(|skin| self.add_bones(skin))
            .collect();
        for group in &crowd.groups {
            let skin = &crowd.skins[group.figure];
            self.draws.push(SkinDraw {
                mesh: skin.mesh,
                detail: (group.detail as usize).min(Mesh::DETAILS - 1),
                instances: group.members.len() as u32,
                bones: skin.bones.len(),
                constants: DrawSkin {
                    sun: 0,
                    first_character: group.members.start,
                    first_bone: firsts[group.figure],
                    dual: u32::from(group.detail == Detail::Fine),
                    texture_place: [0; 4],
                },
                is_ghost: false,
                casts: group.casts,
                command: 0,
            });
        }
        Ok(())
    }

    pub(super) fn add_body(&mut self, body: &SkinnedBody) -> Result<(), GpuError> {
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
        self.draws.push(SkinDraw {
            mesh: body.skin.mesh,
            detail: 0,
            instances: 1,
            bones: body.skin.bones.len(),
            constants: DrawSkin {
                sun: 0,
                first_character: self.members.len() as u32,
                first_bone,
                dual: 1,
                texture_place: [0; 4],
            },
            is_ghost: body.alpha < 1.0,
            casts: true,
            command: 0,
        });
        self.members.push(CrowdCharacter {
            place: [first, 1, weights, body.alpha.to_bits()],
            tint: body.tint,
        });
        Ok(())
    }
}

/// Number of joints up to the last one that a skin refers to.
pub(super) fn joints_of_skin(skin: &Skin) -> u64 {
    let joints = skin.bones.iter().map(|bone| u64::from(bone.joint.0) + 1);
    joints.max().unwrap_or_default()
}

impl Stage {
    /// Writes members, parts, bones, poses and draw commands into a slot's buffers. Returns the draws.
    pub(super) fn upload_skinned(
        &self,
        slot: usize,
        bodies: usize,
        skinned: &Skinned,
    ) -> Result<Vec<SkinDraw>, GpuError> {
        let (context, desc, meshes) = (&self.context, &self.desc, &self.parts.skins);
        let fits = |name, needed: usize, most: u32| within(name, needed as u64, most.into());
        let joints = skinned.numbers.len() / POSE_NUMBERS;
        fits("StageDesc::max_skinned", bodies, desc.max_skinned)?;
        let most = desc.max_skinned_joints;
        fits("StageDesc::max_skinned_joints", joints, most)?;
        fits("StageDesc::max_parts", skinned.parts.len(), desc.max_parts)?;
        let mut draws = skinned.draws.clone();
        let mut commands: Vec<DrawCommand> = Vec::with_capacity(draws.len());
        for draw in &mut draws {
            let last = draw.mesh as u64 + 1;
            within("StageDesc::meshes", last, meshes.len() as u64)?;
            let bones = meshes.bones(draw.mesh);
            within("bones of a Skin", bones.into(), draw.bones as u64)?;
            draw.constants.texture_place = meshes.texture(draw.mesh);
            draw.command = commands.len() as u32;
            commands.push(meshes.command(draw.mesh, draw.detail, draw.instances));
        }
        let slot = &self.parts.slots[slot];
        write(context, &slot.members, &skinned.members)?;
        write(context, &slot.parts, &skinned.parts)?;
        write(context, &slot.commands, &commands)?;
        slot.write_skinned(context, &skinned.numbers)?;
        Ok(draws)
    }

    /// Draws skinned meshes: one indirect draw for each mesh, level and resolution.
    ///
    /// # Safety
    /// As for [`Stage::record`], inside of rendering.
    pub(super) unsafe fn skins<'d>(
        &self,
        cmd: vk::CommandBuffer,
        pass: SkinPass,
        skins: impl Iterator<Item = &'d SkinDraw>,
    ) {
        let (device, meshes) = (self.context.device(), &self.parts.skins);
        let stride = size_of::<DrawCommand>() as u32;
        let mut is_bound = false;
        for skin in skins {
            let constants = DrawSkin {
                sun: u32::from(matches!(pass.draw, Draw::SkinShadow)),
                ..skin.constants
            };
            let offset = u64::from(skin.command) * u64::from(stride);
            // SAFETY: the caller vouches for `cmd`; the buffers are the stage's, and the commands were written.
            unsafe {
                if !std::mem::replace(&mut is_bound, true) {
                    self.bind(cmd, pass.draw);
                    device.cmd_bind_vertex_buffers(cmd, 0, &[meshes.vertices.handle], &[0]);
                    let indices = meshes.indices.handle;
                    device.cmd_bind_index_buffer(cmd, indices, 0, vk::IndexType::UINT32);
                }
                self.push(cmd, &constants);
                device.cmd_draw_indexed_indirect(cmd, pass.commands, offset, 1, stride);
            }
        }
    }
}
