//! A few clips and events, for tests.

use crate::anim::{Clip, ClipDesc, EventKind, Joint, JointId, JointKind, Skeleton};
use crate::graph::ClipId;
use crate::graph::build::align::Aligner;
use crate::graph::build::candidates::{Lengths, LinkSource};
use crate::graph::build::nearest::Candidates;
use crate::graph::motion_graph::GraphEvent;
use crate::graph::search::cloud::PointCloud;
use crate::graph::search::windows::Windows;
use crate::graph::settings::{GraphSettings, LinkSettings};
use crate::graph::watch::Unwatched;
use glam::{Quat, Vec3};

pub(crate) const CLIPS: u32 = 5;
pub(crate) const FRAMES: u32 = 150;

fn skeleton() -> Skeleton {
    let joint = |index: u16| Joint {
        name: format!("joint {index}"),
        parent: index.checked_sub(1).map(JointId),
        offset: Vec3::new(0.0, 0.4, 0.1),
        kind: JointKind::Moving,
    };
    Skeleton::new((0..4).map(joint).collect()).unwrap()
}

fn clip(skeleton: &Skeleton, seed: u32) -> Clip {
    let phase = |joint: u32, frame: u32| {
        let pace = 0.05 + 0.02 * ((seed + joint) % 3) as f32;
        pace * frame as f32 + seed as f32
    };
    let rotation = |joint: u32, frame: u32| {
        Quat::from_rotation_x(0.5 * phase(joint, frame).sin())
            * Quat::from_rotation_z(0.4 * phase(joint + 1, frame).cos())
    };
    let desc = ClipDesc {
        name: format!("clip {seed}"),
        frame_rate: 30.0,
        roots: (0..FRAMES)
            .map(|frame| Vec3::new(0.01 * frame as f32, 1.0, 0.0))
            .collect(),
        rotations: (0..FRAMES)
            .flat_map(|frame| (0..4).map(move |joint| rotation(joint, frame)))
            .collect(),
        translations: Vec::new(),
    };
    Clip::new(skeleton, desc).unwrap()
}

/// Events with enough free frames beside them for windows of full length, and events with fewer.
fn events() -> Vec<GraphEvent> {
    let event = |(clip, [first, last]): (u32, [u32; 2])| GraphEvent {
        clip: ClipId(clip),
        kind: EventKind::Evasion,
        first,
        last,
        joints: Vec::new(),
    };
    [
        (0, [40, 60]),
        (1, [30, 50]),
        (1, [57, 70]),
        (3, [80, 100]),
        (3, [106, 120]),
    ]
    .map(event)
    .to_vec()
}

/// Input of a search for links.
pub(crate) struct Scene {
    pub(crate) clips: Vec<Clip>,
    pub(crate) clouds: Vec<PointCloud>,
    pub(crate) windows: Vec<Windows>,
    pub(crate) events: Vec<GraphEvent>,
    pub(crate) settings: GraphSettings,
}

impl Scene {
    pub(crate) fn new() -> Self {
        let skeleton = skeleton();
        let clips: Vec<Clip> = (0..CLIPS).map(|seed| clip(&skeleton, seed)).collect();
        let clouds: Vec<PointCloud> = clips
            .iter()
            .map(|clip| PointCloud::new(&skeleton, clip, &[1.0; 4]))
            .collect();
        let settings = GraphSettings::default();
        let window = Lengths::new(&settings, &LinkSettings::default()).window;
        let windows = clouds.iter().map(|cloud| Windows::new(cloud, window));
        Self {
            windows: windows.collect(),
            events: events(),
            clips,
            clouds,
            settings,
        }
    }

    pub(crate) fn candidates(&self) -> Candidates<'_> {
        let source = LinkSource {
            clips: &self.clips,
            aligner: Aligner {
                clouds: &self.clouds,
                feet: None,
            },
            windows: &self.windows,
            events: &self.events,
            settings: &self.settings,
            watch: &Unwatched,
        };
        Candidates::new(
            source,
            Lengths::new(&self.settings, &LinkSettings::default()),
        )
    }
}
