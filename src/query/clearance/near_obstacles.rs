//! A quick test for entries into obstacles: a few spheres of the body at a few moments.
//!
//! Not in the paper. The body comes from the baked tracks of evasions, so that nothing is posed, and [`ObstacleCells`] list the few obstacles
//! that a sphere may touch. An entry that is found is one. If none is found, the exact test decides.

use glam::{Vec2, Vec3};

use super::bodies::PlayedTrack;
use super::extent::ObstacleHit;
use crate::anim::JointId;
use crate::graph::{MotionGraph, MotionMoment};
use crate::maps::{BakedGraph, BodyTrack};
use crate::query::obstacle::Obstacle;

/// Obstacles by cells, and the spheres that are tested.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct NearObstacles {
    pub(in crate::query) obstacles: Vec<Obstacle>,
    cells: ObstacleCells,
    /// Spheres of the trunk.
    spheres: Vec<TrunkSphere>,
    /// A ball around the root that the body contains.
    at_root: Option<TrunkSphere>,
}

#[derive(Clone, Copy, Debug)]
struct TrunkSphere {
    index: usize,
    radius: f32,
}

impl NearObstacles {
    /// Time between two samples, in seconds.
    const STEP: f32 = 0.15;
    /// Number of spheres of a track that are tested.
    const SPHERES: usize = 3;
    /// Time for which the cells contain moving obstacles, in seconds. Later they may be missed.
    const LONGEST: f32 = 4.0;

    /// Replaces the obstacles; `middle` is the position of the body.
    pub(in crate::query) fn set(
        &mut self,
        baked: &BakedGraph,
        obstacles: &[Obstacle],
        middle: Vec3,
    ) {
        self.obstacles.clear();
        self.obstacles.extend_from_slice(obstacles);
        if obstacles.is_empty() {
            return;
        }
        self.choose_spheres(baked);
        let tested = self.spheres.iter().chain(&self.at_root);
        let radius = tested.map(|sphere| sphere.radius);
        let widest = radius.fold(0.0, f32::max);
        self.cells
            .fill(&self.obstacles, middle, widest, Self::LONGEST);
    }

    /// Chooses thick spheres, evenly among all of them.
    fn choose_spheres(&mut self, baked: &BakedGraph) {
        let spheres = &baked.body().spheres;
        let thickest = spheres.iter().map(|sphere| sphere.radius);
        let thickest = thickest.fold(0.0, f32::max);
        let all = spheres.iter().enumerate();
        let thick = all.clone().filter(|(_, one)| one.radius > 0.8 * thickest);
        let count = thick.clone().count();
        let every = (count / Self::SPHERES).max(1);
        self.spheres.clear();
        let chosen = thick.step_by(every).take(Self::SPHERES);
        self.spheres.extend(chosen.map(|(index, one)| TrunkSphere {
            index,
            radius: one.radius,
        }));
        let at_root = all.filter(|(_, one)| one.joint == JointId::ROOT);
        let inside = at_root.map(|(index, one)| TrunkSphere {
            index,
            radius: one.radius - one.offset.length(),
        });
        self.at_root = inside
            .max_by(|a, b| a.radius.total_cmp(&b.radius))
            .filter(|ball| ball.radius > 0.0);
    }

    /// An entry on a track; `None` if none is found.
    pub(in crate::query) fn on_track(&self, part: &PlayedTrack<'_>) -> Option<ObstacleHit> {
        let (from, to) = part.seconds;
        let samples = ((to - from) / Self::STEP).max(0.0) as usize;
        (0..=samples).find_map(|sample| {
            let seconds = from + sample as f32 * Self::STEP;
            let tick = (seconds - part.origin) * part.rate * BodyTrack::RATE;
            // The nearest sample, and its time.
            let tick = (tick.max(0.0).round() as usize).min(part.track.ticks() - 1);
            let seconds = part.origin + tick as f32 / BodyTrack::RATE / part.rate;
            let hits = self.spheres.iter().filter_map(|&sphere| {
                let centre = part.placement.point(part.track.centre(tick, sphere.index));
                self.entry_at(centre, sphere, seconds)
            });
            hits.max_by(|a, b| a.harm.total_cmp(&b.harm))
        })
    }

    /// The first entry of a motion, until a moment of it, whose harm is more than `enough`; `None` if none is found.
    pub(in crate::query) fn until(
        &self,
        graph: &MotionGraph,
        end: MotionMoment<'_>,
        enough: f32,
    ) -> Option<ObstacleHit> {
        let ball = self.at_root?;
        let samples = (end.seconds / Self::STEP).max(0.0) as usize;
        (0..=samples).find_map(|sample| {
            let seconds = sample as f32 * Self::STEP;
            let root = end.motion.root(graph, seconds);
            self.entry_at(root, ball, seconds)
                .filter(|hit| hit.harm > enough)
        })
    }

    /// The entry of a body whose root is at a place; `None` if none is found.
    pub(in crate::query) fn at_root(&self, root: Vec3, seconds: f32) -> Option<ObstacleHit> {
        self.entry_at(root, self.at_root?, seconds)
    }

    /// The deepest entry of a sphere.
    fn entry_at(&self, centre: Vec3, sphere: TrunkSphere, seconds: f32) -> Option<ObstacleHit> {
        let near = self.cells.near(Vec2::new(centre.x, centre.z));
        let harms = near.filter_map(|index| {
            let obstacle = &self.obstacles[index as usize];
            let depth = sphere.radius - obstacle.distance(centre, seconds);
            (depth > 0.0).then_some(depth * obstacle.weight)
        });
        harms.max_by(f32::total_cmp).map(|harm| ObstacleHit {
            harm,
            time: seconds,
            sphere: sphere.index,
        })
    }
}

/// Square cells around a place, each with the obstacles that a small sphere above it may touch.
#[derive(Clone, Debug, Default)]
struct ObstacleCells {
    /// Lowest x and z coordinates of all cells.
    corner: Vec2,
    /// Start of each cell in `covered`. The last entry is the length of the list.
    first: Vec<u32>,
    /// Cells and the obstacles near them, sorted.
    covered: Vec<(u32, u32)>,
}

impl ObstacleCells {
    /// Side of a cell, in metres.
    const SIDE: f32 = 0.4;
    /// Number of cells in a row, and number of rows.
    const ROW: usize = 32;

    fn fill(&mut self, obstacles: &[Obstacle], middle: Vec3, radius: f32, seconds: f32) {
        let width = Self::SIDE * Self::ROW as f32;
        self.corner = Vec2::new(middle.x, middle.z) - 0.5 * width;
        self.covered.clear();
        for (index, obstacle) in obstacles.iter().enumerate() {
            self.cover(index as u32, obstacle, middle, radius, seconds);
        }
        self.covered.sort_unstable();
        self.first.clear();
        for (at, &(cell, _)) in self.covered.iter().enumerate() {
            self.first.resize(cell as usize + 1, at as u32);
        }
        let end = self.covered.len() as u32;
        self.first.resize(Self::ROW * Self::ROW + 1, end);
    }

    /// The obstacles that a sphere at a place of the ground (x, z) may touch; none outside of all cells.
    #[inline]
    fn near(&self, place: Vec2) -> impl Iterator<Item = u32> + '_ {
        let at = (place - self.corner) / Self::SIDE;
        let end = Self::ROW as f32;
        let is_inside = at.x >= 0.0 && at.y >= 0.0 && at.x < end && at.y < end;
        let cell = at.y as usize * Self::ROW + at.x as usize;
        let listed = match is_inside && !self.first.is_empty() {
            true => self.first[cell] as usize..self.first[cell + 1] as usize,
            false => 0..0,
        };
        self.covered[listed].iter().map(|&(_, obstacle)| obstacle)
    }

    fn cover(&mut self, index: u32, obstacle: &Obstacle, middle: Vec3, radius: f32, seconds: f32) {
        let bounds = obstacle.ground_bounds(seconds);
        let limit = (Self::ROW - 1) as f32;
        let [low, high] = [(bounds[0], -radius), (bounds[1], radius)]
            .map(|(bound, wider)| ((bound + wider - self.corner) / Self::SIDE).floor());
        if low.x > limit || low.y > limit || high.x < 0.0 || high.y < 0.0 {
            return;
        }
        let [low, high] = [low, high].map(|at| at.clamp(Vec2::ZERO, Vec2::splat(limit)));
        // A sphere above a cell is at most so far from its middle.
        let around = radius + 0.5 * std::f32::consts::SQRT_2 * Self::SIDE;
        let heights = [middle.y - 10.0, middle.y + 10.0];
        let is_still = obstacle.velocity() == Vec3::ZERO;
        for row in low.y as usize..=high.y as usize {
            for column in low.x as usize..=high.x as usize {
                let at = Vec2::new(column as f32, row as f32) + 0.5;
                let centre = self.corner + at * Self::SIDE;
                if is_still && obstacle.metres_from_line(centre, heights, 0.0) > around {
                    continue;
                }
                self.covered
                    .push(((row * Self::ROW + column) as u32, index));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::math::Rigid2;
    use crate::query::fixture::{self, baked};

    /// One obstacle of each kind within some metres of the origin, which moves at up to `speed`.
    fn obstacles(random: &mut Pcg64Mcg, speed: f32) -> Vec<Obstacle> {
        let mut number = |most: f32| random.random_range(-most..most);
        let mut place = || Vec3::new(number(3.0), 1.0 + number(0.8), number(3.0));
        let places = [(); 6].map(|()| place());
        let ground = |at: usize| Vec2::new(places[at].x, places[at].z);
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE].map(|corner| ground(4) + 0.5 * corner);
        let solids = [
            Obstacle::half_space(places[0], -places[0].with_y(0.2)),
            Obstacle::block(places[1], Vec3::new(0.2, 0.4, 0.3), places[0].x),
            Obstacle::capsule(places[2], places[3], 0.1),
            Obstacle::polygon(&corners),
            Obstacle::disc(ground(5), 0.3),
        ];
        let moved = solids.map(|solid| {
            let velocity = Vec3::new(number(1.0), number(0.3), number(1.0)) * speed;
            solid.unwrap().moving(velocity).unwrap().later(0.3, 0.02)
        });
        moved.to_vec()
    }

    #[test]
    fn cells_name_every_obstacle_that_a_sphere_touches() {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let mut cells = ObstacleCells::default();
        let (mut touched, mut named, mut all) = (0, 0, 0);
        for round in 0..200 {
            let obstacles = obstacles(&mut random, (round % 3) as f32);
            let (middle, radius, seconds) = (Vec3::new(0.3, 1.0, -0.2), 0.12, 2.0);
            cells.fill(&obstacles, middle, radius, seconds);
            for _ in 0..40 {
                let mut number = |most: f32| random.random_range(-most..most);
                let point = Vec3::new(number(6.0), 1.0 + number(1.0), number(6.0));
                let time = 1.0 + number(1.0);
                let near: Vec<u32> = cells.near(Vec2::new(point.x, point.z)).collect();
                for (index, obstacle) in obstacles.iter().enumerate() {
                    let touches = obstacle.distance(point, time) < radius;
                    let is_named = near.contains(&(index as u32));
                    assert!(!touches || is_named, "{obstacle:?} {point}");
                    touched += usize::from(touches);
                }
                named += near.len();
                all += obstacles.len();
            }
        }
        assert!(touched > 500 && named < all / 2, "{touched} {named} {all}");
    }

    #[test]
    fn what_is_found_on_tracks_and_motions_is_an_entry() {
        let baked = baked();
        let (graph, body) = (baked.graph(), baked.body());
        let mut random = Pcg64Mcg::seed_from_u64(9);
        let mut near = NearObstacles::default();
        let (mut found, mut free) = (0, 0);
        for round in 0..150 {
            let obstacles = obstacles(&mut random, (round % 3) as f32);
            near.set(baked, &obstacles, Vec3::ZERO);
            let place = Rigid2::new(round as f32, 0.2, -0.3);
            let evasion = round % baked.evasions().len();
            let track = baked.track(evasion);
            let part = PlayedTrack {
                seconds: (0.4, 1.2),
                ..PlayedTrack::new(track, place, 0.4)
            };
            let harm = |hit: ObstacleHit, centre: Vec3| {
                let depth = |one: &Obstacle| {
                    body.spheres[hit.sphere].radius - one.distance(centre, hit.time)
                };
                let depths = obstacles.iter().map(depth);
                depths.fold(f32::NEG_INFINITY, f32::max) * 4.0
            };
            let on_track = near.on_track(&part);
            if let Some(hit) = on_track {
                let tick = track.nearest_tick(hit.time - 0.4);
                let harm = harm(hit, place.point(track.centre(tick, hit.sphere)));
                assert!((harm - hit.harm).abs() < 1e-4, "{harm} {hit:?}");
            }
            let edge = crate::graph::EdgeId((round % graph.edges().len()) as u32);
            let motion = fixture::motion(baked, edge, 0.0, place);
            let on_motion = near.until(graph, motion.moment_at(1.5), 0.0);
            if let Some(hit) = on_motion {
                let joints = fixture::joints(baked, &motion, hit.time);
                let harm = harm(hit, body.spheres[hit.sphere].centre(&joints));
                assert!(hit.harm > 0.0 && harm >= hit.harm - 1e-4, "{harm} {hit:?}");
            }
            for hit in [on_track, on_motion] {
                found += usize::from(hit.is_some());
                free += usize::from(hit.is_none());
            }
        }
        assert!(found > 30 && free > 30, "{found} {free}");
    }
}
