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
    /// closest to the root. If the names identify none, it finds them by structure: two like chains at the joint that is closest to the root are
    /// the legs, the next two above it the arms. Otherwise the last moving joint of every chain counts as a foot.
    #[must_use]
    pub fn of(skeleton: &Skeleton) -> Self {
        Self::known(skeleton).unwrap_or_else(|| Self {
            hands: Vec::new(),
            feet: last_moving_joints(skeleton),
        })
    }

    /// Hands and feet that names or the structure tell.
    pub(super) fn known(skeleton: &Skeleton) -> Option<Self> {
        if let Some(ends) = skeleton.ends() {
            let (hands, feet) = ends.split_at(2);
            return Some(Self {
                hands: hands.to_vec(),
                feet: feet.to_vec(),
            });
        }
        let hands = by_name(skeleton, &["hand", "wrist", "手首"]);
        let feet = by_name(skeleton, &["foot", "ankle", "足首"]);
        match hands.is_empty() && feet.is_empty() {
            true => by_structure(skeleton),
            false => Some(Self { hands, feet }),
        }
    }

    /// All hands, then all feet.
    pub fn all(&self) -> impl Iterator<Item = JointId> + '_ {
        self.hands.iter().chain(&self.feet).copied()
    }
}

/// The joint that carries the whole body: where the legs and the trunk meet. Joints above it only carry it, as `Reference`, `Armature` or a
/// root on the ground do. It is the nearest common ancestor of hands and feet, if at least half of all joints hang on it.
pub fn body_root(skeleton: &Skeleton) -> JointId {
    let limbs = Limbs::of(skeleton);
    let carried = |joint: JointId| {
        let joints = skeleton.ids().filter(|&id| skeleton.carries(joint, id));
        joints.count()
    };
    let carries_body = |&joint: &JointId| {
        let is_above_all = limbs.all().all(|end| skeleton.carries(joint, end));
        is_above_all && 2 * carried(joint) >= skeleton.len()
    };
    let above = limbs.feet.first().filter(|_| limbs.feet.len() > 1);
    let mut above = above.into_iter().flat_map(|&foot| skeleton.ancestry(foot));
    above.find(carries_body).unwrap_or(JointId::ROOT)
}

/// Words in the names of joints that control others, or carry what is no part of the body.
const HELPERS: [&str; 29] = [
    "ik", "fk", "ctrl", "control", "target", "pole", "goal", "twist", "roll", "helper", "slot",
    "socket", "handle", "prop", "weapon", "sword", "blade", "shield", "gun", "bow", "cape",
    "cloak", "cloth", "skirt", "coat", "scarf", "belt", "hair", "ponytail",
];

/// Whether a joint's name says that it controls other joints, or carries a thing or a part of a bone.
fn is_helper(name: &str) -> bool {
    let mut words: Vec<String> = Vec::new();
    let mut before = ' ';
    for letter in name.chars() {
        let starts = letter.is_uppercase() && !before.is_uppercase() || !before.is_alphabetic();
        before = letter;
        match words.last_mut() {
            _ if !letter.is_alphabetic() => {}
            Some(word) if !starts => word.extend(letter.to_lowercase()),
            _ => words.push(letter.to_lowercase().collect()),
        }
    }
    words.iter().any(|word| HELPERS.contains(&word.as_str()))
}

/// For each joint, whether it is a detail that tells nothing of the body's pose: a helper, a finger, a part of the face, a thing that is
/// carried ([`carried`]).
pub fn details(skeleton: &Skeleton) -> Vec<bool> {
    let limbs = Limbs::known(skeleton);
    let mut ends = limbs.map_or_else(Vec::new, |limbs| limbs.hands);
    ends.extend(by_name(skeleton, &["head", "頭"]));
    // A hand with a tip, and a head with one, have no fingers and no face.
    ends.retain(|&end| {
        let below = skeleton.ids().filter(|&id| skeleton.carries(end, id));
        below.count() > 2
    });
    let mut details = carried(skeleton);
    for id in skeleton.ids() {
        let mut above = skeleton.ancestry(id).skip(1);
        details[id.index()] |= above.any(|above| ends.contains(&above));
        details[id.index()] |= is_helper(&skeleton.joint(id).name);
    }
    details
}

/// For each joint, whether it is no part of the body: a helper, a weapon, cloth, or what hangs on one. A helper that carries a hand, a foot
/// or the head is a part of the body. Where all of them are known, what neither carries one nor hangs on one is cloth or a tail, and a bone
/// that is much longer than the forearm and hangs on a hand is a weapon, whatever their names are.
pub fn carried(skeleton: &Skeleton) -> Vec<bool> {
    /// Least length of a bone of a weapon, as a multiple of the bone that leads to the hand.
    const WEAPON: f32 = 1.5;
    let limbs = Limbs::known(skeleton);
    let hands = limbs.as_ref().map_or(&[][..], |limbs| &limbs.hands);
    let heads = by_name(skeleton, &["head", "頭"]);
    let is_known = hands.len() > 1 && !heads.is_empty();
    let is_known = is_known && limbs.as_ref().is_some_and(|limbs| limbs.feet.len() > 1);
    let mut ends: Vec<JointId> = limbs.iter().flat_map(Limbs::all).collect();
    ends.extend(heads);
    let length = |id: JointId| skeleton.joint(id).offset.length();
    let mut carried = vec![false; skeleton.len()];
    for id in skeleton.ids() {
        let joint = skeleton.joint(id);
        let on_one = joint.parent.is_some_and(|parent| carried[parent.index()]);
        let is_helper = joint.kind == JointKind::Moving && is_helper(&joint.name);
        let carries_end = || ends.iter().any(|&end| skeleton.carries(id, end));
        let is_loose = || is_known && !ends.iter().any(|&end| skeleton.carries(end, id));
        let is_weapon = |&hand: &JointId| {
            id != hand && skeleton.carries(hand, id) && length(id) > WEAPON * length(hand)
        };
        carried[id.index()] = on_one
            || (is_helper || is_loose()) && !carries_end()
            || is_known && hands.iter().any(is_weapon);
    }
    carried
}

/// For each chain, the first joint whose name contains one of `words` and that is no helper.
fn by_name(skeleton: &Skeleton, words: &[&str]) -> Vec<JointId> {
    let named = |id: JointId| {
        let joint = skeleton.joint(id);
        let lower = joint.name.to_ascii_lowercase();
        joint.kind == JointKind::Moving
            && words.iter().any(|word| lower.contains(word))
            && !is_helper(&joint.name)
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

/// Hands and feet of a skeleton whose names do not tell them.
fn by_structure(skeleton: &Skeleton) -> Option<Limbs> {
    let mut reach = vec![0f32; skeleton.len()];
    let mut counts = vec![1usize; skeleton.len()];
    for id in skeleton.ids().rev() {
        let joint = skeleton.joint(id);
        if let Some(parent) = joint.parent.map(JointId::index) {
            let own = reach[id.index()] + joint.offset.length();
            reach[parent] = reach[parent].max(own);
            counts[parent] += counts[id.index()];
        }
    }
    // Two children of one joint with as many joints and about as long chains, of two joints at least.
    let pair = |joint: JointId| {
        let own: Vec<JointId> = skeleton.children(joint).collect();
        let mut pairs = own
            .iter()
            .enumerate()
            .flat_map(|(index, &a)| own[index + 1..].iter().map(move |&b| [a, b]));
        pairs.find(|pair| {
            let [a, b] = pair.map(JointId::index);
            let is_like = (reach[a] - reach[b]).abs() <= LIKE * reach[a].max(reach[b]);
            counts[a] == counts[b] && counts[a] > 2 && is_like && reach[a] > 0.0
        })
    };
    let pairs: Vec<(JointId, [JointId; 2])> = skeleton
        .ids()
        .filter_map(|id| Some((id, pair(id)?)))
        .collect();
    let &(hips, legs) = pairs.first()?;
    let is_arms = |&&(chest, arms): &&(JointId, [JointId; 2])| {
        let is_long = reach[arms[0].index()] > SHORTEST_ARM * reach[legs[0].index()];
        chest != hips && is_long && !legs.iter().any(|&leg| skeleton.carries(leg, chest))
    };
    let &(_, arms) = pairs.iter().find(is_arms)?;
    // The joint behind the two long bones: what hangs on it is short.
    let end = |top: JointId| {
        let limit = END * reach[top.index()];
        let mut at = top;
        while reach[at.index()] > limit {
            let moving = skeleton
                .children(at)
                .filter(|&id| skeleton.joint(id).kind == JointKind::Moving);
            let longest = moving.max_by(|a, b| reach[a.index()].total_cmp(&reach[b.index()]));
            match longest {
                Some(next) => at = next,
                None => break,
            }
        }
        at
    };
    Some(Limbs {
        hands: arms.map(end).to_vec(),
        feet: legs.map(end).to_vec(),
    })
}

/// Largest difference of two like chains, as a share of the longer one.
const LIKE: f32 = 0.1;
/// Least length of an arm, as a share of a leg.
const SHORTEST_ARM: f32 = 0.3;
/// Largest length of a hand or foot, as a share of the limb.
const END: f32 = 0.32;

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
    pub fn is_of_hips(self) -> bool {
        self.pair.is_some()
    }

    /// The character's frame: root on the ground, with the pelvis' facing direction.
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

const WORDS: [(&str, &str); 4] = [
    ("Left", "Right"),
    ("left", "right"),
    ("LEFT", "RIGHT"),
    ("左", "右"),
];

/// The reading of a name such as `lfemur` or `rhumerus`: only another joint's name tells that the first letter is a side.
pub(super) fn loose_reading(name: &str) -> Option<(Side, String)> {
    let (side, other, rest) = match name.split_at_checked(1)? {
        ("l", rest) => (Side::Left, "r", rest),
        ("r", rest) => (Side::Right, "l", rest),
        _ => return None,
    };
    Some((side, format!("{other}{rest}")))
}

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
