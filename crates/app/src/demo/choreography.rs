//! The choreography of one clip: key poses, foot movements and events, listed in order of time and sampled at
//! [`FRAME_RATE`].

use glam::{Vec2, Vec3};

use super::feet::{AirKey, Foot, FootPath, FootPlacement, Kick, Swing};
use super::guard::{guard, guard_placement};
use super::keys::{Body, ROWS, Track};
use super::rhythm::Rhythm;
use super::skeleton::{LEFT, RIGHT};
use super::solve::solve;
use sabaki::anim::{Clip, ClipDesc, ClipError, Event, EventKind, JointId, Skeleton};
use sabaki::math::Rigid2;

/// Frames per second of all embedded motions.
pub(super) const FRAME_RATE: f64 = 30.0;

/// A clip under construction. Times are in seconds; `dt` counts from the last key.
pub(super) struct Choreography {
    name: String,
    rhythm: Rhythm,
    southpaw: bool,
    keys: Vec<(f32, Body)>,
    ways: [FootPath; 2],
    shares: [Vec<f32>; 2],
    events: Vec<(EventKind, f32, f32, Vec<JointId>)>,
    now: f32,
    began: f32,
    /// Home before and after the last [`Choreography::travel`].
    left: Vec3,
    place: Vec3,
}

impl Choreography {
    /// Starts a clip in guard at the origin.
    pub(super) fn new(name: &str, rhythm: Rhythm) -> Self {
        let spot = |side| own_placement(side, false, &rhythm);
        Self {
            name: name.to_owned(),
            keys: vec![(0.0, guard(false))],
            ways: [LEFT, RIGHT].map(|side| FootPath::new(spot(side))),
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

    /// Adds a key `dt` after the last one: the guard, modified by `change`.
    pub(super) fn pose(&mut self, dt: f32, change: impl FnOnce(&mut Body)) -> &mut Self {
        self.partway(dt, 1.0, change)
    }

    /// As [`Choreography::pose`], with only a share of the last travel made.
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

    /// Adds a key in guard.
    pub(super) fn guard(&mut self, dt: f32) -> &mut Self {
        self.pose(dt, |_| {})
    }

    /// Repeats the last key.
    pub(super) fn hold(&mut self, dt: f32) -> &mut Self {
        self.now += dt;
        if let Some(&(_, body)) = self.keys.last() {
            self.keys.push((self.now, body));
        }
        self
    }

    /// Exchanges the front foot from now on; the feet must step there.
    pub(super) fn switch(&mut self) -> &mut Self {
        self.southpaw = !self.southpaw;
        self
    }

    /// Moves home by (left, forward) metres and turns it left by radians, for all keys and steps from now on.
    pub(super) fn travel(&mut self, left: f32, forward: f32, turn: f32) -> &mut Self {
        self.left = self.place;
        let moved = self.home().point(Vec3::new(left, 0.0, forward));
        self.place = Vec3::new(moved.x, self.place.y + turn, moved.z);
        self
    }

    fn home(&self) -> Rigid2 {
        Rigid2::new(self.place.y, self.place.x, self.place.z)
    }

    /// Steps a foot to its place in guard, starting `delay` after the last key, within `duration`.
    pub(super) fn step(&mut self, side: usize, delay: f32, duration: f32) -> &mut Self {
        self.foot(side, delay, duration).step_off(Vec3::ZERO)
    }

    /// A movement of a foot that starts `delay` after the last key and takes `duration`.
    pub(super) fn foot(&mut self, side: usize, delay: f32, duration: f32) -> FootMove<'_> {
        FootMove {
            choreography: self,
            side,
            delay,
            duration,
        }
    }

    /// Place of a foot in this clip's guard, in home.
    fn own_placement(&self, side: usize) -> FootPlacement {
        own_placement(side, self.southpaw, &self.rhythm)
    }

    fn placed(&self, spot: FootPlacement) -> FootPlacement {
        // Headings are not wrapped, so that a foot never turns the long way round.
        let turned = spot.yaw + self.place.y;
        FootPlacement {
            yaw: turned,
            ..spot.placed(self.home())
        }
    }

    /// Starts an event `delay` after the last key.
    pub(super) fn begin(&mut self, delay: f32) -> &mut Self {
        self.began = self.now + delay;
        self
    }

    /// Ends an evasion at the last key.
    pub(super) fn evaded(&mut self) -> &mut Self {
        let event = (EventKind::Evasion, self.began, self.now, Vec::new());
        self.events.push(event);
        self
    }

    /// Ends an attack at the last key.
    pub(super) fn struck(&mut self, joints: Vec<JointId>) -> &mut Self {
        let event = (EventKind::Attack, self.began, self.now, joints);
        self.events.push(event);
        self
    }

    /// Samples the clip and returns it with its events; `index` is the clip's index in the set.
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

    /// Shifts the body over the standing foot while the other is in the air.
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

/// A movement of one foot.
pub(super) struct FootMove<'a> {
    choreography: &'a mut Choreography,
    side: usize,
    /// Time from the last key to the start, in seconds.
    delay: f32,
    /// Duration of the kick, in seconds.
    duration: f32,
}

impl<'a> FootMove<'a> {
    /// Steps to another place: (left, turn left, forward) from that in guard.
    pub(super) fn step_off(self, off: Vec3) -> &'a mut Choreography {
        let mut spot = self.choreography.own_placement(self.side);
        spot.toe += Vec2::new(off.x, off.z);
        spot.yaw += off.y;
        let to = self.choreography.placed(spot);
        let far = self.choreography.ways[self.side]
            .spot()
            .toe
            .distance(to.toe);
        let lift = 0.035 + 0.07 * far.min(0.8);
        self.push(to, lift, &[])
    }

    /// Leaps to the place in guard, higher than a step.
    pub(super) fn leap(self, lift: f32) -> &'a mut Choreography {
        let to = self
            .choreography
            .placed(self.choreography.own_placement(self.side));
        self.push(to, lift, &[])
    }

    /// Turns the foot on its ball to an angle relative to guard, in radians to the left.
    pub(super) fn pivot(self, turn: f32) -> &'a mut Choreography {
        let toe = self.choreography.ways[self.side].spot().toe;
        let yaw = self.choreography.own_placement(self.side).yaw + self.choreography.place.y + turn;
        self.push(FootPlacement { toe, yaw }, 0.0, &[])
    }

    /// Moves the foot through the air along `keys` and back to its place in guard.
    pub(super) fn kick(self, keys: &[AirKey]) -> &'a mut Choreography {
        let to = self
            .choreography
            .placed(self.choreography.own_placement(self.side));
        self.push(to, 0.05, keys)
    }

    fn push(self, to: FootPlacement, lift: f32, keys: &[AirKey]) -> &'a mut Choreography {
        let Self {
            choreography,
            side,
            delay,
            duration,
        } = self;
        let from = choreography.ways[side].spot();
        let start = (choreography.now + delay).max(choreography.ways[side].busy_until());
        let way = Kick {
            from,
            to,
            duration,
            home: choreography.home(),
        };
        let air = (!keys.is_empty()).then(|| way.track(keys));
        // Turning on the ball keeps the weight; a kick gives nearly all of it to the other foot, a wide step or a leap
        // carries it along.
        let far = (from.toe.distance(to.toe) / 0.45).min(1.0);
        let share = match (&air, lift) {
            (Some(_), _) => 0.62,
            (None, 0.0) => 0.0,
            (None, _) => 0.28 - 0.22 * far,
        };
        choreography.shares[side].push(share);
        choreography.ways[side].push(Swing {
            start,
            end: start + duration,
            from,
            to,
            lift,
            air,
        });
        choreography
    }
}

/// Place of a foot in this clip's guard, in home.
fn own_placement(side: usize, southpaw: bool, rhythm: &Rhythm) -> FootPlacement {
    let mut spot = guard_placement(side, southpaw);
    spot.toe += Vec2::new(rhythm.feet[side].x, rhythm.feet[side].z);
    spot.yaw += rhythm.feet[side].y;
    spot
}

/// Delay of each row of [`Body`] after the hips, in seconds: the hips lead, the hands come last.
const LAGS: [f32; ROWS] = [
    0.0, 0.0, 0.0, 0.012, 0.0, 0.02, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0,
];

/// The spline through the keys, smoothed over a few hundredths of a second so that no motion starts with a jerk.
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
