use serde::{Deserialize, Serialize};

use super::KnownEntry;
use crate::math::byte_list;

/// A list of entries for each moment. The moments are those of the [`EntryTable`](super::EntryTable).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MomentLists {
    /// End of each moment's list in `entries`.
    ends: Vec<u32>,
    #[serde(with = "byte_list")]
    entries: Vec<KnownEntry>,
}

impl MomentLists {
    /// Number of moments.
    #[must_use]
    pub(super) fn moments(&self) -> usize {
        self.ends.len()
    }

    /// Number of entries of all moments.
    #[must_use]
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Appends the list of the next moment.
    pub(super) fn push(&mut self, entries: &[KnownEntry]) {
        self.entries.extend_from_slice(entries);
        self.ends.push(self.entries.len() as u32);
    }

    /// The list of a moment.
    pub(super) fn of(&self, moment: u32) -> &[KnownEntry] {
        let moment = moment as usize;
        let start = moment.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.entries[start as usize..self.ends[moment] as usize]
    }

    /// Checks that there is a list for each moment, and that each entry is valid.
    pub(super) fn fits(&self, moments: usize, is_sound: impl Fn(&KnownEntry) -> bool) -> bool {
        self.moments() == moments
            && self.ends.is_sorted()
            && self.ends.last().map_or(0, |&end| end as usize) == self.entries.len()
            && self.entries.iter().all(is_sound)
    }
}
