use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::crowd_poses::CrowdPoses;
use super::error::CharacterError;
use super::settings::CharacterSettings;
use super::steer::Steering;
use crate::anim::Clip;
use crate::graph::MotionGraph;
use crate::maps::BakedGraph;

/// Identifies a kind of character of [`Characters`](super::Characters): a graph with settings. The default is the first one.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct KindId(pub u16);

impl KindId {
    /// The kind, which is one of `kinds`.
    pub(super) fn of(self, kinds: &[Kind]) -> &Kind {
        &kinds[usize::from(self.0)]
    }

    /// The kind, if it exists.
    pub(super) fn find_mut(self, kinds: &mut [Kind]) -> Result<&mut Kind, CharacterError> {
        let kind = kinds.get_mut(usize::from(self.0));
        kind.ok_or(CharacterError::NoSuchKind(self))
    }
}

/// A kind of character, with what is computed once.
pub(super) struct Kind {
    pub id: KindId,
    pub baked: Arc<BakedGraph>,
    /// Checksum that identifies the graph in saved games.
    pub fingerprint: u32,
    pub settings: CharacterSettings,
    pub steering: Steering,
    pub crowd: Option<CrowdPoses>,
    /// The lowest and the highest root of the clips, in metres.
    pub roots: [f32; 2],
}

impl Kind {
    pub(super) fn new(
        id: KindId,
        baked: Arc<BakedGraph>,
        settings: CharacterSettings,
    ) -> Result<Self, CharacterError> {
        settings.check()?;
        let steering = Steering::new(&baked);
        if steering.len() == 0 {
            return Err(CharacterError::NothingToPlay);
        }
        baked.prepare();
        let clips = baked.graph().clips().iter();
        let heights = clips.flat_map(|clip| (0..clip.frames()).map(|frame| clip.root(frame).y));
        let roots = heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], y| {
            [low.min(y), high.max(y)]
        });
        Ok(Self {
            id,
            fingerprint: fingerprint(baked.graph()),
            baked,
            settings,
            steering,
            crowd: None,
            roots,
        })
    }
}

/// A number that differs between graphs: of the names of joints and clips, and of the edges.
fn fingerprint(graph: &MotionGraph) -> u32 {
    let mut hash = crc32fast::Hasher::new();
    let joints = graph.skeleton().joints().iter().map(|joint| &*joint.name);
    for name in joints.chain(graph.clips().iter().map(Clip::name)) {
        hash.update(name.as_bytes());
        hash.update(b"\n");
    }
    for edge in graph.edges() {
        for number in [edge.from.0, edge.to.0, edge.frames] {
            hash.update(&number.to_le_bytes());
        }
    }
    hash.finalize()
}
