//! A library of any length, made of a few clips.

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, ClipDesc, Skeleton};

/// A library that is made of clips by cutting, by changes of their speed and by turning joints.
pub(crate) struct Library<'a> {
    pub(crate) skeleton: &'a Skeleton,
    pub(crate) clips: &'a [Clip],
    /// Standard deviation of the turn of each joint about a random axis, in radians. It is drawn once for each pass over the
    /// clips, as another person holds another posture. The first pass is not turned.
    pub(crate) turn: f32,
}

impl Library<'_> {
    /// Clips of `seconds` at 30 Hz. A longer library begins with the clips of a shorter one.
    pub(crate) fn of(&self, seconds: f64) -> Vec<Clip> {
        let mut random = Random(1);
        let (mut clips, mut total) = (Vec::new(), 0.0);
        for pass in 0.. {
            let turns: Vec<Quat> = (0..self.skeleton.len())
                .map(|joint| match (pass, joint) {
                    (0, _) | (_, 0) => Quat::IDENTITY,
                    _ => Quat::from_scaled_axis(self.turn * random.normal()),
                })
                .collect();
            for clip in self.clips {
                if total >= seconds {
                    return clips;
                }
                let share = random.number(0.6, 1.0);
                let frames = ((clip.frames() as f32 * share) as usize).max(1);
                let first = (random.number(0.0, 1.0) * (clip.frames() - frames) as f32) as usize;
                let desc = self.changed(clip, first..first + frames, &turns);
                let desc = ClipDesc {
                    name: format!("{pass} {}", clip.name()),
                    frame_rate: clip.frame_rate() * f64::from(random.number(0.8, 1.25)),
                    ..desc
                };
                let clip = Clip::new(self.skeleton, desc).unwrap();
                let clip = clip.resampled(30.0).unwrap();
                total += clip.duration();
                clips.push(clip);
            }
        }
        clips
    }

    fn changed(&self, clip: &Clip, frames: std::ops::Range<usize>, turns: &[Quat]) -> ClipDesc {
        let (joints, desc) = (self.skeleton.len(), clip.desc());
        let rotations = &desc.rotations[frames.start * joints..frames.end * joints];
        let translations = match desc.translations.is_empty() {
            true => &[][..],
            false => &desc.translations[frames.start * joints..frames.end * joints],
        };
        let turned = rotations.iter().enumerate();
        ClipDesc {
            name: String::new(),
            frame_rate: desc.frame_rate,
            roots: desc.roots[frames].to_vec(),
            rotations: turned
                .map(|(index, rotation)| (*rotation * turns[index % joints]).normalize())
                .collect(),
            translations: translations.to_vec(),
        }
    }
}

/// Splitmix64.
struct Random(u64);

impl Random {
    fn number(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        low + (high - low) * ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Three numbers of about a normal distribution: sums of twelve uniform ones.
    fn normal(&mut self) -> Vec3 {
        let mut one = || (0..12).map(|_| self.number(-0.5, 0.5)).sum();
        Vec3::new(one(), one(), one())
    }
}
