//! The exact distance of body and attack, and of body and obstacles.
//!
//! A query tests its candidates with it. It also answers how near an attack comes to any other motion:
//!
//! ```
//! # fn measure(baked: &sabaki::maps::BakedGraph, attack: &sabaki::query::Attack, motion: &sabaki::graph::Motion) {
//! use sabaki::query::clearance::{ExactTest, MotionBody};
//!
//! // Keep it from one test to the next, because its memory is reused.
//! let mut body = MotionBody::default();
//! let clearance = ExactTest::new(baked, attack).on_motion(motion, &mut body);
//! println!("nearest at {} s: {} m", clearance.time, clearance.metres);
//! # }
//! ```

mod bodies;
mod distances;
mod exact_test;
mod extent;
mod near_obstacles;
mod obstacle_test;
mod pose_cache;
mod sweep;

pub use bodies::PlayedTrack;
pub use distances::closest;
pub(crate) use exact_test::WorkLimit;
pub use exact_test::{ExactTest, MotionBody};
pub use extent::{Clearance, Extent, ObstacleHit, SAMPLE_RATE, Sampling};
pub(in crate::query) use near_obstacles::NearObstacles;
pub use obstacle_test::ObstacleTest;
pub(crate) use pose_cache::AdditiveLayer;
