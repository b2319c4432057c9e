//! What the device's tests share: a headless device that listens to validation, and a small random
//! generator.

use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use sabaki::gpu::Terms;
use sabaki::gpu::ash::{self, vk};
use sabaki::internal::{Disc, Drawing, MapRect, SUB_TEXELS};
use sabaki_app::headless::{DeviceChoice, Headless, HeadlessDesc};

/// A device with validation on: the one that the variable `SABAKI_DEVICE` names, else a software device. A machine without it fails the
/// test.
pub fn device() -> Headless {
    Headless::new(&desc()).expect("the Vulkan device and the validation layer")
}

pub fn desc() -> HeadlessDesc {
    wait_for_turn();
    keep_loaded();
    HeadlessDesc {
        device: std::env::var("SABAKI_DEVICE").map_or(DeviceChoice::Software, DeviceChoice::Named),
        validation: true,
        ..HeadlessDesc::default()
    }
}

/// Waits until no other test of this process has devices. The validation layer looks devices up in a table without a lock, which breaks
/// while another thread makes or destroys one (vendor-notes/lavapipe.md).
fn wait_for_turn() {
    static TURN: Mutex<()> = Mutex::new(());
    thread_local! {
        /// Held until the thread ends, which is the test's own.
        static HELD: MutexGuard<'static, ()> = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    }
    HELD.with(|_| ());
}

/// Makes an instance that lives as long as the process. Otherwise the loader would unload drivers and layers whenever no test has an
/// instance, while their threads may still run.
fn keep_loaded() {
    static KEPT: Once = Once::new();
    KEPT.call_once(|| {
        // SAFETY: the system's Vulkan loader, which is never unloaded.
        let Ok(entry) = (unsafe { ash::Entry::load() }) else {
            return;
        };
        let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
        let info = vk::InstanceCreateInfo::default().enabled_layer_names(&layers);
        // SAFETY: the arguments are valid for the call. Where there is no driver or no layer, the test's own instance says so.
        let _never_destroyed = unsafe { entry.create_instance(&info, None) };
        std::mem::forget(entry);
    });
}

/// Terms on which stencil targets do without S8_UINT, and the format that they then have.
pub const FALLBACK_FORMATS: [(Terms, vk::Format); 2] = [
    (without_formats(false), vk::Format::D24_UNORM_S8_UINT),
    (without_formats(true), vk::Format::D32_SFLOAT_S8_UINT),
];

const fn without_formats(d24_s8: bool) -> Terms {
    Terms {
        without_s8: true,
        without_d24_s8: d24_s8,
        ..Terms::new(vk::API_VERSION_1_3)
    }
}

/// The same device on other terms.
pub fn device_on(terms: Terms) -> Headless {
    Headless::new(&HeadlessDesc { terms, ..desc() }).expect("a device on these terms")
}

/// Ends a test: any message of validation, to the very end of the device, fails it.
pub fn finish(device: Headless) {
    let messages = device.destroy();
    assert!(messages.is_empty(), "validation says: {messages:#?}");
}

/// Small, seeded, and good enough for shapes (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Within `low..=high`.
    pub fn int(&mut self, low: i32, high: i32) -> i32 {
        low + (self.bits() % (i64::from(high) - i64::from(low) + 1) as u64) as i32
    }

    /// Within `low..high`.
    pub fn float(&mut self, low: f32, high: f32) -> f32 {
        low + (self.bits() >> 40) as f32 / (1u64 << 24) as f32 * (high - low)
    }

    pub fn chance(&mut self, share: f32) -> bool {
        self.float(0.0, 1.0) < share
    }

    /// A disc about a map, often across its border.
    pub fn disc(&mut self, rect: MapRect, largest: i32) -> Disc {
        let (width, height) = (rect.width as i32, rect.height as i32);
        Disc {
            x: self.int(-8 * SUB_TEXELS, (width + 8) * SUB_TEXELS),
            z: self.int(-8 * SUB_TEXELS, (height + 8) * SUB_TEXELS),
            radius: self.int(0, largest * SUB_TEXELS),
        }
    }
}

/// A body that drifts: neighbouring frames share most of their texels, as in a motion.
pub fn drifting(random: &mut Random, rect: MapRect, frames: usize, discs: usize) -> Drawing {
    let mut drawing = Drawing {
        rect,
        ..Drawing::default()
    };
    let largest = (rect.width.max(rect.height) as i32 / 2).max(1);
    let mut body: Vec<Disc> = (0..discs).map(|_| random.disc(rect, largest)).collect();
    let reach = SUB_TEXELS * 4 / frames.max(1) as i32 + 1;
    for _ in 0..frames {
        for disc in &mut body {
            disc.x += random.int(-reach, reach);
            disc.z += random.int(-reach, reach);
        }
        drawing.discs.extend(&body);
        drawing.frame_ends.push(drawing.discs.len() as u32);
    }
    drawing
}
