//! The tests of the component. Folders mirror `src`.
#![allow(clippy::unwrap_used, clippy::expect_used)]
// The files mirror those of `src`, and a test uses an example's memory.
#![allow(clippy::module_inception, clippy::duplicate_mod)]

/// A check of the embedded motions, and of real motion capture.
macro_rules! on_both {
    ($check:ident) => {
        mod $check {
            #[test]
            fn of_the_embedded_motions() {
                super::$check(sabaki_fixtures::baked::embedded());
            }

            #[test]
            #[ignore = "needs SABAKI_MOCAP"]
            fn of_real_motion_capture() {
                super::$check(sabaki_fixtures::captures::fight());
            }
        }
    };
}

mod archive;
mod capi;
mod character;
mod gpu;
mod graph;
mod guide;
mod limits;
mod maps;
mod query;

/// The largest distance between two points with the same index.
fn furthest(a: &[glam::Vec3], b: &[glam::Vec3]) -> f32 {
    let apart = a.iter().zip(b).map(|(a, b)| a.distance(*b));
    apart.fold(0.0, f32::max)
}

#[global_allocator]
static COUNTING: sabaki_fixtures::memory::Counting = sabaki_fixtures::memory::Counting;
