use glam::{Quat, Vec3};

use super::frames::{Place, place_all};
use super::motion::check;
use super::{Level, LodError};
use crate::anim::{Clip, ClipDesc, JointKind, Skeleton};

impl Level {
    /// Converts the clip to what this level draws, on the full skeleton: kept joints move as before, removed joints follow their
    /// carriers. The result plays wherever clips play.
    ///
    /// # Errors
    /// A clip or a level of another skeleton, or positions out of range.
    pub fn drawn(&self, skeleton: &Skeleton, clip: &Clip) -> Result<Clip, LodError> {
        check(skeleton, clip)?;
        self.check(skeleton)?;
        let entries = clip.frames() * skeleton.len();
        let mut desc = ClipDesc {
            name: clip.name().to_owned(),
            frame_rate: clip.frame_rate(),
            roots: (0..clip.frames()).map(|frame| clip.root(frame)).collect(),
            rotations: Vec::with_capacity(entries),
            translations: Vec::with_capacity(entries),
        };
        let mut places = Vec::new();
        for frame in 0..clip.frames() {
            place_all(skeleton, clip.at(frame as f32), &mut places);
            let drawn: Vec<Place> = self
                .attachments
                .iter()
                .map(|attachment| {
                    let carrier = places[self.kept[usize::from(attachment.carrier)].index()];
                    carrier.after(&Place {
                        rotation: attachment.offset.rotation.as_dquat(),
                        translation: attachment.offset.translation.as_dvec3(),
                    })
                })
                .collect();
            for (joint, place) in skeleton.joints().iter().zip(&drawn) {
                let local = match joint.parent {
                    Some(parent) => drawn[parent.index()].sees(place),
                    None => *place,
                };
                // An end site has a position only.
                let (rotation, translation) = match joint.kind {
                    JointKind::EndSite => (Quat::IDENTITY, local.translation.as_vec3()),
                    JointKind::Moving => (local.rotation.as_quat(), local.translation.as_vec3()),
                };
                desc.rotations.push(rotation);
                desc.translations.push(if joint.parent.is_some() {
                    translation
                } else {
                    Vec3::ZERO
                });
            }
        }
        Ok(Clip::new(skeleton, desc)?)
    }
}
