//! The search for transitions: pairs of similar windows of the clips.

pub(crate) mod bands;
pub(crate) mod cloud;
pub(crate) mod diagonal;
pub(crate) mod distance;
pub(crate) mod features;
pub(crate) mod minima;
pub(crate) mod near;
pub(crate) mod projection;
pub(crate) mod pruned;
pub(crate) mod transition;
pub(crate) mod windows;
