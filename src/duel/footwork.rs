//! Footwork: the motion of the fighters while neither attacks.
//!
//! Paths come from the search for [moves](crate::query::MoveSettings). Each is rated against the opponent's planned motion.

use glam::Vec2;

use super::duel_state::Duel;
use super::record::Side;
use crate::anim::EventKind;
use crate::graph::{EdgeMotion, Motion, MotionGraph, MotionStep, NodeId};
use crate::math::{Rigid2, sorted_indices};
use crate::query::MoveSettings;

impl Duel<'_> {
    /// Lets both fighters choose a motion, the attacker first, and advances time.
    pub(super) fn footwork(&mut self) {
        for side in [self.turn, self.turn.other()] {
            if let Some(motion) = self.better_motion(side) {
                let now = self.now;
                self.fighters[side.index()].play(self.baked.graph(), now, motion);
            }
        }
        self.now += self.settings.step;
    }

    /// The best motion, if it is better than the planned one.
    fn better_motion(&mut self, side: Side) -> Option<Motion> {
        /// Maximum number of motions that are tested, best first.
        const TRIED: usize = 24;
        let graph = self.baked.graph();
        let me = &self.fighters[side.index()];
        let planned = me.ahead(graph, self.now);
        let other = self.fighters[side.other().index()].ahead(graph, self.now);
        let playhead = me.playhead(graph, self.now);
        let wait = me.branch(graph, self.now, &[]).duration();
        let mut ways = vec![(self.cost(side, &planned, &other), planned)];
        for steps in self.paths_from(playhead.next_node(graph), self.settings.window - wait) {
            let me = &self.fighters[side.index()];
            let mut motion = me.branch(graph, self.now, &steps);
            motion.extend(graph, self.settings.window + self.settings.step);
            let cost = self.cost(side, &motion, &other);
            ways.push((cost, motion));
        }
        let order = sorted_indices(ways.len(), &|&a, &b| ways[a].0.total_cmp(&ways[b].0));
        let seconds = self.settings.window;
        let fits = |way: &Motion| {
            self.keeps_distance([way, &other], seconds)
                && self.stays_inside(way, seconds)
                && self.stays_apart([way, &other], seconds)
        };
        let best = order
            .iter()
            .take(TRIED)
            .find(|&&index| fits(&ways[index].1));
        let best = match best {
            Some(&best) => best,
            // No motion fits: the fighters step away from each other.
            None => order
                .iter()
                .copied()
                .max_by(|&a, &b| {
                    let free_distance = |index: usize| self.free_distance(&ways[index].1, &other);
                    free_distance(a)
                        .total_cmp(&free_distance(b))
                        .then(b.cmp(&a))
                })
                .unwrap_or(0),
        };
        (best > 0).then(|| ways.swap_remove(best).1)
    }

    /// Paths from a node that differ from each other.
    fn paths_from(&mut self, node: NodeId, seconds: f32) -> Vec<Vec<MotionStep>> {
        let settings = MoveSettings {
            width: 48,
            candidates: 192,
            ..MoveSettings::default()
        };
        let (mut found, graph) = (Vec::new(), self.baked.graph());
        let is_blocked = |_, _| false;
        self.search
            .search(graph, node, seconds.max(0.1), settings, &is_blocked, |id| {
                found.push(id);
            });
        let steps = |id| {
            let edges = self.search.edges_backwards(id);
            let mut steps: Vec<MotionStep> =
                edges.map(|edge| MotionStep { edge, rate: 1.0 }).collect();
            steps.reverse();
            steps
        };
        found.into_iter().map(steps).collect()
    }

    /// The cost of a motion. It grows with the difference from the distance for attacks, the angle to the opponent, the nearness to the arena's
    /// border, bad transitions, and attacks that hit nothing.
    fn cost(&self, side: Side, motion: &Motion, other: &Motion) -> f32 {
        let (graph, seconds) = (self.baked.graph(), self.settings.window);
        let playhead = motion.playhead(graph, seconds);
        let node = playhead.next_node(graph);
        let me = playhead.next_clip_to_world(graph) * self.baked.placement(node);
        let them = other.playhead(graph, seconds).placement(graph);
        let away = them.ground() - me.ground();
        let (bearing, reach) = self.grid.aim(node).unwrap_or((0.0, self.settings.distance));
        let apart = (away.length() - reach).abs();
        let facing = heading_error(me * Rigid2::new(bearing, 0.0, 0.0), away).abs();
        let border = (me.ground().length() - 0.6 * self.settings.arena).max(0.0);
        let can_strike = side == self.turn && self.reaches(motion, other, seconds);
        apart + 0.6 * facing + 2.0 * border + looks(graph, motion, seconds)
            - if can_strike { 0.3 } else { 0.0 }
    }

    /// Mean over the window of the distance between the roots or from the arena's border, whichever is smaller, in metres.
    fn free_distance(&self, motion: &Motion, other: &Motion) -> f32 {
        /// Number of samples.
        const SAMPLES: u16 = 12;
        let free_distance = |sample: u16| {
            let t = f32::from(sample) * self.settings.window / f32::from(SAMPLES);
            let root = motion.root(self.baked.graph(), t);
            let border = self.settings.arena - root.x.hypot(root.z);
            self.apart([motion, other], t).min(border)
        };
        (1..=SAMPLES).map(free_distance).sum::<f32>() / f32::from(SAMPLES)
    }
}

/// Angle from a heading to a direction, in radians.
pub(super) fn heading_error(me: Rigid2, way: Vec2) -> f32 {
    let wanted = Rigid2::facing(way, 0.0, 0.0);
    (Rigid2::new(me.heading(), 0.0, 0.0).inverse() * wanted).heading()
}

/// The cost of a motion's transitions and events until `seconds`.
fn looks(graph: &MotionGraph, motion: &Motion, seconds: f32) -> f32 {
    let events = motion.events(graph);
    let of_event = |(event, [start, _]): (_, [f32; 2])| match graph.event(event).kind {
        _ if start <= 0.0 || start > seconds => 0.0,
        EventKind::Attack => 1.0,
        EventKind::Evasion => 0.3,
    };
    let of_step = |step: MotionStep| match graph.edge(step.edge).motion {
        EdgeMotion::Clip => 0.0,
        EdgeMotion::Transition { distance, .. } => 0.02 + distance,
    };
    let steps: f32 = motion.steps().take(16).map(of_step).sum();
    events.map(of_event).sum::<f32>() + steps
}
