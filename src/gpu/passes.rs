//! Passes of a command buffer: a label for frame debuggers and, if requested, two timestamps around each.

use std::ffi::CStr;
use std::time::Duration;

use ash::vk;

use super::{Context, GpuError, error::Named};

/// Time of a pass on the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassTime {
    /// Name of the pass, which is also its debug label.
    pub name: &'static str,
    /// Total time of the renderings and dispatches of this name.
    pub time: Duration,
}

/// Timestamps of one cull in flight. Null handles by default; destroying those does nothing.
#[derive(Debug, Default)]
pub(super) struct Stamps {
    pool: vk::QueryPool,
    /// Names of the recorded passes, each of which has two timestamps.
    names: Vec<&'static CStr>,
}

impl Stamps {
    /// Maximum number of timed passes of a cull. Further passes are not timed.
    const MOST: usize = 64;

    /// Creates the query pool. Fails if the queue has no timestamps.
    pub(super) fn new(context: &Context, name: &str) -> Result<Self, GpuError> {
        if context.timestamps().is_none() {
            return Err(GpuError::Missing(vec!["timestamps on the queue family"]));
        }
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2 * Self::MOST as u32);
        // SAFETY: the context's device is valid.
        let pool =
            unsafe { context.device().create_query_pool(&info, None) }.call("vkCreateQueryPool")?;
        context.name(pool, name);
        Ok(Self {
            pool,
            names: Vec::with_capacity(Self::MOST),
        })
    }

    /// Removes the timed passes.
    pub(super) fn clear(&mut self) {
        self.names.clear();
    }

    /// Writes the time of each pass to `times`. Returns `false` if the device has not finished.
    pub(super) fn read(
        &self,
        context: &Context,
        times: &mut Vec<PassTime>,
    ) -> Result<bool, GpuError> {
        let Some((period, mask)) = context.timestamps().filter(|_| !self.names.is_empty()) else {
            return Ok(true);
        };
        let mut stamps = [0u64; 2 * Self::MOST];
        let stamps = &mut stamps[..2 * self.names.len()];
        let flags = vk::QueryResultFlags::TYPE_64;
        // SAFETY: the pool is of this device, and has as many timestamps.
        let read = unsafe {
            let device = context.device();
            device.get_query_pool_results(self.pool, 0, stamps, flags)
        };
        if read == Err(vk::Result::NOT_READY) {
            return Ok(false);
        }
        read.call("vkGetQueryPoolResults")?;
        for (name, pair) in self.names.iter().zip(stamps.chunks_exact(2)) {
            let steps = pair[1].wrapping_sub(pair[0]) & mask;
            let time = Duration::from_nanos((steps as f64 * period) as u64);
            let name = name.to_str().unwrap_or_default();
            match times.iter_mut().find(|one| one.name == name) {
                Some(known) => known.time += time,
                None => times.push(PassTime { name, time }),
            }
        }
        Ok(true)
    }

    /// Frees the pool. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context) {
        // SAFETY: the handle is null or was made from this device, which the caller says is done with it.
        unsafe { context.device().destroy_query_pool(self.pool, None) };
        self.pool = vk::QueryPool::null();
    }
}

/// The command buffer of one cull, pass by pass.
pub(crate) struct Passes<'a> {
    pub(crate) context: &'a Context,
    pub(crate) cmd: vk::CommandBuffer,
    stamps: Option<&'a mut Stamps>,
    /// Whether the pass that has begun is timed.
    is_timed: bool,
}

impl<'a> Passes<'a> {
    /// Starts to record passes.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering. The cull that used the timestamps before has finished, or will never be submitted.
    pub(super) unsafe fn new(
        context: &'a Context,
        cmd: vk::CommandBuffer,
        mut stamps: Option<&'a mut Stamps>,
    ) -> Self {
        if let Some(stamps) = &mut stamps {
            stamps.clear();
            let count = 2 * Stamps::MOST as u32;
            // SAFETY: the caller vouches for `cmd` and the pool.
            unsafe {
                let device = context.device();
                device.cmd_reset_query_pool(cmd, stamps.pool, 0, count);
            }
        }
        Self {
            context,
            cmd,
            stamps,
            is_timed: false,
        }
    }

    /// Begins a pass. Passes do not nest.
    ///
    /// # Safety
    /// The command buffer is being recorded, and [`Passes::end`] follows within the same rendering, or outside of rendering if this call is.
    pub(crate) unsafe fn begin(&mut self, name: &'static CStr) {
        // SAFETY: the caller vouches for the command buffer.
        unsafe { self.context.begin_label(self.cmd, name) };
        self.is_timed = false;
        if let Some(stamps) = &mut self.stamps
            && stamps.names.len() < Stamps::MOST
        {
            let at = 2 * stamps.names.len() as u32;
            stamps.names.push(name);
            self.is_timed = true;
            self.stamp(at);
        }
    }

    /// Ends the pass that has begun.
    ///
    /// # Safety
    /// As for [`Passes::begin`].
    pub(crate) unsafe fn end(&mut self) {
        let passes = self.stamps.as_ref().map_or(0, |stamps| stamps.names.len());
        if self.is_timed {
            self.stamp(2 * passes as u32 - 1);
        }
        // SAFETY: the caller vouches for the command buffer.
        unsafe { self.context.end_label(self.cmd) };
    }

    /// Records a timestamp behind everything that was recorded before it.
    fn stamp(&self, at: u32) {
        if let Some(stamps) = &self.stamps {
            let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
            // SAFETY: the caller of `Passes::new` vouches for the command buffer; the pool was reset, and has this timestamp.
            unsafe {
                let device = self.context.device();
                device.cmd_write_timestamp(self.cmd, stage, stamps.pool, at);
            }
        }
    }
}
