//! The choreography of one clip: key postures, foot movements and events, written one after the other, then played at
//! [`FRAME_RATE`].

use glam::{Vec2, Vec3};

use super::feet::{Air, Foot, Spot, Swing, Way, air_track};
use super::keys::{Body, ROWS, Track};
use super::rhythm::Rhythm;
use super::skeleton::{LEFT, RIGHT};
use super::solve::solve;
use super::stance::{guard, guard_spot};
use sabaki::anim::{Clip, ClipDesc, ClipError, Event, EventKind, JointId, Skeleton};
use sabaki::math::Rigid2;

/// Frames per second of all embedded motions.
pub(super) const FRAME_RATE: f64 = 30.0;

/// A clip in the making. Times are seconds, `dt` counts from the last key.
pub(super) struct Score {
    name: String,
    rhythm: Rhythm,
    southpaw: bool,
    keys: Vec<(f32, Body)>,
    ways: [Way; 2],
    shares: [Vec<f32>; 2],
    events: Vec<(EventKind, f32, f32, Vec<JointId>)>,
    now: f32,
    began: f32,
    /// Home before and after the last [`Score::travel`].
    left: Vec3,
    place: Vec3,
}

impl Score {
    /// Starts in guard at the origin.
    pub(super) fn new(name: &str, rhythm: Rhythm) -> Self {
        let spot = |side| own_spot(side, false, &rhythm);
        Self {
            name: name.to_owned(),
            keys: vec![(0.0, guard(false))],
            ways: [LEFT, RIGHT].map(|side| Way::new(spot(side))),
            rhythm,
            southpaw: false,
            shares: [Vec::new(), Vec::new()],
            events: Vec::new(),
            now: 0.0,
            began: 0.0,
            left: Vec3::ZERO,
            place: Vec3::ZERO,
        }
    }

    /// A key `dt` after the last one: guard, as `change` alters it.
    pub(super) fn pose(&mut self, dt: f32, change: impl FnOnce(&mut Body)) -> &mut Self {
        self.partway(dt, 1.0, change)
    }

    /// As [`Score::pose`], with only a share of the last travel made.
    pub(super) fn partway(
        &mut self,
        dt: f32,
        share: f32,
        change: impl FnOnce(&mut Body),
    ) -> &mut Self {
        let mut body = guard(self.southpaw);
        body.place = self.left.lerp(self.place, share);
        change(&mut body);
        self.now += dt;
        self.keys.push((self.now, body));
        self
    }

    /// Back in guard.
    pub(super) fn guard(&mut self, dt: f32) -> &mut Self {
        self.pose(dt, |_| {})
    }

    /// The last key again.
    pub(super) fn hold(&mut self, dt: f32) -> &mut Self {
        self.now += dt;
        if let Some(&(_, body)) = self.keys.last() {
            self.keys.push((self.now, body));
        }
        self
    }

    /// The other foot goes first from now on; the feet are to be stepped there.
    pub(super) fn switch(&mut self) -> &mut Self {
        self.southpaw = !self.southpaw;
        self
    }

    /// Home moves by (left, forward) metres and turns left by radians, for all keys and steps from now on.
    pub(super) fn travel(&mut self, left: f32, forward: f32, turn: f32) -> &mut Self {
        self.left = self.place;
        let moved = self.home().point(Vec3::new(left, 0.0, forward));
        self.place = Vec3::new(moved.x, self.place.y + turn, moved.z);
        self
    }

    fn home(&self) -> Rigid2 {
        Rigid2::new(self.place.y, self.place.x, self.place.z)
    }

    /// A foot steps to its place in guard, from `delay` after the last key on, in `duration`.
    pub(super) fn step(&mut self, side: usize, delay: f32, duration: f32) -> &mut Self {
        self.step_off(side, delay, duration, Vec3::ZERO)
    }

    /// As [`Score::step`], to another place: (left, turn left, forward) from that in guard.
    pub(super) fn step_off(
        &mut self,
        side: usize,
        delay: f32,
        duration: f32,
        off: Vec3,
    ) -> &mut Self {
        let mut spot = own_spot(side, self.southpaw, &self.rhythm);
        spot.toe += Vec2::new(off.x, off.z);
        spot.yaw += off.y;
        let far = self.ways[side].spot().toe.distance(self.placed(spot).toe);
        let lift = 0.035 + 0.07 * far.min(0.8);
        self.swing(side, delay, duration, spot, lift)
    }

    /// A foot leaps to its place in guard: higher than a step.
    pub(super) fn leap(&mut self, side: usize, delay: f32, duration: f32, lift: f32) -> &mut Self {
        let spot = own_spot(side, self.southpaw, &self.rhythm);
        self.swing(side, delay, duration, spot, lift)
    }

    /// A foot turns on its ball to another angle than in guard, radians to the left.
    pub(super) fn pivot(&mut self, side: usize, delay: f32, duration: f32, turn: f32) -> &mut Self {
        let toe = self.ways[side].spot().toe;
        let yaw = own_spot(side, self.southpaw, &self.rhythm).yaw + self.place.y + turn;
        self.push(side, delay, duration, Spot { toe, yaw }, 0.0, &[])
    }

    /// A foot leaves the ground along `keys` and returns to its place in guard.
    pub(super) fn kick(
        &mut self,
        side: usize,
        delay: f32,
        duration: f32,
        keys: &[Air],
    ) -> &mut Self {
        let spot = self.placed(own_spot(side, self.southpaw, &self.rhythm));
        self.push(side, delay, duration, spot, 0.05, keys)
    }

    fn placed(&self, spot: Spot) -> Spot {
        // Headings stay unwrapped, so that a foot never turns the long way round.
        let turned = spot.yaw + self.place.y;
        Spot {
            yaw: turned,
            ..spot.placed(self.home())
        }
    }

    fn swing(
        &mut self,
        side: usize,
        delay: f32,
        duration: f32,
        spot: Spot,
        lift: f32,
    ) -> &mut Self {
        let to = self.placed(spot);
        self.push(side, delay, duration, to, lift, &[])
    }

    fn push(
        &mut self,
        side: usize,
        delay: f32,
        duration: f32,
        to: Spot,
        lift: f32,
        keys: &[Air],
    ) -> &mut Self {
        let from = self.ways[side].spot();
        let start = (self.now + delay).max(self.ways[side].busy_until());
        let air = (!keys.is_empty()).then(|| air_track(from, to, duration, keys, self.home()));
        // Turning on the ball keeps the weight; a kick gives nearly all of it to the other foot, a wide step or a leap
        // carries it along.
        let far = (from.toe.distance(to.toe) / 0.45).min(1.0);
        let share = match (&air, lift) {
            (Some(_), _) => 0.62,
            (None, 0.0) => 0.0,
            (None, _) => 0.28 - 0.22 * far,
        };
        self.shares[side].push(share);
        self.ways[side].push(Swing {
            start,
            end: start + duration,
            from,
            to,
            lift,
            air,
        });
        self
    }

    /// An event starts `delay` after the last key.
    pub(super) fn begin(&mut self, delay: f32) -> &mut Self {
        self.began = self.now + delay;
        self
    }

    /// An evasion ends at the last key.
    pub(super) fn evaded(&mut self) -> &mut Self {
        let event = (EventKind::Evasion, self.began, self.now, Vec::new());
        self.events.push(event);
        self
    }

    /// An attack ends at the last key.
    pub(super) fn struck(&mut self, joints: Vec<JointId>) -> &mut Self {
        let event = (EventKind::Attack, self.began, self.now, joints);
        self.events.push(event);
        self
    }

    /// Plays it: the clip and its events, for the clip's `index` in the set.
    pub(super) fn play(
        &self,
        skeleton: &Skeleton,
        index: usize,
    ) -> Result<(Clip, Vec<Event>), ClipError> {
        let track = Track::new(
            self.keys
                .iter()
                .map(|(t, body)| (*t, body.rows()))
                .collect(),
        );
        let frames = (f64::from(self.now) * FRAME_RATE).floor() as usize + 1;
        let mut desc = ClipDesc {
            name: self.name.clone(),
            frame_rate: FRAME_RATE,
            roots: Vec::with_capacity(frames),
            rotations: Vec::with_capacity(frames * skeleton.len()),
            translations: Vec::new(),
        };
        for frame in 0..frames {
            let time = (frame as f64 / FRAME_RATE) as f32;
            let mut body = body_at(&track, time);
            self.rhythm.apply(time, &mut body);
            let solved = solve(&body, self.feet(time, &body), self.shift(time));
            desc.roots.push(solved.root);
            desc.rotations.extend_from_slice(&solved.rotations);
        }
        let clip = Clip::new(skeleton, desc)?;
        let events = self.events.iter().map(|(kind, start, end, joints)| Event {
            clip: index,
            kind: *kind,
            start: f64::from(*start),
            end: f64::from(*end).min(clip.duration()),
            joints: joints.clone(),
        });
        let events = events.collect();
        Ok((clip, events))
    }

    fn feet(&self, time: f32, body: &Body) -> [Foot; 2] {
        [LEFT, RIGHT].map(|side| self.ways[side].foot(time, body.heels[side]))
    }

    /// The body leans over the foot that stands while the other is in the air.
    fn shift(&self, time: f32) -> Vec3 {
        let mut shift = Vec2::ZERO;
        for side in [LEFT, RIGHT] {
            let stands = self.ways[1 - side].stood(time).toe;
            let swings = self.ways[side].swings().iter().zip(&self.shares[side]);
            for (swing, share) in swings {
                let weight = share * swing.unweighted(time);
                if weight > 0.0 {
                    shift += 0.5 * (stands - swing.from.toe.lerp(swing.to.toe, 0.5)) * weight;
                }
            }
        }
        Vec3::new(shift.x, 0.0, shift.y)
    }
}

/// Where a foot stands in this clip's guard, in home.
fn own_spot(side: usize, southpaw: bool, rhythm: &Rhythm) -> Spot {
    let mut spot = guard_spot(side, southpaw);
    spot.toe += Vec2::new(rhythm.feet[side].x, rhythm.feet[side].z);
    spot.yaw += rhythm.feet[side].y;
    spot
}

/// How much later than the hips each row of [`Body`] moves, seconds: the hips lead, the hands come last.
const LAGS: [f32; ROWS] = [
    0.0, 0.0, 0.0, 0.012, 0.0, 0.02, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0,
];

/// The curve through the keys, smoothed over a few hundredths of a second so that no motion starts with a jerk.
fn body_at(track: &Track<ROWS>, time: f32) -> Body {
    const TAPS: [(f32, f32); 5] = [
        (-0.04, 0.12),
        (-0.02, 0.23),
        (0.0, 0.30),
        (0.02, 0.23),
        (0.04, 0.12),
    ];
    let rows = std::array::from_fn(|row| {
        let taps = TAPS.iter();
        taps.map(|&(offset, weight)| track.row(row, time - LAGS[row] + offset) * weight)
            .sum()
    });
    Body::from_rows(&rows)
}
