//! Which culling paths run on a device: what they require, what the device offers, and the report on both.

use std::ffi::CStr;

use ash::vk;

use super::{ContextDesc, Features};
use crate::query::cull::CullPath;

/// A feature, format or version that a culling path uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requirement {
    /// Name in Vulkan.
    pub name: &'static str,
    /// Paths that cannot run without it.
    pub needed_by: &'static [CullPath],
    /// Fallback without it; `None` if it is required.
    pub fallback: Option<&'static str>,
}

impl Requirement {
    const fn required(name: &'static str, needed_by: &'static [CullPath]) -> Self {
        Self {
            name,
            needed_by,
            fallback: None,
        }
    }

    const fn optional(name: &'static str, fallback: &'static str) -> Self {
        Self {
            name,
            needed_by: &[],
            fallback: Some(fallback),
        }
    }

    /// Whether any path cannot run without it.
    pub fn is_required(&self) -> bool {
        !self.needed_by.is_empty()
    }
}

const BOTH: &[CullPath] = &[CullPath::Stencil, CullPath::Compute];
const FOR_STENCIL: &[CullPath] = &[CullPath::Stencil];
const FOR_COMPUTE: &[CullPath] = &[CullPath::Compute];

const REQUIREMENTS: [Requirement; 9] = [
    Requirement::required("Vulkan 1.1", BOTH),
    Requirement::required("a queue family with graphics", FOR_STENCIL),
    Requirement::required("a queue family with compute", FOR_COMPUTE),
    Requirement::required("dynamicRendering", FOR_STENCIL),
    // It is part of Vulkan 1.3, where it needs no enabled feature.
    Requirement::required("extendedDynamicState", FOR_STENCIL),
    Requirement::required(
        "a stencil format that can be drawn to and copied from",
        FOR_STENCIL,
    ),
    Requirement::optional(
        "Vulkan 1.3",
        "for the stencil path: VK_KHR_dynamic_rendering and VK_EXT_extended_dynamic_state",
    ),
    Requirement::optional("S8_UINT", "D24_UNORM_S8_UINT, else D32_SFLOAT_S8_UINT"),
    Requirement::optional("occlusionQueryPrecise", "the stencil path says any or none"),
];

/// All requirements, first those that are not optional.
///
/// No limit is needed above the minimum that Vulkan guarantees (the specification, "Required Limits"), so none is checked. Where an input needs
/// more than a device offers, the work is divided (large attacks and many queries of the stencil path by further renderings), or refused by name
/// ([`GpuError::Limit`](super::GpuError::Limit): maps above `maxStorageBufferRange`, which is at least 128 MiB, and on the compute path more
/// candidates than `maxComputeWorkGroupCount`, which is at least 65,535).
pub fn requirements() -> &'static [Requirement] {
    &REQUIREMENTS
}

/// Which culling paths run on a device, by what it offers or by what its host has enabled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Report of the stencil path.
    pub stencil: PathReport,
    /// Report of the compute path.
    pub compute: PathReport,
    /// Optional requirements that are missing, with their fallbacks.
    pub fallbacks: Vec<Requirement>,
    /// Device extensions that the host must enable for the stencil path, besides the features. Empty on Vulkan 1.3, and on 1.0, where no
    /// path runs.
    pub extensions: Vec<&'static CStr>,
    /// Stencil format that is used.
    pub stencil_format: Option<vk::Format>,
    /// Available features. A host that creates a device should enable these.
    pub features: Features,
}

/// Whether one path runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PathReport {
    /// Names of missing requirements of the path. The path runs if this is empty.
    pub lacks: Vec<&'static str>,
    /// Whether counts are exact. Otherwise a count is 0 for no overlap and not 0 for some overlap, which is enough to remove candidates but
    /// not to score them.
    pub counts_exact: bool,
}

impl PathReport {
    /// Whether the path runs.
    pub fn runs(&self) -> bool {
        self.lacks.is_empty()
    }
}

impl Report {
    /// Whether any path runs.
    pub fn is_usable(&self) -> bool {
        self.stencil.runs() || self.compute.runs()
    }

    /// The report of a path; `None` for a path that needs no device.
    pub fn path(&self, path: CullPath) -> Option<&PathReport> {
        match path {
            CullPath::Stencil => Some(&self.stencil),
            CullPath::Compute => Some(&self.compute),
            CullPath::None | CullPath::Exact | CullPath::Cpu => None,
        }
    }

    /// Names of all missing requirements of both paths, in the order of [`requirements`].
    pub fn missing(&self) -> Vec<&'static str> {
        let paths = [&self.stencil, &self.compute];
        let names = REQUIREMENTS.iter().map(|one| one.name);
        names
            .filter(|name| paths.iter().any(|path| path.lacks.contains(name)))
            .collect()
    }
}

/// Stencil formats in the order of preference.
const STENCIL_FORMATS: [vk::Format; 3] = [
    vk::Format::S8_UINT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D32_SFLOAT_S8_UINT,
];

/// Extensions that replace Vulkan 1.3, with those that they depend on under Vulkan 1.1.
const EXTENSIONS: [&CStr; 5] = [
    ash::khr::synchronization2::NAME,
    ash::khr::dynamic_rendering::NAME,
    ash::ext::extended_dynamic_state::NAME,
    ash::khr::depth_stencil_resolve::NAME,
    ash::khr::create_renderpass2::NAME,
];

/// Checks which [`requirements()`] a physical device meets. [`check_enabled`] checks the features that the host has enabled.
///
/// # Safety
/// `physical_device` belongs to `instance`, and both are valid. `api_version` is the `apiVersion` that the instance was created with.
pub unsafe fn check(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    api_version: u32,
) -> Report {
    // SAFETY: the caller vouches for both handles.
    unsafe { Offer::of(instance, physical_device, api_version) }.report()
}

/// Checks which [`requirements()`] the host's device and queue family meet with the features that are enabled.
///
/// # Safety
/// The instance and the physical device of `desc` are as for [`check`]. Its device is not used.
pub unsafe fn check_enabled(desc: &ContextDesc<'_>) -> Report {
    let (instance, physical_device) = (desc.instance, desc.physical_device);
    // SAFETY: the caller vouches for both handles.
    let (mut offer, families) = unsafe {
        (
            Offer::of(instance, physical_device, desc.api_version),
            instance.get_physical_device_queue_family_properties(physical_device),
        )
    };
    let family = families.get(desc.queue_family as usize);
    offer.queues = family.map_or(vk::QueueFlags::empty(), |family| family.queue_flags);
    let is_core = offer.version >= vk::API_VERSION_1_3;
    let enabled = Features {
        extended_dynamic_state: is_core || desc.features.extended_dynamic_state,
        ..desc.features
    };
    offer.features = offer.features.and(enabled);
    offer.report()
}

/// The extensions that replace the parts of Vulkan 1.3 that a version lacks.
fn extensions(version: u32) -> &'static [&'static CStr] {
    match version {
        ..vk::API_VERSION_1_1 | vk::API_VERSION_1_3.. => &[],
        // The other two are part of Vulkan 1.2.
        vk::API_VERSION_1_2.. => &EXTENSIONS[..3],
        _ => &EXTENSIONS,
    }
}

/// Capabilities of a device.
#[derive(Default)]
struct Offer {
    /// The lower one of the Vulkan versions of device and instance.
    version: u32,
    /// Capabilities of all queue families, or of the host's family.
    queues: vk::QueueFlags,
    features: Features,
    stencil_format: Option<vk::Format>,
}

impl Offer {
    /// # Safety
    /// As for [`check`].
    unsafe fn of(
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
        api_version: u32,
    ) -> Self {
        // SAFETY: the caller vouches for both handles.
        let (properties, families) = unsafe {
            (
                instance.get_physical_device_properties(physical_device),
                instance.get_physical_device_queue_family_properties(physical_device),
            )
        };
        let mut offer = Self {
            version: properties.api_version.min(api_version),
            queues: families
                .iter()
                .fold(vk::QueueFlags::empty(), |all, one| all | one.queue_flags),
            ..Self::default()
        };
        if offer.version >= vk::API_VERSION_1_1 {
            // SAFETY: as above; both sides know Vulkan 1.1.
            unsafe { offer.ask_features(instance, physical_device) };
        }
        offer.stencil_format = STENCIL_FORMATS.into_iter().find(|&format| {
            // SAFETY: as above.
            unsafe { has_stencil(instance, physical_device, format) }
        });
        offer
    }

    fn missing(&self) -> impl Iterator<Item = &'static Requirement> {
        let met: [bool; REQUIREMENTS.len()] = [
            self.version >= vk::API_VERSION_1_1,
            self.queues.contains(vk::QueueFlags::GRAPHICS),
            self.queues.contains(vk::QueueFlags::COMPUTE),
            self.features.dynamic_rendering,
            self.features.extended_dynamic_state,
            self.stencil_format.is_some(),
            self.version >= vk::API_VERSION_1_3,
            self.stencil_format == Some(vk::Format::S8_UINT),
            self.features.precise_queries,
        ];
        let pairs = REQUIREMENTS.iter().zip(met);
        pairs.filter(|(_, is_met)| !is_met).map(|(one, _)| one)
    }

    fn report(&self) -> Report {
        let path = |path: CullPath, counts_exact| PathReport {
            lacks: self
                .missing()
                .filter(|one| one.needed_by.contains(&path))
                .map(|one| one.name)
                .collect(),
            counts_exact,
        };
        Report {
            stencil: path(CullPath::Stencil, self.features.precise_queries),
            compute: path(CullPath::Compute, true),
            fallbacks: self
                .missing()
                .filter(|one| !one.is_required())
                .copied()
                .collect(),
            extensions: extensions(self.version).to_vec(),
            stencil_format: self.stencil_format,
            features: self.features,
        }
    }

    /// # Safety
    /// As for [`check`], with Vulkan 1.1.
    unsafe fn ask_features(
        &mut self,
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
    ) {
        // SAFETY: the caller vouches for both handles. Without a list the device counts as having no extension.
        let known = unsafe { instance.enumerate_device_extension_properties(physical_device) }
            .unwrap_or_default();
        let has = |name: &CStr| {
            let same = |one: &vk::ExtensionProperties| one.extension_name_as_c_str() == Ok(name);
            known.iter().any(same)
        };
        let is_core = self.version >= vk::API_VERSION_1_3;
        let knows = |name: &CStr| is_core || has(name);
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default();
        let mut synchronization = vk::PhysicalDeviceSynchronization2Features::default();
        let mut state = vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT::default();
        let mut features = vk::PhysicalDeviceFeatures2::default();
        if !is_core && knows(ash::ext::extended_dynamic_state::NAME) {
            features = features.push_next(&mut state);
        }
        // Below Vulkan 1.3 it depends on other extensions, which are checked with it.
        if extensions(self.version)
            .iter()
            .filter(|name| **name != ash::khr::synchronization2::NAME)
            .all(|name| knows(name))
        {
            features = features.push_next(&mut rendering);
        }
        if knows(ash::khr::synchronization2::NAME) {
            features = features.push_next(&mut synchronization);
        }
        // SAFETY: as above; the chain is only given to devices that know its structures.
        unsafe { instance.get_physical_device_features2(physical_device, &mut features) };
        let core = features.features;
        self.features = Features {
            dynamic_rendering: rendering.dynamic_rendering == vk::TRUE,
            synchronization2: synchronization.synchronization2 == vk::TRUE,
            extended_dynamic_state: is_core || state.extended_dynamic_state == vk::TRUE,
            precise_queries: core.occlusion_query_precise == vk::TRUE,
        };
    }
}

/// Whether a device supports stencil targets of a format.
///
/// # Safety
/// As for [`check`].
unsafe fn has_stencil(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    format: vk::Format,
) -> bool {
    let needed =
        vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT | vk::FormatFeatureFlags::TRANSFER_SRC;
    // SAFETY: the caller vouches for both handles.
    let properties =
        unsafe { instance.get_physical_device_format_properties(physical_device, format) };
    properties.optimal_tiling_features.contains(needed)
}
