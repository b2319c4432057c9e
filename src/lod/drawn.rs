use glam::{Quat, Vec3};

use super::frames::{Place, place_all};
use super::motion::check;
use super::{Level, LodError};
use crate::anim::{Clip, ClipDesc, JointKind, Skeleton};

impl Level {
    /// The clip as this level draws it, on the full skeleton: kept joints where they are, removed ones where they ride. To look at a level,
    /// or to show it with anything that plays clips.
    ///
    /// # Errors
    /// A clip or a level that is not of this skeleton, places out of all range.
    pub fn drawn(&self, skeleton: &Skeleton, clip: &Clip) -> Result<Clip, LodError> {
        check(skeleton, clip)?;
        self.check(skeleton)?;
        let entries = clip.frames() * skeleton.len();
        let mut desc = ClipDesc {
            name: clip.name().to_owned(),
            frame_rate: clip.frame_rate(),
            roots: clip.desc().roots.clone(),
            rotations: Vec::with_capacity(entries),
            translations: Vec::with_capacity(entries),
        };
        let mut places = Vec::new();
        for frame in 0..clip.frames() {
            place_all(skeleton, clip, frame, &mut places);
            let drawn: Vec<Place> = { self.seats.iter() }
                .map(|seat| {
                    let carrier = places[self.kept[usize::from(seat.carrier)].index()];
                    carrier.after(&Place {
                        rotation: seat.offset.rotation.as_dquat(),
                        translation: seat.offset.translation.as_dvec3(),
                    })
                })
                .collect();
            for (joint, place) in skeleton.joints().iter().zip(&drawn) {
                let local = match joint.parent {
                    Some(parent) => drawn[parent.index()].sees(place),
                    None => *place,
                };
                // Nothing hangs on an end site: its place is all that it has.
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
