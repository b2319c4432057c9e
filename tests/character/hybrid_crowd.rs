//! Promise: a member of a crowd is where its playhead is, whoever poses it, and looks like its
//! level; nothing jumps where it goes from the graph to the crowd or back.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_testing as common;

use common::crowd::{forms, joint_of};
use common::random::Random;
use common::small::small;
use glam::{Affine3A, DVec3, Vec3};
use sabaki::anim::{Pose, forward_kinematics};
use sabaki::character::{HybridCrowd, HybridCrowdSettings};
use sabaki::crowd::{CrowdSettings, Form, MemberId};
use sabaki::graph::{EdgeId, Motion, MotionGraph, Playhead};
use sabaki::internal::affine;
use sabaki::lod::{LevelId, LevelSettings, Levels, Rule, SwitchSettings, Switching};
use sabaki::math::{F32x16, Rigid2};

/// Metres.
const NEAR: f64 = 4e-4;

struct Scene {
    graph: &'static MotionGraph,
    levels: Levels,
    switching: Switching,
}

/// A crowd and the lines that it has written.
struct Posed<'a, 'b> {
    crowd: &'a mut HybridCrowd<'b>,
    out: &'a [F32x16],
}

impl Scene {
    fn new() -> Self {
        let graph = small().graph();
        let settings = LevelSettings::default();
        let levels = Levels::build(graph.skeleton(), graph.clips(), &settings).unwrap();
        let settings = SwitchSettings {
            rule: Rule::Energy { furthest: 12.0 },
            ..SwitchSettings::default()
        };
        let switching = Switching::new(&levels, &settings).unwrap();
        assert!(
            switching.bands().len() > 2 && switching.furthest() > 4.0,
            "{switching:?}"
        );
        Self {
            graph,
            levels,
            switching,
        }
    }

    fn crowd(&self, crowd: CrowdSettings) -> HybridCrowd<'_> {
        let settings = HybridCrowdSettings {
            crowd,
            near: 3.0,
            switching: self.switching.clone(),
        };
        HybridCrowd::new(self.graph, &self.levels, settings).unwrap()
    }

    /// Everywhere in the graph and on the ground.
    fn fill(&self, crowd: &mut HybridCrowd<'_>, count: usize) -> Vec<MemberId> {
        let mut random = Random::new(9);
        let mut number = |most: f32| most * (random.next() >> 40) as f32 / (1 << 24) as f32;
        let edges = self.graph.edges().len() as f32;
        let members = (0..count).map(|_| {
            let edge = EdgeId((number(edges) as u32).min(edges as u32 - 1));
            let frame = number(self.graph.edge(edge).frames as f32);
            let world = Rigid2::new(number(6.0), number(30.0) - 15.0, number(30.0) - 15.0);
            let playhead = Playhead::at(self.graph, edge, frame, world);
            crowd.add(playhead).unwrap()
        });
        members.collect()
    }

    /// The joints of the finest level where a playhead has them, drawn on the level that a distance asks for.
    fn drawn(&self, playhead: Playhead, detail: f32) -> Vec<Affine3A> {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        playhead.pose(self.graph, &mut pose);
        forward_kinematics(self.graph.skeleton(), &pose, &mut joints);
        let exact: Vec<Affine3A> = joints.iter().map(affine).collect();
        let levels = &self.levels.levels;
        let (own, blend) = (detail as usize, detail.fract());
        let mut kept: Vec<Affine3A> = { levels[own].kept.iter() }
            .map(|id| exact[id.index()])
            .collect();
        if blend > 0.0 {
            self.levels
                .blend(LevelId(own as u16))
                .unwrap()
                .apply(blend, &mut kept);
        }
        let seats = levels[own].seats.iter();
        seats
            .map(|seat| kept[usize::from(seat.carrier)] * affine(&seat.offset))
            .collect()
    }

    /// How far the worst point of a member is from where it should be, and who posed it.
    fn check(&self, posed: Posed<'_, '_>, member: MemberId, form: Form) -> (f64, bool) {
        let Posed { crowd, out } = posed;
        let slice = crowd.pose_slice(member).unwrap();
        let detail = crowd.detail(member).unwrap();
        let drawn = self.drawn(crowd.playhead(member).unwrap(), detail);
        let level = &self.levels.levels[usize::from(slice.level.0)];
        let mut worst: f64 = 0.0;
        for (joint, id) in level.kept.iter().enumerate() {
            let found = joint_of(out, &slice, form, joint);
            for point in [DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1] {
                let expected = drawn[id.index()].transform_point3(point.as_vec3());
                let apart = found.transform_point3(point).distance(expected.as_dvec3());
                assert!(!apart.is_nan());
                worst = worst.max(apart);
            }
        }
        (worst, crowd.is_posed_by_graph(member).unwrap())
    }
}

#[test]
fn members_are_where_their_playheads_are() {
    let scene = Scene::new();
    for output in forms() {
        let settings = CrowdSettings {
            output,
            ..CrowdSettings::default()
        };
        let mut crowd = scene.crowd(settings);
        let members = scene.fill(&mut crowd, 150);
        let mut out = Vec::new();
        let mut seen = [0, 0];
        let mut changes = 0;
        let mut before = vec![true; members.len()];
        for frame in 0..90 {
            crowd.advance(1.0 / 30.0).unwrap();
            // A camera that flies across.
            let eye = Vec3::new(frame as f32 * 0.5 - 20.0, 1.6, 0.0);
            crowd.look_from(eye).unwrap();
            out.resize(crowd.lines(), F32x16::ZERO);
            crowd.pose(&mut out).unwrap();
            for (&member, before) in members.iter().zip(&mut before) {
                let posed = Posed {
                    crowd: &mut crowd,
                    out: &out,
                };
                let (worst, by_graph) = scene.check(posed, member, output.form);
                // Quaternions and matrices are blended differently.
                let blend = crowd.detail(member).unwrap().fract();
                if output.form == Form::Matrices || blend == 0.0 {
                    assert!(
                        worst < NEAR,
                        "{output:?}, frame {frame}: {worst} m, by the graph: {by_graph}"
                    );
                }
                seen[usize::from(!by_graph)] += 1;
                changes += usize::from(*before != by_graph);
                *before = by_graph;
            }
        }
        assert!(
            seen[0] > 500 && seen[1] > 5000 && changes > 300,
            "{seen:?}, {changes} changes"
        );
    }
}

#[test]
fn an_answer_is_played_and_then_the_member_walks_on() {
    let scene = Scene::new();
    let mut crowd = scene.crowd(CrowdSettings::default());
    let members = scene.fill(&mut crowd, 20);
    let far = Vec3::new(500.0, 0.0, 0.0);
    let mut out = Vec::new();
    crowd.look_from(far).unwrap();
    // Its own way, at another speed.
    let start = crowd.playhead(members[3]).unwrap();
    let graph = scene.graph;
    let step = |edge| sabaki::graph::MotionStep { edge, rate: 1.5 };
    let first = graph.natural_edge(start.next_node(graph));
    let second = graph.natural_edge(graph.edge(first).to);
    let motion = Motion::new(graph, start, &[step(first), step(second)]);
    crowd.play(members[3], &motion);
    let (mut seconds, mut by_graph, mut by_crowd) = (0.0f32, 0, 0);
    for _ in 0..200 {
        seconds += 0.02;
        crowd.advance(0.02).unwrap();
        crowd.look_from(far).unwrap();
        out.resize(crowd.lines(), F32x16::ZERO);
        crowd.pose(&mut out).unwrap();
        let posed = Posed {
            crowd: &mut crowd,
            out: &out,
        };
        let (worst, by) = scene.check(posed, members[3], Form::Matrices);
        assert!(worst < NEAR, "{worst} m after {seconds} s by {by:?}");
        if seconds < motion.duration() {
            let expected = motion.playhead(graph, seconds);
            let found = crowd.playhead(members[3]).unwrap();
            assert_eq!(found.edge, expected.edge);
            assert!((found.frame - expected.frame).abs() < 1e-3);
            by_graph += usize::from(by);
        } else {
            by_crowd += usize::from(!by);
        }
    }
    assert!(by_graph > 5 && by_crowd > 5, "{by_graph} {by_crowd}");
}

#[test]
fn strangers_and_small_memory_are_errors() {
    let scene = Scene::new();
    let mut crowd = scene.crowd(CrowdSettings::default());
    assert!(crowd.is_empty() && crowd.pose_slice(MemberId(0)).is_err());
    assert_eq!(crowd.playhead(MemberId(0)), None);
    scene.fill(&mut crowd, 3);
    assert_eq!(crowd.len(), 3);
    let needed = crowd.lines();
    assert!(crowd.pose(&mut vec![F32x16::ZERO; needed - 1]).is_err());
    crowd.pose(&mut vec![F32x16::ZERO; needed]).unwrap();
    let frozen = crowd.playhead(MemberId(0));
    crowd.advance(f32::NAN).unwrap();
    crowd.advance(-1.0).unwrap();
    assert_eq!(crowd.playhead(MemberId(0)), frozen);
}
