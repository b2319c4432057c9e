//! Skinning of a mesh that is bound to the full skeleton, at any level.
//!
//! A vertex is skinned by the matrix of a joint of the full skeleton, times the joint's inverse bind matrix. On a level where that joint
//! is removed, its matrix is the carrier's times a constant. So a renderer draws every level with one mesh in one of two ways:
//!
//! - it maps the vertices' joints to their carriers ([`Level::attachments`]) and replaces the inverse bind matrices by the level's own
//!   ([`Level::binds`]), without further work per character;
//! - or it fills a palette of all joints ([`Level::palette`]) for each character.

use glam::Affine3A;

use super::{Level, LodError, affine};

impl Level {
    /// The matrices that replace the inverse bind matrices on this level, one for each joint of the full skeleton. The skinning matrix is
    /// the carrier's matrix times this one.
    ///
    /// # Errors
    /// The number of inverse bind matrices is not the number of joints.
    pub fn binds(&self, inverse_binds: &[Affine3A]) -> Result<Vec<Affine3A>, LodError> {
        if inverse_binds.len() != self.attachments.len() {
            return Err(LodError::Binds {
                found: inverse_binds.len(),
                expected: self.attachments.len(),
            });
        }
        let pairs = self.attachments.iter().zip(inverse_binds);
        Ok(pairs
            .map(|(attachment, bind)| affine(&attachment.offset) * *bind)
            .collect())
    }

    /// Writes the skinning matrices of all joints of the full skeleton to `out`, from the kept joints' matrices in the level's order and
    /// the level's [`Level::binds`]. Does not allocate once `out` is large enough.
    ///
    /// # Panics
    /// If there are fewer matrices than kept joints.
    pub fn palette(&self, matrices: &[Affine3A], binds: &[Affine3A], out: &mut Vec<Affine3A>) {
        let pairs = self.attachments.iter().zip(binds);
        out.clear();
        out.extend(
            pairs.map(|(attachment, bind)| matrices[usize::from(attachment.carrier)] * *bind),
        );
    }
}
