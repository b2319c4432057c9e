//! The stencil culling path: the paper's, from the maps of an attack and its candidates to counts.
//!
//! Source: Masaoka & Oshita, section 5.3, in Vulkan where the paper has OpenGL.
//! ```text
//! for each pass, which is one for nearly every attack:
//!     draw the attack's maps into the cleared stencil target                          attack.rs
//!     for each candidate and part:
//!         begin an occlusion query
//!         draw the candidate's maps over them, where the stencil test finds the attack    candidates.rs
//!         end the query
//!     copy the counts of all queries to the host
//! ```
//! One sample that passes removes the candidate. Limits of the device and of buffers are met by further renderings.

use ash::vk;

use super::{
    attack::{COVERED, SIDE},
    candidates::{Gathered, MOST_MAPS, Query, most_queries},
    maps::{Maps, Part, word_count},
    rules,
    screen::Screen,
};
use crate::{
    gpu::{
        Context, CullerDesc, GpuError, Memory,
        barriers::Access,
        counts::{Counts, HEADER, record_numbers},
        device_path::{self, DevicePath},
        drivers,
        error::{Named, within},
        pipelines::{CANDIDATES, Pipeline},
        resources::DeviceMemory,
    },
    query::cull::{Counted, CullInput, CullPath, Overlap},
};

const GRAPHICS: vk::PipelineBindPoint = vk::PipelineBindPoint::GRAPHICS;
/// Number of queries of the pool. More queries are divided into several renderings.
const MOST_QUERIES: u32 = 1 << 12;

/// Counts overlaps with the stencil buffer.
#[derive(Debug)]
pub(in crate::gpu) struct StencilPath {
    context: Context,
    screen: Screen,
    candidates: Pipeline,
    maps: Maps,
    /// Vulkan executes a reset after earlier commands that use the same queries, so that all slots can share the pool.
    pool: vk::QueryPool,
    slots: Vec<Slot>,
    /// Input of each entry of a batch.
    entries: Vec<Gathered>,
    max_candidates: u32,
}

/// One cull in flight.
#[derive(Debug, Default)]
struct Slot {
    counts: Counts,
    /// Candidate and part of each query.
    queries: Vec<(u32, Part)>,
}

impl StencilPath {
    /// Creates pipelines and memory. On failure everything is freed again.
    pub(in crate::gpu) fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        context.runs(CullPath::Stencil)?;
        let mut path = Self {
            context: context.clone(),
            screen: Screen::default(),
            candidates: Pipeline::default(),
            maps: Maps::default(),
            pool: vk::QueryPool::null(),
            slots: Vec::new(),
            entries: vec![Gathered::default()],
            max_candidates: desc.max_candidates,
        };
        match path.fill(memory, desc) {
            Ok(()) => Ok(path),
            Err(error) => {
                path.destroy(memory);
                Err(error)
            }
        }
    }

    fn fill(&mut self, memory: &mut dyn Memory, desc: &CullerDesc<'_>) -> Result<(), GpuError> {
        let (context, name) = (&self.context, desc.name);
        let mut device = DeviceMemory { context, memory };
        self.maps.fill(&mut device, name, desc.atlas)?;
        self.screen
            .fill(&mut device, name, SIDE, desc.pipeline_cache)?;
        let (sets, cache) = ([self.maps.sets.layout], desc.pipeline_cache);
        self.candidates = Pipeline::new(context, &CANDIDATES, &sets, cache)?;
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::OCCLUSION)
            .query_count(MOST_QUERIES);
        let (vulkan, callbacks) = (context.device(), context.callbacks());
        // SAFETY: the context's device is valid.
        self.pool =
            unsafe { vulkan.create_query_pool(&info, callbacks) }.call("vkCreateQueryPool")?;
        context.name(self.pool, &format!("{name}: queries"));
        let words = most_queries(desc.max_candidates);
        for slot in 0..desc.frames_in_flight.max(1) {
            let name = format!("{name}: counts {slot}");
            self.slots.push(Slot {
                counts: Counts::new(&mut device, &name, words, vk::BufferUsageFlags::empty())?,
                queries: Vec::new(),
            });
        }
        Ok(())
    }

    /// Memory of a culler of this description with the staging buffer of the maps, in bytes.
    pub(in crate::gpu) fn bytes(context: &Context, desc: &CullerDesc<'_>) -> Result<u64, GpuError> {
        let maps = 8 * word_count(desc.atlas)? as u64;
        let texel = match context.stencil_format() {
            vk::Format::S8_UINT => 1,
            vk::Format::D24_UNORM_S8_UINT => 4,
            _ => 8,
        };
        let target = texel * u64::from(SIDE) * u64::from(SIDE);
        let slots = u64::from(desc.frames_in_flight.max(1));
        let counts = HEADER + 4 * most_queries(desc.max_candidates);
        Ok(maps + target + Screen::INSTANCE_BYTES as u64 + slots * counts)
    }

    /// Records one cull.
    ///
    /// # Safety
    /// As for [`Culler::record_batch`](crate::gpu::Culler::record_batch).
    unsafe fn record_cull(&self, cmd: vk::CommandBuffer, gathered: &Gathered, counts: &Counts) {
        let (context, pool, buffer) = (&self.context, self.pool, counts.buffer.handle);
        let (device, wait) = (context.device(), vk::QueryResultFlags::WAIT);
        let mut offset = HEADER;
        for queries in gathered.queries.chunk_by(|a, b| a.pass == b.pass) {
            let pass = queries[0].pass;
            let used = gathered.attack.passes[pass].used;
            // SAFETY: the caller vouches for `cmd`; all handles are this path's.
            unsafe {
                context.begin_label(cmd, c"sabaki: attack");
                self.screen
                    .record_draws(context, cmd, &gathered.draws[pass], used, 0);
                context.end_label(cmd);
                context.begin_label(cmd, c"sabaki: candidates");
                let mut rest = queries;
                while let [start, ..] = rest {
                    let most = rest.len().min(MOST_QUERIES as usize);
                    let end = start.maps.start + MOST_MAPS;
                    let count = rest[..most].partition_point(|query| query.maps.end <= end);
                    let (some, later) = rest.split_at(count.max(1));
                    self.record_queries(cmd, gathered, some, used);
                    let count = some.len() as u32;
                    device
                        .cmd_copy_query_pool_results(cmd, pool, 0, count, buffer, offset, 4, wait);
                    offset += 4 * u64::from(count);
                    rest = later;
                }
                context.end_label(cmd);
            }
        }
    }

    /// Records a rendering in which the maps of some queries are drawn over the attack's, each within its query.
    ///
    /// # Safety
    /// As for [`StencilPath::record_cull`]; the queries fit the pool, and their maps the buffer of instances.
    unsafe fn record_queries(
        &self,
        cmd: vk::CommandBuffer,
        gathered: &Gathered,
        queries: &[Query],
        used: [u32; 2],
    ) {
        let (context, screen, pool) = (&self.context, &self.screen, self.pool);
        let device = context.device();
        let precision = match context.features().precise_queries {
            true => vk::QueryControlFlags::PRECISE,
            false => vk::QueryControlFlags::empty(),
        };
        let start = queries.first().map_or(0, |query| query.maps.start);
        let end = queries.last().map_or(start, |query| query.maps.end);
        let maps = &gathered.maps[start as usize..end as usize];
        let (layout, set) = (self.candidates.layout, [self.maps.set]);
        // SAFETY: the caller vouches for `cmd` and the number of queries; precise ones are enabled, and all handles are this path's.
        unsafe {
            screen.upload(context, cmd, bytemuck::cast_slice(maps));
            device.cmd_reset_query_pool(cmd, pool, 0, queries.len() as u32);
            screen.begin(context, cmd, used, None);
            screen.bind(context, cmd, &self.candidates);
            device.cmd_bind_descriptor_sets(cmd, GRAPHICS, layout, 0, &set, &[]);
            rules::over(COVERED).set(context, cmd);
            for (query, number) in queries.iter().zip(0..) {
                let count = query.maps.end - query.maps.start;
                device.cmd_begin_query(cmd, pool, number, precision);
                device.cmd_draw(cmd, 4, count, 0, query.maps.start - start);
                device.cmd_end_query(cmd, pool, number);
            }
            device.cmd_end_rendering(cmd);
        }
    }
}

impl DevicePath for StencilPath {
    fn gather(
        &mut self,
        entry: usize,
        input: &CullInput<'_>,
        counted: Counted,
    ) -> Result<(), GpuError> {
        let gathered = device_path::entry(&mut self.entries, entry);
        gathered.fill(input, counted, &self.maps, self.max_candidates)?;
        let entries = self.entries[..=entry].iter();
        let queries = entries.map(|one| one.queries.len() as u64).sum();
        let most = drivers::most_queries(self.context.driver());
        within("the driver's queries in one submission", queries, most)
    }

    fn write(&mut self, entry: usize, slot: usize) -> Result<(), GpuError> {
        // All else is part of the commands.
        let queries = self.entries[entry].queries.iter();
        let slot = &mut self.slots[slot];
        slot.counts.start();
        slot.queries.clear();
        let numbers = queries.map(|query| (query.candidate, query.part));
        slot.queries.extend(numbers);
        Ok(())
    }

    unsafe fn record(&self, cmd: vk::CommandBuffer, slots: &[usize]) {
        let counts = || slots.iter().map(|&slot| &self.slots[slot].counts);
        // SAFETY: the caller vouches for the command buffer and the slots.
        unsafe {
            for (gathered, counts) in self.entries.iter().zip(counts()) {
                self.record_cull(cmd, gathered, counts);
            }
            record_numbers(&self.context, cmd, Access::TRANSFER_WRITE, counts());
        }
    }

    fn counts(&self, slot: usize) -> &Counts {
        &self.slots[slot].counts
    }

    fn words(&self, slot: usize) -> usize {
        self.slots[slot].queries.len()
    }

    fn add(&self, slot: usize, words: &mut dyn Iterator<Item = u32>, overlaps: &mut [Overlap]) {
        for (&(candidate, part), count) in self.slots[slot].queries.iter().zip(words) {
            let overlap = &mut overlaps[candidate as usize];
            let sum = match part {
                Part::Body => &mut overlap.body,
                Part::Outer => &mut overlap.outer,
                Part::Evasion => &mut overlap.evasion,
            };
            *sum = sum.saturating_add(count);
        }
    }

    unsafe fn record_upload(&self, cmd: vk::CommandBuffer) {
        // SAFETY: the caller vouches for `cmd` and staging.
        unsafe {
            self.maps
                .words
                .record(&self.context, cmd, Access::SHADER_READ)
        };
    }

    fn release_staging(&mut self, memory: &mut dyn Memory) {
        self.maps.words.release_staging(&self.context, memory);
    }

    fn destroy(&mut self, memory: &mut dyn Memory) {
        let context = &self.context;
        for slot in &mut self.slots {
            slot.counts.destroy(context, memory);
        }
        let (device, callbacks) = (context.device(), context.callbacks());
        // SAFETY: the handle is null or was made from this device, which the caller says is done with it.
        unsafe { device.destroy_query_pool(self.pool, callbacks) };
        self.candidates.destroy(context);
        self.screen.destroy(context, memory);
        self.maps.destroy(context, memory);
    }
}
