//! Weights of a body's joints: each vertex starts with the joint of its nearest shape, then weights spread along the surface.
//!
//! Source: the diffusion of Baran and Popovic, "Automatic Rigging and Animation of 3D Characters", SIGGRAPH 2007, section 4, in explicit steps on
//! the surface's edges.

use std::collections::BTreeMap;

use glam::Vec3;
use sabaki::math::smooth_step;

use super::anatomy::Anatomy;
use super::shapes::{Carrier, Shapes};
use super::surface_net::Net;

/// Distance over which weights spread, as a share of the height; then the distance at the hips and shoulders, which rotate
/// furthest.
const SPREAD: f32 = 0.022;
const WIDE: f32 = 0.042;
/// Distance from the joint of a hip or shoulder at which weights spread as far as elsewhere, as a share of the height.
const REACH: f32 = 0.12;

impl Net {
    /// Four bones and their weights for each vertex. `cell` is the side of the grid's cells, in metres.
    pub(super) fn weights(
        &self,
        anatomy: &Anatomy,
        human: &Shapes,
        cell: f32,
    ) -> Vec<([u16; 4], [u16; 4])> {
        let mut neighbours = vec![Vec::new(); self.places.len()];
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                neighbours[from as usize].push(to as usize);
                neighbours[to as usize].push(from as usize);
            }
        }
        let start = |place| match human.nearest(place).carrier {
            Carrier::Joint(joint) => joint,
            Carrier::Trunk => anatomy.of_trunk(place),
        };
        let mut all: Vec<BTreeMap<u16, f32>> = self
            .places
            .iter()
            .map(|&place| BTreeMap::from([(start(place).0, 1.0)]))
            .collect();
        // Each step spreads by about 0.8 cells.
        let steps_of = |spread: f32| (spread * anatomy.height / (0.8 * cell)).powi(2).ceil();
        let joints = anatomy.legs.iter().chain(&anatomy.arms);
        let joints: Vec<Vec3> = joints.map(|limb| anatomy.at(limb.hip)).collect();
        let steps_at = |place: &Vec3| {
            let apart = joints.iter().map(|joint| joint.distance(*place));
            let apart = apart.fold(f32::MAX, f32::min) / (REACH * anatomy.height);
            let near = smooth_step(2.0 * (1.0 - apart));
            steps_of(SPREAD + (WIDE - SPREAD) * near) as usize
        };
        let steps: Vec<usize> = self.places.iter().map(steps_at).collect();
        for step in 0..steps.iter().copied().max().unwrap_or(0) {
            let next = neighbours.iter().enumerate().map(|(vertex, around)| {
                if step >= steps[vertex] {
                    return all[vertex].clone();
                }
                let share = 0.75 / around.len().max(1) as f32;
                let mut mixed: BTreeMap<u16, f32> = BTreeMap::new();
                for (&joint, &weight) in &all[vertex] {
                    *mixed.entry(joint).or_default() += 0.25 * weight;
                }
                for &other in around {
                    for (&joint, &weight) in &all[other] {
                        *mixed.entry(joint).or_default() += share * weight;
                    }
                }
                mixed.retain(|_, weight| *weight > 1e-3);
                mixed
            });
            all = next.collect();
        }
        all.iter().map(four).collect()
    }
}

/// The four largest weights with a sum of 65,535.
fn four(weights: &BTreeMap<u16, f32>) -> ([u16; 4], [u16; 4]) {
    let mut sorted: Vec<(u16, f32)> = weights
        .iter()
        .map(|(&joint, &weight)| (joint, weight))
        .collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    sorted.truncate(4);
    let sum: f32 = sorted.iter().map(|(_, weight)| weight).sum();
    let (mut joints, mut whole) = ([0; 4], [0u16; 4]);
    for (slot, (joint, weight)) in sorted.into_iter().enumerate() {
        joints[slot] = joint;
        whole[slot] = (weight / sum * 65_535.0) as u16;
    }
    let rest = u32::from(u16::MAX) - whole.iter().map(|&part| u32::from(part)).sum::<u32>();
    whole[0] += rest as u16;
    (joints, whole)
}
