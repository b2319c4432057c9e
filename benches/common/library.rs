//! A library of any length, made of a few clips.

use glam::{Quat, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use sabaki::anim::{Clip, ClipDesc, Event, EventKind, Skeleton};

/// A library that is made of clips by cutting, by changes of their speed and by turning joints.
pub(crate) struct Library<'a> {
    pub(crate) skeleton: &'a Skeleton,
    pub(crate) clips: &'a [Clip],
    pub(crate) events: &'a [Event],
    /// Standard deviation of the turn of each joint about a random axis, in radians. It is drawn once for each pass over the
    /// clips, as another person holds another posture. The first pass is not turned.
    pub(crate) turn: f32,
    /// Maximum number of evasions. Later ones are not labelled.
    pub(crate) evasions: usize,
}

/// The clips of a library, and their events.
#[derive(Default)]
pub(crate) struct MadeClips {
    pub(crate) clips: Vec<Clip>,
    pub(crate) events: Vec<Event>,
}

/// A part of a clip, played at another rate.
struct Cut {
    first: usize,
    frames: usize,
    rate: f64,
}

impl Library<'_> {
    /// Clips of `seconds` at 30 Hz. A longer library begins with the clips of a shorter one.
    pub(crate) fn of(&self, seconds: f64) -> MadeClips {
        let mut random = Pcg32::seed_from_u64(1);
        let (mut made, mut total) = (MadeClips::default(), 0.0);
        for pass in 0.. {
            let turns: Vec<Quat> = (0..self.skeleton.len())
                .map(|joint| match (pass, joint) {
                    (0, _) | (_, 0) => Quat::IDENTITY,
                    _ => Quat::from_scaled_axis(self.turn * normal(&mut random)),
                })
                .collect();
            for (index, clip) in self.clips.iter().enumerate() {
                if total >= seconds {
                    return made;
                }
                let share = random.random_range(0.6..1.0f32);
                let frames = ((clip.frames() as f32 * share) as usize).max(1);
                let cut = Cut {
                    first: random.random_range(0..=clip.frames() - frames),
                    frames,
                    rate: f64::from(random.random_range(0.8..1.25f32)),
                };
                let desc = ClipDesc {
                    name: format!("{pass} {}", clip.name()),
                    ..self.changed(clip, &cut, &turns)
                };
                let clip = Clip::new(self.skeleton, desc).unwrap();
                let clip = clip.resampled(30.0).unwrap();
                total += clip.duration();
                self.add_events(index, &cut, &mut made);
                made.clips.push(clip);
            }
        }
        made
    }

    /// Adds the events of a clip that lie within a cut of it, for the next clip of `made`.
    fn add_events(&self, clip: usize, cut: &Cut, made: &mut MadeClips) {
        let frame_rate = self.clips[clip].frame_rate();
        let moved = |seconds: f64| (seconds - cut.first as f64 / frame_rate) / cut.rate;
        let end = (cut.frames - 1) as f64 / frame_rate / cut.rate;
        let evasion = |event: &&Event| event.kind == EventKind::Evasion;
        for event in self.events.iter().filter(|event| event.clip == clip) {
            let own = Event {
                clip: made.clips.len(),
                start: moved(event.start),
                end: moved(event.end),
                ..event.clone()
            };
            let is_full =
                evasion(&&own) && made.events.iter().filter(evasion).count() >= self.evasions;
            if own.start >= 0.0 && own.end <= end && !is_full {
                made.events.push(own);
            }
        }
    }

    fn changed(&self, clip: &Clip, cut: &Cut, turns: &[Quat]) -> ClipDesc {
        let (joints, desc) = (self.skeleton.len(), clip.desc());
        let frames = cut.first..cut.first + cut.frames;
        let rotations = &desc.rotations[frames.start * joints..frames.end * joints];
        let translations = match desc.translations.is_empty() {
            true => &[][..],
            false => &desc.translations[frames.start * joints..frames.end * joints],
        };
        let turned = rotations.iter().enumerate();
        ClipDesc {
            name: String::new(),
            frame_rate: desc.frame_rate * cut.rate,
            roots: desc.roots[frames].to_vec(),
            rotations: turned
                .map(|(index, rotation)| (*rotation * turns[index % joints]).normalize())
                .collect(),
            translations: translations.to_vec(),
        }
    }
}

/// Three numbers of about a normal distribution: sums of twelve uniform ones.
fn normal(random: &mut Pcg32) -> Vec3 {
    let mut one = || (0..12).map(|_| random.random_range(-0.5..0.5f32)).sum();
    Vec3::new(one(), one(), one())
}
