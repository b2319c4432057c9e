//! Converts goals, threats, obstacles and events from and to the layout of C.

use glam::{Vec2, Vec3};

use super::culler::SphereOut;
use super::given_slice;
use super::sized::{Grows, sized};
use crate::anim::JointId;
use crate::character::{
    CharacterEvent, CharacterEventKind, CharacterId, Goal, StrikeAt, StrikeKind, Threat,
};
use crate::math::{Space, Sphere};
use crate::query::Obstacle;

/// `sabaki_goal`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct GoalIn {
    size: u32,
    kind: u32,
    x: f32,
    z: f32,
    heading: f32,
    has_heading: u32,
    speed: f32,
    y: f32,
    has_target: u32,
    has_limb: u32,
    limb: u32,
    target: u64,
}

/// `sabaki_threat`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct ThreatIn {
    size: u32,
    has_target: u32,
    time: f64,
    position: [f32; 3],
    velocity: [f32; 3],
    gravity: f32,
    seconds: f32,
    sphere_count: u32,
    spheres: *const SphereOut,
    target: u64,
}

/// `sabaki_obstacle`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct ObstacleIn {
    size: u32,
    kind: u32,
    a: [f32; 3],
    b: [f32; 3],
    radius: f32,
    heading: f32,
    velocity: [f32; 3],
    weight: f32,
    corner_count: u32,
    corners: *const f32,
}

/// `sabaki_event`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct EventOut {
    size: u32,
    kind: u32,
    character: u64,
    time: f64,
    threat: u64,
    is_change: u32,
    joint: u32,
    metres: f32,
    entered: f32,
    contact: f64,
    point: [f32; 3],
    normal: [f32; 3],
    by: u64,
    speed: f32,
    is_whole: u32,
    edge: u32,
}

sized! {
    GoalIn, "goal";
    ThreatIn, "threat";
    ObstacleIn, "obstacles";
    EventOut, "events";
}

impl GoalIn {
    /// The goal. `space` leads from the host's to sabaki's.
    pub(super) fn goal(&self, space: Space) -> Result<Goal, String> {
        let ground = space.ground(Vec2::new(self.x, self.z));
        let at = Vec3::new(ground.x, 0.0, ground.y);
        Ok(match self.kind {
            0 => Goal::Idle,
            1 => Goal::Walk {
                velocity: at,
                facing: (self.has_heading != 0).then_some(space.heading(self.heading)),
            },
            2 => Goal::Face {
                heading: space.heading(self.heading),
            },
            3 => Goal::GoTo {
                point: at,
                speed: space.length(self.speed),
            },
            4 => Goal::Stop,
            5 => Goal::Strike {
                at: match self.has_target {
                    0 => StrikeAt::Place(at.with_y(space.length(self.y))),
                    _ => StrikeAt::Character(CharacterId::from_bits(self.target)),
                },
                kind: match self.has_limb {
                    0 => StrikeKind::Any,
                    _ => StrikeKind::Limb(self.limb()?),
                },
            },
            other => return Err(format!("there is no goal {other}")),
        })
    }

    fn limb(&self) -> Result<JointId, String> {
        let limb = u16::try_from(self.limb);
        limb.map(JointId)
            .map_err(|_| format!("there is no joint {}", self.limb))
    }
}

impl ThreatIn {
    /// # Safety
    /// The spheres are valid.
    pub(super) unsafe fn threat(&self, space: Space) -> Result<Threat, String> {
        // SAFETY: the caller vouches for the spheres.
        let spheres = unsafe { given_slice(self.spheres, self.sphere_count as usize, "spheres")? };
        let sphere = |sphere: &SphereOut| Sphere {
            centre: space.point(Vec3::from_array(sphere.center)),
            radius: space.length(sphere.radius),
        };
        Ok(Threat {
            time: self.time,
            position: space.point(Vec3::from_array(self.position)),
            velocity: space.point(Vec3::from_array(self.velocity)),
            gravity: space.length(self.gravity),
            spheres: spheres.iter().map(sphere).collect(),
            seconds: self.seconds,
            target: (self.has_target != 0).then_some(CharacterId::from_bits(self.target)),
        })
    }
}

impl ObstacleIn {
    /// # Safety
    /// The corners are valid.
    pub(super) unsafe fn obstacle(&self, space: Space) -> Result<Obstacle, String> {
        let (a, b) = (
            space.point(Vec3::from_array(self.a)),
            Vec3::from_array(self.b),
        );
        let radius = space.length(self.radius);
        let shape = match self.kind {
            0 => Obstacle::half_space(a, space.direction(b)),
            1 => Obstacle::block(a, space.sizes(b), space.heading(self.heading)),
            2 => Obstacle::capsule(a, space.point(b), radius),
            3 => {
                let count = self.corner_count.min(1 << 16) as usize;
                // SAFETY: the caller vouches for the corners.
                let corners = unsafe { given_slice(self.corners, 2 * count, "corners")? };
                let corners = corners.chunks_exact(2);
                let corners: Vec<Vec2> = corners
                    .map(|pair| space.ground(Vec2::new(pair[0], pair[1])))
                    .collect();
                Obstacle::polygon(&corners)
            }
            4 => Obstacle::disc(Vec2::new(a.x, a.z), radius),
            other => return Err(format!("there is no obstacle {other}")),
        };
        let velocity = space.point(Vec3::from_array(self.velocity));
        let moving = shape.and_then(|shape| shape.moving(velocity));
        let weighed = match self.weight {
            0.0 => moving,
            weight => moving.and_then(|shape| shape.weighing(weight)),
        };
        weighed.map_err(|error| error.to_string())
    }
}

impl EventOut {
    /// The event. `space` leads to the host's.
    pub(super) fn new(event: &CharacterEvent, space: Space) -> Self {
        let mut out = Self {
            character: event.character.to_bits(),
            time: event.time,
            threat: u64::MAX,
            joint: u32::MAX,
            by: u64::MAX,
            edge: u32::MAX,
            ..Self::blank()
        };
        match event.kind {
            CharacterEventKind::Planned {
                clearance,
                is_change,
                threat,
                contact,
            } => {
                (out.metres, out.is_change) = (clearance, u32::from(is_change));
                (out.threat, out.contact) = (threat.0, contact);
            }
            CharacterEventKind::Kept { clearance } => (out.kind, out.metres) = (1, clearance),
            CharacterEventKind::Began => out.kind = 2,
            CharacterEventKind::Cannot => out.kind = 3,
            CharacterEventKind::Cornered { hit, entered } => {
                (out.kind, out.metres, out.entered) = (4, -hit, entered);
            }
            CharacterEventKind::MissedBy { threat, metres } => {
                (out.kind, out.threat, out.metres) = (5, threat.0, metres);
            }
            CharacterEventKind::Hit {
                threat,
                joint,
                point,
                depth,
                normal,
            } => {
                (out.kind, out.threat, out.metres) = (6, threat.0, -depth);
                out.point = space.point(point).to_array();
                out.normal = space.direction(normal).to_array();
                out.joint = joint.0.into();
            }
            CharacterEventKind::Ended => out.kind = 7,
            CharacterEventKind::Shoved => out.kind = 8,
            CharacterEventKind::Stuck { depth } => (out.kind, out.metres) = (9, -depth),
            CharacterEventKind::Strikes {
                threat,
                attack,
                contact,
            } => {
                (out.kind, out.threat, out.contact) = (10, threat.0, contact);
                out.edge = attack.0;
            }
            CharacterEventKind::Struck {
                by,
                threat,
                joint,
                point,
                depth,
                speed,
            } => {
                (out.kind, out.threat, out.metres) = (11, threat.0, -depth);
                out.point = space.point(point).to_array();
                (out.joint, out.by) = (joint.0.into(), by.to_bits());
                out.speed = space.length(speed);
            }
            CharacterEventKind::StrikeEnded { is_whole } => {
                (out.kind, out.is_whole) = (12, is_whole.into());
            }
        }
        out
    }
}
