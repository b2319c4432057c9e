//! Errors of files of attacks.

use thiserror::Error;

use crate::json::JsonError;

/// Reason why attacks cannot be used. Attacks, spheres and keys are counted from 0.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AttacksError {
    /// The text is not a valid attack file.
    #[error(transparent)]
    Json(#[from] JsonError),
    /// The file has no attack.
    #[error("the file holds no attack")]
    NoAttack,
    /// An attack has no sphere, or a sphere has no key.
    #[error("attack {attack}, sphere {sphere}: no key; a sphere needs one at least")]
    NoKey {
        /// Index of the attack.
        attack: usize,
        /// Index of the sphere.
        sphere: usize,
    },
    /// A time, a position or a radius is not finite, or the radius is not positive.
    #[error(
        "attack {attack}, sphere {sphere}, key {key}: not a finite time and place and a radius above 0"
    )]
    BadKey {
        /// Index of the attack.
        attack: usize,
        /// Index of the sphere.
        sphere: usize,
        /// Index of the key.
        key: usize,
    },
    /// A key is not later than the one before it.
    #[error("attack {attack}, sphere {sphere}, key {key}: {t} s is not after {before} s")]
    Order {
        /// Index of the attack.
        attack: usize,
        /// Index of the sphere.
        sphere: usize,
        /// Index of the key.
        key: usize,
        /// Time of the key, in seconds.
        t: f32,
        /// Time of the previous key, in seconds.
        before: f32,
    },
}
