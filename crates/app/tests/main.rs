//! The tests of the command and of what it is made of.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod command;
mod film;
mod live;
mod view_window;
