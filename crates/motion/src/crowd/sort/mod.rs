//! The groups of sixteen characters that are posed together, and how characters are sorted into them.

pub(super) mod fill;
pub(super) mod group;
pub(super) mod rebuild;
pub(super) mod schedule;
