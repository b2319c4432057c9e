//! Levels of detail and culling of all characters, sixteen at a time.

pub(super) mod pass;
pub(super) mod ramps;
