//! # Concept
//! Ten thousand characters are posed each frame, straight into memory that the device reads. Joints that move little are removed from
//! characters that are far away.
//!
//! # Usage
//! `cargo run --release --example crowd -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. A renderer that wants crowds alone depends on `sabaki-motion` and reads the clips itself.
//!
//! # How it works
//! 1. `Levels` orders the joints by kinetic energy; `Switching` chooses the level for a distance.
//! 2. `AnimationSet` holds the clips on all levels, in the form that the SIMD kernels read.
//! 3. `Crowd::frame` advances the time, chooses levels, and poses into the mapped buffer.
//! 4. `pose_slice` says where in the buffer a character's joints are.

#[path = "common/baked.rs"]
mod common;

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use sabaki::crowd::{AnimationSet, Character, Crowd, CrowdSettings, Frame, Placement};
use sabaki::lod::{LevelSettings, Levels, SwitchSettings, Switching};
use sabaki::math::{F32x16, Rigid2};

const COUNT: usize = 10_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let baked = common::baked()?;
    let (skeleton, clips) = (baked.graph().skeleton(), baked.graph().clips());
    let levels = Levels::build(skeleton, clips, &LevelSettings::default())?;
    let switching = Switching::new(&levels, &SwitchSettings::default())?;
    let animations = Arc::new(AnimationSet::new(skeleton, clips, &levels.levels)?);
    let mut crowd = Crowd::with_capacity(animations, CrowdSettings::default(), COUNT);
    let mut first = None;
    for index in 0..COUNT {
        let (column, row) = ((index % 100) as f32, (index / 100) as f32);
        let character = Character {
            time: 0.1 * row,
            placement: Placement {
                ground: Rigid2::new(0.0, 1.5 * (column - 50.0), -1.5 * row),
                ..Placement::IDENTITY
            },
            ..Character::default()
        };
        first.get_or_insert(crowd.add(&character)?);
    }
    // In a renderer: a buffer of this size that is mapped for its whole life, with
    // `slice::from_raw_parts_mut(mapped.cast::<F32x16>(), crowd.max_output_len(COUNT))`. Mapped memory is aligned to 64 bytes.
    let mut mapped = vec![F32x16::ZERO; crowd.max_output_len(COUNT)];
    let start = Instant::now();
    for _ in 0..300 {
        let frame = Frame {
            seconds: 1.0 / 60.0,
            switching: Some(&switching),
            eye: Vec3::new(0.0, 1.7, 25.0),
        };
        crowd.frame(&frame, &mut mapped)?;
    }
    let milliseconds = start.elapsed().as_secs_f64() * 1e3 / 300.0;
    println!(
        "{COUNT} characters, {} levels: {milliseconds:.2} ms a frame",
        levels.levels.len()
    );
    let slice = crowd.pose_slice(first.ok_or("no character")?)?;
    let [x, y, z] = [0, 1, 2].map(|axis| slice.number(&mapped, 0, 3 + axis));
    println!("the root of the first one is at ({x:.2}, {y:.2}, {z:.2})");
    Ok(())
}
