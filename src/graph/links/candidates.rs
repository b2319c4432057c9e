//! Finds possible links and rates them.

use rustc_hash::FxHashMap;

use super::clip_windows::ClipWindows;
use super::lengths::Lengths;
use super::margin::EventMargin;
use super::source::LinkSource;
use super::space::LinkSpace;

/// Finds possible links.
pub(super) struct Candidates<'a> {
    pub(super) space: LinkSpace<'a>,
    /// Windows of all clips, by their length.
    windows: FxHashMap<usize, ClipWindows<'a>>,
}

impl<'a> Candidates<'a> {
    pub(super) fn new(source: LinkSource<'a>, lengths: Lengths) -> Self {
        Self {
            space: LinkSpace::new(source, lengths),
            windows: FxHashMap::default(),
        }
    }

    /// Creates the windows of all clips for the window lengths of some ranges.
    pub(super) fn make_windows<'m>(&mut self, ranges: impl Iterator<Item = &'m EventMargin>) {
        for EventMargin { window, .. } in ranges {
            if !self.windows.contains_key(window) {
                let windows = ClipWindows::new(&self.space, *window);
                self.windows.insert(*window, windows);
            }
        }
    }

    /// The windows of all clips for a length that [`Candidates::make_windows`] created.
    pub(super) fn windows(&self, length: usize) -> &ClipWindows<'a> {
        &self.windows[&length]
    }

    /// Frees the memory of the windows. They are created again when needed.
    pub(super) fn forget_windows(&mut self) {
        self.windows.clear();
    }
}
