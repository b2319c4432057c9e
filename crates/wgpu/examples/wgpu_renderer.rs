//! # Concept
//! sabaki is a guest of a renderer in wgpu: one frame draws a character and the ball that is thrown at it, and culls the ways to dodge in
//! the same submission. A later frame draws the dodge.
//!
//! # Usage
//! `cargo run --release --package sabaki-wgpu --example wgpu_renderer -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. The example writes `out/wgpu_0.png` and `out/wgpu_1.png`.
//!
//! # How it works
//! 1. `Host::open` creates the device with what both culling paths use; `Host::new` takes one that is already there.
//! 2. `Culler::record` gives a command buffer, which the renderer submits between its own.
//! 3. In a later frame `Culler::poll` returns the counts, or nothing; then the CPU counts the same.

#[path = "../../../examples/common/baked.rs"]
mod common;
#[path = "../../../examples/common/throw.rs"]
mod throw;

use std::{error::Error, fs, io::BufWriter};

use glam::{Quat, Vec3};
use pollster::block_on;
use sabaki::anim::{Pose, forward_kinematics};
use sabaki::gpu::{BatchEntry, CullerDesc};
use sabaki::maps::BakedGraph;
use sabaki::query::{
    Answer, Attack, CullPath, Query, QueryContext, QuerySettings, Step, cull::cpu,
};
use sabaki_wgpu::Host;
use throw::Throw;

/// A sphere in camera space: x, y, radius, lowness; red, green, blue, and padding.
type Instance = [f32; 8];

const MOST_INSTANCES: usize = 256;

const SIDE: u32 = 640;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

fn main() -> Result<(), Box<dyn Error>> {
    let options = wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    };
    let adapter = block_on(wgpu::Instance::new(options).request_adapter(&Default::default()))?;

    // The renderer's device, with what sabaki uses switched on.
    let (host, queue) = Host::open(&adapter, &wgpu::DeviceDescriptor::default())?;
    let renderer = Renderer::new(host.device().clone(), queue);
    let baked = &common::baked()?;
    let mut culler = host.culler(&CullerDesc::new(CullPath::Compute, baked.atlas()))?;

    // Frame 0: a ball comes. The ways to dodge it are culled while the frame is drawn.
    let throw = Throw::new(baked)?;
    let settings = QuerySettings::default();
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let query = Query::new(baked, &settings);
    let mut session = query.start(throw.request(), &mut context);
    let mut batch = [BatchEntry {
        slot: 0,
        input: session.cull_input(),
        ticket: None,
    }];
    // SAFETY: slot 0 is free, and the frame submits the commands.
    let cull = unsafe { culler.record(&mut batch) }?;
    let ticket = batch[0].ticket.ok_or("nothing was recorded")?;
    let spheres = before(baked, &throw);
    renderer.frame("out/wgpu_0.png", &spheres, Some(cull))?;

    // Later: the counts are there, or else the CPU counts the same.
    let mut overlaps = Vec::new();
    let there = culler.poll(ticket, &mut overlaps)?;
    if !there {
        cpu::count(&session.cull_input(), &mut overlaps);
    }
    if session.submit(&overlaps, &mut answer) == Step::Recount {
        session.run_on_cpu(&mut cpu::Culler::default(), &mut answer);
    }
    throw::print(there, overlaps.len(), &answer);

    // The frames after that play the answer; here the one in which the ball is nearest.
    let spheres = nearest(baked, &throw, &answer);
    renderer.frame("out/wgpu_1.png", &spheres, None)
}

/// A small renderer in wgpu: spheres into a texture, the texture into a PNG. It knows nothing of sabaki.
struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    instances: wgpu::Buffer,
    picture: wgpu::Texture,
    pixels: wgpu::Buffer,
}

impl Renderer {
    fn new(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        use wgpu::{BufferUsages, TextureUsages};
        let buffer = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let instances = (MOST_INSTANCES * size_of::<Instance>()) as u64;
        Self {
            instances: buffer(instances, BufferUsages::VERTEX | BufferUsages::COPY_DST),
            pixels: buffer(
                u64::from(4 * SIDE * SIDE),
                BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            ),
            picture: device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: extent(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
                view_formats: &[],
            }),
            pipeline: pipeline(&device),
            device,
            queue,
        }
    }

    /// Draws a frame, submits it together with the guest's commands, and waits for the picture.
    fn frame(
        &self,
        path: &str,
        spheres: &[Instance],
        guest: Option<wgpu::CommandBuffer>,
    ) -> Result<(), Box<dyn Error>> {
        let bytes: Vec<u8> = spheres
            .as_flattened()
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.queue.write_buffer(&self.instances, 0, &bytes);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.draw(&mut encoder, spheres.len() as u32);
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.pixels,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * SIDE),
                    rows_per_image: None,
                },
            },
            extent(),
        );
        self.queue
            .submit(guest.into_iter().chain([encoder.finish()]));
        let read = self.pixels.slice(..);
        let (sender, mapped) = std::sync::mpsc::channel();
        read.map_async(wgpu::MapMode::Read, move |result| {
            let _ = sender.send(result);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        mapped.recv()??;
        write_png(path, SIDE, &read.get_mapped_range()?)?;
        self.pixels.unmap();
        Ok(())
    }

    fn draw(&self, encoder: &mut wgpu::CommandEncoder, spheres: u32) {
        let grey = wgpu::Color {
            r: 0.55,
            g: 0.58,
            b: 0.6,
            a: 1.0,
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.picture.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(grey),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_vertex_buffer(0, self.instances.slice(..));
        pass.draw(0..4, 0..spheres);
    }
}

fn extent() -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: SIDE,
        height: SIDE,
        depth_or_array_layers: 1,
    }
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("spheres.wgsl"));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Instance>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x3],
            })],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// What is drawn before the ball flies.
fn before(baked: &BakedGraph, throw: &Throw) -> Vec<Instance> {
    let mut pose = Pose::default();
    throw.playhead.pose(baked.graph(), &mut pose);
    instances(baked, &pose, ball(&throw.attack, 0.0))
}

/// What is drawn of an answer when the ball is nearest.
fn nearest(baked: &BakedGraph, throw: &Throw, answer: &Answer) -> Vec<Instance> {
    let (mut pose, seconds) = (Pose::default(), answer.clearance().time);
    answer.motion.sample(baked.graph(), seconds, &mut pose);
    instances(baked, &pose, ball(&throw.attack, seconds))
}

/// Where the ball is: before it is thrown, where it will start; nowhere after its flight.
fn ball(attack: &Attack, seconds: f32) -> Option<(Vec3, f32)> {
    let keys = attack.spheres()[0].keys();
    let mut pairs = keys.windows(2);
    let pair = pairs.find(|pair| seconds <= pair[1].t)?;
    let share = (seconds - pair[0].t) / (pair[1].t - pair[0].t);
    let center = pair[0].center.lerp(pair[1].center, share.max(0.0));
    Some((center, pair[0].radius))
}

/// The body's spheres in a pose, and the ball at that moment; what is further away comes first.
fn instances(baked: &BakedGraph, pose: &Pose, ball: Option<(Vec3, f32)>) -> Vec<Instance> {
    let mut joints = Vec::new();
    forward_kinematics(baked.graph().skeleton(), pose, &mut joints);
    let body = baked.body().spheres.iter();
    let mut spheres: Vec<_> = body
        .map(|one| (one.centre(&joints), one.radius, [0.35, 0.55, 0.85]))
        .collect();
    spheres.extend(ball.map(|(center, radius)| (center, radius, [0.9, 0.3, 0.15])));
    let camera = Quat::from_rotation_x(0.25) * Quat::from_rotation_y(-0.7);
    let seen = |center: Vec3| camera * (center - Vec3::new(0.0, 0.9, 0.0));
    spheres.sort_by(|a, b| seen(a.0).z.total_cmp(&seen(b.0).z));
    let instance = |center, radius, [red, green, blue]: [f32; 3], lowness| {
        let Vec3 { x, y, .. } = seen(center);
        [x, y, radius, lowness, red, green, blue, 0.0]
    };
    let shadows = spheres
        .iter()
        .map(|one| instance(one.0.with_y(0.0), one.1, [0.25; 3], 0.25));
    let bodies = spheres.iter().map(|one| instance(one.0, one.1, one.2, 1.0));
    shadows.chain(bodies).take(MOST_INSTANCES).collect()
}

/// Writes a picture of four bytes a pixel.
fn write_png(path: &str, side: u32, pixels: &[u8]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all("out")?;
    let file = BufWriter::new(fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, side, side);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(())
}
