//! Tests of `sabaki::gpu`.

use sabaki::gpu::{Culler, CullerDesc};
use sabaki::maps::RegionAtlas;
use sabaki::query::cull::CullPath;
use sabaki_fixtures::cull::{DEVICE_PATHS, culler};
use sabaki_fixtures::desc;
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::shim;

mod cases;
mod contract;
mod drivers;
mod fallbacks;
mod faults;
mod memory;
mod motions;
mod needs;
mod raster;
mod shader_table;
mod soak;

/// A device whose calls the shim sees.
fn shimmed_device() -> Headless {
    // SAFETY: the shim calls the system's loader.
    unsafe { Headless::with_loader(shim::entry(), &desc()) }.unwrap()
}

/// A culler of each path, of as many slots.
fn each_culler(
    device: &mut Headless,
    atlas: &RegionAtlas,
    frames_in_flight: u32,
) -> [(CullPath, Culler); 2] {
    DEVICE_PATHS.map(|path| {
        let mut desc = CullerDesc {
            frames_in_flight,
            ..CullerDesc::new(path, atlas)
        };
        // Attacks here are wider than a game's.
        desc.max_blocks = 1 << 17;
        (path, culler(device, &desc))
    })
}

fn destroy(device: &mut Headless, cullers: [(CullPath, Culler); 2]) {
    for (_, culler) in cullers {
        culler.destroy(device.memory().unwrap());
    }
}
