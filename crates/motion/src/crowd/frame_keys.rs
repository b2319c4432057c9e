//! The numbers of keys between the frames of clips: one from each frame to the next, more where a joint turns fast.
//!
//! Time is counted in frames, which have equal durations. A moment between two frames lies between two of the keys there.

use super::clip_range::ClipRange;
use super::moment::Moment;
use crate::math::{F32x16, Lanes};

/// The keys from each frame of each clip to the next frame.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameKeys(Vec<KeysOfFrame>);

/// The keys from a frame to the next one.
#[derive(Clone, Copy, Debug)]
struct KeysOfFrame {
    /// Index of the first key in its clip.
    first: f32,
    /// Number of keys.
    count: f32,
}

impl FrameKeys {
    /// Adds a clip. `keys_of_frames` has the number of keys of each frame but the last.
    pub(super) fn add(&mut self, keys_of_frames: &[u32]) {
        let mut first = 0;
        // A clip of one frame stands still for the duration of a frame.
        for &count in if keys_of_frames.is_empty() {
            &[1]
        } else {
            keys_of_frames
        } {
            self.0.push(KeysOfFrame {
                first: first as f32,
                count: count as f32,
            });
            first += count;
        }
    }

    /// The position of `time`, which is in frames, in intervals between keys. Both are counted from the clip's beginning.
    pub(super) fn position(&self, range: &ClipRange, time: f32) -> f32 {
        let frame = time.floor().min(range.frames as f32 - 1.0);
        let KeysOfFrame { first, count } = self.0[range.frame + frame as usize];
        (time - frame) * count + first
    }

    /// Looks up the keys of sixteen characters. `frames` are their frames; `before` are the numbers of frames of all clips
    /// before their own.
    #[inline(always)]
    pub(super) fn of(&self, frames: &F32x16, before: &[u32; F32x16::LANES]) -> LaneKeys {
        let mut keys = LaneKeys {
            first: F32x16::ZERO,
            count: F32x16::ZERO,
        };
        for (lane, &before) in before.iter().enumerate() {
            let own = self.0[before as usize + frames.0[lane] as usize];
            keys.first.0[lane] = own.first;
            keys.count.0[lane] = own.count;
        }
        keys
    }

    /// Size of the table, in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

/// The keys of the frames of sixteen characters.
pub(super) struct LaneKeys {
    first: F32x16,
    count: F32x16,
}

impl LaneKeys {
    /// Converts a moment between frames to a moment between keys.
    ///
    /// No operation is fused, so that all machines find the same interval.
    #[inline(always)]
    pub(super) fn moment<L: Lanes>(&self, part: usize, share: L) -> Moment<L> {
        let count = L::load(&self.count, part);
        let place = share * count;
        let key = place.floor().min(count - L::splat(1.0));
        Moment {
            interval: L::load(&self.first, part) + key,
            share: place - key,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Isa, Kernel};

    /// Converts sixteen moments between frames to moments between keys.
    struct Moments<'a> {
        keys: &'a FrameKeys,
        frames: F32x16,
        shares: F32x16,
    }

    impl Kernel for Moments<'_> {
        /// Intervals, and shares of them.
        type Out = [F32x16; 2];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [F32x16; 2] {
            let keys = self.keys.of(&self.frames, &[3; F32x16::LANES]);
            let mut out = [F32x16::ZERO; 2];
            for part in 0..L::PARTS {
                let moment = keys.moment(part, L::load(&self.shares, part));
                moment.interval.store(&mut out[0], part);
                moment.share.store(&mut out[1], part);
            }
            out
        }
    }

    #[test]
    fn moments_between_frames_are_moments_between_keys() {
        let mut keys = FrameKeys::default();
        let before = ClipRange::after(None, &[1, 1, 1], 30.0);
        keys.add(&[1, 1, 1]);
        let counts = [1, 3, 1, 7, 2];
        let range = ClipRange::after(Some(&before), &counts, 30.0);
        keys.add(&counts);
        assert_eq!((range.frame, range.frames, range.intervals), (3, 5, 14));
        assert!(before.is_even() && !range.is_even());
        let frames = F32x16(std::array::from_fn(|lane| (lane % 5) as f32));
        let shares = F32x16(std::array::from_fn(|lane| lane as f32 / 15.0));
        for isa in Isa::available() {
            let [intervals, rest] = isa.on_lanes(Moments {
                keys: &keys,
                frames,
                shares,
            });
            for lane in 0..F32x16::LANES {
                let frame = lane % 5;
                let first: u32 = counts[..frame].iter().sum();
                let at = first as f32 + shares.0[lane] * counts[frame] as f32;
                let found = intervals.0[lane] + rest.0[lane];
                assert!((found - at).abs() < 1e-5, "{isa:?}: {found} {at}");
                assert!((0.0..=1.0).contains(&rest.0[lane]));
                assert!(intervals.0[lane] < (first + counts[frame]) as f32);
                let position = keys.position(&range, frames.0[lane] + shares.0[lane]);
                assert!((position - at).abs() < 1e-4, "{position} {at}");
            }
        }
        assert_eq!(keys.position(&range, 5.0), 14.0);
    }
}
