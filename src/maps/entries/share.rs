//! Shares of all moments, for several processes that test them.

use super::record::EntryRecord;

/// A share of all moments: every `of`th batch, starting with batch `index`. Shares have about equal cost.
#[derive(Clone, Copy, Debug)]
pub struct MomentShare {
    /// Number of the share, from 0.
    pub index: usize,
    /// Number of shares.
    pub of: usize,
}

impl MomentShare {
    /// All moments.
    pub(super) const ALL: Self = Self { index: 0, of: 1 };

    /// Number of moments of a batch. They share scratch.
    const BATCH: usize = 64;

    /// The batches of the share.
    pub(super) fn of<T>(self, moments: &[T]) -> impl Iterator<Item = &[T]> {
        moments
            .chunks(Self::BATCH)
            .skip(self.index)
            .step_by(self.of)
    }

    /// Index of the share that a moment belongs to.
    fn holds(moment: usize, shares: usize) -> usize {
        moment / Self::BATCH % shares
    }
}

impl EntryRecord {
    /// Joins the records of all shares, given in order. `None` if they do not belong to one graph.
    #[must_use]
    pub fn of_shares(shares: Vec<Self>) -> Option<Self> {
        let first = shares.first()?;
        let mut all = Self {
            settings: first.settings,
            first_moment: first.first_moment.clone(),
            entries: first.entries.without_tests(),
            exits: first.exits.without_tests(),
            layers: first.layers.without_tests(),
            ..Self::default()
        };
        let moments = all.first_moment.last().map_or(0, |&end| end as usize);
        let mut next = vec![0; shares.len()];
        for moment in 0..moments {
            let share = MomentShare::holds(moment, shares.len());
            let own = &shares[share];
            let tests = [&own.entries, &own.exits, &own.layers];
            let [entries, exits, layers] = tests.map(|table| table.moment(next[share]));
            all.push([entries?, exits?, layers?]);
            next[share] += 1;
        }
        let has_same = |own: &Self| {
            own.settings == all.settings
                && own.first_moment == all.first_moment
                && own.entries.is_of(&all.entries)
                && own.exits.is_of(&all.exits)
                && own.layers.is_of(&all.layers)
        };
        shares.iter().all(has_same).then_some(all)
    }
}
