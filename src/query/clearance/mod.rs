//! The exact distance of body and attack.

mod body_samples;
mod closest;
mod exact_test;
mod extent;
mod nearest;
mod posed_body;
mod result;
mod segment;
mod segment_lanes;
mod sweep;
mod tracked_body;

pub use closest::closest;
pub use exact_test::{ExactTest, PlacedEvasion};
pub use extent::{Extent, SAMPLE_RATE, Sampling};
pub use posed_body::MotionBody;
pub(in crate::query) use posed_body::PoseKey;
pub use result::Clearance;
