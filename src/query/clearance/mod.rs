//! The exact distance of body and attack.

mod body_samples;
mod closest;
mod exact_test;
mod extent;
mod nearest;
mod pose_cache;
mod posed_body;
mod result;
mod segment;
mod segment_lanes;
mod sweep;
mod tracked_body;

pub use closest::closest;
pub use exact_test::{ExactTest, PlacedEvasion};
pub use extent::{Extent, SAMPLE_RATE, Sampling};
pub(in crate::query) use pose_cache::PoseCache;
pub use posed_body::MotionBody;
pub use result::Clearance;
