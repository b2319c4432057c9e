use std::collections::{HashMap, HashSet};

use super::hierarchy::RawJoint;

/// Computes a unique name for every joint.
///
/// The first joint with a name keeps it; later ones get `_2`, `_3` or the next free number. End
/// Sites are named after their parents with `_End` or `_End2`; their names in the file are ignored.
pub(super) fn unique(raw: &[RawJoint]) -> Vec<String> {
    let mut taken = UsedNames::default();
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

/// The names that several joints have in the file, each once, in the order of the file.
pub(super) fn repeated(raw: &[RawJoint]) -> Vec<String> {
    let mut seen: HashMap<&str, bool> = HashMap::new();
    let mut repeated = Vec::new();
    for joint in raw.iter().filter(|joint| !joint.is_end) {
        match seen.get_mut(joint.name.as_str()) {
            Some(is_told) if *is_told => {}
            Some(is_told) => {
                *is_told = true;
                repeated.push(joint.name.clone());
            }
            None => {
                seen.insert(&joint.name, false);
            }
        }
    }
    repeated
}

/// The names in use and, for each repeated name, the next number to try.
#[derive(Default)]
pub(crate) struct UsedNames {
    names: HashSet<String>,
    next: HashMap<String, usize>,
}

impl UsedNames {
    /// Returns the name, or the name with the first free number.
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
