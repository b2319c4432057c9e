//! What the examples that host sabaki on a device share: a ball that is thrown, and what is printed of the answer.

use std::error::Error;

use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, Request};

/// A character, and a ball that flies at its head.
pub struct Throw {
    pub playhead: Playhead,
    pub attack: Attack,
}

impl Throw {
    pub fn new(baked: &BakedGraph) -> Result<Self, Box<dyn Error>> {
        let key = |t, z| SphereKey {
            t,
            center: Vec3::new(0.0, 1.5, z),
            radius: 0.1,
        };
        Ok(Self {
            playhead: Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY),
            attack: Attack::new(vec![vec![key(0.9, 3.0), key(1.4, -1.0)]])?,
        })
    }

    pub fn request(&self) -> Request<'_> {
        Request::new(self.playhead, &self.attack)
    }
}

/// Prints how the candidates were counted, and the answer.
pub fn print(by_device: bool, candidates: usize, answer: &Answer) {
    println!("counted by the device: {by_device}; {candidates} candidates");
    println!(
        "avoided: {}, by {:.3} m",
        answer.avoided,
        answer.clearance().metres
    );
}
