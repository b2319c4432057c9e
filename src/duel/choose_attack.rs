//! The choice of an attack.
//!
//! Source: Lee & Lee (2004). The node's grid is looked up at the predicted positions of the opponent's body. Each attack that it contains is
//! tested on the actual motions: whether it hits an opponent that continues as planned, and whether both fighters stay apart.

use glam::Vec3;

use super::duel_state::Duel;
use super::record::Challenge;
use super::settings::LeadTime;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{EdgeId, Motion, MotionStep, Playhead};
use crate::maps::AttackOption;
use crate::query::Attack;

/// Number of recent attacks that are avoided if there are others.
const REMEMBERED: usize = 4;

impl Duel<'_> {
    /// Finds an attack that would hit.
    pub(super) fn find_challenge(&mut self) -> Option<Challenge> {
        let graph = self.baked.graph();
        let attacker = self.turn;
        let me = self.fighters[attacker.index()].ahead(graph, self.now);
        let them = self.fighters[attacker.other().index()].ahead(graph, self.now);
        // Attacks with a smaller rank are tried first.
        let mut ranked: Vec<(f32, AttackOption)> = Vec::new();
        for option in self.attacks(&me, &them, 0.0) {
            let strike = self.grid.attack_move(self.baked, option.path).edge;
            let recent = self.used.iter().rev().take(REMEMBERED);
            let used = recent.filter(|&&used| used == strike).count() as f32;
            ranked.push((self.rng.share() + 2.0 * used, option));
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut options = ranked.into_iter();
        options.find_map(|(_, option)| self.challenge_by(option, &them))
    }

    /// Whether the grid has an attack at the next node after a time, in seconds.
    pub(super) fn reaches(&self, me: &Motion, them: &Motion, seconds: f32) -> bool {
        !self.attacks(me, them, seconds).is_empty()
    }

    /// The attacks that the grid of the next node after `seconds` has for the positions of the opponent's trunk and thighs. Each path is
    /// listed once.
    fn attacks(&self, me: &Motion, them: &Motion, seconds: f32) -> Vec<AttackOption> {
        /// Usual time from a node to the impact, in seconds.
        const USUAL: f32 = 0.6;
        let graph = self.baked.graph();
        let mine = me.playhead(graph, seconds);
        let (node, wait) = (mine.next_node(graph), mine.seconds_to_next_node(graph));
        let frame = mine.next_clip_to_world(graph) * self.baked.placement(node);
        let mut attacks = Vec::new();
        for target in self.targets(them.playhead(graph, seconds + wait + USUAL)) {
            attacks.extend_from_slice(self.grid.at(node, frame.inverse().point(target)));
        }
        attacks.sort();
        attacks.dedup_by_key(|option| option.path);
        attacks
    }

    /// The positions of a body's targets.
    fn targets(&self, playhead: Playhead) -> Vec<Vec3> {
        let (mut pose, mut joints): (Pose, Vec<JointTransform>) = Default::default();
        playhead.pose(self.baked.graph(), &mut pose);
        forward_kinematics(self.baked.graph().skeleton(), &pose, &mut joints);
        let mut targets: Vec<Vec3> = self
            .trunk
            .spheres()
            .iter()
            .map(|sphere| sphere.centre(&joints))
            .collect();
        // Points of the legs below the trunk, at three quarters and at half of the height of the hips.
        let hips = joints[0].translation;
        targets.extend([0.75, 0.5].map(|share| Vec3::new(hips.x, share * hips.y, hips.z)));
        targets
    }

    /// The challenge of an attack. `None` if it would land too early or miss, or if the fighters would not stay apart or inside the arena.
    fn challenge_by(&mut self, option: AttackOption, them: &Motion) -> Option<Challenge> {
        let graph = self.baked.graph();
        let rate = graph.frame_rate() as f32;
        let attacker = self.turn;
        let me = &self.fighters[attacker.index()];
        let wait = me.branch(graph, self.now, &[]).duration();
        let impact = wait + self.grid.frames(option) as f32 / rate;
        if impact < self.settings.lead.shortest {
            return None;
        }
        let strike = *self.grid.attack_move(self.baked, option.path);
        let path: Vec<EdgeId> = self.grid.paths().edges(option.path).collect();
        let edges = path.iter().chain([&strike.edge]);
        let steps: Vec<MotionStep> = edges.map(|&edge| MotionStep { edge, rate: 1.0 }).collect();
        let mut motion = me.branch(graph, self.now, &steps);
        let start = wait + f32::from(self.grid.paths().path(option.path).frames) / rate;
        // The transform of the attack's clip at that time.
        let placement = motion.playhead(graph, start + 0.5 / rate).clip_to_world * strike.placement;
        let attack = Attack::from_attack_move(self.baked, &strike, placement, start).ok()?;
        let end = attack.end();
        motion.extend(graph, end + self.settings.window);
        let lands = self.depth(them, &attack) < -self.settings.depth;
        let seconds = end + self.settings.pause;
        let fits = lands
            && self.stays_inside(&motion, seconds)
            && self.stays_apart([&motion, them], seconds);
        if !fits {
            return None;
        }
        // The attack begins now. It is announced later, at a random time before the impact.
        let LeadTime { shortest, longest } = self.settings.lead;
        let wanted = shortest + (longest - shortest).max(0.0) * self.rng.share();
        // It is announced at its start at the latest.
        let hidden = (impact - wanted).clamp(0.0, start);
        let now = self.now;
        self.fighters[attacker.index()].play(graph, now, motion);
        self.now += hidden;
        let start = start - hidden;
        let attack = Attack::from_attack_move(self.baked, &strike, placement, start).ok()?;
        let defender = &self.fighters[attacker.other().index()];
        let (playhead, playing) = (
            defender.playhead(graph, self.now),
            defender.ahead(graph, self.now),
        );
        let without = self.clearance(&playing, &attack).metres;
        Some(Challenge {
            attacker,
            playhead,
            playing,
            attack,
            strike: strike.edge,
            path,
            announced: self.now,
            lead: impact - hidden,
            without,
        })
    }
}
