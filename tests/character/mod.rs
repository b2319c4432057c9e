//! Tests of `sabaki::character`.

mod crowd_poses;
mod kinds;
mod lasting;
mod obstacles;
mod save;
mod steer;
mod strikes;
mod threats;
mod world;
