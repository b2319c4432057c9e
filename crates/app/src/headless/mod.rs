//! A Vulkan device without a window, for the command, tests and benches. A renderer uses its own device instead.

mod cull;
mod desc;
mod device;
mod instance;
mod list;
mod messages;
mod work;

use ash::vk;

pub use desc::{DeviceChoice, HeadlessDesc};
pub use list::{DeviceInfo, DeviceKind, devices};
pub use messages::{AcceptedMessage, Message, accepted};

use device::DevicePart;
use messages::Collector;
use sabaki::gpu::{Context, ContextDesc, GpuAllocatorMemory, GpuError, Memory};
use work::WorkPart;

/// An instance, a device, a queue, and a command buffer with a fence.
pub struct Headless {
    // In order of creation; `teardown` destroys them in reverse.
    entry: ash::Entry,
    instance: ash::Instance,
    collector: Option<Collector>,
    device: Option<DevicePart>,
    work: Option<WorkPart>,
    memory: Option<GpuAllocatorMemory>,
    context: Option<Context>,
    live: bool,
}

impl std::fmt::Debug for Headless {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Headless")
            .field("device", &self.device_name())
            .finish_non_exhaustive()
    }
}

impl Headless {
    /// Creates a device. Frees everything if it fails.
    ///
    /// # Errors
    /// [`GpuError::NoLoader`], [`GpuError::NoLayer`], [`GpuError::NoDevice`], [`GpuError::Missing`], or a call's.
    pub fn new(desc: &HeadlessDesc) -> Result<Self, GpuError> {
        // SAFETY: the library is the system's Vulkan loader, whose loading has no conditions.
        let entry =
            unsafe { ash::Entry::load() }.map_err(|error| GpuError::NoLoader(error.to_string()))?;
        // SAFETY: it is the loader.
        unsafe { Self::with_loader(entry, desc) }
    }

    /// Creates a device by another loader than the system's, for instance one that wraps it.
    ///
    /// # Errors
    /// Those of [`Headless::new`].
    ///
    /// # Safety
    /// The functions that `entry` hands out do what Vulkan says of them, until the device has been destroyed.
    pub unsafe fn with_loader(entry: ash::Entry, desc: &HeadlessDesc) -> Result<Self, GpuError> {
        let instance = instance::create(&entry, desc)?;
        let mut headless = Self {
            entry,
            instance,
            collector: None,
            device: None,
            work: None,
            memory: None,
            context: None,
            live: true,
        };
        match headless.fill(desc) {
            Ok(()) => Ok(headless),
            Err(error) => {
                headless.teardown();
                Err(error)
            }
        }
    }

    fn fill(&mut self, desc: &HeadlessDesc) -> Result<(), GpuError> {
        if desc.validation {
            // SAFETY: the instance has the extension, as it was made for validation.
            self.collector = Some(unsafe { Collector::new(&self.entry, &self.instance) }?);
        }
        let device = DevicePart::new(&self.instance, desc)?;
        let context = ContextDesc {
            instance: &self.instance,
            physical_device: device.physical,
            device: &device.device,
            queue_family: device.queue_family,
            features: device.features,
            debug_utils: desc.validation,
            terms: desc.terms,
        };
        // SAFETY: the handles belong together, the features were enabled, and teardown destroys the device last.
        let context = unsafe { Context::new(&context) };
        let device = self.device.insert(device);
        let context = self.context.insert(context?);
        // With the functions that the version in use has by other names.
        device.device = context.device().clone();
        self.work = Some(WorkPart::new(device)?);
        self.memory = Some(GpuAllocatorMemory::new(context)?);
        Ok(())
    }

    /// The context that components are created from.
    ///
    /// # Errors
    /// None while the device lives.
    pub fn context(&self) -> Result<&Context, GpuError> {
        self.context.as_ref().ok_or_else(gone)
    }

    /// The device memory, to create and destroy components.
    ///
    /// # Errors
    /// None while the device lives.
    pub fn memory(&mut self) -> Result<&mut GpuAllocatorMemory, GpuError> {
        self.memory.as_mut().ok_or_else(gone)
    }

    /// Creates a component: calls `make` with the context and the memory.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn make<T>(
        &mut self,
        make: impl FnOnce(&Context, &mut dyn Memory) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let (Some(context), Some(memory)) = (&self.context, &mut self.memory) else {
            return Err(gone());
        };
        make(context, memory)
    }

    /// The loader of the instance.
    #[must_use]
    pub fn entry(&self) -> &ash::Entry {
        &self.entry
    }

    /// The device's only queue, of the [context's](Headless::context) family. [`Headless::run`] uses it, too.
    ///
    /// # Errors
    /// None while the device lives.
    pub fn queue(&self) -> Result<vk::Queue, GpuError> {
        self.device
            .as_ref()
            .map(|device| device.queue)
            .ok_or_else(gone)
    }

    /// Name of the device.
    #[must_use]
    pub fn device_name(&self) -> &str {
        self.device.as_ref().map_or("", |device| &device.name)
    }

    /// The validation messages so far, without those [`accepted`] for this device.
    #[must_use]
    pub fn messages(&self) -> Vec<Message> {
        let heard = self.collector.as_ref().map(Collector::messages);
        self.unexpected(heard.unwrap_or_default())
    }

    fn unexpected(&self, mut heard: Vec<Message>) -> Vec<Message> {
        let name = self.device_name();
        heard.retain(|message| {
            !accepted()
                .iter()
                .any(|known| name.contains(known.device) && message.id.starts_with(known.id))
        });
        heard
    }

    /// Records commands, submits them, and waits until they are done.
    ///
    /// # Errors
    /// Those of `record`, a call's, or [`GpuError::Timeout`].
    pub fn run<T>(
        &mut self,
        record: impl FnOnce(vk::CommandBuffer) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let (Some(device), Some(work)) = (&self.device, &mut self.work) else {
            return Err(gone());
        };
        work.run(device, record)
    }

    /// Destroys the device. All components created from it must be destroyed before.
    ///
    /// Returns all validation messages, without the [`accepted`] ones.
    #[must_use = "these are the complaints of validation"]
    pub fn destroy(mut self) -> Vec<Message> {
        self.teardown()
    }

    fn teardown(&mut self) -> Vec<Message> {
        self.live = false;
        if self.work.as_ref().is_some_and(WorkPart::is_stuck) {
            tracing::error!("the device did not finish: it is left as it is");
            std::mem::forget((self.memory.take(), self.collector.take()));
            return Vec::new();
        }
        self.context = None;
        if let Some(memory) = self.memory.take() {
            memory.destroy();
        }
        if let (Some(device), Some(work)) = (&self.device, self.work.take()) {
            work.destroy(device);
        }
        if let Some(device) = &self.device {
            device.destroy();
        }
        // SAFETY: the device is gone, and the messenger goes before the instance.
        let heard = self
            .collector
            .take()
            .map(|collector| unsafe { collector.destroy() });
        // SAFETY: everything made from the instance is gone.
        unsafe { self.instance.destroy_instance(None) };
        self.unexpected(heard.unwrap_or_default())
    }
}

impl Drop for Headless {
    fn drop(&mut self) {
        if self.live {
            tracing::error!("a Headless was dropped without destroy: its device leaks");
            // One message is enough.
            std::mem::forget(self.memory.take());
        }
    }
}

fn gone() -> GpuError {
    GpuError::Call {
        call: "use of a destroyed device",
        result: vk::Result::ERROR_DEVICE_LOST,
    }
}
