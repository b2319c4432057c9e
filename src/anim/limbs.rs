use super::{JointId, JointKind, Skeleton};

/// The ends of a skeleton that the eye follows: hands and feet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limbs {
    /// Wrists or hands.
    pub hands: Vec<JointId>,
    /// Ankles or feet.
    pub feet: Vec<JointId>,
}

impl Limbs {
    /// Finds hands and feet by name (`hand` or `wrist`; `foot` or `ankle`), the one nearest to the
    /// root on each side. Where names do not tell, every last moving joint of a chain counts as a
    /// foot: all ends are then treated alike.
    #[must_use]
    pub fn of(skeleton: &Skeleton) -> Self {
        let hands = by_name(skeleton, &["hand", "wrist"]);
        let feet = named_feet(skeleton);
        if hands.is_empty() && feet.is_empty() {
            return Self {
                hands,
                feet: last_moving_joints(skeleton),
            };
        }
        Self { hands, feet }
    }

    /// Hands, then feet.
    pub fn all(&self) -> impl Iterator<Item = JointId> + '_ {
        self.hands.iter().chain(&self.feet).copied()
    }
}

/// The feet that names tell.
pub(super) fn named_feet(skeleton: &Skeleton) -> Vec<JointId> {
    by_name(skeleton, &["foot", "ankle"])
}

/// For each chain the first joint whose name holds one of `words`.
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
