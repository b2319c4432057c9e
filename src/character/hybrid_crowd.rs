use std::sync::Arc;

use glam::Vec3;

use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::crowd::{
    AnimationSet, Character, Crowd, CrowdError, CrowdSettings, ExternalGroups, ExternalPose,
    ExternalTarget, LevelId, MemberId, Placement, PoseSlice,
};
use crate::graph::{EdgeMotion, Motion, MotionGraph, Playhead};
use crate::lod::{Levels, Switching};
use crate::math::F32x16;

/// The implementation that poses a member.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PosedBy {
    /// The motion graph, one by one and with all joints.
    Graph,
    /// The crowd's kernels, sixteen at a time and on the member's level of detail.
    Crowd,
}

/// Settings of a hybrid crowd.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HybridCrowdSettings {
    /// Settings of the crowd. Its output format holds for all members.
    pub crowd: CrowdSettings,
    /// Distance from the camera below which the graph poses members, metres. Default 0.
    pub near: f32,
    /// Choice of the level of detail by distance.
    pub switching: Switching,
}

/// Characters of one graph, each posed by the graph or by the crowd.
pub struct HybridCrowd<'a> {
    graph: &'a MotionGraph,
    levels: &'a Levels,
    settings: HybridCrowdSettings,
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
    /// Motion that the member plays before it goes on along natural edges.
    motion: Motion,
    /// Time since the motion's start, seconds.
    seconds: f32,
    /// Level of detail; the fraction blends to the next level.
    detail: f32,
    is_near: bool,
    character: MemberId,
    posed_by: PosedBy,
    /// Position among the members that the graph poses.
    single: usize,
}

impl Member {
    fn is_playing(&self) -> bool {
        self.seconds < self.motion.duration()
    }
}

impl<'a> HybridCrowd<'a> {
    /// A crowd without members. `levels` are built from the graph's skeleton and clips.
    ///
    /// # Errors
    /// Levels of another skeleton or other clips.
    pub fn new(
        graph: &'a MotionGraph,
        levels: &'a Levels,
        settings: HybridCrowdSettings,
    ) -> Result<Self, CrowdError> {
        let animations = AnimationSet::new(graph.skeleton(), graph.clips(), &levels.levels)?;
        let animations = Arc::new(animations);
        Ok(Self {
            graph,
            levels,
            crowd: Crowd::new(Arc::clone(&animations), settings.crowd),
            settings,
            animations,
            members: Vec::new(),
            singles: Vec::new(),
            pose: Pose::default(),
            single: ExternalPose::default(),
            joints: Vec::new(),
        })
    }

    /// Number of members.
    #[must_use]
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Whether there are no members.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Adds a member at a position of the graph. Members are numbered in the order in which they are added, from 0. The graph poses it
    /// until [`HybridCrowd::look_from`] chooses its level.
    ///
    /// # Errors
    /// A crowd that is full.
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

    /// The position of a member in graph and world, for example for a query.
    #[must_use]
    pub fn playhead(&self, id: MemberId) -> Option<Playhead> {
        Some(self.members.get(id.0 as usize)?.playhead)
    }

    /// The level of detail of a member. The fraction blends to the next level.
    #[must_use]
    pub fn detail(&self, id: MemberId) -> Option<f32> {
        Some(self.members.get(id.0 as usize)?.detail)
    }

    /// Whether the graph poses a member in the next [`HybridCrowd::pose`], by itself and with all joints. Otherwise the crowd's
    /// kernels pose it on its level of detail.
    #[must_use]
    pub fn is_posed_by_graph(&self, id: MemberId) -> Option<bool> {
        Some(self.members.get(id.0 as usize)?.posed_by == PosedBy::Graph)
    }

    /// Starts a motion at the member's position, such as the answer to an attack. The graph poses the member while it plays; then the
    /// member goes on along natural edges. An unknown member is ignored.
    pub fn play(&mut self, id: MemberId, motion: &Motion) {
        if let Some(member) = self.members.get_mut(id.0 as usize) {
            member.motion.clone_from(motion);
            member.seconds = 0.0;
        }
    }

    /// Advances all members by a time, seconds. A negative or infinite time counts as 0.
    ///
    /// # Errors
    /// Those of [`Crowd::set`].
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
            self.assign_poser(index, has_moved)?;
        }
        Ok(())
    }

    /// Chooses each member's level of detail, and the implementation that poses it, by the distance from the camera.
    ///
    /// # Errors
    /// Those of [`Crowd::set`].
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
                .settings
                .switching
                .choose(distance, Some(LevelId(member.detail as u16)));
            member.detail = f32::from(choice.level.0) + choice.blend;
            member.is_near = distance < self.settings.near;
            if member.posed_by == PosedBy::Crowd {
                self.crowd
                    .set_detail(member.character, choice.level, choice.blend)?;
            }
            self.assign_poser(index, false)?;
        }
        Ok(())
    }

    /// Chooses the implementation that poses a member. `has_moved`: the member is on another edge.
    fn assign_poser(&mut self, index: usize, has_moved: bool) -> Result<(), CrowdError> {
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

    /// Sets the crowd's character to the member's playhead.
    fn hand_over(&mut self, index: usize) -> Result<(), CrowdError> {
        let member = &self.members[index];
        let from = self.graph.node(self.graph.edge(member.playhead.edge).from);
        let clip = self.graph.clip(from.clip);
        // The crowd wraps to the start of a clip at its very end.
        let last = (clip.frames() - 1) as f32 * (1.0 - f32::EPSILON);
        let frame = (from.frame as f32 + member.playhead.frame).min(last);
        let character = Character {
            clip: from.clip,
            level: LevelId(member.detail as u16),
            blend: member.detail.fract(),
            time: frame / self.graph.frame_rate() as f32,
            speed: 1.0,
            placement: Placement {
                ground: member.playhead.clip_to_world,
                height: 0.0,
            },
            fade: None,
            layer: None,
        };
        self.crowd.set(member.character, &character)
    }

    /// Number of vectors that [`HybridCrowd::pose`] writes: those of the crowd, then those of the members that the graph poses.
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

    /// Writes the poses of all members to the beginning of `out`, in the crowd's output format.
    ///
    /// # Errors
    /// An output that is too small.
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), CrowdError> {
        let (needed, found) = (self.lines(), out.len());
        if found < needed {
            return Err(CrowdError::TooSmall { needed, found });
        }
        self.crowd.pose(out)?;
        let first_line = self.crowd.output_len();
        for (single, &index) in self.singles.iter().enumerate() {
            let member = &self.members[index as usize];
            match member.is_playing() {
                true => { &member.motion }.sample(self.graph, member.seconds, &mut self.pose),
                false => member.playhead.pose(self.graph, &mut self.pose),
            }
            forward_kinematics(self.graph.skeleton(), &self.pose, &mut self.joints);
            let kept = self.levels.levels[0].kept.iter();
            self.single.joints.clear();
            self.single
                .joints
                .extend(kept.map(|id| self.joints[id.index()]));
            let output = self.settings.crowd.output;
            let groups = ExternalGroups {
                output,
                offset: first_line,
            };
            let target = ExternalTarget {
                slice: self.animations.external_slice(groups, single),
                out,
                detail: member.detail,
            };
            self.animations.write_external(&mut self.single, target);
        }
        Ok(())
    }

    /// The place of a member's pose in the output of the last [`HybridCrowd::pose`].
    ///
    /// # Errors
    /// A member that is unknown, or was added since.
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
                let groups = ExternalGroups {
                    output,
                    offset: first_line,
                };
                Ok(self.animations.external_slice(groups, member.single))
            }
        }
    }
}

/// Advances a playhead along natural edges by a time at rate 1, seconds.
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
