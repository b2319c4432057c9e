//! A wgpu device as sabaki sees it.

use std::ffi::c_void;

use sabaki::gpu::ash::ext::debug_utils;
use sabaki::gpu::ash::{
    self,
    vk::{self, Handle},
};
use sabaki::gpu::{
    Context, ContextDesc, CullerDesc, Features, GpuError, Report, check, raw_device, raw_instance,
};
use wgpu::hal::api::Vulkan;
use wgpu::hal::vulkan::InstanceShared;

use super::HostedCuller;

/// Reason why a wgpu device cannot cull.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// The device or the adapter is not one of wgpu's Vulkan backend.
    #[error("wgpu does not run on Vulkan here")]
    NotVulkan,
    /// The adapter does not have these features.
    #[error("the adapter lacks the features {0}")]
    Features(wgpu::Features),
    /// These features are experimental, and [`wgpu::DeviceDescriptor::experimental_features`] does not enable them.
    #[error("experimental features are not enabled: {0}")]
    Experimental(wgpu::Features),
    /// A limit of the descriptor is beyond the adapter's.
    #[error("the limit {name} is {allowed} on the adapter, not {required}")]
    Limit {
        /// Field of [`wgpu::Limits`].
        name: &'static str,
        /// Value that the descriptor requires.
        required: u64,
        /// Limit of the adapter.
        allowed: u64,
    },
    /// The device lacks something, or a call failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The Vulkan device cannot be created.
    #[error("the device cannot be opened: {0}")]
    Open(#[from] wgpu::hal::DeviceError),
    /// wgpu refuses the device.
    #[error(transparent)]
    Request(#[from] wgpu::RequestDeviceError),
}

/// A wgpu device that culls.
#[derive(Clone, Debug)]
pub struct Host {
    device: wgpu::Device,
    context: Context,
}

impl Host {
    /// A device that the program has created through wgpu. Only the compute path runs on it, because wgpu does not enable what the
    /// stencil path needs.
    ///
    /// # Errors
    /// [`HostError::NotVulkan`]; [`GpuError::Missing`] if the queue family has no compute.
    pub fn new(device: &wgpu::Device) -> Result<Self, HostError> {
        Self::with(device.clone(), Features::default())
    }

    /// Creates a device with what both culling paths use, as far as the adapter offers it, beside what `desc` asks for.
    ///
    /// # Errors
    /// [`HostError::NotVulkan`]; [`HostError::Features`], [`HostError::Experimental`] or [`HostError::Limit`] where the adapter does not
    /// have what `desc` asks for; an error of creating the device.
    pub fn open(
        adapter: &wgpu::Adapter,
        desc: &wgpu::DeviceDescriptor<'_>,
    ) -> Result<(Self, wgpu::Queue), HostError> {
        let report = report(adapter)?;
        check_required(adapter, desc)?;
        let offered = report.features;
        let mut rendering =
            vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(true);
        let mut synchronization =
            vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true);
        let is_core = report.extensions.is_empty();
        // SAFETY: the adapter offers what the descriptor requires and the features that are added, and nothing is taken away.
        let (device, queue) = unsafe {
            let vulkan = adapter.as_hal::<Vulkan>().ok_or(HostError::NotVulkan)?;
            let open = vulkan.open_with_callback(
                desc.required_features,
                &desc.required_limits,
                &desc.memory_hints,
                Some(Box::new(|arguments| {
                    // Below Vulkan 1.3 the features are those of extensions, which wgpu may not enable.
                    let mut info = std::mem::take(arguments.create_info);
                    if is_core && offered.dynamic_rendering {
                        info = info.push_next(&mut rendering);
                    }
                    if is_core && offered.synchronization2 {
                        info = info.push_next(&mut synchronization);
                    }
                    *arguments.create_info = info;
                })),
            )?;
            adapter.create_device_from_hal(open, desc)?
        };
        let features = Features {
            dynamic_rendering: is_core && offered.dynamic_rendering,
            synchronization2: is_core && offered.synchronization2,
            extended_dynamic_state: is_core,
            // wgpu does not enable it. Occlusion queries then say any or none.
            precise_queries: false,
        };
        Ok((Self::with(device, features)?, queue))
    }

    fn with(device: wgpu::Device, features: Features) -> Result<Self, HostError> {
        // SAFETY: the handles are of one device, which `device` keeps alive as long as the host; wgpu has enabled the features.
        let context = unsafe {
            let vulkan = device.as_hal::<Vulkan>().ok_or(HostError::NotVulkan)?;
            let shared = vulkan.shared_instance();
            let instance = instance(shared)?;
            Context::new(&ContextDesc {
                instance: &instance,
                physical_device: physical_device(vulkan.raw_physical_device()),
                device: &raw_device(&instance, vulkan.raw_device().handle().as_raw())?,
                queue_family: vulkan.queue_family_index(),
                features,
                debug_utils: shared.extensions().contains(&debug_utils::NAME),
                api_version: shared.instance_api_version(),
            })?
        };
        Ok(Self { device, context })
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The features of the device that the culling paths need.
    pub fn report(&self) -> &Report {
        self.context.report()
    }

    /// The device for the rest of [`sabaki::gpu`] and for `sabaki-draw`.
    ///
    /// # Safety
    /// What is created from the context is destroyed before the last clone of [`Host::device`] is dropped.
    #[must_use]
    pub unsafe fn context(&self) -> &Context {
        &self.context
    }

    /// Creates a culler with memory of its own.
    ///
    /// # Errors
    /// As for [`sabaki::gpu::Culler::new`].
    pub fn culler(&self, desc: &CullerDesc<'_>) -> Result<HostedCuller, HostError> {
        HostedCuller::new(self.device.clone(), &self.context, desc)
    }
}

/// The checks of [`wgpu::Adapter::request_device`], which creating a device from its Vulkan handle leaves out.
fn check_required(
    adapter: &wgpu::Adapter,
    desc: &wgpu::DeviceDescriptor<'_>,
) -> Result<(), HostError> {
    let lacking = desc.required_features - adapter.features();
    if !lacking.is_empty() {
        return Err(HostError::Features(lacking));
    }
    let experimental = desc.required_features & wgpu::Features::all_experimental_mask();
    if !experimental.is_empty() && !desc.experimental_features.is_enabled() {
        return Err(HostError::Experimental(experimental));
    }
    let (mut limit, offered) = (Ok(()), adapter.limits());
    let fail = |name, required, allowed| {
        limit = Err(HostError::Limit {
            name,
            required,
            allowed,
        });
    };
    desc.required_limits
        .check_limits_with_fail_fn(&offered, true, fail);
    limit
}

/// The features of a physical device that the culling paths need.
fn report(adapter: &wgpu::Adapter) -> Result<Report, HostError> {
    // SAFETY: the handles are wgpu's, which the adapter keeps alive.
    unsafe {
        let vulkan = adapter.as_hal::<Vulkan>().ok_or(HostError::NotVulkan)?;
        let shared = vulkan.shared_instance();
        let physical_device = physical_device(vulkan.raw_physical_device());
        let version = shared.instance_api_version();
        Ok(check(&instance(shared)?, physical_device, version))
    }
}

/// wgpu's instance. Its handle goes through 64 bits, as wgpu may use another version of `ash`.
///
/// # Safety
/// The instance lives.
unsafe fn instance(shared: &InstanceShared) -> Result<ash::Instance, GpuError> {
    let lookup = shared.entry().static_fn().get_instance_proc_addr;
    // SAFETY: the caller vouches for the instance, which was created with this function.
    unsafe {
        raw_instance(
            lookup as *const c_void,
            shared.raw_instance().handle().as_raw(),
        )
    }
}

fn physical_device(handle: impl Handle) -> vk::PhysicalDevice {
    vk::PhysicalDevice::from_raw(handle.as_raw())
}
