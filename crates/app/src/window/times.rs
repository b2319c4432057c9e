use std::collections::VecDeque;
use std::time::Instant;

/// Times of the last pictures.
#[derive(Debug, Default)]
pub(super) struct Times {
    last: Option<Instant>,
    recent: VecDeque<f32>,
    /// Number of pictures so far.
    pub(super) pictures: u64,
}

/// Number of times that are kept.
const KEPT: usize = 240;

impl Times {
    /// Records that a picture was shown.
    pub(super) fn shown(&mut self) {
        self.pictures += 1;
        let now = Instant::now();
        if let Some(last) = self.last.replace(now) {
            self.recent.push_back(1e3 * (now - last).as_secs_f32());
            if self.recent.len() > KEPT {
                self.recent.pop_front();
            }
        }
    }

    /// Records a pause, which does not count as the time of a picture.
    pub(super) fn pause(&mut self) {
        self.last = None;
    }

    /// Median time of a picture, in milliseconds; 0 before the second picture.
    pub(super) fn median(&self) -> f64 {
        median(self.recent.iter().copied())
    }
}

/// Median; the upper one of two middle values; 0 without values.
pub(super) fn median(values: impl Iterator<Item = f32>) -> f64 {
    let mut values: Vec<f32> = values.collect();
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().map_or(0.0, f64::from)
}
