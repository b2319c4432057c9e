//! Writes a shot into the buffers of a slot.

use ash::vk;

use super::frame::{FrameSettings, frame_data};
use super::skinned::{SkinDraw, Skinned, joints_of_skin};
use super::slot::write;
use super::{Picture, Stage, Target};
use crate::scene::{
    Capsule, CrowdMember, CrowdShot, Detail, Figure, FigurePart, Layer, MemberGroup,
};
use crate::shaders::{CrowdCharacter, CrowdPart, DrawLayer};
use sabaki::gpu::GpuError;
use sabaki::gpu::internal::within;
use sabaki::math::F32x16;

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
    pub(super) crowd: Vec<CrowdDraw>,
    pub(super) skins: Vec<SkinDraw>,
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
            shadow_side: desc.shadow_side.max(1),
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
        let mut skinned = Skinned::new(slot.first_skinned_number());
        if let Some(crowd) = crowd {
            check_poses(crowd, slot.crowd_numbers())?;
            skinned.members = members(crowd, slot.first_number);
            fits(
                "StageDesc::max_members",
                skinned.members.len(),
                desc.max_members,
            )?;
            slot.flush_poses(&context)?;
            match crowd.skins.is_empty() {
                true => draws.crowd = figures(crowd, &mut skinned),
                false => skinned.add_crowd(crowd)?,
            }
        }
        for body in &shot.skinned {
            skinned.add_body(body)?;
        }
        draws.skins = self.upload_skinned(number, shot.skinned.len(), &skinned)?;
        Ok(draws)
    }
}

/// Whether the groups of a crowd have the members and figures or skins that they refer to, and whether the poses of all their members are
/// within the first `numbers` of the memory.
fn check_poses(crowd: &CrowdShot, numbers: u64) -> Result<(), GpuError> {
    let (what, joints): (_, Vec<u64>) = match crowd.skins.is_empty() {
        true => ("figures of a CrowdShot", {
            crowd.figures.iter().map(joints_of_figure).collect()
        }),
        false => ("skins of a CrowdShot", {
            crowd
                .skins
                .iter()
                .map(|skin| joints_of_skin(skin))
                .collect()
        }),
    };
    let members = crowd.members.len() as u64;
    for group in &crowd.groups {
        within("members of a CrowdShot", group.members.end.into(), members)?;
        within(what, group.figure as u64 + 1, joints.len() as u64)?;
        let Some(last) = (MATRIX_NUMBERS * joints[group.figure]).checked_sub(1) else {
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

/// Number of joints up to the last one that a figure refers to.
fn joints_of_figure(figure: &Figure) -> u64 {
    let joints = figure.parts.iter().flat_map(|part| part.joints);
    joints.max().map_or(0, |joint| u64::from(joint.0) + 1)
}

/// The draws of a crowd of figures, whose parts are added.
fn figures(crowd: &CrowdShot, skinned: &mut Skinned) -> Vec<CrowdDraw> {
    let (parts, ranges) = parts(&crowd.figures);
    skinned.parts = parts;
    let draw = |group: &MemberGroup| {
        let (first_part, parts) = ranges[group.figure];
        CrowdDraw {
            detail: group.detail,
            first_character: group.members.start,
            characters: group.members.len() as u32,
            first_part,
            parts,
            casts: group.casts,
        }
    };
    crowd.groups.iter().map(draw).collect()
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
            first.wrapping_add(member.first),
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
