//! Sorts characters into groups: the groups (`group`, `schedule`), and how they are filled (`fill`).

mod fill;
pub(super) mod group;
pub(super) mod schedule;
