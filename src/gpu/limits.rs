//! Limits of a device, and their minima that Vulkan guarantees.
//!
//! Source: the Vulkan specification, "Required Limits". Every component runs within the guaranteed values
//! (`shader_table.rs` asserts it for the shaders). With higher limits the work is divided into fewer parts.

use ash::vk;

/// Calls a macro with the limits that are used, each with the value that Vulkan guarantees.
macro_rules! guaranteed {
    ($do:ident) => {
        $do! {
            max_image_dimension2_d: 4096,
            max_image_array_layers: 256,
            max_framebuffer_width: 4096,
            max_framebuffer_height: 4096,
            max_framebuffer_layers: 256,
            max_viewports: 1,
            max_storage_buffer_range: 1 << 27,
            max_uniform_buffer_range: 16_384,
            max_texel_buffer_elements: 65_536,
            max_push_constants_size: 128,
            max_memory_allocation_count: 4096,
            max_bound_descriptor_sets: 4,
            max_per_stage_descriptor_storage_buffers: 4,
            max_per_stage_descriptor_uniform_buffers: 12,
            max_descriptor_set_storage_buffers: 24,
            max_vertex_input_attributes: 16,
            max_vertex_input_bindings: 16,
            max_vertex_output_components: 64,
            max_fragment_input_components: 64,
            max_compute_shared_memory_size: 16_384,
            max_compute_work_group_invocations: 128,
            max_draw_indirect_count: 1,
        }
    };
}

/// Whether limits are no less than Vulkan guarantees.
pub(crate) fn are_enough(limits: &vk::PhysicalDeviceLimits) -> bool {
    let mut enough = limits.min_storage_buffer_offset_alignment <= 256
        && limits.min_uniform_buffer_offset_alignment <= 256;
    macro_rules! compare {
        ($($name:ident: $least:expr,)*) => { $(enough &= limits.$name >= $least;)* };
    }
    guaranteed!(compare);
    enough
        && limits
            .max_viewport_dimensions
            .iter()
            .all(|&side| side >= 4096)
        && limits
            .max_compute_work_group_count
            .iter()
            .all(|&count| count >= 65_535)
        && std::iter::zip(limits.max_compute_work_group_size, [128, 128, 64]).all(|(a, b)| a >= b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guaranteed_limits_are_enough_and_nothing_less() {
        let least = vk::PhysicalDeviceLimits {
            max_viewport_dimensions: [4096; 2],
            max_compute_work_group_count: [65_535; 3],
            max_compute_work_group_size: [128, 128, 64],
            min_storage_buffer_offset_alignment: 256,
            min_uniform_buffer_offset_alignment: 256,
            ..guaranteed()
        };
        assert!(are_enough(&least));
        for less in [
            vk::PhysicalDeviceLimits {
                max_push_constants_size: 127,
                ..least
            },
            vk::PhysicalDeviceLimits {
                max_viewport_dimensions: [4096, 4095],
                ..least
            },
            vk::PhysicalDeviceLimits {
                max_compute_work_group_size: [128, 64, 64],
                ..least
            },
            vk::PhysicalDeviceLimits {
                min_storage_buffer_offset_alignment: 512,
                ..least
            },
        ] {
            assert!(!are_enough(&less));
        }
    }

    fn guaranteed() -> vk::PhysicalDeviceLimits {
        let mut limits = vk::PhysicalDeviceLimits::default();
        macro_rules! set {
            ($($name:ident: $least:expr,)*) => { $(limits.$name = $least;)* };
        }
        guaranteed!(set);
        limits
    }
}
