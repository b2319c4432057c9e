//! Motion of a foot: planted, stepping, turning on its ball, or kicking.

use glam::{Quat, Vec2, Vec3};

use super::keys::Track;
use super::skeleton::{TOE_HEIGHT, toe_offset};
use sabaki::math::{Rigid2, smooth_step};

/// A foot flat on the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootPlacement {
    /// End of the toes in the space of the motion, in metres; it stays when the heel rises or the foot turns.
    pub(super) toe: Vec2,
    /// Heading of the toes, in radians.
    pub(super) yaw: f32,
}

impl FootPlacement {
    /// The spot of a foot with its ankle above this place.
    pub(super) fn at_ankle(ankle: Vec2, yaw: f32) -> Self {
        let toe = Rigid2::new(yaw, ankle.x, ankle.y).point(toe_offset());
        Self {
            toe: Vec2::new(toe.x, toe.z),
            yaw,
        }
    }

    /// Transforms the spot from a frame on the ground to the space of the motion.
    pub(super) fn placed(self, place: Rigid2) -> Self {
        let toe = place.point(Vec3::new(self.toe.x, 0.0, self.toe.y));
        Self {
            toe: Vec2::new(toe.x, toe.z),
            yaw: self.yaw + place.heading(),
        }
    }

    /// The foot on this spot, with its heel raised by `pitch` radians.
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
    /// Position, in metres.
    pub(super) ankle: Vec3,
    /// Heading of the toes, in radians.
    pub(super) yaw: f32,
    /// Angle of the raised heel about the toes, in radians.
    pub(super) pitch: f32,
    /// Weight of the next two fields, 0 to 1.
    pub(super) free: f32,
    /// Extension of the foot from a right angle to the shin, in radians.
    pub(super) point: f32,
    /// Direction of the knee.
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

/// A key of a foot in the air, in the frame of home.
#[derive(Clone, Copy, Debug)]
pub(super) struct AirKey {
    /// Time from the start of the movement, in seconds.
    pub(super) after: f32,
    /// Position, in metres.
    pub(super) ankle: Vec3,
    /// Extension of the foot, in radians.
    pub(super) point: f32,
    /// Direction of the knee.
    pub(super) knee: Vec3,
}

/// One movement of a foot from spot to spot.
#[derive(Clone, Debug)]
pub(super) struct Swing {
    /// Start of the movement, in seconds.
    pub(super) start: f32,
    /// End of the movement, in seconds.
    pub(super) end: f32,
    /// Spot at the start.
    pub(super) from: FootPlacement,
    /// Spot at the end.
    pub(super) to: FootPlacement,
    /// Height of the toes on the way, in metres; 0 turns on the ball.
    pub(super) lift: f32,
    /// Track of a kick.
    pub(super) air: Option<Track<4>>,
}

impl AirKey {
    /// The key with the foot extended by `point`, in radians.
    pub(super) fn pointed(self, point: f32) -> Self {
        Self { point, ..self }
    }
}

/// A kick from spot to spot.
#[derive(Clone, Copy)]
pub(super) struct Kick {
    pub(super) from: FootPlacement,
    pub(super) to: FootPlacement,
    /// Duration of the kick, in seconds.
    pub(super) duration: f32,
    /// Space of the keys, in the world.
    pub(super) home: Rigid2,
}

impl Kick {
    /// The track of the kick: rows are ankle, knee, (yaw, pitch, free), (point, 0, 0).
    pub(super) fn track(self, keys: &[AirKey]) -> Track<4> {
        let Self {
            from,
            to,
            duration,
            home,
        } = self;
        let end = |spot: FootPlacement, knee: Vec3, point: f32| {
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
        // The heel leaves the ground first: its angle is greatest at a third of the way.
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

    /// Share of the weight on the other foot, 0 to 1; the weight shifts before the foot lifts.
    pub(super) fn unweighted(&self, time: f32) -> f32 {
        const BEFORE: f32 = 0.14;
        const AFTER: f32 = 0.16;
        let before = smooth_step((time - self.start + BEFORE) / BEFORE);
        before * (1.0 - smooth_step((time - self.end) / AFTER))
    }
}

/// The movements of one foot in a clip.
#[derive(Clone, Debug)]
pub(super) struct FootPath {
    first: FootPlacement,
    swings: Vec<Swing>,
}

impl FootPath {
    /// A foot without movements.
    pub(super) fn new(first: FootPlacement) -> Self {
        Self {
            first,
            swings: Vec::new(),
        }
    }

    /// Spot after all movements.
    pub(super) fn spot(&self) -> FootPlacement {
        self.swings.last().map_or(self.first, |swing| swing.to)
    }

    /// End of the last movement, in seconds.
    pub(super) fn busy_until(&self) -> f32 {
        self.swings.last().map_or(0.0, |swing| swing.end)
    }

    /// Appends a movement.
    pub(super) fn push(&mut self, swing: Swing) {
        self.swings.push(swing);
    }

    /// All movements in order.
    pub(super) fn swings(&self) -> &[Swing] {
        &self.swings
    }

    /// The foot at a time; its heel is raised by `heel` radians while it stands.
    pub(super) fn foot(&self, time: f32, heel: f32) -> Foot {
        let begun = self.swings.partition_point(|swing| swing.start <= time);
        match begun.checked_sub(1).map(|last| &self.swings[last]) {
            None => self.first.foot(heel),
            Some(swing) if time < swing.end => swing.foot(time, heel),
            Some(swing) => swing.to.foot(heel),
        }
    }

    /// Spot where the foot stands or last stood.
    pub(super) fn stood(&self, time: f32) -> FootPlacement {
        let begun = self.swings.partition_point(|swing| swing.end <= time);
        begun
            .checked_sub(1)
            .map_or(self.first, |last| self.swings[last].to)
    }
}
