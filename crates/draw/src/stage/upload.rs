//! Writes a shot into the buffers of a slot.

use ash::vk;
use glam::Mat3;

use super::frame::{FrameSettings, frame_data};
use super::skins::bones;
use super::slot::{MOST_SKINNED_GROUPS, POSE_NUMBERS, Slot, write};
use super::{Picture, Stage, Target};
use crate::scene::{
    Capsule, CrowdMember, CrowdShot, Detail, Figure, FigurePart, Layer, MemberGroup, Mesh, Skin,
    SkinnedBody,
};
use crate::shaders::{CrowdCharacter, CrowdPart, DrawLayer, DrawSkin};
use sabaki::gpu::internal::within;
use sabaki::gpu::{Context, GpuError};

/// Contents of a slot's buffers.
pub(super) struct Draws {
    /// Image that is drawn into.
    pub(super) target: Target,
    pub(super) solids: u32,
    pub(super) occluders: u32,
    pub(super) ghosts: u32,
    pub(super) layers: Vec<DrawLayer>,
    pub(super) crowd: Vec<CrowdDraw>,
    pub(super) skins: Vec<SkinDraw>,
}

/// Skinned bodies that one draw call draws.
pub(super) struct SkinDraw {
    /// Index of the command.
    pub(super) command: u32,
    pub(super) constants: DrawSkin,
    pub(super) is_ghost: bool,
    pub(super) casts: bool,
}

/// A group of crowd members that one draw call draws.
pub(super) struct CrowdDraw {
    pub(super) detail: Detail,
    pub(super) first_character: u32,
    pub(super) characters: u32,
    pub(super) first_part: u32,
    pub(super) parts: u32,
    pub(super) casts: bool,
}

impl Stage {
    /// Writes a picture into a slot's buffers.
    pub(super) fn upload(&mut self, slot: u32, picture: &Picture<'_>) -> Result<Draws, GpuError> {
        let (context, desc) = (self.context.clone(), self.desc);
        let Picture {
            shot,
            crowd,
            target,
        } = *picture;
        let number = slot as usize;
        let slot = self.slot_mut(slot)?;
        let settings = FrameSettings {
            side: target.size,
            encodes: !is_srgb(desc.format),
            shadow_side: desc.shadow_side,
        };
        let fits = |name, needed: usize, most: u32| within(name, needed as u64, most.into());
        write(&context, &slot.frame, &[frame_data(shot, settings)])?;
        let capsules = shot.solids.iter().chain(&shot.occluders);
        let capsules: Vec<Capsule> = capsules.chain(&shot.ghosts).copied().collect();
        fits("StageDesc::max_capsules", capsules.len(), desc.max_capsules)?;
        write(&context, &slot.capsules, &capsules)?;
        let (layers, words) = layers(&shot.layers);
        fits("StageDesc::max_map_words", words.len(), desc.max_map_words)?;
        write(&context, &slot.words, &words)?;
        let mut draws = Draws {
            target,
            solids: shot.solids.len() as u32,
            occluders: shot.occluders.len() as u32,
            ghosts: shot.ghosts.len() as u32,
            layers,
            crowd: Vec::new(),
            skins: Vec::new(),
        };
        let mut skinned = Skinned::default();
        if let Some(crowd) = crowd {
            skinned.members = members(crowd, slot.first_number);
            let members = skinned.members.len();
            fits("StageDesc::max_members", members, desc.max_members)?;
            let (parts, ranges) = parts(&crowd.figures);
            skinned.parts = parts;
            slot.flush_poses(&context)?;
            let groups = crowd.groups.len();
            fits("groups of a CrowdShot", groups, MOST_SKINNED_GROUPS)?;
            let skins: Vec<u32> = { crowd.skins.iter() }
                .map(|skin| skinned.add_bones(skin))
                .collect();
            for group in &crowd.groups {
                let (end, all) = (u64::from(group.members.end), members as u64);
                within("members of a CrowdShot", end, all)?;
                if !crowd.skins.is_empty() {
                    let last = group.figure as u64 + 1;
                    within("skins of a CrowdShot", last, skins.len() as u64)?;
                    skinned.add_group(&crowd.skins[group.figure], group, skins[group.figure]);
                    continue;
                }
                within(
                    "figures of a CrowdShot",
                    group.figure as u64 + 1,
                    ranges.len() as u64,
                )?;
                let (first_part, parts) = ranges[group.figure];
                draws.crowd.push(CrowdDraw {
                    detail: group.detail,
                    first_character: group.members.start,
                    characters: group.members.len() as u32,
                    first_part,
                    parts,
                    casts: group.casts,
                });
            }
        }
        for body in &shot.skinned {
            skinned.add_body(body, slot.first_skinned_number());
        }
        let (bodies, joints) = (shot.skinned.len(), skinned.numbers.len() / POSE_NUMBERS);
        fits("StageDesc::max_skinned", bodies, desc.max_skinned)?;
        fits(
            "StageDesc::max_skinned_joints",
            joints,
            desc.max_skinned_joints,
        )?;
        fits("StageDesc::max_parts", skinned.parts.len(), desc.max_parts)?;
        skinned.write(&context, slot)?;
        let meshes = &self.parts.skins;
        let mut commands = Vec::with_capacity(skinned.draws.len());
        for draw in skinned.draws {
            within(
                "StageDesc::meshes",
                draw.mesh as u64 + 1,
                meshes.len() as u64,
            )?;
            let mut constants = draw.constants;
            constants.texture_place = meshes.texture(draw.mesh);
            draws.skins.push(SkinDraw {
                command: commands.len() as u32,
                constants,
                is_ghost: draw.is_ghost,
                casts: draw.casts,
            });
            commands.push(meshes.command(draw.mesh, draw.detail, draw.instances));
        }
        write(&context, &self.parts.slots[number].commands, &commands)?;
        Ok(draws)
    }
}

/// What is written for skinned bodies and a crowd.
#[derive(Default)]
struct Skinned {
    members: Vec<CrowdCharacter>,
    /// Parts of figures, then bones of skins.
    parts: Vec<CrowdPart>,
    /// Poses of single bodies.
    numbers: Vec<f32>,
    draws: Vec<MeshDraw>,
}

/// Instances of a mesh.
struct MeshDraw {
    mesh: usize,
    detail: usize,
    instances: u32,
    constants: DrawSkin,
    is_ghost: bool,
    casts: bool,
}

impl Skinned {
    /// Adds the bones of a skin and returns the index of the first.
    fn add_bones(&mut self, skin: &Skin) -> u32 {
        let first = self.parts.len() as u32;
        self.parts
            .extend(bones(skin).map(bytemuck::cast::<_, CrowdPart>));
        first
    }

    fn add_group(&mut self, skin: &Skin, group: &MemberGroup, first_bone: u32) {
        let detail = (group.detail as usize).min(Mesh::DETAILS - 1);
        self.draws.push(MeshDraw {
            mesh: skin.mesh,
            detail,
            instances: group.members.len() as u32,
            constants: DrawSkin {
                sun: 0,
                first_character: group.members.start,
                first_bone,
                dual: u32::from(group.detail == Detail::Fine),
                texture_place: [0; 4],
            },
            is_ghost: false,
            casts: group.casts,
        });
    }

    fn add_body(&mut self, body: &SkinnedBody, first_number: u32) {
        let first = first_number + self.numbers.len() as u32;
        for joint in &body.joints {
            let (turn, at) = (Mat3::from_quat(joint.rotation), joint.translation);
            for row in 0..3 {
                self.numbers
                    .extend(turn.row(row).extend(at[row]).to_array());
            }
        }
        let weights = first_number + self.numbers.len() as u32;
        let tinted = |joint: usize| body.tinted.get(joint).copied();
        let all = if body.tinted.is_empty() { 1.0 } else { 0.0 };
        let tints = (0..body.joints.len()).map(|joint| tinted(joint).unwrap_or(all));
        self.numbers.extend(tints);
        let first_bone = self.add_bones(&body.skin);
        self.draws.push(MeshDraw {
            mesh: body.skin.mesh,
            detail: 0,
            instances: 1,
            constants: DrawSkin {
                sun: 0,
                first_character: self.members.len() as u32,
                first_bone,
                dual: 1,
                texture_place: [0; 4],
            },
            is_ghost: body.alpha < 1.0,
            casts: true,
        });
        self.members.push(CrowdCharacter {
            place: [first, 1, weights, body.alpha.to_bits()],
            tint: body.tint,
        });
    }

    fn write(&self, context: &Context, slot: &Slot) -> Result<(), GpuError> {
        write(context, &slot.members, &self.members)?;
        write(context, &slot.parts, &self.parts)?;
        slot.write_skinned(context, &self.numbers)
    }
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

/// Members in the layout of the shaders. `first` is the index of the first number of their poses.
fn members(crowd: &CrowdShot, first: u32) -> Vec<CrowdCharacter> {
    let member = |member: &CrowdMember| CrowdCharacter {
        place: [
            first + member.first,
            member.stride,
            u32::MAX,
            1f32.to_bits(),
        ],
        tint: member.tint,
    };
    crowd.members.iter().map(member).collect()
}

/// Parts of all figures, and the first part and number of parts of each figure.
fn parts(figures: &[Figure]) -> (Vec<CrowdPart>, Vec<(u32, u32)>) {
    let mut parts: Vec<CrowdPart> = Vec::new();
    let ranges = figures.iter().map(|figure| {
        let first = parts.len() as u32;
        parts.extend(figure.parts.iter().map(|part: &FigurePart| {
            let [a, b] = part.joints.map(|joint| u32::from(joint.0));
            CrowdPart {
                joints: [a, b, 0, 0],
                a: part.ends[0].extend(part.radii[0]).to_array(),
                b: part.ends[1].extend(part.radii[1]).to_array(),
                colour: part.colour.extend(1.0).to_array(),
            }
        }));
        (first, figure.parts.len() as u32)
    });
    let ranges = ranges.collect();
    (parts, ranges)
}
