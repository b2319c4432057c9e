//! Validation messages, and the accepted ones.

use std::ffi::{CStr, c_void};
use std::sync::{Mutex, PoisonError};

use ash::{ext::debug_utils, vk};

use sabaki::gpu::{GpuError, internal::Named};

/// A message of a validation layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Identifier, such as `VUID-...` or `BestPractices-...`.
    pub id: String,
    /// Text of the message.
    pub text: String,
}

/// A known message that cannot be avoided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AcceptedMessage {
    /// A part of the device's name.
    pub device: &'static str,
    /// The start of [`Message::id`].
    pub id: &'static str,
    /// Why it cannot be avoided; `vendor-notes/` has more.
    pub reason: &'static str,
}

/// All accepted messages. There are none.
#[must_use]
pub fn accepted() -> &'static [AcceptedMessage] {
    &[]
}

/// Collects messages. Boxed, because Vulkan keeps its address.
pub(super) struct Collector {
    heard: Box<Mutex<Vec<Message>>>,
    instance: debug_utils::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
}

impl Collector {
    /// # Safety
    /// The instance is valid, has `VK_EXT_debug_utils`, and lives until [`Collector::destroy`].
    pub(super) unsafe fn new(
        entry: &ash::Entry,
        instance: &ash::Instance,
    ) -> Result<Self, GpuError> {
        let heard = Box::new(Mutex::new(Vec::new()));
        let user_data: *const Mutex<Vec<Message>> = &*heard;
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR
                    | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(hear))
            .user_data(user_data.cast_mut().cast());
        let instance = debug_utils::Instance::new(entry, instance);
        // SAFETY: the caller vouches for the instance; the list is boxed and outlives the messenger.
        let messenger = unsafe { instance.create_debug_utils_messenger(&info, None) }
            .call("vkCreateDebugUtilsMessengerEXT")?;
        Ok(Self {
            heard,
            instance,
            messenger,
        })
    }

    pub(super) fn messages(&self) -> Vec<Message> {
        let heard = self.heard.lock();
        heard.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// # Safety
    /// Called before the instance is destroyed.
    pub(super) unsafe fn destroy(self) -> Vec<Message> {
        // SAFETY: the messenger is of this instance, which the caller says still lives.
        unsafe {
            self.instance
                .destroy_debug_utils_messenger(self.messenger, None);
        }
        self.messages()
    }
}

/// # Safety
/// Called by Vulkan alone, with the list of a [`Collector`] as `user_data`.
unsafe extern "system" fn hear(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan gives valid data for the time of the call, and the pointer that it was given.
    let (data, heard) = unsafe { (&*data, &*user_data.cast::<Mutex<Vec<Message>>>()) };
    let text = |pointer: *const std::ffi::c_char| {
        if pointer.is_null() {
            return String::new();
        }
        // SAFETY: Vulkan's strings end with a zero byte.
        let text = unsafe { CStr::from_ptr(pointer) };
        text.to_string_lossy().into_owned()
    };
    let message = Message {
        id: text(data.p_message_id_name),
        text: text(data.p_message),
    };
    heard
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push(message);
    vk::FALSE
}
