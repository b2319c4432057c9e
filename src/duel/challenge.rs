//! The choice of an attack.
//!
//! Source: Lee & Lee (2004): the node's grid is asked at the places where the other one's body will be. What it names would strike
//! there; whether it does, who goes on as planned, and whether both keep apart, is tested on the very motions.

use glam::Vec3;

use super::{Duel, Side};
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{EdgeId, Motion, Playhead, Step};
use crate::maps::AttackOption;
use crate::query::{Attack, Request};

/// An attack that is announced.
#[derive(Clone, Debug, PartialEq)]
pub struct Challenge {
    /// Who strikes.
    pub attacker: Side,
    /// Where the one who is to avoid it is now.
    pub playhead: Playhead,
    /// Where it passes: in the duel's world, by a clock that starts now.
    pub attack: Attack,
    /// The attack's edge.
    pub strike: EdgeId,
    /// The edges that lead to it, from the attacker's next node on when it began.
    pub path: Vec<EdgeId>,
    /// When, seconds since the duel's start.
    pub announced: f32,
    /// From now to the blow, seconds.
    pub lead: f32,
    /// How near it would come to trunk, head and thighs of who does nothing, metres: below 0.
    pub without: f32,
}

impl Challenge {
    /// The request of the character that is attacked.
    #[must_use]
    pub fn request(&self) -> Request<'_> {
        Request::new(self.playhead, &self.attack)
    }
}

/// An attack of the grid that may do.
#[derive(Clone, Copy)]
struct Choice {
    blow: AttackOption,
    /// Smaller is tried sooner.
    rank: f32,
}

/// Attacks of late that others are preferred to.
const REMEMBERED: usize = 4;

impl Duel<'_> {
    /// An attack that would land now, if there is one.
    pub(super) fn find_challenge(&mut self) -> Option<Challenge> {
        let graph = self.baked.graph();
        let attacker = self.turn;
        let me = self.fighters[attacker.index()].ahead(graph, self.now);
        let them = self.fighters[attacker.other().index()].ahead(graph, self.now);
        let mut options: Vec<Choice> = Vec::new();
        for blow in self.blows((&me, &them), 0.0) {
            let strike = self.grid.attack_move(self.baked, blow.path).edge;
            let recent = self.used.iter().rev().take(REMEMBERED);
            let used = recent.filter(|&&used| used == strike).count() as f32;
            options.push(Choice {
                blow,
                rank: self.chance.share() + 2.0 * used,
            });
        }
        options.sort_by(|a, b| a.rank.total_cmp(&b.rank).then(a.blow.cmp(&b.blow)));
        { options.iter() }.find_map(|option| self.challenge_by(option.blow, &them))
    }

    /// Whether the grid names anything for somebody who moves so, and is at a node by then.
    pub(super) fn reaches(&self, motions: (&Motion, &Motion), seconds: f32) -> bool {
        !self.blows(motions, seconds).is_empty()
    }

    /// What the grid of the next node after `seconds` has for the places of the other's core and thighs; each path once.
    fn blows(&self, (me, them): (&Motion, &Motion), seconds: f32) -> Vec<AttackOption> {
        /// Seconds from a node to most blows.
        const USUAL: f32 = 0.6;
        let graph = self.baked.graph();
        let mine = me.playhead(graph, seconds);
        let (node, wait) = (mine.next_node(graph), mine.seconds_to_next_node(graph));
        let frame = mine.next_clip_to_world(graph) * self.baked.placement(node);
        let mut blows = Vec::new();
        for target in self.targets(them.playhead(graph, seconds + wait + USUAL)) {
            blows.extend_from_slice(self.grid.at(node, frame.inverse().point(target)));
        }
        blows.sort_unstable();
        blows.dedup_by_key(|blow| blow.path);
        blows
    }

    /// Where a body can be struck.
    fn targets(&self, playhead: Playhead) -> Vec<Vec3> {
        let (mut pose, mut joints): (Pose, Vec<JointTransform>) = Default::default();
        playhead.pose(self.baked.graph(), &mut pose);
        forward_kinematics(self.baked.graph().skeleton(), &pose, &mut joints);
        let mut targets: Vec<Vec3> = { self.core.spheres().iter() }
            .map(|sphere| sphere.centre(&joints))
            .collect();
        // Below the core there are the legs: half way down and at the knees.
        let hips = joints[0].translation;
        targets.extend([0.75, 0.5].map(|share| Vec3::new(hips.x, share * hips.y, hips.z)));
        targets
    }

    /// The challenge of a blow; `None` where it comes at the wrong time, would not land, or ends where it must not.
    fn challenge_by(&mut self, blow: AttackOption, them: &Motion) -> Option<Challenge> {
        let graph = self.baked.graph();
        let rate = graph.frame_rate() as f32;
        let attacker = self.turn;
        let me = &self.fighters[attacker.index()];
        let wait = me.branch(graph, self.now, &[]).duration();
        let blow_at = wait + self.grid.frames(blow) as f32 / rate;
        if blow_at < self.settings.lead.0 {
            return None;
        }
        let strike = *self.grid.attack_move(self.baked, blow.path);
        let path: Vec<EdgeId> = self.grid.paths().edges(blow.path).collect();
        let edges = path.iter().chain([&strike.edge]);
        let steps: Vec<Step> = edges.map(|&edge| Step { edge, rate: 1.0 }).collect();
        let mut motion = me.branch(graph, self.now, &steps);
        let start = wait + f32::from(self.grid.paths().path(blow.path).frames) / rate;
        // The strike's clip as it stands in the world then.
        let placement = motion.playhead(graph, start + 0.5 / rate).clip_to_world * strike.placement;
        let attack = Attack::of_attack_move(self.baked, &strike, placement, start).ok()?;
        let end = attack.end();
        motion.extend(graph, end + self.settings.window);
        let without = self.depth(them, &attack);
        let lands = without < -self.settings.depth;
        let seconds = end + self.settings.pause;
        let fits = lands
            && self.stays_inside(&motion, seconds)
            && self.stays_apart([&motion, them], seconds);
        if !fits {
            return None;
        }
        // It begins now, and is announced when there is as much time left as chance says.
        let (shortest, longest) = self.settings.lead;
        let wanted = shortest + (longest - shortest).max(0.0) * self.chance.share();
        // An attack is known of before it starts.
        let hidden = (blow_at - wanted).clamp(0.0, start);
        let now = self.now;
        self.fighters[attacker.index()].play(graph, now, motion);
        self.now += hidden;
        let attack = Attack::of_attack_move(self.baked, &strike, placement, start - hidden).ok()?;
        Some(Challenge {
            attacker,
            playhead: self.fighters[attacker.other().index()].playhead(graph, self.now),
            attack,
            strike: strike.edge,
            path,
            announced: self.now,
            lead: blow_at - hidden,
            without,
        })
    }
}
