//! A baked graph that is small enough to be spoilt thousands of times.

use std::sync::OnceLock;

use glam::Vec3;
use sabaki::anim::{Event, EventKind, JointId};
use sabaki::graph::{self, ClipSource, EdgeId, GraphSettings, Playhead};
use sabaki::internal::{ExactTest, MotionBody};
use sabaki::maps::{BakeSettings, BakedGraph, Baker, MapGrid, PathSettings, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request};

use super::clips::{small_skeleton, swinging_clip};

/// So loose that clips which have nothing to do with each other are joined.
pub fn small_graph() -> GraphSettings {
    GraphSettings {
        frame_rate: 15.0,
        threshold: 3.0,
        separation: 0.1,
        ..GraphSettings::default()
    }
}

/// Maps of few texels: what is spoilt is their form, not their contents.
pub fn small_maps() -> MapGrid {
    MapGrid {
        texel: 0.1,
        slab_height: 0.3,
        slices: 4,
        slice_seconds: 0.25,
        ..MapGrid::default()
    }
}

pub fn small() -> &'static BakedGraph {
    static BAKED: OnceLock<BakedGraph> = OnceLock::new();
    BAKED.get_or_init(|| {
        let skeleton = small_skeleton();
        let clips = [0.3, 0.4, 1.1].map(|seed| swinging_clip(&skeleton, 150, seed));
        let event = |clip, kind, start, joints| Event {
            clip,
            kind,
            start,
            end: start + 0.4,
            joints,
        };
        let events = [
            event(0, EventKind::Evasion, 1.8, Vec::new()),
            event(1, EventKind::Attack, 2.2, vec![JointId(8)]),
        ];
        let source = ClipSource {
            skeleton: &skeleton,
            clips: &clips,
            events: &events,
        };
        let graph = graph::build(source, &small_graph()).unwrap().0;
        let settings = BakeSettings {
            maps: small_maps(),
            paths: PathSettings {
                most: 60,
                ..PathSettings::default()
            },
            ..BakeSettings::default()
        };
        let baked = Baker::new(graph, settings).unwrap();
        let baked = baked.finish_on_cpu().unwrap();
        assert_eq!(baked.evasions().len(), 1);
        baked
    })
}

/// Everything that a program does with a graph that it has read.
pub fn use_it(baked: &BakedGraph) {
    let settings = QuerySettings::default();
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let key = |t, x: f32| SphereKey {
        t,
        center: Vec3::new(x, 0.9, 0.0),
        radius: 0.1,
    };
    let attack = Attack::new(vec![vec![key(0.9, -1.0), key(1.1, 1.0)]]).unwrap();
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    Query::new(baked, &settings).answer(Request::new(playhead, &attack), &mut context, &mut answer);
    let test = ExactTest::new(baked, &attack);
    let _ = test.on_motion(&answer.motion, &mut MotionBody::default());
    let _ = (baked.responsive_share(1.0), baked.graph().seconds_kept());
    let _ = baked.atlas().bytes();
    for event in baked.graph().events() {
        let _ = baked.graph().describe_event(event);
    }
}
