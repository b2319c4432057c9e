//! The groups of a crowd cut into chunks, for threads to take.

use super::bucket::Piece;
use super::schedule::Schedule;
use super::settings::Hold;

impl Schedule {
    /// Cuts the groups into chunks of equal lengths in the output.
    pub(super) fn share_out(&mut self, chunks: usize) {
        self.pieces.clear();
        self.ends.clear();
        for chunk in 0..chunks {
            let start = self.lines * chunk / chunks;
            let end = self.lines * (chunk + 1) / chunks;
            for bucket in &self.buckets {
                // A group belongs to the chunk in which it starts.
                let up_to = |line: usize| {
                    let groups = line.saturating_sub(bucket.offset).div_ceil(bucket.lines);
                    groups.min(bucket.groups.len())
                };
                let (from, to) = (up_to(start), up_to(end));
                if from < to {
                    let line = |group: usize| bucket.offset + group * bucket.lines;
                    self.pieces.push(Piece {
                        level: bucket.level,
                        mix: bucket.mix,
                        groups: bucket.groups.start + from..bucket.groups.start + to,
                        lines: line(from)..line(to),
                    });
                }
            }
            self.ends.push(self.pieces.len());
        }
    }

    /// The pieces of each chunk.
    pub(super) fn parts(&self) -> impl Iterator<Item = &[Piece]> {
        (0..self.ends.len()).map(|chunk| self.part(chunk))
    }

    /// Number of chunks.
    pub(super) fn chunks(&self) -> usize {
        self.ends.len()
    }

    /// The pieces of one chunk, in the order of the output.
    pub(super) fn part(&self, chunk: usize) -> &[Piece] {
        let start = chunk.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.pieces[start..self.ends[chunk]]
    }

    /// Whether the groups of a piece are posed in turn: their level is no finer than [`Hold::from`], and all existed at the
    /// last sorting. The answer is the same for all groups of a bucket, however they are cut into pieces.
    pub(super) fn is_held(&self, piece: &Piece, hold: Hold) -> bool {
        hold.frames > 0 && piece.level >= hold.from && piece.groups.end <= self.first_late
    }

    /// Whether a group has just come into view. Its pose may then be too old.
    pub(super) fn is_new_in_view(&self, group: usize) -> bool {
        self.visible[group] != 0 && !self.was_visible[group]
    }
}
