//! The pipelines: graphics pipelines for discs, whole rectangles and candidates, and a compute pipeline that counts. Stencil operations
//! are dynamic state, so that no further pipelines are needed.

use std::mem::offset_of;

use ash::vk;

use super::{
    Context, GpuError,
    error::Named,
    shader_table::{
        BoxCorner, CANDIDATE_FRAG, CANDIDATE_VERT, COUNT_COMP, DISC_FRAG, DISC_VERT, PlacedDisc,
        RECT_VERT, Shader, Stage,
    },
};

/// Description of a pipeline: shaders and vertex inputs.
#[derive(Clone, Copy)]
pub(crate) struct PipelineDesc {
    name: &'static str,
    shaders: &'static [&'static Shader],
    inputs: Inputs,
    topology: vk::PrimitiveTopology,
}

/// Inputs of a vertex shader.
#[derive(Clone, Copy)]
enum Inputs {
    Nothing,
    /// One [`PlacedDisc`] for each instance, at these locations.
    Discs(&'static [u32]),
    /// One [`BoxCorner`] for each vertex.
    Corners,
}

/// Draws the texels that discs cover.
pub(crate) const DISCS: PipelineDesc = PipelineDesc {
    name: "sabaki discs",
    shaders: &[&DISC_VERT, &DISC_FRAG],
    inputs: Inputs::Discs(&[0, 1]),
    topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
};
/// Draws whole maps.
pub(crate) const RECTS: PipelineDesc = PipelineDesc {
    name: "sabaki whole maps",
    shaders: &[&RECT_VERT],
    inputs: Inputs::Discs(&[1]),
    topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
};
/// Draws the maps of candidates over those of the attack.
pub(crate) const CANDIDATES: PipelineDesc = PipelineDesc {
    name: "sabaki candidates",
    shaders: &[&CANDIDATE_VERT, &CANDIDATE_FRAG],
    inputs: Inputs::Corners,
    topology: vk::PrimitiveTopology::TRIANGLE_LIST,
};
/// Compares the masks of candidates with those of the attack in a compute shader.
pub(crate) const COUNT: PipelineDesc = PipelineDesc {
    name: "sabaki count",
    shaders: &[&COUNT_COMP],
    inputs: Inputs::Nothing,
    // A compute shader draws nothing.
    topology: vk::PrimitiveTopology::POINT_LIST,
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
        // SAFETY: the caller vouches for `cmd`; the state is dynamic in every pipeline made here.
        unsafe {
            device.cmd_set_stencil_op(
                cmd,
                faces,
                self.fail,
                self.pass,
                vk::StencilOp::KEEP,
                self.compare,
            );
            device.cmd_set_stencil_compare_mask(cmd, faces, self.mask);
            device.cmd_set_stencil_reference(cmd, faces, self.reference);
            device.cmd_set_stencil_write_mask(cmd, faces, self.write);
        }
    }
}

/// Inputs of the creation of a pipeline, besides its description.
#[derive(Clone, Copy, Default)]
pub(crate) struct PipelineInputs<'a> {
    /// Layouts of the descriptor sets.
    pub(crate) sets: &'a [vk::DescriptorSetLayout],
    /// Values of the first specialization constants of the shader. Only compute shaders have any.
    pub(crate) constants: &'a [u32],
    /// Pipeline cache of the host, or null.
    pub(crate) cache: vk::PipelineCache,
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
    /// Creates a pipeline. On failure everything is freed again.
    pub(crate) fn new(
        context: &Context,
        desc: &PipelineDesc,
        inputs: &PipelineInputs<'_>,
    ) -> Result<Self, GpuError> {
        let range = push_constants(desc);
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(inputs.sets)
            .push_constant_ranges(std::slice::from_ref(&range));
        // SAFETY: the context's device is valid, and so are the set layouts.
        let layout = unsafe { context.device().create_pipeline_layout(&info, None) }
            .call("vkCreatePipelineLayout")?;
        context.name(layout, desc.name);
        let mut builder = Builder {
            context,
            desc,
            inputs,
            layout,
            modules: Vec::with_capacity(desc.shaders.len()),
        };
        let handle = builder.add_modules().and_then(|()| builder.build());
        for module in builder.modules {
            // SAFETY: the pipeline does not need its modules after it was made.
            unsafe { context.device().destroy_shader_module(module, None) };
        }
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
                unsafe { context.device().destroy_pipeline_layout(layout, None) };
                Err(error)
            }
        }
    }

    /// Frees pipeline and layout. The device must no longer use them.
    pub(crate) fn destroy(&mut self, context: &Context) {
        // SAFETY: the handles are null or were made from this device, and the caller knows that the device is done with them.
        unsafe {
            context.device().destroy_pipeline(self.handle, None);
            context.device().destroy_pipeline_layout(self.layout, None);
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

/// A pipeline that is being created.
struct Builder<'a> {
    context: &'a Context,
    desc: &'a PipelineDesc,
    inputs: &'a PipelineInputs<'a>,
    layout: vk::PipelineLayout,
    /// Modules of the shaders, in the order of the description.
    modules: Vec<vk::ShaderModule>,
}

/// Size of a specialization constant, in bytes.
const WORD: usize = size_of::<u32>();

impl Builder<'_> {
    fn add_modules(&mut self) -> Result<(), GpuError> {
        for shader in self.desc.shaders {
            let info = vk::ShaderModuleCreateInfo::default().code(shader.words);
            // SAFETY: the words were validated when the crate was built.
            let module = unsafe { self.context.device().create_shader_module(&info, None) }
                .call("vkCreateShaderModule")?;
            self.context.name(module, shader.name);
            self.modules.push(module);
        }
        Ok(())
    }

    fn build(&self) -> Result<vk::Pipeline, GpuError> {
        match self.desc.shaders {
            [shader] if shader.stage == Stage::Compute => self.compute(self.modules[0]),
            _ => self.graphics(),
        }
    }

    fn compute(&self, module: vk::ShaderModule) -> Result<vk::Pipeline, GpuError> {
        let constants = self.inputs.constants;
        let words = (0..).zip(constants).map(|(id, _)| {
            vk::SpecializationMapEntry::default()
                .constant_id(id)
                .offset(id * WORD as u32)
                .size(WORD)
        });
        let words: Vec<_> = words.collect();
        let specialization = vk::SpecializationInfo::default()
            .map_entries(&words)
            .data(bytemuck::cast_slice(constants));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&specialization);
        let info = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(self.layout)];
        // SAFETY: module and layout are of this device and fit each other: both come from the shader table.
        let pipelines = unsafe {
            let device = self.context.device();
            device.create_compute_pipelines(self.inputs.cache, &info, None)
        };
        match pipelines {
            Ok(pipelines) => Ok(pipelines[0]),
            Err((_, result)) => Err(result).call("vkCreateComputePipelines"),
        }
    }

    fn graphics(&self) -> Result<vk::Pipeline, GpuError> {
        let stages: Vec<_> = std::iter::zip(self.desc.shaders, &self.modules)
            .map(|(shader, &module)| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(stage(shader))
                    .module(module)
                    .name(c"main")
            })
            .collect();
        let (bindings, attributes) = vertices(self.desc.inputs);
        let inputs = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(self.desc.topology);
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
            .stencil_attachment_format(self.context.stencil_format());
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&inputs)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&stencil)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering);
        // SAFETY: modules and layout are of this device and fit each other: both come from the shader table.
        unsafe { graphics_pipeline(self.context.device(), self.inputs.cache, info) }
    }
}

/// Creates a graphics pipeline.
///
/// # Errors
/// The call fails.
///
/// # Safety
/// Everything that `info` names is of the device and fits together.
pub unsafe fn graphics_pipeline(
    device: &ash::Device,
    cache: vk::PipelineCache,
    info: vk::GraphicsPipelineCreateInfo<'_>,
) -> Result<vk::Pipeline, GpuError> {
    // SAFETY: the caller vouches for it.
    match unsafe { device.create_graphics_pipelines(cache, &[info], None) } {
        Ok(pipelines) => Ok(pipelines[0]),
        Err((_, result)) => Err(result).call("vkCreateGraphicsPipelines"),
    }
}

fn vertices(
    inputs: Inputs,
) -> (
    Vec<vk::VertexInputBindingDescription>,
    Vec<vk::VertexInputAttributeDescription>,
) {
    let binding = |stride: usize, rate| {
        vec![
            vk::VertexInputBindingDescription::default()
                .stride(stride as u32)
                .input_rate(rate),
        ]
    };
    let attribute = |location, (format, offset): (vk::Format, usize)| {
        vk::VertexInputAttributeDescription::default()
            .location(location)
            .format(format)
            .offset(offset as u32)
    };
    use vk::{Format, VertexInputRate};
    match inputs {
        Inputs::Nothing => (Vec::new(), Vec::new()),
        Inputs::Discs(locations) => {
            let all = [
                (Format::R32G32B32_SINT, offset_of!(PlacedDisc, disc)),
                (Format::R16G16B16A16_UINT, offset_of!(PlacedDisc, clip)),
            ];
            let of = |&at: &u32| attribute(at, all[at as usize]);
            let stride = size_of::<PlacedDisc>();
            let attributes = locations.iter().map(of).collect();
            (binding(stride, VertexInputRate::INSTANCE), attributes)
        }
        Inputs::Corners => {
            let all = [
                (Format::R16G16_UINT, offset_of!(BoxCorner, corner)),
                (Format::R32G32B32A32_SINT, offset_of!(BoxCorner, turn)),
                (Format::R32G32B32A32_UINT, offset_of!(BoxCorner, map)),
            ];
            let attributes = (0..).zip(all).map(|(at, one)| attribute(at, one));
            let stride = size_of::<BoxCorner>();
            (
                binding(stride, VertexInputRate::VERTEX),
                attributes.collect(),
            )
        }
    }
}
