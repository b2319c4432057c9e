use serde::{Deserialize, Serialize};

/// The smallest distance of body and attack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clearance {
    /// Distance of the surfaces, in metres. It is negative if they overlap.
    pub metres: f32,
    /// Time from the query to the moment of the smallest distance, in seconds.
    pub time: f32,
    /// Index of the body's sphere.
    pub body_sphere: usize,
}

impl Clearance {
    /// An infinite clearance.
    #[must_use]
    pub fn none(time: f32) -> Self {
        Self {
            metres: f32::INFINITY,
            time,
            body_sphere: 0,
        }
    }

    /// Whether the attack is avoided.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.metres >= 0.0
    }
}
