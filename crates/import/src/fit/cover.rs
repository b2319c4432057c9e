//! Covers the part of a mesh that moves with one joint by few balls.
//!
//! Candidates: the largest balls inside the mesh that touch it. Source: Ma, Bae & Choi, "3D Medial Axis Point Approximation Using Nearest
//! Neighbors and the Normal Field" (2012). A large ball that touches a point is shrunk until no other surface point
//! is inside. Differs: other points may lie inside by a tolerance. Otherwise the edges between the
//! flat triangles of a round limb would keep nearly all balls small.
//!
//! Choice: Stolpner, Kry & Siddiqi, "Medial Spheres for Shape Approximation" (2012). Balls inside
//! the solid that touch its surface are enlarged by the allowed error, and as few as possible are
//! kept to cover the surface, by greedy set cover (Chvátal 1979). Differs: a point counts as
//! covered if it sticks out of an enlarged ball by at most a second tolerance, because between two
//! balls of a limb a dent remains in any case. The selected balls are then exchanged for better
//! ones, as in Lloyd's method, while that reduces the deepest dent.

use std::f32::consts::PI;

use glam::Vec3;
use sabaki::anim::JointId;
use sabaki::math::Sphere;

use super::mesh::bounds;
use super::surface::Surface;
use super::{FitSettings, JointFit, Mesh};

/// Maximum number of candidate balls for each joint.
const CANDIDATES: usize = 384;
/// Number of points on a sphere at which its distance outside the mesh is measured.
const PROBES: usize = 96;

/// Finds few balls that cover the points of a surface that move with a joint, in the space of the mesh, and measures them. `joints` are those
/// of the mesh's vertices. `None` if no point moves with the joint.
pub(super) fn cover(
    mesh: &Mesh,
    joints: &[JointId],
    surface: &Surface,
    joint: JointId,
    settings: &FitSettings,
) -> Option<(Vec<Sphere>, JointFit)> {
    // In the order of the tree, so that each range of them is local.
    let points = surface.tree.order.iter().map(|&point| point as usize);
    let points: Vec<usize> = points.filter(|&at| surface.joints[at] == joint).collect();
    let places: Vec<Vec3> = points.iter().map(|&point| surface.places[point]).collect();
    if places.is_empty() {
        return None;
    }
    let (low, high) = bounds(places.iter().copied());
    // Limit the radius, because a ball could grow without bound where the mesh is open.
    let largest = low.distance(high).max(settings.cover);
    let inside = 0.5 * settings.bulge;
    let grown = |point: usize| {
        let mut ball = medial_ball(surface, point, largest, inside);
        ball.radius = ball.radius + settings.bulge - inside;
        ball
    };
    let on_border = |&point: &usize| surface.normals[point] != Vec3::ZERO;
    let mut seeds: Vec<usize> = points.iter().copied().filter(on_border).collect();
    if seeds.is_empty() {
        seeds.clone_from(&points);
    }
    let step = seeds.len().div_ceil(CANDIDATES);
    let cover = Cover {
        points: &places,
        balls: seeds.iter().step_by(step).map(|&p| grown(p)).collect(),
        allowed: settings.cover,
        most: settings.most_spheres,
    };
    let balls = cover.choose(|point| grown(points[point]));
    let mut own = vec![false; joints.len()];
    for &vertex in mesh.triangles().iter().flatten() {
        own[vertex as usize] = joints[vertex as usize] == joint;
    }
    let vertices = own.into_iter().filter(|&own| own).count();
    let fit = measure(&places, vertices, surface, &balls, settings);
    Some((balls, fit))
}

/// Measures how far the mesh, whose points are at `places`, and the balls stick out of each other.
fn measure(
    places: &[Vec3],
    vertices: usize,
    surface: &Surface,
    balls: &[Sphere],
    settings: &FitSettings,
) -> JointFit {
    let out = |&place: &Vec3| nearest_distance(balls.iter(), place).max(0.0);
    let (mesh_out_max, mesh_out_mean) = max_and_mean(places.iter().map(out));
    let probes = balls.iter().enumerate().flat_map(|(index, ball)| {
        let place = |probe| ball.centre + ball.radius * direction(probe);
        let others = move || {
            let others = balls.iter().enumerate();
            others.filter_map(move |(other, ball)| (other != index).then_some(ball))
        };
        let is_outer = move |place: &Vec3| others().all(|other| distance(other, *place) >= 0.0);
        (0..PROBES).map(place).filter(is_outer)
    });
    let probes = probes.map(|place| surface.outside(place));
    let (spheres_out_max, spheres_out_mean) = max_and_mean(probes);
    JointFit {
        joint: String::new(),
        vertices,
        points: places.len(),
        spheres: balls.len(),
        mesh_out_max,
        mesh_out_mean,
        spheres_out_max,
        spheres_out_mean,
        limited: mesh_out_max > settings.cover + 1e-5,
    }
}

fn max_and_mean(metres: impl Iterator<Item = f32>) -> (f32, f32) {
    let (mut most, mut sum, mut count) = (0.0f32, 0.0, 0u32);
    for metres in metres {
        (most, sum, count) = (most.max(metres), sum + f64::from(metres), count + 1);
    }
    (most, (sum / f64::from(count.max(1))) as f32)
}

/// Distance of a place from the surface of the nearest ball, negative inside.
fn nearest_distance<'a>(balls: impl Iterator<Item = &'a Sphere>, place: Vec3) -> f32 {
    let distances = balls.map(|ball| distance(ball, place));
    distances.fold(f32::INFINITY, f32::min)
}

/// Points distributed evenly on the unit sphere by the golden angle.
fn direction(index: usize) -> Vec3 {
    let y = 1.0 - (2 * index + 1) as f32 / PROBES as f32;
    let turn = index as f32 * PI * (3.0 - 5.0_f32.sqrt());
    let around = (1.0 - y * y).sqrt();
    Vec3::new(around * turn.cos(), y, around * turn.sin())
}

/// Distance from a ball's surface to a place, negative inside.
fn distance(ball: &Sphere, place: Vec3) -> f32 {
    ball.centre.distance(place) - ball.radius
}

/// Largest ball that touches the surface at a point. On an inner wall it is the largest ball around
/// the point; on a sheet its radius is 0. Other points lie at most `inside` metres deep in it.
fn medial_ball(surface: &Surface, point: usize, largest: f32, inside: f32) -> Sphere {
    /// Maximum number of steps. Each step shrinks the ball to one more point; a few suffice.
    const MOST_STEPS: usize = 64;
    let (place, normal) = (surface.places[point], surface.normals[point]);
    if normal == Vec3::ZERO {
        let border = surface.border.nearest(&surface.places, place);
        let deep = border.filter(|_| surface.is_inner[point]);
        let radius = deep.map_or(0.0, |(_, squared)| squared.sqrt().min(0.5 * largest));
        return Sphere::new(place, radius);
    }
    let mut radius = largest;
    for _ in 0..MOST_STEPS {
        let centre = place - radius * normal;
        let Some((other, squared)) = surface.border.nearest(&surface.places, centre) else {
            break;
        };
        if squared.sqrt() >= radius - inside {
            break;
        }
        let across = place - surface.places[other as usize];
        let depth = across.dot(normal);
        let smaller = across.length_squared() / (2.0 * depth);
        if !(depth > 0.0 && smaller < radius) {
            break;
        }
        radius = smaller;
    }
    Sphere::new(place - radius * normal, radius)
}

/// Points to cover, and the balls to choose from, which already have their final radii.
struct Cover<'a> {
    points: &'a [Vec3],
    balls: Vec<Sphere>,
    /// Distance that a point may stick out, in metres.
    allowed: f32,
    /// Maximum number of balls.
    most: usize,
}

impl Cover<'_> {
    /// Chooses balls. `ball_at` returns a ball that covers a point, for points that no candidate
    /// covers.
    fn choose(mut self, ball_at: impl Fn(usize) -> Sphere) -> Vec<Sphere> {
        let candidates = 0..self.balls.len();
        let mut covered: Vec<Vec<u32>> = candidates.map(|ball| self.covered_by(ball)).collect();
        let mut chosen = self.greedy(&mut covered, ball_at);
        self.drop_needless(&covered, &mut chosen);
        self.exchange(&mut chosen);
        chosen.into_iter().map(|ball| self.balls[ball]).collect()
    }

    /// The points that a ball covers.
    fn covered_by(&self, ball: usize) -> Vec<u32> {
        let covers = |point: &Vec3| distance(&self.balls[ball], *point) <= self.allowed;
        let points = (0..).zip(self.points);
        points
            .filter(|(_, point)| covers(point))
            .map(|(at, _)| at)
            .collect()
    }

    /// Repeatedly chooses the ball that covers the most remaining points. Ties are decided for the
    /// larger ball, then for the first.
    fn greedy(
        &mut self,
        covered: &mut Vec<Vec<u32>>,
        ball_at: impl Fn(usize) -> Sphere,
    ) -> Vec<usize> {
        let mut is_left = vec![true; self.points.len()];
        let mut chosen = Vec::new();
        while chosen.len() < self.most {
            let Some(open) = is_left.iter().position(|&is_left| is_left) else {
                break;
            };
            let gain = |ball: usize| {
                covered[ball]
                    .iter()
                    .filter(|&&point| is_left[point as usize])
                    .count()
            };
            let gains: Vec<usize> = (0..covered.len()).map(gain).collect();
            let order = |&a: &usize, &b: &usize| {
                let by_radius = self.balls[a].radius.total_cmp(&self.balls[b].radius);
                gains[a].cmp(&gains[b]).then(by_radius).then(b.cmp(&a))
            };
            let best = (0..covered.len()).max_by(order);
            let ball = best.filter(|&ball| gains[ball] > 0).unwrap_or_else(|| {
                self.balls.push(ball_at(open));
                covered.push(self.covered_by(self.balls.len() - 1));
                // The ball was created to cover this point, so the point is removed even if
                // rounding says otherwise.
                is_left[open] = false;
                self.balls.len() - 1
            });
            covered[ball]
                .iter()
                .for_each(|&point| is_left[point as usize] = false);
            chosen.push(ball);
        }
        chosen
    }

    /// Removes balls whose points later choices cover completely.
    fn drop_needless(&self, covered: &[Vec<u32>], chosen: &mut Vec<usize>) {
        let mut times = vec![0_u32; self.points.len()];
        for &ball in chosen.iter() {
            covered[ball]
                .iter()
                .for_each(|&point| times[point as usize] += 1);
        }
        for at in (0..chosen.len()).rev() {
            let own = &covered[chosen[at]];
            if chosen.len() > 1
                && !own.is_empty()
                && own.iter().all(|&point| times[point as usize] > 1)
            {
                own.iter().for_each(|&point| times[point as usize] -= 1);
                chosen.remove(at);
            }
        }
    }

    /// Replaces each ball by the candidate that its points stick out of least, as long as the
    /// maximum error decreases.
    fn exchange(&self, chosen: &mut Vec<usize>) {
        const ROUNDS: usize = 6;
        let mut worst = self.worst(chosen);
        for _ in 0..ROUNDS {
            let mut mine = vec![Vec::new(); chosen.len()];
            for &point in self.points {
                let far = |&at: &usize| distance(&self.balls[chosen[at]], point);
                let nearest = (0..chosen.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
                if let Some(at) = nearest {
                    mine[at].push(point);
                }
            }
            let better = chosen.iter().zip(&mine);
            let better: Vec<usize> = better
                .map(|(&ball, mine)| self.best_for(mine, ball))
                .collect();
            let deepest = self.worst(&better);
            if deepest >= worst {
                break;
            }
            (*chosen, worst) = (better, deepest);
        }
    }

    fn best_for(&self, points: &[Vec3], now: usize) -> usize {
        let deepest = |ball: usize, limit: f32| {
            let mut most = f32::NEG_INFINITY;
            for &point in points {
                most = most.max(distance(&self.balls[ball], point));
                if most >= limit {
                    break;
                }
            }
            most
        };
        let (mut best, mut least) = (now, deepest(now, f32::INFINITY));
        for ball in 0..self.balls.len() {
            let most = deepest(ball, least);
            if most < least {
                (best, least) = (ball, most);
            }
        }
        best
    }

    /// Maximum distance by which a point sticks out.
    fn worst(&self, chosen: &[usize]) -> f32 {
        let balls = || chosen.iter().map(|&ball| &self.balls[ball]);
        let out = |&point: &Vec3| nearest_distance(balls(), point);
        let out = self.points.iter().map(out);
        out.fold(f32::NEG_INFINITY, f32::max)
    }
}
