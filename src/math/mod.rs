//! Rigid transforms of the ground plane.

mod rigid2;

pub use rigid2::Rigid2;
