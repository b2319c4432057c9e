//! A small renderer in plain ash: spheres into an image, the image into a PNG. It knows nothing of sabaki but the allocator
//! that the example shares with it; whoever is its guest records into its command buffer.

use std::error::Error;

use ash::vk;
use sabaki::gpu::{Block, Memory, MemoryDesc, MemoryUse, Resource};

use super::scene::{Instance, MOST_INSTANCES, write_png};

const SIDE: u32 = 640;
const EXTENT: vk::Extent2D = vk::Extent2D {
    width: SIDE,
    height: SIDE,
};
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};
const PIXELS: u64 = 4 * SIDE as u64 * SIDE as u64;

type Outcome<T> = Result<T, Box<dyn Error>>;

pub struct Renderer {
    device: ash::Device,
    queue: vk::Queue,
    commands: (vk::CommandPool, vk::CommandBuffer),
    fence: vk::Fence,
    image: (vk::Image, Block),
    view: vk::ImageView,
    instances: (vk::Buffer, Block),
    pixels: (vk::Buffer, Block),
    pipeline: (vk::Pipeline, vk::PipelineLayout),
}

impl Renderer {
    /// # Safety
    /// The device is valid, has dynamic rendering and synchronization2, and a queue of this family.
    pub unsafe fn new(
        device: &ash::Device,
        memory: &mut dyn Memory,
        queue_family: u32,
    ) -> Outcome<Self> {
        // SAFETY: the caller vouches for the device; all else is made here.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(queue_family);
            let pool = device.create_command_pool(&info, None)?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            let cmd = device.allocate_command_buffers(&info)?[0];
            let image = image(device, memory)?;
            let info = vk::ImageViewCreateInfo::default()
                .image(image.0)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(FORMAT)
                .subresource_range(WHOLE);
            use vk::BufferUsageFlags as Usage;
            let bytes = (MOST_INSTANCES * size_of::<Instance>()) as u64;
            let instances = (Usage::VERTEX_BUFFER, MemoryUse::Upload);
            let pixels = (Usage::TRANSFER_DST, MemoryUse::Readback);
            Ok(Self {
                queue: device.get_device_queue(queue_family, 0),
                commands: (pool, cmd),
                fence: device.create_fence(&vk::FenceCreateInfo::default(), None)?,
                image,
                view: device.create_image_view(&info, None)?,
                instances: buffer(device, memory, bytes, instances)?,
                pixels: buffer(device, memory, PIXELS, pixels)?,
                pipeline: pipeline(device)?,
                device: device.clone(),
            })
        }
    }

    /// Draws a frame, with whatever the guest records before it, and waits for the picture.
    ///
    /// # Safety
    /// The guest leaves the command buffer in recording, outside of rendering.
    pub unsafe fn frame<T>(
        &self,
        path: &str,
        spheres: &[Instance],
        guest: impl FnOnce(vk::CommandBuffer) -> T,
    ) -> Outcome<T> {
        let (device, (pool, cmd)) = (&self.device, self.commands);
        let pixels = self.pixels.1.mapped.ok_or("the pixels are not mapped")?;
        let target = self
            .instances
            .1
            .mapped
            .ok_or("the instances are not mapped")?;
        // SAFETY: the buffer has room for them, and the device has finished the frame before.
        unsafe {
            target
                .cast::<Instance>()
                .copy_from_nonoverlapping(std::ptr::NonNull::from(spheres).cast(), spheres.len())
        };
        // SAFETY: all handles are the renderer's, and the caller vouches for the guest.
        unsafe {
            device.reset_command_pool(pool, vk::CommandPoolResetFlags::empty())?;
            device.begin_command_buffer(cmd, &vk::CommandBufferBeginInfo::default())?;
            let guests = guest(cmd);
            self.draw(cmd, spheres.len() as u32);
            device.end_command_buffer(cmd)?;
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
            let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
            device.queue_submit2(self.queue, &submit, self.fence)?;
            device.wait_for_fences(&[self.fence], true, u64::MAX)?;
            device.reset_fences(&[self.fence])?;
            let range = [vk::MappedMemoryRange::default()
                .memory(self.pixels.1.memory)
                .offset(self.pixels.1.offset)
                .size(self.pixels.1.size)];
            device.invalidate_mapped_memory_ranges(&range)?;
            write_png(
                path,
                SIDE,
                std::slice::from_raw_parts(pixels.as_ptr(), PIXELS as usize),
            )?;
            Ok(guests)
        }
    }

    /// # Safety
    /// `cmd` is being recorded, outside of rendering.
    unsafe fn draw(&self, cmd: vk::CommandBuffer, spheres: u32) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let (device, drawn) = (&self.device, Access::COLOR_ATTACHMENT_WRITE);
        let turn = |before: (Stage, Access, Layout), after: (Stage, Access, Layout)| {
            let barrier = [vk::ImageMemoryBarrier2::default()
                .src_stage_mask(before.0)
                .src_access_mask(before.1)
                .old_layout(before.2)
                .dst_stage_mask(after.0)
                .dst_access_mask(after.1)
                .new_layout(after.2)
                .image(self.image.0)
                .subresource_range(WHOLE)];
            let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
            // SAFETY: the caller vouches for `cmd`.
            unsafe { device.cmd_pipeline_barrier2(cmd, &info) };
        };
        let fresh = (Stage::COPY, Access::NONE, Layout::UNDEFINED);
        let attached = (
            Stage::COLOR_ATTACHMENT_OUTPUT,
            drawn,
            Layout::COLOR_ATTACHMENT_OPTIMAL,
        );
        let copied = (
            Stage::COPY,
            Access::TRANSFER_READ,
            Layout::TRANSFER_SRC_OPTIMAL,
        );
        let area = vk::Rect2D::default().extent(EXTENT);
        let colour = [vk::RenderingAttachmentInfo::default()
            .image_view(self.view)
            .image_layout(Layout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(vk::ClearValue {
                color: vk::ClearColorValue {
                    float32: [0.55, 0.58, 0.6, 1.0],
                },
            })];
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colour);
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(WHOLE.aspect_mask)
            .layer_count(1);
        let copy = [vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(EXTENT.into())];
        // SAFETY: the caller vouches for `cmd`; all handles are the renderer's.
        unsafe {
            turn(fresh, attached);
            device.cmd_begin_rendering(cmd, &info);
            device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, self.pipeline.0);
            device.cmd_bind_vertex_buffers(cmd, 0, &[self.instances.0], &[0]);
            device.cmd_draw(cmd, 4, spheres, 0, 0);
            device.cmd_end_rendering(cmd);
            turn(attached, copied);
            device.cmd_copy_image_to_buffer(cmd, self.image.0, copied.2, self.pixels.0, &copy);
            let barrier = [vk::MemoryBarrier2::default()
                .src_stage_mask(Stage::COPY)
                .src_access_mask(Access::TRANSFER_WRITE)
                .dst_stage_mask(Stage::HOST)
                .dst_access_mask(Access::HOST_READ)];
            let info = vk::DependencyInfo::default().memory_barriers(&barrier);
            device.cmd_pipeline_barrier2(cmd, &info);
        }
    }

    /// # Safety
    /// The device has finished.
    pub unsafe fn destroy(self, memory: &mut dyn Memory) {
        // SAFETY: the caller vouches for the device; the handles are the renderer's.
        unsafe {
            self.device.destroy_pipeline(self.pipeline.0, None);
            self.device.destroy_pipeline_layout(self.pipeline.1, None);
            self.device.destroy_image_view(self.view, None);
            self.device.destroy_image(self.image.0, None);
            self.device.destroy_buffer(self.instances.0, None);
            self.device.destroy_buffer(self.pixels.0, None);
            self.device.destroy_fence(self.fence, None);
            self.device.destroy_command_pool(self.commands.0, None);
        }
        let blocks = [self.image.1, self.instances.1, self.pixels.1];
        blocks.into_iter().for_each(|block| memory.free(block));
    }
}

/// # Safety
/// The device is valid.
unsafe fn image(device: &ash::Device, memory: &mut dyn Memory) -> Outcome<(vk::Image, Block)> {
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(FORMAT)
        .extent(EXTENT.into())
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
    // SAFETY: the caller vouches for the device.
    unsafe {
        let image = device.create_image(&info, None)?;
        let block = memory.allocate(&MemoryDesc {
            name: "picture",
            requirements: device.get_image_memory_requirements(image),
            usage: MemoryUse::Device,
            resource: Resource::Image(image),
            prefers_dedicated: false,
        })?;
        device.bind_image_memory(image, block.memory, block.offset)?;
        Ok((image, block))
    }
}

/// # Safety
/// The device is valid.
unsafe fn buffer(
    device: &ash::Device,
    memory: &mut dyn Memory,
    size: u64,
    (usage, memory_use): (vk::BufferUsageFlags, MemoryUse),
) -> Outcome<(vk::Buffer, Block)> {
    let info = vk::BufferCreateInfo::default().size(size).usage(usage);
    // SAFETY: the caller vouches for the device.
    unsafe {
        let buffer = device.create_buffer(&info, None)?;
        let block = memory.allocate(&MemoryDesc {
            name: "buffer",
            requirements: device.get_buffer_memory_requirements(buffer),
            usage: memory_use,
            resource: Resource::Buffer(buffer),
            prefers_dedicated: false,
        })?;
        device.bind_buffer_memory(buffer, block.memory, block.offset)?;
        Ok((buffer, block))
    }
}

/// WGSL to SPIR-V.
fn shaders() -> Outcome<Vec<u32>> {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    let module = naga::front::wgsl::parse_str(include_str!("spheres.wgsl"))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module)?;
    Ok(naga::back::spv::write_vec(
        &module,
        &info,
        &Default::default(),
        None,
    )?)
}

/// # Safety
/// The device is valid.
unsafe fn pipeline(device: &ash::Device) -> Outcome<(vk::Pipeline, vk::PipelineLayout)> {
    let words = shaders()?;
    // SAFETY: the caller vouches for the device; naga has validated the shaders.
    let (layout, module) = unsafe {
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        let layout =
            device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None)?;
        (layout, device.create_shader_module(&info, None)?)
    };
    let stage = |stage, name| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(module)
            .name(name)
    };
    let stages = [
        stage(vk::ShaderStageFlags::VERTEX, c"vertex"),
        stage(vk::ShaderStageFlags::FRAGMENT, c"fragment"),
    ];
    let binding = [vk::VertexInputBindingDescription::default()
        .stride(size_of::<Instance>() as u32)
        .input_rate(vk::VertexInputRate::INSTANCE)];
    let attributes = [0, 1].map(|location| {
        vk::VertexInputAttributeDescription::default()
            .location(location)
            .format(
                [
                    vk::Format::R32G32B32A32_SFLOAT,
                    vk::Format::R32G32B32_SFLOAT,
                ][location as usize],
            )
            .offset(16 * location)
    });
    let inputs = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&binding)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(vk::PrimitiveTopology::TRIANGLE_STRIP);
    let (width, height) = (SIDE as f32, SIDE as f32);
    let viewports = [vk::Viewport {
        width,
        height,
        max_depth: 1.0,
        ..Default::default()
    }];
    let scissors = [vk::Rect2D::default().extent(EXTENT)];
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewports(&viewports)
        .scissors(&scissors);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let colours = [vk::PipelineColorBlendAttachmentState::default()
        .color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&colours);
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&[FORMAT]);
    let info = [vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&inputs)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .color_blend_state(&blend)
        .layout(layout)
        .push_next(&mut rendering)];
    // SAFETY: everything in the description is valid, and fits the shaders.
    unsafe {
        let made = device.create_graphics_pipelines(vk::PipelineCache::null(), &info, None);
        device.destroy_shader_module(module, None);
        Ok((made.map_err(|(_, error)| error)?[0], layout))
    }
}
