//! Poses of all characters at once, in one buffer: those that the crowd poses, then those that the graph poses.

use std::sync::{Mutex, PoisonError};

use glam::Vec3;

use super::characters::Characters;
use super::crowd_poses::{CrowdPoseSettings, CrowdPoses, Member, Poser, Seen};
use super::error::CharacterError;
use super::event::CharacterId;
use super::kind::{Kind, KindId};
use super::slot::{Blend, Slot};
use super::state::CharacterState;
use super::world::Worker;
use crate::anim::forward_kinematics;
use crate::crowd::{AnimationSet, CrowdError, Layout, MemberId, PoseSlice};
use crate::graph::{BESIDE, MotionGraph};
use crate::lod::Levels;
use crate::math::F32x16;
use crate::math::parallel::lock;

impl Characters {
    /// Makes [`Characters::pose_all`] possible for a kind. `levels` are built from its graph's skeleton and clips.
    ///
    /// # Errors
    /// An unknown kind; levels of another skeleton or other clips.
    pub fn use_crowd(
        &mut self,
        kind: KindId,
        levels: &Levels,
        settings: CrowdPoseSettings,
    ) -> Result<(), CharacterError> {
        let kind = kind.find_mut(&mut self.kinds)?;
        kind.crowd = Some(CrowdPoses::new(kind.baked.graph(), levels, settings)?);
        Ok(())
    }

    /// Length of a buffer that [`Characters::pose_all`] can always write to, while no more than so many characters, of all kinds, have existed
    /// at once. 0 without [`Characters::use_crowd`].
    pub fn max_output_len(&self, kind: KindId, characters: usize) -> usize {
        let crowd = self.crowd(kind);
        crowd.map_or(0, |poses| poses.max_len(characters))
    }

    /// The levels and joints of what [`Characters::pose_all`] writes. `None` without [`Characters::use_crowd`].
    pub fn animations(&self, kind: KindId) -> Option<&AnimationSet> {
        self.crowd(kind).map(|poses| &*poses.animations)
    }

    fn crowd(&self, kind: KindId) -> Option<&CrowdPoses> {
        self.known_kind(kind).ok()?.crowd.as_ref()
    }

    /// Writes the poses of all characters of a kind, as they are after the last step, to `out`, in the crowd's output format. Levels are chosen
    /// by the distance from the camera at `eye`, in metres. In [`Layout::Instances`] the row of a character is that of its
    /// [`CharacterId::index`].
    ///
    /// # Errors
    /// An unknown kind; no [`Characters::use_crowd`] before; an output that is too small; more characters than a crowd can have.
    pub fn pose_all(
        &mut self,
        kind: KindId,
        eye: Vec3,
        out: &mut [F32x16],
    ) -> Result<(), CharacterError> {
        let _span = tracing::trace_span!("characters: pose all").entered();
        let Kind { baked, crowd, .. } = kind.find_mut(&mut self.kinds)?;
        let poses = crowd.as_mut().ok_or(CharacterError::NoCrowd)?;
        let graph = baked.graph();
        poses.grow(self.slots.len())?;
        poses.singles.clear();
        poses.crowd.set_time(self.now);
        for (index, slot) in self.slots.iter_mut().enumerate() {
            let slot = slot.get_mut().unwrap_or_else(PoisonError::into_inner);
            if slot.kind != kind {
                poses.choose(index, None)?;
                continue;
            }
            let state = slot.state.as_deref();
            let played = state.map(|state| (&state.playing.motion, state.playing.seconds));
            let age = played.and_then(|(motion, seconds)| motion.blend_age(seconds));
            let blend = age.map(|age| slot.known_blend(age, self.now));
            let seen = slot.state.as_deref().map(|state| {
                let (motion, seconds) = (&state.playing.motion, state.playing.seconds);
                let blended = |blend: Blend| {
                    let reach = motion.blend_reach(graph, seconds, &mut poses.reaches);
                    reach.map_or(0.0, |reach| blend.moved_at(reach))
                };
                Seen {
                    graph,
                    state,
                    playhead: motion.playhead(graph, seconds),
                    distance: (motion.root(graph, seconds) + Vec3::Y * state.height).distance(eye),
                    left_out: match blend {
                        _ if motion.is_bent(seconds) || !state.additive.is_empty() => f32::INFINITY,
                        None => 0.0,
                        Some(blend) => blend.map_or(f32::INFINITY, blended),
                    },
                    now: self.now,
                }
            });
            poses.choose(index, seen.as_ref())?;
        }
        poses.crowd_len = poses.crowd.output_len();
        let needed = poses.len_with(poses.crowd_len, poses.singles.len());
        if out.len() < needed {
            let found = out.len();
            return Err(CrowdError::TooSmall { needed, found }.into());
        }
        poses.crowd.pose(out)?;
        let by_graph = ByGraph {
            graph,
            poses,
            slots: &self.slots,
            now: self.now,
        };
        let groups = Mutex::new(by_graph.groups(out));
        let workers = &self.workers;
        self.pool.run(&|thread: usize| {
            let mut worker = lock(&workers[thread]);
            loop {
                // The lock is held for this statement alone.
                let next = lock(&groups).next();
                let Some((singles, lines)) = next else {
                    return;
                };
                by_graph.write(singles, lines, &mut worker);
            }
        });
        Ok(())
    }

    /// The place of a character's pose in the output of the last [`Characters::pose_all`].
    ///
    /// # Errors
    /// An unknown character; one that was not posed.
    pub fn pose_slice(&self, id: CharacterId) -> Result<PoseSlice, CharacterError> {
        let (poses, member) = self.member(id)?;
        match member.poser {
            Poser::Nothing => Err(CharacterError::NotPosed),
            Poser::Graph(single) => Ok(poses.slice(id.index as usize, single)),
            Poser::Crowd(_) => Ok(poses.crowd.pose_slice(MemberId(id.index))?),
        }
    }

    /// The level of detail on which a character was posed. The fraction blends to the next level.
    ///
    /// # Errors
    /// The errors of [`Characters::pose_slice`].
    pub fn detail(&self, id: CharacterId) -> Result<f32, CharacterError> {
        Ok(self.member(id)?.1.detail)
    }

    /// Whether the crowd's kernels posed a character in the last [`Characters::pose_all`], and not the graph.
    ///
    /// # Errors
    /// The errors of [`Characters::pose_slice`].
    pub fn is_posed_by_crowd(&self, id: CharacterId) -> Result<bool, CharacterError> {
        Ok(matches!(self.member(id)?.1.poser, Poser::Crowd(_)))
    }

    fn member(&self, id: CharacterId) -> Result<(&CrowdPoses, Member), CharacterError> {
        let poses = self.crowd(self.kind(id)?).ok_or(CharacterError::NoCrowd)?;
        let member = poses.members.get(id.index as usize);
        Ok((poses, *member.ok_or(CharacterError::NotPosed)?))
    }
}

/// The characters that the graph poses.
struct ByGraph<'a> {
    graph: &'a MotionGraph,
    poses: &'a CrowdPoses,
    slots: &'a [Mutex<Slot>],
    /// Time of the characters, in seconds.
    now: f64,
}

impl<'a> ByGraph<'a> {
    /// Characters that are written together, each time with the lines that are theirs.
    fn groups<'b>(
        &self,
        out: &'b mut [F32x16],
    ) -> impl Iterator<Item = (&'a [u32], &'b mut [F32x16])> + use<'a, 'b> {
        let (members, lines) = self.poses.group();
        let is_by_row = self.poses.settings.crowd.output.layout == Layout::Instances;
        let first = if is_by_row { 0 } else { self.poses.crowd_len };
        let mut chunks = out[first..].chunks_exact_mut(lines);
        let mut next_row = 0;
        self.poses.singles.chunks(members).filter_map(move |group| {
            let skipped = if is_by_row {
                let row = group[0] as usize;
                row - std::mem::replace(&mut next_row, row + 1)
            } else {
                0
            };
            Some((group, chunks.nth(skipped)?))
        })
    }

    fn write(&self, singles: &[u32], lines: &mut [F32x16], worker: &mut Worker) {
        let output = self.poses.settings.crowd.output;
        let animations = &self.poses.animations;
        for (lane, &index) in singles.iter().enumerate() {
            let mut slot = lock(&self.slots[index as usize]);
            let Some(state) = slot.state.as_deref() else {
                continue;
            };
            let (motion, seconds) = (&state.playing.motion, state.playing.seconds);
            motion.sample(self.graph, seconds, &mut worker.pose);
            state.additive.apply(&mut worker.pose);
            worker.pose.root.y += state.height;
            forward_kinematics(self.graph.skeleton(), &worker.pose, &mut worker.joints);
            let reach = motion.blend_reach(self.graph, seconds, &mut worker.reaches);
            if let Some((age, reach)) = motion.blend_age(seconds).zip(reach) {
                slot.blend = Some(Blend {
                    age,
                    now: self.now,
                    moved: self.blended_by(state, worker),
                    reach,
                });
            }
            let kept = self.poses.kept.iter();
            worker.external.joints.clear();
            let joints = &worker.joints;
            let kept = kept.map(|id| joints[id.index()]);
            worker.external.joints.extend(kept);
            let slice = animations.external_slice(output, 0, lane);
            let detail = self.poses.members[index as usize].detail;
            animations.write_external(&mut worker.external, detail, slice, lines);
        }
    }

    /// How far the farthest point [beside](BESIDE) a joint is from where it is without a blend, in metres.
    fn blended_by(&self, state: &CharacterState, worker: &mut Worker) -> f32 {
        let (motion, seconds) = (&state.playing.motion, state.playing.seconds);
        let (pose, joints) = (&mut worker.unblended, &mut worker.unblended_joints);
        motion.playhead(self.graph, seconds).pose(self.graph, pose);
        state.additive.apply(pose);
        pose.root.y += state.height;
        forward_kinematics(self.graph.skeleton(), pose, joints);
        let pairs = worker.joints.iter().zip(&*joints);
        let apart = pairs.map(|(a, b)| {
            let turned = 2.0 * (a.rotation * b.rotation.conjugate()).xyz().length();
            a.translation.distance(b.translation) + turned * BESIDE
        });
        apart.fold(0.0, f32::max)
    }
}
