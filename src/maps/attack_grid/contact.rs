use glam::{Vec2, Vec3};

use crate::graph::{EdgeId, MotionGraph};
use crate::maps::{BakedGraph, MovingSphere, SphereKey, Strike};

/// A moment of an attack at which it strikes: the foremost sphere of its limb then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Frames since the attack's start.
    pub frame: u32,
    /// Centre of the sphere, in the character's frame at the attack's start, metres.
    pub centre: Vec3,
    /// Metres.
    pub radius: f32,
}

/// The contacts of an attack: one each frame, from where its foremost sphere has `drive` of its furthest reach until where that is
/// largest. Reach is along the ground, from the root's place at the attack's start towards where the sphere gets.
pub(super) fn contacts(baked: &BakedGraph, strike: &Strike, drive: f32) -> Vec<Contact> {
    let spheres = baked.strike_spheres(strike);
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
    let is_short = |key: &SphereKey| ground(key).dot(way) < drive * reach;
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

/// For all attacks of a graph.
pub(super) fn of_all(baked: &BakedGraph, drive: f32) -> Vec<Vec<Contact>> {
    let strikes = baked.strikes().iter();
    strikes
        .map(|strike| contacts(baked, strike, drive))
        .collect()
}

/// The edges of all attacks.
pub(super) fn edges(baked: &BakedGraph) -> Vec<EdgeId> {
    baked.strikes().iter().map(|strike| strike.edge).collect()
}

/// Seconds as whole frames, rounded up.
pub(super) fn frames(graph: &MotionGraph, seconds: f32) -> u32 {
    (seconds * graph.frame_rate() as f32).ceil().max(0.0) as u32
}
