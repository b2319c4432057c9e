use std::collections::HashSet;

use super::hierarchy::RawJoint;

/// A unique name for every joint.
///
/// Joints keep their names, a second one of the same name gets `_2`, a third `_3` (or the next that is free). End
/// Sites are then named after their parents with `_End`, `_End2`; a name that the file gives them is not used.
pub(super) fn unique(raw: &[RawJoint]) -> Vec<String> {
    let mut taken = HashSet::new();
    let mut names = vec![String::new(); raw.len()];
    for (index, joint) in raw.iter().enumerate().filter(|(_, joint)| !joint.is_end) {
        names[index] = first_free(&mut taken, &joint.name, "_");
    }
    for (index, joint) in raw.iter().enumerate().filter(|(_, joint)| joint.is_end) {
        let parent = joint.parent.map_or("", |parent| names[parent].as_str());
        names[index] = first_free(&mut taken, &format!("{parent}_End"), "");
    }
    names
}

fn first_free(taken: &mut HashSet<String>, name: &str, before_number: &str) -> String {
    let mut free = name.to_owned();
    let mut number = 2;
    while taken.contains(&free) {
        free = format!("{name}{before_number}{number}");
        number += 1;
    }
    taken.insert(free.clone());
    free
}
