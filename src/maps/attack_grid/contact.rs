use glam::{Vec2, Vec3};

use crate::graph::{EdgeId, MotionGraph};
use crate::maps::{AttackMove, BakedGraph, MovingSphere, SphereKey};

/// The foremost sphere of an attack's limb at one moment of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Time since the attack's start, in frames.
    pub frame: u32,
    /// Centre of the sphere, in the character's frame at the attack's start, in metres.
    pub centre: Vec3,
    /// Radius of the sphere, in metres.
    pub radius: f32,
}

/// Finds the contacts of an attack, one for each frame. The first contact is where the foremost
/// sphere has `reach_share` of its maximum reach, the last where its reach is at its maximum. Reach is
/// measured along the ground, from the root's position at the attack's start towards the point of
/// maximum reach.
pub(super) fn contacts(baked: &BakedGraph, attack: &AttackMove, reach_share: f32) -> Vec<Contact> {
    let spheres = baked.attack_spheres(attack);
    let ground = |key: &SphereKey| Vec2::new(key.center.x, key.center.z);
    let furthest = |sphere: &MovingSphere| {
        let keys = sphere.keys().iter().enumerate();
        let reached = keys.map(|(frame, key)| (frame, ground(key).length()));
        reached.fold((0, f32::NEG_INFINITY), |best, one| {
            if one.1 > best.1 { one } else { best }
        })
    };
    let reached = spheres.iter().map(|sphere| (sphere, furthest(sphere)));
    let foremost = reached.fold(
        None,
        |best: Option<(&MovingSphere, (usize, f32))>, one| match best {
            Some(best) if best.1.1 >= one.1.1 => Some(best),
            _ => Some(one),
        },
    );
    let Some((sphere, (last, reach))) = foremost else {
        return Vec::new();
    };
    let keys = &sphere.keys()[..=last];
    let way = ground(&keys[last]).normalize_or(Vec2::Y);
    let is_short = |key: &SphereKey| ground(key).dot(way) < reach_share * reach;
    let first = keys.iter().rposition(is_short).map_or(0, |at| at + 1);
    (first..=last.max(first))
        .filter_map(|frame| {
            let key = keys.get(frame)?;
            Some(Contact {
                frame: frame as u32,
                centre: key.center,
                radius: key.radius,
            })
        })
        .collect()
}

/// Contacts of all attacks of a graph.
pub(super) fn all_contacts(baked: &BakedGraph, reach_share: f32) -> Vec<Vec<Contact>> {
    let attack_moves = baked.attack_moves().iter();
    attack_moves
        .map(|attack| contacts(baked, attack, reach_share))
        .collect()
}

/// Edges of all attacks.
pub(super) fn edges(baked: &BakedGraph) -> Vec<EdgeId> {
    baked
        .attack_moves()
        .iter()
        .map(|attack| attack.edge)
        .collect()
}

/// Converts seconds to whole frames, rounded up.
pub(super) fn frames(graph: &MotionGraph, seconds: f32) -> u32 {
    (seconds * graph.frame_rate() as f32).ceil().max(0.0) as u32
}
