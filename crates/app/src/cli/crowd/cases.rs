//! What is measured.

use sabaki::crowd::{CrowdSettings, Layout};
use sabaki::math::{Isa, thread_count};

use super::Args;

/// The level of each character.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Lod {
    /// All joints.
    Off,
    /// One level for all characters.
    Level(u16),
    /// Levels by the distance from the head of the column.
    Distance,
}

/// A case that is measured.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Case {
    pub(super) what: TimedWork,
    pub(super) lod: Lod,
    pub(super) layout: Layout,
    pub(super) isa: Isa,
    pub(super) threads: usize,
    /// Clips that are cut from the motions, without levels; `None`: the clips as they are.
    pub(super) cut: Option<usize>,
    pub(super) mixed: Mixed,
    /// Frames for which the coarser half of the levels keeps a pose after its own.
    pub(super) hold: u16,
    /// Threads that are always busy beside: one for each core but one.
    pub(super) busy: usize,
}

/// Numbers of frames of hold that are measured.
const HOLDS: [u16; 2] = [1, 3];

/// Clips that are mixed into each character's own.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Mixed {
    Nothing,
    /// A cross-fade to a second clip.
    Fade,
    /// An additive layer.
    Layer,
}

/// The work that a measured time contains.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum TimedWork {
    /// Poses of characters whose levels are known.
    Pose,
    /// The whole frame: levels by a camera at this speed, in metres per second, time and poses.
    Frame(Motion),
}

/// How the camera moves into the column.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Motion {
    Still,
    Walk,
    Run,
    /// The camera jumps between the head of the column and its middle, twice a second.
    Jump,
}

/// Numbers of clips that are measured against each other, each clip [`CUT_SECONDS`] long.
pub(super) const CUTS: [usize; 3] = [1, 8, 200];
pub(super) const CUT_SECONDS: f64 = 2.0;

impl Args {
    /// Poses without levels and by distance, and frames, on all instruction sets and numbers of threads; the rest on the
    /// widest registers and one thread.
    pub(super) fn cases(&self, levels: usize) -> Vec<Case> {
        let most = thread_count(self.threads as usize).min(CrowdSettings::MOST_THREADS);
        let doubled = std::iter::successors(Some(1), |&threads| Some(2 * threads));
        let mut threads: Vec<usize> = doubled.take_while(|&threads| threads < most).collect();
        threads.push(most);
        let plain = Case::plain();
        let mut cases = Vec::new();
        let frame = |motion| (TimedWork::Frame(motion), Lod::Distance);
        for (what, lod) in [
            (TimedWork::Pose, Lod::Off),
            (TimedWork::Pose, Lod::Distance),
            frame(Motion::Still),
            frame(Motion::Walk),
            frame(Motion::Run),
            frame(Motion::Jump),
        ] {
            for isa in Isa::available() {
                let all = threads.iter().map(|&threads| Case {
                    what,
                    lod,
                    isa,
                    threads,
                    ..plain
                });
                cases.extend(all);
            }
        }
        for motion in [Motion::Still, Motion::Walk, Motion::Run] {
            let (what, lod) = frame(motion);
            cases.extend(HOLDS.map(|hold| Case {
                what,
                lod,
                hold,
                ..plain
            }));
        }
        cases.extend([Layout::Rows, Layout::Instances].map(|layout| Case { layout, ..plain }));
        cases.extend(CUTS.map(|clips| Case {
            cut: Some(clips),
            ..plain
        }));
        cases.extend([Mixed::Fade, Mixed::Layer].map(|mixed| Case {
            cut: Some(CUTS[0]),
            mixed,
            ..plain
        }));
        if most > 1 {
            // One thread and all of them, while all cores but one are taken.
            cases.extend([1, most].map(|threads| Case {
                threads,
                busy: most - 1,
                ..plain
            }));
        }
        let each = (1..levels).map(|level| Case {
            lod: Lod::Level(level as u16),
            ..plain
        });
        cases.extend(each);
        cases
    }
}

impl Case {
    /// Poses of all joints in blocks, on one thread and the widest registers.
    pub(super) fn plain() -> Self {
        Self {
            what: TimedWork::Pose,
            lod: Lod::Off,
            layout: Layout::Blocks,
            isa: Isa::best(),
            threads: 1,
            cut: None,
            mixed: Mixed::Nothing,
            hold: 0,
            busy: 0,
        }
    }
}

impl Motion {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Walk => "walk",
            Self::Run => "run",
            Self::Jump => "jump",
        }
    }

    /// Distance of the camera into the column after `seconds`, in metres.
    pub(super) fn walked(self, seconds: f32) -> f32 {
        match self {
            Self::Still => 0.0,
            Self::Walk => 1.5 * seconds,
            Self::Run => 5.0 * seconds,
            Self::Jump => 50.0 * (2.0 * seconds).fract().round(),
        }
    }
}

impl Mixed {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Fade => "fade",
            Self::Layer => "layer",
        }
    }
}

impl TimedWork {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::Frame(_) => "frame",
        }
    }

    pub(super) fn camera(self) -> &'static str {
        match self {
            Self::Pose => Motion::Still.name(),
            Self::Frame(motion) => motion.name(),
        }
    }
}

impl Lod {
    pub(super) fn name(self) -> String {
        match self {
            Self::Off => "off".to_owned(),
            Self::Level(level) => level.to_string(),
            Self::Distance => "distance".to_owned(),
        }
    }
}
