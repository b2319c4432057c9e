//! What steering remembers of one character: its last search, and what it played while it stood idle.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::SteerStep;
use super::table::Moment;
use crate::character::goal::Aim;
use crate::math::Rigid2;

/// State of the steering of one character.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::character) struct SteerState {
    /// Time until the next search, in seconds.
    pub(super) search_in: f32,
    /// Whether it stands as it should, so that no search is needed.
    pub(super) is_held: bool,
    /// Whether the played moment stands.
    pub(super) stands: bool,
    /// The aim of the last search.
    pub(super) aim: [f32; 2],
    pub(super) facing: Option<f32>,
    /// Position of the root in the last step (x, z), in metres.
    last: [f32; 2],
    /// Speed at which it has come along its aim of late, in metres per second.
    pub(super) progress: f32,
    /// Frames that were played while it stood idle, oldest first.
    recent: Vec<Recent>,
    /// Place where the character came to stand (x, z), in metres; `None` if it does not stand.
    pub(super) place: Option<[f32; 2]>,
}

/// Time within which repetition is seen at once, in seconds.
pub(super) const SHORTLY: f32 = 11.0;

/// A range of frames that was played.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Recent {
    clip: u32,
    from: u32,
    to: u32,
    /// Time since it was played, in seconds.
    age: f32,
}

impl SteerState {
    /// Whether every number is one that steering may have written.
    pub(in crate::character) fn is_sound(&self) -> bool {
        let place = self.place.unwrap_or_default();
        self.search_in <= 60.0
            && self.progress.is_finite()
            && place
                .iter()
                .chain(&self.aim)
                .chain(&self.last)
                .all(|value| value.is_finite())
            && self.facing.is_none_or(f32::is_finite)
            && self.recent.iter().all(|one| one.age >= 0.0)
    }

    /// Makes the next step search. A character that stands then stays where it is.
    pub(in crate::character) fn search_now(&mut self) {
        (self.search_in, self.place) = (0.0, None);
    }

    /// Makes one of the next steps search.
    pub(in crate::character) fn search_soon(&mut self) {
        (self.search_in, self.is_held) = (self.search_in.min(0.0), false);
    }

    /// Time until the next search at the start of a step, in seconds; below 0 for one that waits. `None` if none is needed.
    pub(in crate::character) fn next_search(&self) -> Option<f32> {
        (!self.is_held).then_some(self.search_in)
    }

    /// Moves the place where the character came to stand.
    pub(in crate::character) fn move_by(&mut self, by: Rigid2) {
        self.place = self.place.map(|[x, z]| {
            let moved = by.point(Vec3::new(x, 0.0, z));
            [moved.x, moved.z]
        });
    }

    /// Cost of a search relative to that of a character that walks: one that stands is also compared with all moments that walk.
    pub(in crate::character) fn search_cost(&self) -> usize {
        1 + usize::from(self.stands)
    }

    /// Follows how fast the character comes along its aim. A new aim is given time.
    pub(super) fn follow(&mut self, place: Vec2, aim: &Aim, is_new: bool, dt: f32) {
        /// Time over which the speed is averaged, in seconds.
        const LATELY: f32 = 0.7;
        let moved = place - Vec2::from(std::mem::replace(&mut self.last, place.to_array()));
        let speed = aim.velocity.length();
        if is_new || aim.stands() || dt <= 0.0 {
            self.progress = speed;
            return;
        }
        let along = moved.dot(aim.velocity) / (speed * dt);
        self.progress += (along - self.progress) * (dt / LATELY).min(1.0);
    }

    /// Whether the character hardly comes along its aim, for a speed that can be had, in metres per second.
    pub(super) fn is_stuck(&self, speed: f32) -> bool {
        self.progress < 0.5 * speed
    }

    /// Whether a search that is needed may be made in this step. Otherwise it is made soon.
    pub(super) fn may_search(&mut self, may: bool) -> bool {
        if !may {
            self.search_soon();
        }
        may
    }

    /// Offset of a point of the ground from the place where the character came to stand (x, z), in metres.
    pub(super) fn off_place(&self, now: Vec2) -> Vec2 {
        self.place
            .map_or(Vec2::ZERO, |place| now - Vec2::from(place))
    }

    pub(super) fn last_aim(&self) -> Aim {
        Aim {
            velocity: Vec2::from(self.aim),
            facing: self.facing,
        }
    }

    /// Remembers the moment that an idle character plays, and forgets those that are long ago. `calm` is the time for which the clips
    /// stand, in seconds.
    pub(super) fn remember(&mut self, moment: &Moment, step: &SteerStep<'_>, calm: f32) {
        /// Share of the clips' calm time that may be remembered: enough is left to choose from.
        const SHARE: f32 = 0.5;
        self.recent.iter_mut().for_each(|one| one.age += step.dt);
        let repeat = step.settings.repeat.min(SHARE * calm);
        self.recent.retain(|one| one.age < repeat);
        let (clip, frame) = (moment.clip.0, moment.frame);
        match self.recent.last_mut() {
            Some(last) if last.clip == clip && (last.to..=last.to + 2).contains(&frame) => {
                (last.to, last.age) = (frame, 0.0);
            }
            _ => self.recent.push(Recent {
                clip,
                from: frame,
                to: frame,
                age: 0.0,
            }),
        }
    }

    /// Whether the played motion reaches frames that were played a moment ago.
    pub(super) fn repeats(&self, moment: &Moment) -> bool {
        /// The motion is left this many frames before them.
        const BEFORE: u32 = 6;
        let before = self.recent.len().saturating_sub(1);
        self.recent[..before].iter().any(|one| {
            let frames = one.from.saturating_sub(BEFORE)..=one.to;
            one.clip == moment.clip.0 && one.age < SHORTLY && frames.contains(&moment.frame)
        })
    }

    /// Whether the frames from a moment on were played within a time, in seconds.
    pub(super) fn has_played(&self, moment: &Moment, within: f32) -> bool {
        /// Distance in a clip within which frames look the same, in frames.
        const ALIKE: u32 = 12;
        /// Minimum number of frames that are played after a jump.
        const PLAYED: u32 = 30;
        self.recent.iter().any(|one| {
            one.clip == moment.clip.0
                && one.age < within
                && moment.frame + PLAYED >= one.from
                && moment.frame <= one.to + ALIKE
        })
    }
}
