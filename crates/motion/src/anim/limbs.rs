use glam::{Vec2, Vec3};

use super::{JointId, JointKind, JointTransform, Skeleton};
use crate::math::Rigid2;

/// Hands and feet of a skeleton.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limbs {
    /// Wrists or hands.
    pub hands: Vec<JointId>,
    /// Ankles or feet.
    pub feet: Vec<JointId>,
}

impl Limbs {
    /// Finds hands and feet by name (`hand` or `wrist`; `foot` or `ankle`), on each side the one
    /// closest to the root. If the names identify none, the last moving joint of every chain counts
    /// as a foot.
    #[must_use]
    pub fn of(skeleton: &Skeleton) -> Self {
        let hands = named_hands(skeleton);
        let feet = named_feet(skeleton);
        if hands.is_empty() && feet.is_empty() {
            return Self {
                hands,
                feet: last_moving_joints(skeleton),
            };
        }
        Self { hands, feet }
    }

    /// All hands, then all feet.
    pub fn all(&self) -> impl Iterator<Item = JointId> + '_ {
        self.hands.iter().chain(&self.feet).copied()
    }
}

/// The hands that names tell.
pub(super) fn named_hands(skeleton: &Skeleton) -> Vec<JointId> {
    by_name(skeleton, &["hand", "wrist"])
}

/// Feet that joint names identify.
pub(super) fn named_feet(skeleton: &Skeleton) -> Vec<JointId> {
    by_name(skeleton, &["foot", "ankle"])
}

/// For each chain, the first joint whose name contains one of `words`.
fn by_name(skeleton: &Skeleton, words: &[&str]) -> Vec<JointId> {
    let named = |id: JointId| {
        let joint = skeleton.joint(id);
        let lower = joint.name.to_ascii_lowercase();
        joint.kind == JointKind::Moving && words.iter().any(|word| lower.contains(word))
    };
    skeleton
        .ids()
        .filter(|&id| named(id) && !skeleton.ancestry(id).skip(1).any(named))
        .collect()
}

fn last_moving_joints(skeleton: &Skeleton) -> Vec<JointId> {
    let moving = |id: JointId| skeleton.joint(id).kind == JointKind::Moving;
    skeleton
        .ids()
        .filter(|&id| moving(id) && !skeleton.children(id).any(moving))
        .collect()
}

/// Finds the position and the facing direction of a pose, independently of the joints' axes.
///
/// The direction is computed from the line between a left and a right joint, usually the hips: of
/// the pairs with mirrored names that the rest pose keeps apart, the pair closest to the root. Left
/// is +X of the character's frame, so the character faces +Z. A skeleton without such a pair faces
/// along its root's Z axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facing {
    /// Left and right joint.
    pair: Option<(JointId, JointId)>,
}

impl Facing {
    /// Finds the pair of joints in `skeleton`.
    #[must_use]
    pub fn of(skeleton: &Skeleton) -> Self {
        let depth = |id| skeleton.ancestry(id).count();
        let pair = skeleton
            .ids()
            .filter_map(|id| match skeleton.sided(id)? {
                (Side::Left, twin) => Some((id, twin)),
                (Side::Right, _) => None,
            })
            .filter(|&(left, right)| apart(skeleton, left, right))
            .min_by_key(|&(left, _)| depth(left));
        Self { pair }
    }

    /// Whether the skeleton has a pair of left and right joints.
    #[must_use]
    pub fn is_of_hips(self) -> bool {
        self.pair.is_some()
    }

    /// The character's frame: root on the ground, with the pelvis' facing direction.
    #[must_use]
    pub fn placement(self, joints: &[JointTransform]) -> Rigid2 {
        self.placement_by(|joint| joints[joint.index()])
    }

    /// [`Facing::placement`] with a function that returns the frame of a joint.
    pub fn placement_by(self, frame: impl Fn(JointId) -> JointTransform) -> Rigid2 {
        let root = frame(JointId::ROOT);
        let forward = match self.pair {
            Some((left, right)) => {
                (frame(left).translation - frame(right).translation).cross(Vec3::Y)
            }
            None => root.rotation * Vec3::Z,
        };
        Rigid2::facing(
            Vec2::new(forward.x, forward.z),
            root.translation.x,
            root.translation.z,
        )
    }
}

/// Whether two joints have different positions in the rest pose. In CMU's skeletons, both hip
/// joints lie on the root.
fn apart(skeleton: &Skeleton, left: JointId, right: JointId) -> bool {
    let place = |id| -> Vec3 {
        skeleton
            .ancestry(id)
            .filter(|&j| j != JointId::ROOT)
            .map(|j| skeleton.joint(j).offset)
            .sum()
    };
    (place(left) - place(right)).length() > 1e-4
}

/// Side of the body, identified by a joint's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

const WORDS: [(&str, &str); 3] = [("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT")];

/// All readings of a joint's name as the name of one side: the side, and the name that the mirrored
/// joint would have.
///
/// The side may be the word `left` or `right` anywhere in the name, or the letter `L` or `R`: as a
/// separate word (`hand.l`, `l_hand`, `Bip01 L Hand`), before a capital at the start of a word
/// (`lHand`), or as a capital at the end of a word (`handL`).
pub(super) fn readings(name: &str) -> impl Iterator<Item = (Side, String)> {
    let (stem, tail) = name
        .strip_suffix("_End")
        .map_or((name, ""), |stem| (stem, "_End"));
    let words = WORDS
        .into_iter()
        .flat_map(|(left, right)| [(Side::Left, left, right), (Side::Right, right, left)])
        .filter(|(_, own, _)| stem.contains(own))
        .map(|(side, own, other)| (side, stem.replacen(own, other, 1)));
    let letters = stem.char_indices().filter_map(|(at, letter)| {
        let (side, other) = match letter {
            'L' => (Side::Left, "R"),
            'l' => (Side::Left, "r"),
            'R' => (Side::Right, "L"),
            'r' => (Side::Right, "l"),
            _ => return None,
        };
        let (before, after) = (&stem[..at], &stem[at + 1..]);
        tells_a_side(before, letter, after).then(|| (side, format!("{before}{other}{after}")))
    });
    words
        .chain(letters)
        .map(move |(side, twin)| (side, twin + tail))
}

fn tells_a_side(before: &str, letter: char, after: &str) -> bool {
    let (last, next) = (before.chars().next_back(), after.chars().next());
    let starts_word = last.is_none_or(|c| !c.is_alphanumeric());
    let ends_word = next.is_none_or(|c| !c.is_alphanumeric());
    let capital_follows = next.is_some_and(char::is_uppercase);
    let small_precedes = last.is_some_and(|c| c.is_lowercase() || c.is_numeric());
    starts_word && (ends_word || capital_follows)
        || ends_word && letter.is_uppercase() && small_precedes
}
