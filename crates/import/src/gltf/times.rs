//! Converts keys at arbitrary times to frames at a constant rate.

/// Frame rate of animations whose keys have no common rate, in frames per second.
pub(super) const USUAL_RATE: f64 = 60.0;

/// Maximum deviation of a key from its frame, as a share of the frame time. Times are in single
/// precision.
const OFF: f64 = 0.05;

/// Frame times of an animation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frames {
    /// Time of the first frame, in seconds.
    pub(super) start: f64,
    /// Frame rate, in frames per second.
    pub(super) rate: f64,
    /// Number of frames, at least 1.
    pub(super) count: u64,
}

/// Time of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameTime {
    /// Time, in seconds.
    pub(super) seconds: f64,
    /// A key that is at most this much later belongs to the frame, in seconds.
    pub(super) slack: f64,
}

impl Frames {
    /// Chooses one frame for each key if the keys of all tracks lie on one grid, otherwise
    /// [`USUAL_RATE`].
    pub(super) fn of<'a>(tracks: impl Iterator<Item = &'a [f32]> + Clone) -> Self {
        let all = || tracks.clone().flatten().map(|&time| f64::from(time));
        let (start, end) = all().fold((f64::INFINITY, 0.0f64), |(start, end), time| {
            (start.min(time), end.max(time))
        });
        let seconds = end - start;
        if !(seconds.is_finite() && seconds > 0.0) {
            return Self {
                start: start.min(end),
                rate: 30.0,
                count: 1,
            };
        }
        let sampled = Self {
            start,
            rate: USUAL_RATE,
            // Times can be any single-precision values, so the count saturates.
            count: ((seconds * USUAL_RATE + 1e-3).floor() as u64).saturating_add(1),
        };
        let gaps = tracks.clone().flat_map(|times| times.windows(2));
        let gaps = gaps.map(|pair| f64::from(pair[1]) - f64::from(pair[0]));
        let least = gaps.clone().fold(f64::INFINITY, f64::min);
        if !least.is_finite() {
            // Each track has a single key, at different times.
            return sampled;
        }
        // Mean of the gaps that differ from the smallest gap only by rounding.
        let (sum, count) = gaps
            .filter(|&gap| gap < 1.2 * least)
            .fold((0.0, 0.0), |(sum, count), gap| (sum + gap, count + 1.0));
        let steps = (seconds * count / sum).round();
        let keys = all().count() as f64;
        if !(1.0..=1e9).contains(&steps) {
            return sampled;
        }
        let frame_time = seconds / steps;
        let off = |time: f64| {
            let frame = (time - start) / frame_time;
            (frame - frame.round()).abs()
        };
        // A few keys that happen to lie on a fine grid do not justify as many frames.
        let too_fine = steps > 4.0 * keys && 1.0 / frame_time > 4.0 * USUAL_RATE;
        if too_fine || all().any(|time| off(time) > OFF) {
            return sampled;
        }
        Self {
            start,
            rate: 1.0 / frame_time,
            count: steps as u64 + 1,
        }
    }

    pub(super) fn time(&self, frame: u64) -> FrameTime {
        FrameTime {
            seconds: self.start + frame as f64 / self.rate,
            slack: OFF / self.rate,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(tracks: &[&[f32]]) -> Frames {
        Frames::of(tracks.iter().copied())
    }

    #[test]
    fn a_common_rate_is_found_again() {
        for rate in [15.0, 23.976, 24.0, 30.0, 60.0, 120.0, 240.0] {
            for count in [2u64, 3, 50, 5000] {
                let start = 7.0 / rate;
                let times: Vec<f32> = (0..count)
                    .map(|k| (start + k as f64 / rate) as f32)
                    .collect();
                let sparse: Vec<f32> = times.iter().copied().step_by(3).collect();
                let found = frames(&[&times, &sparse, &times[..1]]);
                assert_eq!(found.count, count, "{rate}");
                assert!((found.rate / rate - 1.0).abs() < 1e-4, "{rate}: {found:?}");
                assert!((found.start - start).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_grid_with_gaps_in_every_track_is_found() {
        let on = |frames: &[u32]| -> Vec<f32> {
            frames
                .iter()
                .map(|&k| (f64::from(k) / 30.0) as f32)
                .collect()
        };
        let (a, b) = (on(&[0, 1, 5, 90]), on(&[0, 40, 42, 47]));
        let found = frames(&[&a, &b]);
        assert_eq!(found.count, 91);
        assert!((found.rate - 30.0).abs() < 1e-3);
    }

    #[test]
    fn keys_at_any_time_are_sampled() {
        let found = frames(&[&[0.0, 0.31, 0.4567, 2.0]]);
        assert_eq!((found.rate, found.count), (USUAL_RATE, 121));
        let found = frames(&[&[0.0, 1e-20, 2.0]]);
        assert_eq!((found.rate, found.count), (USUAL_RATE, 121));
        assert_eq!(frames(&[&[3.0], &[3.0]]).count, 1);
        assert_eq!(frames(&[&[1.0], &[2.0]]).count, 61);
    }
}
