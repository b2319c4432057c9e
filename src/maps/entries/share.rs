//! Shares of all moments, for several processes that search them.

use serde::{Deserialize, Serialize};

use super::moment_search::MomentFound;

/// A share of all moments: every `of`th batch, starting with batch `index`. Shares have about equal cost.
#[derive(Clone, Copy, Debug)]
pub struct MomentShare {
    /// Number of the share, from 0.
    pub index: usize,
    /// Number of shares.
    pub of: usize,
}

/// Entries, exits and layers of the moments of a share.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EntryShare(pub(super) Vec<MomentFound>);

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
}

impl EntryShare {
    /// Joins all shares, given in order. Too few moments in a share leave out those after them.
    pub(super) fn joined(shares: Vec<Self>) -> Vec<MomentFound> {
        let mut rest: Vec<_> = shares.into_iter().map(|it| it.0.into_iter()).collect();
        let mut all = Vec::new();
        loop {
            let before = all.len();
            for share in &mut rest {
                all.extend(share.take(MomentShare::BATCH));
            }
            if all.len() == before {
                return all;
            }
        }
    }
}
