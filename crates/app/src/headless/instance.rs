//! The instance.

use std::ffi::CStr;

use ash::vk;

use super::desc::HeadlessDesc;
use sabaki::gpu::{GpuError, internal::Named};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The instance, with the validation layer if it is wanted.
pub(super) fn create(entry: &ash::Entry, desc: &HeadlessDesc) -> Result<ash::Instance, GpuError> {
    let validation = desc.validation;
    if validation {
        // SAFETY: the loader was loaded; no conditions beyond.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }
            .call("vkEnumerateInstanceLayerProperties")?;
        let installed = |layer: &vk::LayerProperties| layer.layer_name_as_c_str() == Ok(VALIDATION);
        if !layers.iter().any(installed) {
            return Err(GpuError::NoLayer("VK_LAYER_KHRONOS_validation"));
        }
    }
    let application = vk::ApplicationInfo::default()
        .application_name(c"sabaki")
        .api_version(desc.terms.api_version);
    let wished: Vec<_> = desc
        .instance_extensions
        .iter()
        .map(|name| name.as_ptr())
        .collect();
    let with_debug: Vec<_> = std::iter::once(ash::ext::debug_utils::NAME.as_ptr())
        .chain(wished.iter().copied())
        .collect();
    let layers = [VALIDATION.as_ptr()];
    let mut checks = vk::ValidationFeaturesEXT::default().enabled_validation_features(&[
        vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
        vk::ValidationFeatureEnableEXT::BEST_PRACTICES,
    ]);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_extension_names(&wished);
    if validation {
        info = info
            .enabled_layer_names(&layers)
            .enabled_extension_names(&with_debug)
            .push_next(&mut checks);
    }
    // SAFETY: the layer was found above, and brings its extensions along; whether the others are there is what the call says.
    match unsafe { entry.create_instance(&info, None) } {
        Err(vk::Result::ERROR_EXTENSION_NOT_PRESENT) => {
            let names = desc.instance_extensions.iter();
            Err(GpuError::Missing(
                names.filter_map(|name| name.to_str().ok()).collect(),
            ))
        }
        // The loader's code for finding no driver.
        Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => Err(GpuError::NoDevice {
            wanted: "present".to_owned(),
            found: Vec::new(),
        }),
        made => made.call("vkCreateInstance"),
    }
}
