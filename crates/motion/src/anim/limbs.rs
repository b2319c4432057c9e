use super::{JointId, JointKind, Skeleton};

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
