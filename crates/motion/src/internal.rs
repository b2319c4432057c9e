//! Items that the packages of this workspace share and a host never names: legs and bends, lanes, threads.
//!
//! They are not covered by semantic versioning: a patch version may change any of them.
pub use crate::anim::facing::Facing;
pub use crate::anim::ik::{LegGoal, free_distance};
pub use crate::anim::knee::{Knee, KneeLimit};
pub use crate::anim::leg::{Chain, Leg};
pub use crate::anim::limbs::Limbs;
pub use crate::anim::moment::Moment;
pub use crate::anim::packed::{PackedMoment, scatter};
pub use crate::anim::pose::slerp;
pub use crate::anim::rig::{Part, Rig, RiggedSkeleton};
pub use crate::anim::rows::{LANES, Rows, Slerp, unpack};
pub use crate::anim::warp::{Bend, Envelope, Warp};
pub use crate::crowd::external_pose::{ExternalGroups, ExternalPose, ExternalTarget};
pub use crate::lod::blend::{Blend, affine};
pub use crate::lod::level::Attachment;
pub use crate::lod::mass::BoneShape;
pub use crate::lod::motion::{LevelMotion, LevelTrack, Translations};
pub use crate::lod::settings::{Branch, Carrier, Flexion, Inertia};
pub use crate::lod::switching::Band;
pub use crate::math::code_rows::{RowKernel, RowReader};
pub use crate::math::isa::{Lookup, Words};
pub use crate::math::parallel::{both, each, fill, lock};
pub use crate::math::smooth_step::smooth_step;
pub use crate::math::sorted_indices::{sort_rarely, sorted_indices};
pub use crate::math::worker_pool::WorkerPool;

/// Lists of values of one size as bytes. For `#[serde(with = "byte_list")]`.
pub mod byte_list {
    pub use crate::math::byte_list::{Bytes, deserialize, serialize};
}
