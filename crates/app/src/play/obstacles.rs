//! Obstacles around a character: walls, furniture, opponents.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use rand::{Rng, RngExt};
use sabaki::query::{Obstacle, ObstacleError};

/// Kind of the obstacles around a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Surroundings {
    /// An empty plane.
    #[default]
    Empty,
    /// A corner of a room with a box, a pillar, a bar and a block of five corners.
    Walls,
    /// Six opponents that walk in circles.
    Opponents,
}

/// Obstacles of one run.
#[derive(Clone, Debug, Default)]
pub(super) struct ScenarioObstacles {
    solids: Vec<Obstacle>,
    walkers: Vec<Walker>,
}

/// A disc that walks in a circle.
#[derive(Clone, Copy, Debug)]
struct Walker {
    middle: Vec2,
    radius: f32,
    /// Angle on the circle at time 0, in radians.
    angle: f32,
    /// Angular speed on the circle, in radians per second.
    turn: f32,
}

/// Radius of a walker's body, in metres.
const BODY: f32 = 0.3;

impl ScenarioObstacles {
    /// A room around a character that stands at the origin.
    pub(super) fn new(kind: Surroundings, random: &mut impl Rng) -> Result<Self, ObstacleError> {
        let mut obstacles = Self::default();
        match kind {
            Surroundings::Empty => {}
            Surroundings::Walls => obstacles.add_solids(random)?,
            Surroundings::Opponents => obstacles.add_walkers(random),
        }
        Ok(obstacles)
    }

    fn add_solids(&mut self, random: &mut impl Rng) -> Result<(), ObstacleError> {
        let mut between = |low: f32, high: f32| low + (high - low) * random.random::<f32>();
        let corner = between(0.0, TAU);
        for turned in [0.0, TAU / 4.0] {
            let out = Vec2::from_angle(corner + turned);
            let out = Vec3::new(out.x, 0.0, out.y);
            let far = between(1.3, 3.5);
            self.solids.push(Obstacle::half_space(out * far, -out)?);
        }
        let mut place = |far: (f32, f32)| {
            let way = Vec2::from_angle(between(0.0, TAU)) * between(far.0, far.1);
            Vec3::new(way.x, 0.0, way.y)
        };
        let half = Vec3::new(0.6, 0.5, 0.3);
        let (at, turned) = (place((2.0, 4.0)), place((1.0, 2.0)).x);
        self.solids
            .push(Obstacle::block(at.with_y(0.5), half, turned)?);
        let at = place((1.5, 4.0));
        self.solids
            .push(Obstacle::capsule(at, at.with_y(2.5), 0.2)?);
        let (at, along) = (place((2.2, 4.0)), place((0.5, 1.0)));
        let (from, to) = (at - along, at + along);
        self.solids
            .push(Obstacle::capsule(from.with_y(0.9), to.with_y(0.9), 0.06)?);
        let at = place((2.2, 4.5));
        let corners: Vec<Vec2> = (0..5)
            .map(|corner| Vec2::new(at.x, at.z) + Vec2::from_angle(corner as f32 * TAU / 5.0) * 0.7)
            .collect();
        self.solids.push(Obstacle::polygon(&corners)?);
        Ok(())
    }

    fn add_walkers(&mut self, random: &mut impl Rng) {
        while self.walkers.len() < 6 {
            let mut between = |low: f32, high: f32| low + (high - low) * random.random::<f32>();
            let radius = between(1.0, 3.0);
            let walker = Walker {
                middle: Vec2::from_angle(between(0.0, TAU)) * between(0.5, 4.0),
                radius,
                angle: between(0.0, TAU),
                turn: between(0.5, 1.4) / radius * if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 },
            };
            if walker.at(0.0).0.length() > 1.5 {
                self.walkers.push(walker);
            }
        }
    }

    /// Writes the obstacles at a time, in seconds.
    pub(super) fn at(&self, time: f64, out: &mut Vec<Obstacle>) {
        out.clear();
        out.extend(&self.solids);
        out.extend(self.walkers.iter().filter_map(|walker| {
            let (place, velocity) = walker.at(time);
            let disc = Obstacle::disc(place, BODY).ok()?;
            disc.moving(Vec3::new(velocity.x, 0.0, velocity.y)).ok()
        }));
    }
}

impl Walker {
    /// Place and velocity.
    fn at(&self, time: f64) -> (Vec2, Vec2) {
        let out = Vec2::from_angle((f64::from(self.angle) + f64::from(self.turn) * time) as f32);
        let place = self.middle + out * self.radius;
        (place, out.perp() * self.radius * self.turn)
    }
}
