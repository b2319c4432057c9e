//! Pipelines of a stage.

use std::mem::offset_of;

use ash::vk;

use super::StageDesc;
use crate::scene::MeshVertex;
use crate::shaders::{
    VIEW_BODY_FRAG, VIEW_BODY_VERT, VIEW_FLOOR_FRAG, VIEW_FLOOR_VERT, VIEW_LAYER_FRAG,
    VIEW_LAYER_VERT, VIEW_SKIN_FRAG, VIEW_SKIN_VERT, VIEW_SKY_FRAG, VIEW_SKY_VERT,
};
use sabaki::gpu::internal::{
    DescriptorSets, Named, Shader, graphics_pipeline, has_one_set, runs_anywhere, with_stages,
};
use sabaki::gpu::{Context, GpuError};

/// Format of the shadow map and the depth buffer.
pub(super) const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// Attachments that a draw writes.
#[derive(Clone, Copy, PartialEq)]
enum Writes {
    /// Colour and depth.
    Solid,
    /// Depth only.
    Depth,
    /// Colour, blended.
    Blended,
    /// Depth of the shadow map.
    Shadow,
}

/// Kind of the vertices of a draw.
#[derive(Clone, Copy, PartialEq)]
enum Geometry {
    /// Two-sided strip of four vertices.
    Strip,
    /// Triangles whose vertices the shader computes from their numbers.
    Computed,
    /// Triangles with a vertex buffer of [`MeshVertex`].
    Mesh,
}

/// Name, vertex and fragment shader of a draw, and what it writes and reads.
type Desc = (
    &'static str,
    &'static Shader,
    Option<&'static Shader>,
    Writes,
    Geometry,
);

#[derive(Clone, Copy)]
pub(super) enum Draw {
    Body,
    Floor,
    Sky,
    Layer,
    GhostDepth,
    Ghost,
    BodyShadow,
    Skin,
    SkinGhostDepth,
    SkinGhost,
    SkinShadow,
}

/// Descriptions, in the order of [`Draw`].
const ALL: [Desc; 11] = {
    use Geometry::{Computed, Mesh, Strip};
    use Writes::{Blended, Depth, Shadow, Solid};
    let (body, skin) = (&VIEW_BODY_VERT, &VIEW_SKIN_VERT);
    let (lit, textured) = (Some(&VIEW_BODY_FRAG), Some(&VIEW_SKIN_FRAG));
    let (floor, sky, layer) = (&VIEW_FLOOR_VERT, &VIEW_SKY_VERT, &VIEW_LAYER_VERT);
    [
        ("view: body", body, lit, Solid, Computed),
        ("view: floor", floor, Some(&VIEW_FLOOR_FRAG), Solid, Strip),
        ("view: sky", sky, Some(&VIEW_SKY_FRAG), Solid, Strip),
        ("view: layer", layer, Some(&VIEW_LAYER_FRAG), Blended, Strip),
        ("view: ghosts' depth", body, lit, Depth, Computed),
        ("view: ghosts", body, lit, Blended, Computed),
        ("view: shadow", body, None, Shadow, Computed),
        ("view: skin", skin, textured, Solid, Mesh),
        ("view: skinned ghosts' depth", skin, textured, Depth, Mesh),
        ("view: skinned ghosts", skin, textured, Blended, Mesh),
        ("view: skin's shadow", skin, None, Shadow, Mesh),
    ]
};

const _: () = {
    let mut index = 0;
    while index < ALL.len() {
        assert!(runs_anywhere(ALL[index].1) && has_one_set(ALL[index].1));
        if let Some(fragment) = ALL[index].2 {
            assert!(runs_anywhere(fragment) && has_one_set(fragment));
        }
        index += 1;
    }
};

/// All pipelines and their layouts. Handles are null by default.
#[derive(Debug, Default)]
pub(super) struct Pipelines {
    all: Vec<vk::Pipeline>,
    pub(super) layout: vk::PipelineLayout,
    pub(super) sets: DescriptorSets,
}

/// Shader stages that receive push constants.
pub(super) const PUSHED: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);
/// Maximum size of push constants, in bytes.
const MOST_PUSHED: u32 = 64;

/// Type and stages of each binding, by number.
pub(super) const BINDINGS: [(vk::DescriptorType, vk::ShaderStageFlags); 8] = {
    use vk::{DescriptorType as Type, ShaderStageFlags as Stages};
    [
        (Type::UNIFORM_BUFFER, PUSHED),
        (Type::SAMPLED_IMAGE, Stages::FRAGMENT),
        (Type::STORAGE_BUFFER, PUSHED),
        (Type::STORAGE_BUFFER, Stages::FRAGMENT),
        (Type::STORAGE_BUFFER, Stages::VERTEX),
        (Type::STORAGE_BUFFER, Stages::VERTEX),
        (Type::STORAGE_BUFFER, Stages::VERTEX),
        (Type::STORAGE_BUFFER, Stages::FRAGMENT),
    ]
};

impl Pipelines {
    /// Creates the pipelines. After a failure, [`Pipelines::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        context: &Context,
        desc: &StageDesc<'_>,
        samples: vk::SampleCountFlags,
    ) -> Result<(), GpuError> {
        let device = context.device();
        self.sets.make_layout(context, &BINDINGS)?;
        let (sets, pushed) = (
            [self.sets.layout],
            [vk::PushConstantRange::default()
                .stage_flags(PUSHED)
                .size(MOST_PUSHED)],
        );
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&sets)
            .push_constant_ranges(&pushed);
        // SAFETY: as above; the set layout was just made.
        self.layout = unsafe { device.create_pipeline_layout(&info, context.callbacks()) }
            .call("vkCreatePipelineLayout")?;
        for one in &ALL {
            let shaders: Vec<&Shader> = std::iter::once(one.1).chain(one.2).collect();
            let made = with_stages(context, &shaders, |stages| {
                build(context, one, self.layout, desc, samples, stages)
            })?;
            context.name(made, one.0);
            self.all.push(made);
        }
        Ok(())
    }

    pub(super) fn get(&self, draw: Draw) -> vk::Pipeline {
        self.all[draw as usize]
    }

    /// Frees all pipelines. The device must not use them any more.
    pub(super) fn destroy(&mut self, context: &Context) {
        let device = context.device();
        // SAFETY: the handles are null or were made from this device, and the caller knows that the device is done with them.
        unsafe {
            for pipeline in self.all.drain(..) {
                device.destroy_pipeline(pipeline, context.callbacks());
            }
            device.destroy_pipeline_layout(self.layout, context.callbacks());
        }
        self.sets.destroy(context);
        *self = Self::default();
    }
}

/// Creates a pipeline. Its format, samples and cache are those of the stage.
fn build(
    context: &Context,
    &(_, _, _, writes, geometry): &Desc,
    layout: vk::PipelineLayout,
    stage: &StageDesc<'_>,
    samples: vk::SampleCountFlags,
    stages: &[vk::PipelineShaderStageCreateInfo<'_>],
) -> Result<vk::Pipeline, GpuError> {
    let is_shadow = writes == Writes::Shadow;
    let (buffers, attributes) = vertex_input();
    let mut inputs = vk::PipelineVertexInputStateCreateInfo::default();
    if geometry == Geometry::Mesh {
        inputs = inputs
            .vertex_binding_descriptions(&buffers)
            .vertex_attribute_descriptions(&attributes);
    }
    let (topology, cull) = match geometry {
        Geometry::Strip => (
            vk::PrimitiveTopology::TRIANGLE_STRIP,
            vk::CullModeFlags::NONE,
        ),
        Geometry::Computed | Geometry::Mesh => (
            vk::PrimitiveTopology::TRIANGLE_LIST,
            vk::CullModeFlags::BACK,
        ),
    };
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(cull)
        .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
        .depth_bias_enable(is_shadow)
        .depth_bias_constant_factor(2.0)
        .depth_bias_slope_factor(1.5)
        .line_width(1.0);
    let samples = if is_shadow {
        vk::SampleCountFlags::TYPE_1
    } else {
        samples
    };
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(samples);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(writes != Writes::Blended)
        .depth_compare_op(if is_shadow {
            vk::CompareOp::LESS
        } else {
            // Depth is reversed: the nearest value is 1.
            vk::CompareOp::GREATER_OR_EQUAL
        });
    let colour = vk::PipelineColorBlendAttachmentState::default()
        .blend_enable(writes == Writes::Blended)
        .src_color_blend_factor(vk::BlendFactor::SRC_ALPHA)
        .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .src_alpha_blend_factor(vk::BlendFactor::ZERO)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
        .color_write_mask(match writes {
            Writes::Solid | Writes::Blended => vk::ColorComponentFlags::RGBA,
            Writes::Depth | Writes::Shadow => vk::ColorComponentFlags::empty(),
        });
    let (colours, formats) = ([colour], [stage.format]);
    let mut blend = vk::PipelineColorBlendStateCreateInfo::default();
    let mut rendering = vk::PipelineRenderingCreateInfo::default().depth_attachment_format(DEPTH);
    if !is_shadow {
        blend = blend.attachments(&colours);
        rendering = rendering.color_attachment_formats(&formats);
    }
    let dynamic = vk::PipelineDynamicStateCreateInfo::default()
        .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(stages)
        .vertex_input_state(&inputs)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: modules and layout are of this device and fit each other: `shaders.rs` holds both to the table.
    unsafe { graphics_pipeline(context, stage.pipeline_cache, info) }
}

/// The vertex buffer of meshes, and its attributes by location.
fn vertex_input() -> (
    [vk::VertexInputBindingDescription; 1],
    [vk::VertexInputAttributeDescription; 6],
) {
    let buffer = vk::VertexInputBindingDescription::default()
        .stride(size_of::<MeshVertex>() as u32)
        .input_rate(vk::VertexInputRate::VERTEX);
    let attribute = |location, format, offset: usize| {
        vk::VertexInputAttributeDescription::default()
            .location(location)
            .format(format)
            .offset(offset as u32)
    };
    use vk::Format as F;
    let attributes = [
        attribute(0, F::R32G32B32_SFLOAT, offset_of!(MeshVertex, position)),
        attribute(1, F::R32G32B32_SFLOAT, offset_of!(MeshVertex, normal)),
        attribute(2, F::R32G32_SFLOAT, offset_of!(MeshVertex, uv)),
        attribute(3, F::R16G16B16A16_UNORM, offset_of!(MeshVertex, colour)),
        attribute(4, F::R16G16B16A16_UINT, offset_of!(MeshVertex, bones)),
        attribute(5, F::R16G16B16A16_UNORM, offset_of!(MeshVertex, weights)),
    ];
    ([buffer], attributes)
}
