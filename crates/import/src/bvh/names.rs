use std::collections::{HashMap, HashSet};

use super::hierarchy::RawJoint;

/// A unique name for every joint.
///
/// Joints keep their names, a second one of the same name gets `_2`, a third `_3` (or the next that is free). End
/// Sites are then named after their parents with `_End`, `_End2`; a name that the file gives them is not used.
pub(super) fn unique(raw: &[RawJoint]) -> Vec<String> {
    let mut taken = Taken::default();
    let mut names = vec![String::new(); raw.len()];
    for (index, joint) in raw.iter().enumerate().filter(|(_, joint)| !joint.is_end) {
        names[index] = taken.first_free(&joint.name, "_");
    }
    for (index, joint) in raw.iter().enumerate().filter(|(_, joint)| joint.is_end) {
        let parent = joint.parent.map_or("", |parent| names[parent].as_str());
        names[index] = taken.first_free(&format!("{parent}_End"), "");
    }
    names
}

/// The names that are given, and for each name that was wanted again the number to try next.
#[derive(Default)]
pub(crate) struct Taken {
    names: HashSet<String>,
    next: HashMap<String, usize>,
}

impl Taken {
    /// The name, or the name with the first number that is free behind it.
    pub(crate) fn first_free(&mut self, name: &str, before_number: &str) -> String {
        let mut free = name.to_owned();
        if self.names.contains(name) {
            let next = self.next.entry(free.clone()).or_insert(2);
            while self.names.contains(&free) {
                free = format!("{name}{before_number}{next}");
                *next += 1;
            }
        }
        self.names.insert(free.clone());
        free
    }
}
