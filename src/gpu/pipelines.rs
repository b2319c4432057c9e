//! The pipelines: graphics pipelines for discs, whole rectangles and candidates, and a compute pipeline that counts. Stencil operations
//! are dynamic state, so that no further pipelines are needed.

use std::mem::offset_of;

use ash::vk;

use super::{
    Context, GpuError,
    error::Named,
    shader_table::{
        CANDIDATE_FRAG, CANDIDATE_VERT, COUNT_COMP, DISC_FRAG, DISC_VERT, PlacedDisc, PlacedMap,
        RECT_VERT, Shader, Stage,
    },
};

/// Description of a pipeline: shaders, and the attributes of an instance. Graphics pipelines draw a quad for each instance.
#[derive(Clone, Copy)]
pub(crate) struct PipelineDesc {
    name: &'static str,
    shaders: &'static [&'static Shader],
    /// Size of an instance, in bytes.
    stride: usize,
    /// Location, format and offset of each attribute.
    attributes: &'static [(u32, vk::Format, usize)],
}

const CLIP: (u32, vk::Format, usize) = (
    1,
    vk::Format::R16G16B16A16_UINT,
    offset_of!(PlacedDisc, clip),
);

/// Draws the texels that discs cover.
pub(crate) const DISCS: PipelineDesc = PipelineDesc {
    name: "sabaki discs",
    shaders: &[&DISC_VERT, &DISC_FRAG],
    stride: size_of::<PlacedDisc>(),
    attributes: &[
        (0, vk::Format::R32G32B32_SINT, offset_of!(PlacedDisc, disc)),
        CLIP,
    ],
};
/// Draws whole maps.
pub(crate) const RECTS: PipelineDesc = PipelineDesc {
    name: "sabaki whole maps",
    shaders: &[&RECT_VERT],
    attributes: &[CLIP],
    ..DISCS
};
/// Draws the maps of candidates over those of the attack.
pub(crate) const CANDIDATES: PipelineDesc = PipelineDesc {
    name: "sabaki candidates",
    shaders: &[&CANDIDATE_VERT, &CANDIDATE_FRAG],
    stride: size_of::<PlacedMap>(),
    attributes: &[
        (
            0,
            vk::Format::R16G16B16A16_UINT,
            offset_of!(PlacedMap, clip),
        ),
        (
            1,
            vk::Format::R32G32B32A32_SINT,
            offset_of!(PlacedMap, turn),
        ),
        (2, vk::Format::R32G32B32A32_UINT, offset_of!(PlacedMap, map)),
    ],
};
/// Compares the masks of candidates with those of the attack in a compute shader.
pub(crate) const COUNT: PipelineDesc = PipelineDesc {
    name: "sabaki count",
    shaders: &[&COUNT_COMP],
    stride: 0,
    attributes: &[],
};

/// Stencil test and operations of a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StencilRule {
    pub(crate) compare: vk::CompareOp,
    pub(crate) pass: vk::StencilOp,
    pub(crate) fail: vk::StencilOp,
    /// Bits that the test compares.
    pub(crate) mask: u32,
    /// Value that the test compares with, and that `REPLACE` writes.
    pub(crate) reference: u32,
    /// Bits that operations may change.
    pub(crate) write: u32,
}

impl StencilRule {
    /// Records the rule as dynamic state.
    ///
    /// # Safety
    /// `cmd` is being recorded, for the context's device.
    pub(crate) unsafe fn set(self, context: &Context, cmd: vk::CommandBuffer) {
        let (device, faces) = (context.device(), vk::StencilFaceFlags::FRONT_AND_BACK);
        let (fail, pass, keep) = (self.fail, self.pass, vk::StencilOp::KEEP);
        // SAFETY: the caller vouches for `cmd`; the state is dynamic in every pipeline made here.
        unsafe {
            device.cmd_set_stencil_op(cmd, faces, fail, pass, keep, self.compare);
            device.cmd_set_stencil_compare_mask(cmd, faces, self.mask);
            device.cmd_set_stencil_reference(cmd, faces, self.reference);
            device.cmd_set_stencil_write_mask(cmd, faces, self.write);
        }
    }
}

/// A pipeline and its layout. Default: null handles.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pipeline {
    pub(crate) handle: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    /// Stages of the shaders that read the push constants.
    stages: vk::ShaderStageFlags,
}

impl Pipeline {
    /// Creates a pipeline with these layouts of descriptor sets and the host's cache, or null. On failure everything is freed again.
    pub(crate) fn new(
        context: &Context,
        desc: &PipelineDesc,
        sets: &[vk::DescriptorSetLayout],
        cache: vk::PipelineCache,
    ) -> Result<Self, GpuError> {
        let device = context.device();
        let range = push_constants(desc);
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(sets)
            .push_constant_ranges(std::slice::from_ref(&range));
        // SAFETY: the context's device is valid, and so are the set layouts.
        let layout = unsafe { device.create_pipeline_layout(&info, context.callbacks()) }
            .call("vkCreatePipelineLayout")?;
        context.name(layout, desc.name);
        let handle = with_stages(context, desc.shaders, |stages| match desc.shaders {
            [shader] if shader.stage == Stage::Compute => {
                compute(context, cache, layout, stages[0])
            }
            _ => graphics(context, desc, cache, layout, stages),
        });
        match handle {
            Ok(handle) => {
                context.name(handle, desc.name);
                Ok(Self {
                    handle,
                    layout,
                    stages: range.stage_flags,
                })
            }
            Err(error) => {
                // SAFETY: no pipeline was made with it.
                unsafe { device.destroy_pipeline_layout(layout, context.callbacks()) };
                Err(error)
            }
        }
    }

    /// Frees pipeline and layout. The device must no longer use them.
    pub(crate) fn destroy(&mut self, context: &Context) {
        let (device, callbacks) = (context.device(), context.callbacks());
        // SAFETY: the handles are null or were made from this device, and the caller knows that the device is done with them.
        unsafe {
            device.destroy_pipeline(self.handle, callbacks);
            device.destroy_pipeline_layout(self.layout, callbacks);
        }
        *self = Self::default();
    }

    /// Records the push constants.
    ///
    /// # Safety
    /// `cmd` is being recorded for the context's device; `constants` is the block of the pipeline's shaders.
    pub(crate) unsafe fn push<T: bytemuck::Pod>(
        &self,
        context: &Context,
        cmd: vk::CommandBuffer,
        constants: &T,
    ) {
        let bytes = bytemuck::bytes_of(constants);
        // SAFETY: the caller vouches for `cmd` and for the range.
        unsafe {
            let device = context.device();
            device.cmd_push_constants(cmd, self.layout, self.stages, 0, bytes);
        }
    }
}

fn stage(shader: &Shader) -> vk::ShaderStageFlags {
    match shader.stage {
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
    }
}

fn push_constants(desc: &PipelineDesc) -> vk::PushConstantRange {
    let users = desc.shaders.iter().filter(|one| one.push_constants > 0);
    users.fold(vk::PushConstantRange::default(), |range, shader| {
        vk::PushConstantRange {
            stage_flags: range.stage_flags | stage(shader),
            offset: 0,
            size: range.size.max(shader.push_constants),
        }
    })
}

/// Calls `make` with the stages of shaders, whose modules exist during the call.
///
/// # Errors
/// That of `make`; a module cannot be made.
pub fn with_stages(
    context: &Context,
    shaders: &[&Shader],
    make: impl FnOnce(&[vk::PipelineShaderStageCreateInfo<'_>]) -> Result<vk::Pipeline, GpuError>,
) -> Result<vk::Pipeline, GpuError> {
    let (device, mut modules) = (context.device(), Vec::with_capacity(shaders.len()));
    let mut stages = Vec::with_capacity(shaders.len());
    let made = shaders.iter().try_for_each(|shader| {
        let info = vk::ShaderModuleCreateInfo::default().code(shader.words);
        // SAFETY: the words were validated when the crate was built.
        let module = unsafe { device.create_shader_module(&info, context.callbacks()) }
            .call("vkCreateShaderModule")?;
        context.name(module, shader.name);
        modules.push(module);
        stages.push(
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage(shader))
                .module(module)
                .name(c"main"),
        );
        Ok(())
    });
    let made = made.and_then(|()| make(&stages));
    for module in modules {
        // SAFETY: the pipeline does not need its modules after it was made.
        unsafe { device.destroy_shader_module(module, context.callbacks()) };
    }
    made
}

fn compute(
    context: &Context,
    cache: vk::PipelineCache,
    layout: vk::PipelineLayout,
    stage: vk::PipelineShaderStageCreateInfo<'_>,
) -> Result<vk::Pipeline, GpuError> {
    let info = [vk::ComputePipelineCreateInfo::default()
        .stage(stage)
        .layout(layout)];
    // SAFETY: module and layout are of this device and fit each other: both come from the shader table.
    let pipelines = unsafe {
        let device = context.device();
        device.create_compute_pipelines(cache, &info, context.callbacks())
    };
    match pipelines {
        Ok(pipelines) => Ok(pipelines[0]),
        Err((_, result)) => Err(result).call("vkCreateComputePipelines"),
    }
}

fn graphics(
    context: &Context,
    desc: &PipelineDesc,
    cache: vk::PipelineCache,
    layout: vk::PipelineLayout,
    stages: &[vk::PipelineShaderStageCreateInfo<'_>],
) -> Result<vk::Pipeline, GpuError> {
    let bindings = [vk::VertexInputBindingDescription::default()
        .stride(desc.stride as u32)
        .input_rate(vk::VertexInputRate::INSTANCE)];
    let attributes = desc.attributes.iter().map(|&(location, format, offset)| {
        vk::VertexInputAttributeDescription::default()
            .location(location)
            .format(format)
            .offset(offset as u32)
    });
    let attributes: Vec<_> = attributes.collect();
    let inputs = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(vk::PrimitiveTopology::TRIANGLE_STRIP);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(vk::CullModeFlags::NONE)
        .line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let stencil = vk::PipelineDepthStencilStateCreateInfo::default().stencil_test_enable(true);
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&[
        vk::DynamicState::VIEWPORT,
        vk::DynamicState::SCISSOR,
        vk::DynamicState::STENCIL_OP,
        vk::DynamicState::STENCIL_COMPARE_MASK,
        vk::DynamicState::STENCIL_WRITE_MASK,
        vk::DynamicState::STENCIL_REFERENCE,
    ]);
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .stencil_attachment_format(context.stencil_format());
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(stages)
        .vertex_input_state(&inputs)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&stencil)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: modules and layout are of this device and fit each other: both come from the shader table.
    unsafe { graphics_pipeline(context, cache, info) }
}

/// Creates a graphics pipeline.
///
/// # Errors
/// The call fails.
///
/// # Safety
/// Everything that `info` names is of the device and fits together.
pub unsafe fn graphics_pipeline(
    context: &Context,
    cache: vk::PipelineCache,
    info: vk::GraphicsPipelineCreateInfo<'_>,
) -> Result<vk::Pipeline, GpuError> {
    let device = context.device();
    // SAFETY: the caller vouches for it.
    match unsafe { device.create_graphics_pipelines(cache, &[info], context.callbacks()) } {
        Ok(pipelines) => Ok(pipelines[0]),
        Err((_, result)) => Err(result).call("vkCreateGraphicsPipelines"),
    }
}
