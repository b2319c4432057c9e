//! A node's grid of attacks equals a naive search along all edges. Every entry's attack passes
//! through its cell at the stated time. The grid does not depend on the number of threads.

use std::collections::BTreeMap;

use glam::Vec3;
use sabaki::anim::{Pose, forward_kinematics};
use sabaki::graph::NodeId;
use sabaki::maps::{AttackGrid, AttackGridSettings, BakedGraph, PathSettings};
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::embedded;

use super::{nodes, play};

type Cell = [i16; 3];

/// Seconds and metres of the best blow of each attack at each cell.
type Best = BTreeMap<(Cell, u32), f32>;

/// All paths within the horizon, and no two of them alike but to the millimetre.
fn fine(horizon: f32) -> AttackGridSettings {
    AttackGridSettings {
        most: 1000,
        paths: PathSettings {
            horizon,
            alike_distance: 0.001,
            alike_angle: 0.001,
            most: 1_000_000,
            threads: 0,
        },
        ..AttackGridSettings::default()
    }
}

/// Adds a contact of an attack wherever it belongs, by the plainest means.
fn add(
    (attack, seconds): (u32, f32),
    (centre, radius): (Vec3, f32),
    settings: &AttackGridSettings,
    best: &mut Best,
) {
    let side = settings.cell;
    let low = ((centre - radius) / side).floor() - 2.0;
    for x in 0..8 {
        for y in 0..8 {
            for z in 0..8 {
                let cell = low + Vec3::new(x as f32, y as f32, z as f32);
                let away = ((cell + 0.5) * side).distance(centre);
                if away <= radius + 0.5 * side {
                    let key = ([cell.x as i16, cell.y as i16, cell.z as i16], attack);
                    let cost = seconds + settings.distance_weight * away;
                    let known = best.entry(key).or_insert(f32::INFINITY);
                    *known = known.min(cost);
                }
            }
        }
    }
}

/// By following every edge.
fn search(baked: &BakedGraph, grid: &AttackGrid, node: NodeId) -> Best {
    let (graph, settings) = (baked.graph(), grid.settings());
    let rate = graph.frame_rate() as f32;
    let longest = (settings.paths.horizon * rate).round() as u32;
    let notice = (settings.min_seconds * rate).ceil() as u32;
    let start = baked.placement(node);
    let (mut best, mut open) = (Best::new(), vec![(node, Rigid2::IDENTITY, 0u32)]);
    while let Some((node, to_start, frames)) = open.pop() {
        for (index, strike) in baked.attack_moves().iter().enumerate() {
            if graph.edge(strike.edge).from != node {
                continue;
            }
            let placement = start.inverse() * to_start * strike.placement;
            for contact in grid.contacts(index) {
                let wait = frames + contact.frame;
                if wait >= notice {
                    let hit = (index as u32, wait as f32 / rate);
                    let sphere = (placement.point(contact.centre), contact.radius);
                    add(hit, sphere, settings, &mut best);
                }
            }
        }
        for edge in graph.edges_from(node) {
            let length = graph.edge(edge).frames;
            if frames + length <= longest {
                let next = to_start * graph.clip_change(edge);
                open.push((graph.edge(edge).to, next, frames + length));
            }
        }
    }
    best
}

/// What the grid has, in the same words.
fn filed(baked: &BakedGraph, grid: &AttackGrid, node: NodeId) -> Best {
    let rate = baked.graph().frame_rate() as f32;
    let mut best = Best::new();
    for (cell, blows) in grid.cells(node) {
        let middle =
            Vec3::from_array(cell.map(|index| (f32::from(index) + 0.5) * grid.settings().cell));
        assert_eq!(grid.at(node, middle), blows);
        for &blow in blows {
            let path = grid.paths().path(blow.path);
            let place = path.placement.point(grid.contact(blow).centre);
            let cost = grid.frames(blow) as f32 / rate
                + grid.settings().distance_weight * place.distance(middle);
            let twice = best.insert((cell, path.goal), cost);
            assert!(twice.is_none(), "an attack stands there twice");
        }
    }
    best
}

#[test]
fn every_cell_has_what_a_search_along_all_edges_finds() {
    let baked = embedded();
    let grid = AttackGrid::new(baked, &fine(0.7));
    let (mut compared, mut edges) = (0, 0);
    for node in nodes(baked, 31) {
        let (found, filed) = (search(baked, &grid, node), filed(baked, &grid, node));
        // A place that lies a millimetre aside can miss a cell that it would just touch.
        for (key, cost) in &found {
            match filed.get(key) {
                Some(kept) => {
                    let is_same = (kept - cost).abs() < 0.01;
                    assert!(is_same, "{node:?} {key:?}: {kept} {cost}");
                    compared += 1;
                }
                None => edges += 1,
            }
        }
        edges += filed.keys().filter(|key| !found.contains_key(*key)).count();
    }
    assert!(compared > 1200, "only {compared} cells");
    assert!(edges * 50 < compared, "{edges} of {compared} are elsewhere");
}

#[test]
fn of_a_cells_attacks_the_soonest_and_closest_are_kept_best_first() {
    let baked = embedded();
    let all = AttackGrid::new(baked, &fine(0.6));
    let most_two = AttackGridSettings {
        most: 2,
        ..fine(0.6)
    };
    let few = AttackGrid::new(baked, &most_two);
    let mut cut = 0;
    for node in nodes(baked, 7) {
        let cells = all.cells(node).map(|(cell, blows)| (cell, blows.to_vec()));
        for ((cell, mut all), (same, few)) in cells.zip(few.cells(node)) {
            cut += usize::from(all.len() > 2);
            all.truncate(2);
            assert_eq!((cell, all.as_slice()), (same, few));
        }
    }
    assert!(cut > 40, "{cut}");
}

/// The graph is played: along the path, the attack, up to the blow.
#[test]
fn the_limb_is_there_when_the_grid_says_so() {
    let baked = embedded();
    let (graph, grid) = (
        baked.graph(),
        AttackGrid::new(baked, &AttackGridSettings::default()),
    );
    let rate = graph.frame_rate() as f32;
    let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
    let mut played = 0;
    for node in nodes(baked, 211) {
        for (cell, blows) in grid.cells(node).step_by(7) {
            let blow = blows[blows.len() - 1];
            let strike = grid.attack_move(baked, blow.path);
            let edges: Vec<_> = grid.paths().edges(blow.path).chain([strike.edge]).collect();
            let motion = play(baked, node, &edges);
            motion.sample(graph, grid.frames(blow) as f32 / rate, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            baked.body().centres(&joints, &mut centres);
            let middle =
                Vec3::from_array(cell.map(|index| (f32::from(index) + 0.5) * grid.settings().cell));
            let event = graph.event(graph.edge(strike.edge).event.unwrap());
            let spheres = baked.body().spheres.iter().zip(&centres);
            let of_limb = spheres.filter(|(sphere, _)| {
                let mut above = graph.skeleton().ancestry(sphere.joint);
                above.any(|joint| event.joints.contains(&joint))
            });
            let nearest = of_limb.map(|(sphere, centre)| centre.distance(middle) - sphere.radius);
            let nearest = nearest.fold(f32::INFINITY, f32::min);
            // Paths' places are alike to ten centimetres only where they are merged, which changes where nothing is filed.
            let most = 0.5 * grid.settings().cell + 0.02;
            assert!(nearest <= most, "{node:?} {cell:?}: {nearest} m away");
            assert!(grid.frames(blow) as f32 / rate >= grid.settings().min_seconds);
            played += 1;
        }
    }
    assert!(played > 200, "{played}");
}

#[test]
fn any_number_of_threads_files_the_same() {
    let grid = |threads| {
        let mut settings = AttackGridSettings::default();
        settings.paths.threads = threads;
        settings.paths.horizon = 1.0;
        AttackGrid::new(embedded(), &settings)
    };
    let (one, three) = (grid(1), grid(3));
    assert!(nodes(embedded(), 1).any(|node| one.cells(node).count() > 50));
    for node in nodes(embedded(), 1) {
        assert!(one.cells(node).eq(three.cells(node)), "{node:?}");
    }
    let report = one.report();
    assert_eq!(report, three.report());
    assert!(report.options >= report.cells && report.bytes > report.cells * 8);
    assert_eq!(one.at(NodeId(0), Vec3::splat(1e9)), []);
}
