//! Where a foot is: planted, stepping, turning on its ball, or in the air for a kick.

use glam::{Quat, Vec2, Vec3};

use super::keys::Track;
use super::skeleton::{TOE_HEIGHT, toe_offset};
use sabaki::math::Rigid2;

/// A foot flat on the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// The toes' end in the space of the motion, metres: what stays when the heel rises or the foot turns.
    pub(super) toe: Vec2,
    /// The way that the toes point, radians.
    pub(super) yaw: f32,
}

impl Spot {
    /// From the ankle's place on the ground.
    pub(super) fn at_ankle(ankle: Vec2, yaw: f32) -> Self {
        let toe = Rigid2::new(yaw, ankle.x, ankle.y).point(toe_offset());
        Self {
            toe: Vec2::new(toe.x, toe.z),
            yaw,
        }
    }

    /// From a frame on the ground into the space of the motion.
    pub(super) fn placed(self, place: Rigid2) -> Self {
        let toe = place.point(Vec3::new(self.toe.x, 0.0, self.toe.y));
        Self {
            toe: Vec2::new(toe.x, toe.z),
            yaw: self.yaw + place.heading(),
        }
    }

    /// The foot standing here, its heel raised by `pitch` radians.
    fn foot(self, pitch: f32) -> Foot {
        Foot::about_toe(
            Vec3::new(self.toe.x, TOE_HEIGHT, self.toe.y),
            self.yaw,
            pitch,
        )
    }
}

/// A foot in the space of the motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// Metres.
    pub(super) ankle: Vec3,
    /// The way that the toes point, radians.
    pub(super) yaw: f32,
    /// Heel up about the toes, radians.
    pub(super) pitch: f32,
    /// How much of the following two holds, 0 to 1.
    pub(super) free: f32,
    /// How far the foot is stretched from a right angle to the shin, radians.
    pub(super) point: f32,
    /// Where the knee points to.
    pub(super) knee: Vec3,
}

impl Foot {
    /// A foot whose toes' end is at `toe`.
    pub(super) fn about_toe(toe: Vec3, yaw: f32, pitch: f32) -> Self {
        Self {
            ankle: toe - foot_rotation(yaw, pitch) * toe_offset(),
            yaw,
            pitch,
            free: 0.0,
            point: 0.0,
            knee: Vec3::ZERO,
        }
    }

    /// The toes' end, metres.
    pub(super) fn toe(&self) -> Vec3 {
        self.ankle + foot_rotation(self.yaw, self.pitch) * toe_offset()
    }
}

/// The rotation of a foot's frame.
pub(super) fn foot_rotation(yaw: f32, pitch: f32) -> Quat {
    Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch)
}

/// One place of a foot in the air, in the frame of home.
#[derive(Clone, Copy, Debug)]
pub(super) struct Air {
    /// Seconds from the foot's start.
    pub(super) after: f32,
    /// Metres.
    pub(super) ankle: Vec3,
    /// How far the foot is stretched, radians.
    pub(super) point: f32,
    /// Where the knee points to.
    pub(super) knee: Vec3,
}

/// One movement of a foot from spot to spot.
#[derive(Clone, Debug)]
pub(super) struct Swing {
    /// Seconds.
    pub(super) start: f32,
    /// Seconds.
    pub(super) end: f32,
    /// Where the foot stood.
    pub(super) from: Spot,
    /// Where it will stand.
    pub(super) to: Spot,
    /// How high the toes go on the way, metres; 0 turns on the ball.
    pub(super) lift: f32,
    /// The way of a kick.
    pub(super) air: Option<Track<4>>,
}

/// The track of a kick: rows are ankle, knee, (yaw, pitch, free), (point, 0, 0).
pub(super) fn air_track(
    from: Spot,
    to: Spot,
    duration: f32,
    keys: &[Air],
    home: Rigid2,
) -> Track<4> {
    let end = |spot: Spot, knee: Vec3, point: f32| {
        let yaw = Vec3::new(spot.yaw, 0.0, 0.0);
        [spot.foot(0.0).ankle, knee, yaw, Vec3::new(point, 0.0, 0.0)]
    };
    let mut rows = Vec::with_capacity(keys.len() + 2);
    let first = keys.first().map_or(Vec3::Z, |key| home.vector(key.knee));
    let last = keys.last().map_or(Vec3::Z, |key| home.vector(key.knee));
    rows.push((0.0, end(from, first, 0.2)));
    for key in keys {
        let yaw = from.yaw + (to.yaw - from.yaw) * key.after / duration;
        rows.push((
            key.after,
            [
                home.point(key.ankle),
                home.vector(key.knee),
                Vec3::new(yaw, 0.0, 1.0),
                Vec3::new(key.point, 0.0, 0.0),
            ],
        ));
    }
    rows.push((duration, end(to, last, 0.0)));
    Track::new(rows)
}

impl Swing {
    fn foot(&self, time: f32, heel: f32) -> Foot {
        if let Some(air) = &self.air {
            let at = time - self.start;
            let turn = air.row(2, at);
            return Foot {
                ankle: air.row(0, at),
                yaw: turn.x,
                pitch: turn.y + heel * (1.0 - turn.z),
                free: turn.z,
                point: air.row(3, at).x,
                knee: air.row(1, at),
            };
        }
        let s = ((time - self.start) / (self.end - self.start)).clamp(0.0, 1.0);
        let going = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        let arc = 16.0 * s * s * (1.0 - s) * (1.0 - s);
        let toe = self.from.toe.lerp(self.to.toe, going);
        // The heel leads off the ground: the peel is greatest at a third of the way.
        let peel = 6.75 * s * (1.0 - s) * (1.0 - s);
        let far = (self.from.toe.distance(self.to.toe) / 0.5).min(1.0);
        let turned = (self.from.yaw - self.to.yaw).abs().min(1.0);
        let pitch = if self.lift > 0.0 {
            0.1 + 0.35 * far
        } else {
            0.12 + 0.2 * turned
        };
        let height = TOE_HEIGHT + self.lift * arc;
        let yaw = self.from.yaw + (self.to.yaw - self.from.yaw) * going;
        Foot::about_toe(Vec3::new(toe.x, height, toe.y), yaw, heel + pitch * peel)
    }

    /// How much of the weight the other foot has to bear, 0 to 1: it shifts before the foot lifts.
    pub(super) fn unweighted(&self, time: f32) -> f32 {
        const BEFORE: f32 = 0.14;
        const AFTER: f32 = 0.16;
        let smooth = |s: f32| {
            let s = s.clamp(0.0, 1.0);
            s * s * (3.0 - 2.0 * s)
        };
        smooth((time - self.start + BEFORE) / BEFORE) * (1.0 - smooth((time - self.end) / AFTER))
    }
}

/// The way of one foot through a clip.
#[derive(Clone, Debug)]
pub(super) struct Way {
    first: Spot,
    swings: Vec<Swing>,
}

impl Way {
    /// A foot that stays.
    pub(super) fn new(first: Spot) -> Self {
        Self {
            first,
            swings: Vec::new(),
        }
    }

    /// Where it stands after all its swings.
    pub(super) fn spot(&self) -> Spot {
        self.swings.last().map_or(self.first, |swing| swing.to)
    }

    /// When its last swing ends, seconds.
    pub(super) fn busy_until(&self) -> f32 {
        self.swings.last().map_or(0.0, |swing| swing.end)
    }

    /// Adds a movement after the others.
    pub(super) fn push(&mut self, swing: Swing) {
        self.swings.push(swing);
    }

    /// All movements in order.
    pub(super) fn swings(&self) -> &[Swing] {
        &self.swings
    }

    /// The foot at a time, its heel raised by `heel` radians where it stands.
    pub(super) fn foot(&self, time: f32, heel: f32) -> Foot {
        let begun = self.swings.partition_point(|swing| swing.start <= time);
        match begun.checked_sub(1).map(|last| &self.swings[last]) {
            None => self.first.foot(heel),
            Some(swing) if time < swing.end => swing.foot(time, heel),
            Some(swing) => swing.to.foot(heel),
        }
    }

    /// Where the foot stands or last stood.
    pub(super) fn stood(&self, time: f32) -> Spot {
        let begun = self.swings.partition_point(|swing| swing.end <= time);
        begun
            .checked_sub(1)
            .map_or(self.first, |last| self.swings[last].to)
    }
}
