//! Larger parts of the fighter's panel.

pub(super) mod candidates;
pub(super) mod maps;
