//! A mesh that is bound to the full skeleton, drawn at any level.
//!
//! A vertex asks for the matrix of a joint of the full skeleton, times the joint's inverse bind. On a level that joint rides on a
//! kept one: its matrix is the carrier's times a constant. So a renderer draws every level with one mesh in one of two ways:
//!
//! - it maps the vertices' joints through [`Level::seats`] (the carriers) and uses the level's own binds
//!   ([`Level::binds`]) in place of the inverse binds: nothing more to do per character;
//! - or it has a palette of all joints filled in ([`Level::palette`]).

use glam::Affine3A;

use super::{Level, LodError, affine};

impl Level {
    /// Of each joint of the full skeleton, what takes the place of its inverse bind on this level: to be
    /// multiplied from the left by the matrix of the joint that carries it.
    ///
    /// # Errors
    /// Not one inverse bind for each joint of the skeleton.
    pub fn binds(&self, inverse_binds: &[Affine3A]) -> Result<Vec<Affine3A>, LodError> {
        if inverse_binds.len() != self.seats.len() {
            return Err(LodError::Binds {
                found: inverse_binds.len(),
                expected: self.seats.len(),
            });
        }
        let pairs = self.seats.iter().zip(inverse_binds);
        Ok(pairs
            .map(|(seat, bind)| affine(&seat.offset) * *bind)
            .collect())
    }

    /// The skinning matrix of each joint of the full skeleton, into `out`: from the kept joints' matrices, in the level's order, and the level's
    /// binds. Allocates nothing once `out` was filled.
    ///
    /// # Panics
    /// Where there are fewer matrices than kept joints.
    pub fn palette(&self, matrices: &[Affine3A], binds: &[Affine3A], out: &mut Vec<Affine3A>) {
        let pairs = self.seats.iter().zip(binds);
        out.clear();
        out.extend(pairs.map(|(seat, bind)| matrices[usize::from(seat.carrier)] * *bind));
    }
}
