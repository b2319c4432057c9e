//! Many characters of one motion graph, posed where they need it: near the camera, and where they
//! avoid something, by the graph; far away by the crowd's kernels, on levels of detail.
//!
//! Beyond both papers, which stand side by side here: a member is always a place in the graph
//! ([`Playhead`]), so that an attack may be answered whoever poses it, and walks on by what is
//! natural. On a stretch of a clip the crowd plays the same clip from the same moment in the same
//! place; what is blended between clips the graph poses, and it is made to look like the member's
//! level. So nothing jumps where a member goes from one to the other.
//!
//! ```no_run
//! # use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request};
//! # use sabaki::{lod::{Levels, Switching}, maps::BakedGraph, character::{MemberId, Troupe, TroupeSettings}};
//! # fn frame(baked: &BakedGraph, attack: &Attack, troupe: &mut Troupe<'_>, member: MemberId)
//! # -> Result<(), Box<dyn std::error::Error>> {
//! // Somebody is attacked: what the graph finds is played, near or far.
//! let settings = QuerySettings::default();
//! let (mut context, mut answer) = (QueryContext::default(), Answer::default());
//! if let Some(playhead) = troupe.playhead(member) {
//!     Query::new(baked, &settings).answer(Request::new(playhead, attack), &mut context, &mut answer);
//!     troupe.play(member, &answer.motion);
//! }
//! // Every frame.
//! troupe.advance(1.0 / 60.0)?;
//! troupe.look_from(glam::Vec3::new(0.0, 1.6, 8.0))?;
//! let mut out = vec![sabaki::math::F32x16::ZERO; troupe.lines()];
//! troupe.pose(&mut out)?;
//! # Ok(())
//! # }
//! ```

use std::sync::Arc;

use glam::Vec3;

use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::crowd::{
    AnimationSet, AnimationSetError, Character, CharacterId, ClipId, Crowd, CrowdError,
    CrowdSettings, ExternalPose, LevelId, Placement, PoseError, PoseSlice,
};
use crate::graph::{EdgeMotion, Motion, MotionGraph, Playhead};
use crate::lod::{Levels, Switching};
use crate::math::F32x16;

/// A member of a [`Troupe`], in the order in which they came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MemberId(pub u32);

/// Who poses a member.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PosedBy {
    /// One by one, with all joints.
    Graph,
    /// Sixteen at a time, on the member's level.
    Crowd,
}

/// How a troupe is posed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TroupeSettings {
    /// The crowd's part, and the output of all.
    pub crowd: CrowdSettings,
    /// Members nearer to the camera than this are posed by the graph, metres.
    pub near: f32,
}

/// Characters of one graph.
pub struct Troupe<'a> {
    graph: &'a MotionGraph,
    levels: &'a Levels,
    switching: Switching,
    settings: TroupeSettings,
    animations: Arc<AnimationSet>,
    crowd: Crowd,
    members: Vec<Member>,
    /// Members that the graph poses, in the order of the output.
    singles: Vec<u32>,
    pose: Pose,
    single: ExternalPose,
    joints: Vec<JointTransform>,
}

struct Member {
    playhead: Playhead,
    /// What it plays before it walks on as is natural, and how far it is in it, seconds.
    motion: Motion,
    seconds: f32,
    /// The level, and how far it is on the way to the next.
    detail: f32,
    is_near: bool,
    character: CharacterId,
    posed_by: PosedBy,
    /// Its place among those that the graph poses.
    single: usize,
}

impl Member {
    fn is_playing(&self) -> bool {
        self.seconds < self.motion.duration()
    }
}

impl<'a> Troupe<'a> {
    /// Nobody yet. `levels` are of the graph's skeleton and clips.
    ///
    /// # Errors
    /// Levels that are not of this graph.
    pub fn new(
        graph: &'a MotionGraph,
        (levels, switching): (&'a Levels, Switching),
        settings: TroupeSettings,
    ) -> Result<Self, AnimationSetError> {
        let animations = AnimationSet::new(graph.skeleton(), graph.clips(), &levels.levels)?;
        let animations = Arc::new(animations);
        Ok(Self {
            graph,
            levels,
            switching,
            settings,
            crowd: Crowd::new(Arc::clone(&animations), settings.crowd),
            animations,
            members: Vec::new(),
            singles: Vec::new(),
            pose: Pose::default(),
            single: ExternalPose::default(),
            joints: Vec::new(),
        })
    }

    /// How many members.
    #[must_use]
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Whether nobody is there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// One more, at a place of the graph; near, until the troupe is [looked at](Troupe::look_from).
    ///
    /// # Errors
    /// A troupe that is full.
    pub fn add(&mut self, playhead: Playhead) -> Result<MemberId, CrowdError> {
        let character = self.crowd.add(&Character::default())?;
        self.crowd.deactivate(character)?;
        self.members.push(Member {
            playhead,
            motion: Motion::default(),
            seconds: 0.0,
            detail: 0.0,
            is_near: true,
            character,
            posed_by: PosedBy::Graph,
            single: 0,
        });
        Ok(MemberId(self.members.len() as u32 - 1))
    }

    /// Where a member is: for a query of [`crate::query`], among others.
    #[must_use]
    pub fn playhead(&self, id: MemberId) -> Option<Playhead> {
        Some(self.members.get(id.0 as usize)?.playhead)
    }

    /// The level that a member looks like, and, behind the point, how far it is on the way to the next.
    #[must_use]
    pub fn detail(&self, id: MemberId) -> Option<f32> {
        Some(self.members.get(id.0 as usize)?.detail)
    }

    /// Who poses a member from the next [`Troupe::pose`] on.
    #[must_use]
    pub fn posed_by(&self, id: MemberId) -> Option<PosedBy> {
        Some(self.members.get(id.0 as usize)?.posed_by)
    }

    /// Lets a member play a motion that starts where it is: the answer to an attack. Then it walks on.
    /// The graph poses it meanwhile. Nothing happens where there is no such member.
    pub fn play(&mut self, id: MemberId, motion: &Motion) {
        if let Some(member) = self.members.get_mut(id.0 as usize) {
            member.motion.clone_from(motion);
            member.seconds = 0.0;
        }
    }

    /// Time goes on, seconds: all walk on. What is negative or not finite is nothing.
    ///
    /// # Errors
    /// None but what the crowd cannot have: see [`Crowd::set`].
    pub fn advance(&mut self, seconds: f32) -> Result<(), CrowdError> {
        let seconds = if seconds.is_finite() {
            seconds.max(0.0)
        } else {
            0.0
        };
        self.crowd.advance(f64::from(seconds));
        for index in 0..self.members.len() {
            let member = &mut self.members[index];
            let edge = member.playhead.edge;
            if member.is_playing() {
                let end = member.motion.duration();
                let at = member.seconds + seconds;
                member.playhead = member.motion.playhead(self.graph, at.min(end));
                member.seconds = at;
                walk(self.graph, &mut member.playhead, (at - end).max(0.0));
            } else {
                walk(self.graph, &mut member.playhead, seconds);
            }
            let has_moved = edge != member.playhead.edge;
            self.cast(index, has_moved)?;
        }
        Ok(())
    }

    /// Chooses each member's level, and who poses it, by its distance from the camera.
    ///
    /// # Errors
    /// As [`Troupe::advance`].
    pub fn look_from(&mut self, eye: Vec3) -> Result<(), CrowdError> {
        for index in 0..self.members.len() {
            let member = &mut self.members[index];
            let Playhead {
                edge,
                frame,
                clip_to_world,
            } = member.playhead;
            let root = clip_to_world.point(self.graph.sample_edge_root(edge, frame));
            let distance = root.distance(eye);
            let choice = self
                .switching
                .choose(distance, Some(LevelId(member.detail as u16)));
            member.detail = f32::from(choice.level.0) + choice.blend;
            member.is_near = distance < self.settings.near;
            if member.posed_by == PosedBy::Crowd {
                self.crowd
                    .set_detail(member.character, choice.level, choice.blend)?;
            }
            self.cast(index, false)?;
        }
        Ok(())
    }

    /// Gives a member to whoever can pose it. `has_moved`: its edge is another one.
    fn cast(&mut self, index: usize, has_moved: bool) -> Result<(), CrowdError> {
        let member = &mut self.members[index];
        let edge = self.graph.edge(member.playhead.edge);
        let is_of_one_clip = edge.motion == EdgeMotion::Clip;
        let wanted = if is_of_one_clip && !member.is_near && !member.is_playing() {
            PosedBy::Crowd
        } else {
            PosedBy::Graph
        };
        let before = std::mem::replace(&mut member.posed_by, wanted);
        match (before, wanted) {
            (PosedBy::Crowd, PosedBy::Graph) => self.crowd.deactivate(member.character),
            (PosedBy::Graph, PosedBy::Crowd) => self.hand_over(index),
            (PosedBy::Crowd, PosedBy::Crowd) if has_moved => self.hand_over(index),
            _ => Ok(()),
        }
    }

    /// The crowd goes on where the playhead is.
    fn hand_over(&mut self, index: usize) -> Result<(), CrowdError> {
        let member = &self.members[index];
        let from = self.graph.node(self.graph.edge(member.playhead.edge).from);
        let clip = self.graph.clip(from.clip);
        // At a clip's very end the crowd would be at its start again.
        let last = (clip.frames() - 1) as f32 * (1.0 - f32::EPSILON);
        let frame = (from.frame as f32 + member.playhead.frame).min(last);
        let character = Character {
            clip: ClipId(from.clip.0 as u16),
            level: LevelId(member.detail as u16),
            blend: member.detail.fract(),
            time: frame / self.graph.frame_rate() as f32,
            speed: 1.0,
            placement: Placement {
                ground: member.playhead.clip_to_world,
                height: 0.0,
            },
            fade: None,
        };
        self.crowd.set(member.character, &character)
    }

    /// How many lines [`Troupe::pose`] writes now: the crowd's, then those of the members that the
    /// graph poses.
    pub fn lines(&mut self) -> usize {
        self.singles.clear();
        for (index, member) in self.members.iter_mut().enumerate() {
            if member.posed_by == PosedBy::Graph {
                member.single = self.singles.len();
                self.singles.push(index as u32);
            }
        }
        let joints = self.animations.joints(LevelId(0));
        let each = self.settings.crowd.output.group_len(joints);
        self.crowd.output_len() + self.singles.len().div_ceil(F32x16::LANES) * each
    }

    /// Poses everybody into the beginning of `out`, in the crowd's output.
    ///
    /// # Errors
    /// Memory that is too small.
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), PoseError> {
        let (needed, found) = (self.lines(), out.len());
        if found < needed {
            return Err(PoseError::TooSmall { needed, found });
        }
        self.crowd.pose(out)?;
        let first_line = self.crowd.output_len();
        for (single, &index) in self.singles.iter().enumerate() {
            let member = &self.members[index as usize];
            member.playhead.pose(self.graph, &mut self.pose);
            if member.is_playing() {
                let motion = &member.motion;
                motion.apply_warp(self.graph, member.seconds, &mut self.pose);
            }
            forward_kinematics(self.graph.skeleton(), &self.pose, &mut self.joints);
            let kept = self.levels.levels[0].kept.iter();
            self.single.joints.clear();
            self.single
                .joints
                .extend(kept.map(|id| self.joints[id.index()]));
            let output = self.settings.crowd.output;
            let slice = self.animations.pose_slice(output, (first_line, single));
            self.animations
                .write(&mut self.single, member.detail, (&slice, out));
        }
        Ok(())
    }

    /// Where the pose of a member is, as [`Troupe::pose`] wrote it last.
    ///
    /// # Errors
    /// A member that is not there, or was added since.
    pub fn pose_slice(&mut self, id: MemberId) -> Result<PoseSlice, CrowdError> {
        let Some(member) = self.members.get(id.0 as usize) else {
            return Err(CrowdError::NoSuchCharacter {
                id: id.0,
                characters: self.members.len(),
            });
        };
        match member.posed_by {
            PosedBy::Crowd => self.crowd.pose_slice(member.character),
            PosedBy::Graph => {
                let first_line = self.crowd.output_len();
                let output = self.settings.crowd.output;
                Ok(self
                    .animations
                    .pose_slice(output, (first_line, member.single)))
            }
        }
    }
}

/// On by the natural way, so many seconds at rate 1.
fn walk(graph: &MotionGraph, playhead: &mut Playhead, seconds: f32) {
    playhead.frame += seconds * graph.frame_rate() as f32;
    loop {
        let edge = graph.edge(playhead.edge);
        let over = playhead.frame - edge.frames as f32;
        if over < 0.0 {
            return;
        }
        *playhead = Playhead {
            edge: graph.natural_edge(edge.to),
            frame: over,
            clip_to_world: playhead.next_clip_to_world(graph),
        };
    }
}
