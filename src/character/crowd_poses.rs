//! Decides who poses each character: the crowd's kernels, on levels of detail, or the motion graph. The graph poses characters near the
//! camera and composed poses: transitions, blends, warps and layers, with the joints of the character's level.
//!
//! Not in the papers; it combines both. While a character plays one clip, the crowd plays the same clip from the same time at the same
//! place. A change from the graph to the crowd cuts off the rest of a blend that is too small to be seen.

use std::sync::Arc;

use super::state::CharacterState;
use crate::anim::{ClipId, JointId};
use crate::crowd::{
    AnimationSet, Character, Crowd, CrowdError, CrowdSettings, Layout, LevelId, MemberId,
    Placement, PoseSlice,
};
use crate::graph::{EdgeMotion, JointReach, MotionGraph, Playhead};
use crate::lod::{Levels, Switching};
use crate::math::F32x16;

/// How [`Characters::pose_all`](super::Characters::pose_all) poses.
#[derive(Clone, Debug, PartialEq)]
pub struct CrowdPoseSettings {
    /// Output of all characters; instruction set and threads of the crowd.
    pub crowd: CrowdSettings,
    /// Distance from the camera within which the graph poses characters, in metres. Default 0.
    pub near: f32,
    /// Choice of the level of detail by distance.
    pub switching: Switching,
    /// Error of a pose that is allowed when the crowd poses a character, as a share of the distance from the camera. The crowd leaves out the
    /// rest of a blend, or a transition, once it moves joints by less than about this. Default 0.002, which is 2 pixels of 1080 lines at 60 degrees; 0 draws all blends to their end.
    pub blend_error: f32,
}

impl Default for CrowdPoseSettings {
    fn default() -> Self {
        Self {
            crowd: CrowdSettings::default(),
            near: 0.0,
            switching: Switching::default(),
            blend_error: 0.002,
        }
    }
}

/// The crowd, with one member for each place of a character.
pub(super) struct CrowdPoses {
    pub settings: CrowdPoseSettings,
    pub animations: Arc<AnimationSet>,
    pub crowd: Crowd,
    pub members: Vec<Member>,
    /// Joints of the finest level, in its order.
    pub kept: Vec<JointId>,
    /// Characters that the graph poses, in the order of the output.
    pub singles: Vec<u32>,
    /// Length of what the crowd wrote last.
    pub crowd_len: usize,
    /// Scratch.
    pub reaches: Vec<JointReach>,
}

#[derive(Clone, Copy)]
pub(super) struct Member {
    /// Level plus blend.
    pub detail: f32,
    pub poser: Poser,
}

/// Part of the library that posed a member.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Poser {
    /// None: there is no character, or it has not been posed yet.
    Nothing,
    /// The graph. The number is the index among the members that it poses.
    Graph(u32),
    /// The crowd, with the motion that it plays.
    Crowd(Shown),
}

/// Motion that the crowd plays for a character.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Shown {
    clip: ClipId,
    /// Position in the clip at time 0 of the characters, in seconds.
    phase: f64,
    speed: f32,
    placement: Placement,
}

impl CrowdPoses {
    pub(super) fn new(
        graph: &MotionGraph,
        levels: &Levels,
        settings: CrowdPoseSettings,
    ) -> Result<Self, CrowdError> {
        let animations = AnimationSet::new(graph.skeleton(), graph.clips(), &levels.levels)?;
        let animations = Arc::new(animations);
        Ok(Self {
            crowd: Crowd::new(Arc::clone(&animations), settings.crowd),
            settings,
            animations,
            members: Vec::new(),
            kept: levels.levels[0].kept.clone(),
            singles: Vec::new(),
            crowd_len: 0,
            reaches: Vec::new(),
        })
    }

    /// Makes a member for each place.
    pub(super) fn grow(&mut self, places: usize) -> Result<(), CrowdError> {
        while self.members.len() < places {
            let id = self.crowd.add(&Character::default())?;
            self.crowd.deactivate(id)?;
            self.members.push(Member {
                detail: 0.0,
                poser: Poser::Nothing,
            });
        }
        Ok(())
    }

    /// Chooses level and poser of a character, and tells the crowd.
    pub(super) fn choose(
        &mut self,
        index: usize,
        seen: Option<&Seen<'_>>,
    ) -> Result<(), CrowdError> {
        let id = MemberId(index as u32);
        let member = &mut self.members[index];
        let before = member.poser;
        let Some(seen) = seen else {
            member.poser = Poser::Nothing;
            return self.leave_crowd(id, before);
        };
        let switching = &self.settings.switching;
        let choice = switching.choose(seen.distance, Some(LevelId(member.detail as u16)));
        let detail = f32::from(choice.level.0) + choice.blend;
        let has_changed = detail != std::mem::replace(&mut member.detail, detail);
        let most = self.settings.blend_error * seen.distance;
        let is_small =
            seen.distance >= self.settings.near && seen.left_out + seen.crossed() <= most;
        if !is_small {
            member.poser = Poser::Graph(self.singles.len() as u32);
            self.singles.push(index as u32);
            return self.leave_crowd(id, before);
        }
        let mut shown = seen.shown();
        match before {
            Poser::Crowd(before) if before.goes_on_as(&shown, seen.now) => {
                shown.phase = before.phase;
                if shown.placement != before.placement {
                    self.crowd.place(id, &shown.placement)?;
                }
                if has_changed {
                    self.crowd.set_detail(id, choice.level, choice.blend)?;
                }
            }
            _ => {
                let character = Character {
                    clip: shown.clip,
                    level: choice.level,
                    blend: choice.blend,
                    time: shown.time(seen.now) as f32,
                    speed: shown.speed,
                    placement: shown.placement,
                    fade: None,
                };
                self.crowd.set(id, &character)?;
            }
        }
        member.poser = Poser::Crowd(shown);
        Ok(())
    }

    /// The crowd no longer poses a member that it posed before.
    fn leave_crowd(&mut self, id: MemberId, before: Poser) -> Result<(), CrowdError> {
        match before {
            Poser::Crowd(_) => self.crowd.deactivate(id),
            Poser::Nothing | Poser::Graph(_) => Ok(()),
        }
    }

    /// Characters of the graph that are written together, and the lines that they take.
    pub(super) fn group(&self) -> (usize, usize) {
        let output = self.settings.crowd.output;
        let joints = self.animations.joints(LevelId(0));
        match output.layout {
            Layout::Instances => (1, output.row_len(joints)),
            Layout::Blocks => (F32x16::LANES, output.group_len(joints)),
        }
    }

    /// The largest length of the output for so many characters.
    pub(super) fn max_len(&self, characters: usize) -> usize {
        self.len_with(self.crowd.max_output_len(characters), characters)
    }

    /// Length of the output of the crowd and of characters that the graph poses.
    pub(super) fn len_with(&self, by_crowd: usize, by_graph: usize) -> usize {
        let (members, lines) = self.group();
        match self.settings.crowd.output.layout {
            Layout::Instances => by_crowd,
            Layout::Blocks => by_crowd + by_graph.div_ceil(members) * lines,
        }
    }

    pub(super) fn slice(&self, index: usize, single: u32) -> PoseSlice {
        let (offset, index) = match self.settings.crowd.output.layout {
            Layout::Instances => (0, index),
            Layout::Blocks => (self.crowd_len, single as usize),
        };
        let output = self.settings.crowd.output;
        self.animations.external_slice(output, offset, index)
    }
}

/// A character as the camera sees it.
pub(super) struct Seen<'a> {
    pub graph: &'a MotionGraph,
    pub state: &'a CharacterState,
    pub playhead: Playhead,
    pub distance: f32,
    /// About how far a joint is from where the crowd would have it, but for a transition, in metres.
    pub left_out: f32,
    pub now: f64,
}

impl Seen<'_> {
    /// About how far a joint is, in a transition, from where the nearer of both clips has it, in metres: half of what the clips are
    /// apart, times four for the joint that is farthest, and a tenth for what lies beside it.
    fn crossed(&self) -> f32 {
        match self.graph.edge(self.playhead.edge).motion {
            EdgeMotion::Clip => 0.0,
            EdgeMotion::Transition { distance, .. } => 2.2 * distance,
        }
    }

    /// Motion that the crowd plays for the character. In a transition it comes from the clip with the larger weight.
    fn shown(&self) -> Shown {
        let edge = self.graph.edge(self.playhead.edge);
        let moment = self.graph.edge_moment(edge, self.playhead.frame);
        let clip_to_world = self.playhead.clip_to_world;
        let (at, ground) = match moment.target {
            Some(target) if target.weight > 0.5 => (target.at, clip_to_world * target.align),
            _ => (moment.source, clip_to_world),
        };
        // The crowd wraps to the start of a clip at its very end.
        let frames = self.graph.clip(at.clip).frames() - 1;
        let last = frames as f32 * (1.0 - f32::EPSILON);
        let playing = &self.state.playing;
        let speed = match self.state.is_released {
            true => 0.0,
            false => playing.rate * playing.motion.rate(playing.seconds),
        };
        let seconds = f64::from(at.frame.min(last)) / self.graph.frame_rate();
        Shown {
            clip: at.clip,
            phase: seconds - f64::from(speed) * self.now,
            speed,
            placement: Placement {
                ground,
                height: self.state.height,
            },
        }
    }
}

impl Shown {
    fn time(&self, now: f64) -> f64 {
        self.phase + f64::from(self.speed) * now
    }

    /// Whether the crowd may continue this motion instead of `other`.
    fn goes_on_as(&self, other: &Self, now: f64) -> bool {
        /// Largest error of the time in the clip, in seconds.
        const NEAR: f64 = 5e-6;
        self.clip == other.clip
            && self.speed == other.speed
            && (self.time(now) - other.time(now)).abs() < NEAR
    }
}
