//! The caller's device.

use std::ffi::{c_char, c_void};

use ash::vk::{self, Handle};

use super::memory::{Allocator, HostMemory};
use super::sized::{read, sized};
use super::status::Failure;
use crate::gpu::{
    Context, ContextDesc, Features, PathReport, Report, check, check_enabled, raw_device,
    raw_instance,
};

/// `sabaki_device`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Device {
    size: u32,
    labels: u32,
    get_instance_proc_addr: *mut c_void,
    instance: *mut c_void,
    physical_device: *mut c_void,
    device: *mut c_void,
    queue_family: u32,
    api_version: u32,
    precise_queries: u32,
    dynamic_rendering: u32,
    synchronization2: u32,
    extended_dynamic_state: u32,
    allocator: *const Allocator,
    pub(super) pipeline_cache: u64,
    allocation_callbacks: *const vk::AllocationCallbacks<'static>,
}

sized! {
    Device, "device";
}

impl Device {
    /// # Safety
    /// The handles are null or valid.
    unsafe fn instance(&self) -> Result<ash::Instance, Failure> {
        if self.physical_device.is_null() {
            return Err("a physical device that is not null is missing"
                .to_owned()
                .into());
        }
        // SAFETY: the caller vouches for the handles.
        Ok(unsafe { raw_instance(self.get_instance_proc_addr, self.instance as u64) }?)
    }

    fn desc<'a>(&self, instance: &'a ash::Instance, device: &'a ash::Device) -> ContextDesc<'a> {
        ContextDesc {
            instance,
            physical_device: vk::PhysicalDevice::from_raw(self.physical_device as u64),
            device,
            queue_family: self.queue_family,
            features: Features {
                dynamic_rendering: self.dynamic_rendering != 0,
                synchronization2: self.synchronization2 != 0,
                extended_dynamic_state: self.extended_dynamic_state != 0,
                precise_queries: self.precise_queries != 0,
            },
            debug_utils: self.labels != 0,
            api_version: self.api_version,
        }
    }

    /// # Safety
    /// The handles are null, or valid as for [`Context::new`].
    pub(super) unsafe fn context(&self) -> Result<Context, Failure> {
        // SAFETY: the caller vouches for the handles.
        unsafe {
            let instance = self.instance()?;
            let device = raw_device(&instance, self.device as u64)?;
            let context = Context::new(&self.desc(&instance, &device))?;
            Ok(match self.allocation_callbacks.as_ref() {
                Some(callbacks) => context.with_callbacks(callbacks),
                None => context,
            })
        }
    }

    /// # Safety
    /// The handles are null or valid.
    unsafe fn report(&self) -> Result<Report, Failure> {
        // SAFETY: the caller vouches for the handles.
        unsafe {
            let instance = self.instance()?;
            if self.device.is_null() {
                let physical_device = vk::PhysicalDevice::from_raw(self.physical_device as u64);
                return Ok(check(&instance, physical_device, self.api_version));
            }
            let device = raw_device(&instance, self.device as u64)?;
            Ok(check_enabled(&self.desc(&instance, &device)))
        }
    }

    /// # Safety
    /// The allocator is null or valid.
    pub(super) unsafe fn memory(&self, context: &Context) -> Result<HostMemory, Failure> {
        let allocator = match self.allocator.is_null() {
            true => None,
            // SAFETY: the caller vouches for the pointer.
            false => Some(unsafe { read(self.allocator) }?),
        };
        Ok(HostMemory::new(allocator, context)?)
    }
}

exported! {
    unsafe extern "C" fn sabaki_check(device: *const Device, text: *mut c_char, size: usize) {
        // SAFETY: the caller's device has valid handles.
        let report = unsafe { read(device)?.report() }?;
        // SAFETY: the caller's `size` bytes, or none.
        unsafe { write(&describe(&report), text, size) };
        if !report.is_usable() {
            return Err(format!("the device lacks {}", report.missing().join(", ")).into());
        }
    }
}

fn describe(report: &Report) -> String {
    let path = |name: &str, path: &PathReport| match path.runs() {
        true => format!("{name}: runs\n"),
        false => format!("{name}: lacks {}\n", path.lacks.join(", ")),
    };
    let paths = [
        path("stencil", &report.stencil),
        path("compute", &report.compute),
    ];
    let lines = report.fallbacks.iter().map(|one| {
        let instead = one.fallback.unwrap_or_default();
        format!("lacks {}; instead: {instead}\n", one.name)
    });
    let extensions = report.extensions.iter();
    let extensions = extensions.map(|name| format!("enable {}\n", name.to_string_lossy()));
    paths.into_iter().chain(lines).chain(extensions).collect()
}

/// Writes a text, truncated to `size` bytes with its terminating zero byte.
///
/// # Safety
/// `target` is null, or there are `size` bytes.
unsafe fn write(words: &str, target: *mut c_char, size: usize) {
    if target.is_null() || size == 0 {
        return;
    }
    let count = words.len().min(size - 1);
    // SAFETY: the caller vouches for the room, and `count` leaves one byte of it.
    unsafe {
        std::ptr::copy_nonoverlapping(words.as_ptr().cast(), target, count);
        target.add(count).write(0);
    }
}
