//! Planted feet are found. Transitions between clips that plant them differently do not let them
//! slide, and cause no jump, no stretched bone and no changed end pose.

mod legs;
mod walker;

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, ClipDesc, Joint, Leg, Pose, Skeleton};
use sabaki::graph::{self, ClipId, EdgeId, EdgeMotion, GraphSettings, MotionGraph, blend_weight};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::{embedded, embedded_graph};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::clips::{joints_of, source};
use sabaki_fixtures::with;

use crate::furthest;

type Sample = fn(&MotionGraph, EdgeId, f32, &mut Pose);
const BLENDED: Sample = MotionGraph::sample_blend;
const KEPT: Sample = MotionGraph::sample_edge;

fn transitions(graph: &MotionGraph) -> impl Iterator<Item = EdgeId> + '_ {
    let is_blend = |&id: &EdgeId| graph.edge(id).motion != EdgeMotion::Clip;
    graph.edge_ids().filter(is_blend)
}

fn places(graph: &MotionGraph, pose: &Pose) -> Vec<Vec3> {
    let joints = joints_of(graph.skeleton(), pose).into_iter();
    joints.map(|joint| joint.translation).collect()
}

fn places_at(graph: &MotionGraph, sample: Sample, edge: EdgeId, frame: f32) -> Vec<Vec3> {
    let mut pose = Pose::default();
    sample(graph, edge, frame, &mut pose);
    places(graph, &pose)
}

/// The places of a transition, so many times in each frame.
fn played(graph: &MotionGraph, sample: Sample, edge: EdgeId, steps: u32) -> Vec<Vec<Vec3>> {
    let frames = (0..=steps * graph.edge(edge).frames).map(|step| step as f32 / steps as f32);
    frames
        .map(|frame| places_at(graph, sample, edge, frame))
        .collect()
}

#[test]
fn a_walkers_plants_are_found_to_the_frame_or_two() {
    for (noise, off) in [(0.0, 1), (0.002, 2)] {
        let walk = walker::walk(noise);
        let graph = walk.graph();
        let clip = ClipId(0);
        assert_eq!(graph.feet().legs().len(), 2);
        for (leg, truth) in walk.plants.iter().enumerate() {
            let found = graph.feet().plants(clip, leg);
            let counts = (found.len(), truth.len());
            assert_eq!(counts.0, counts.1, "noise {noise}: {found:?} {truth:?}");
            for (found, truth) in found.iter().zip(truth) {
                let (first, last) = (found.first, found.last);
                let apart = first.abs_diff(truth[0]).max(last.abs_diff(truth[1]));
                assert!(apart <= off, "noise {noise}: {found:?}, truth {truth:?}");
            }
        }
    }
}

#[test]
fn plants_do_not_depend_on_size_place_or_side() {
    let walk = walker::walk(0.001);
    let plants = |walk: &walker::Walk| {
        let graph = walk.graph();
        [0, 1].map(|leg| graph.feet().plants(ClipId(0), leg).to_vec())
    };
    let expected = plants(&walk);
    let lifted = |root: Vec3| root + Vec3::new(3.0, 0.4, -7.0);
    assert_eq!(plants(&walker::changed(&walk, 1.0, lifted)), expected);
    assert_eq!(plants(&walker::changed(&walk, 0.3, |root| root)), expected);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn captured_walks_stand_on_one_foot_after_the_other() {
    let walks = [
        "walk/Male2_B3_Walk.bvh",
        "walk/02_01.bvh",
        "walk/cmu_12_01_walk.bvh",
    ];
    for walk in walks {
        let set = captures(walk);
        let graph = walker::graph(&set.skeleton, &set.clips[0], &GraphSettings::default());
        let frames = graph.clips()[0].frames() as u32;
        let stands = |leg: usize, frame: u32| {
            let mut plants = graph.feet().plants(ClipId(0), leg).iter();
            plants.any(|plant| (plant.first..=plant.last).contains(&frame))
        };
        let share = |of: &dyn Fn(u32) -> bool| {
            (0..frames).filter(|&frame| of(frame)).count() as f32 / frames as f32
        };
        for leg in [0, 1] {
            let alone = share(&|frame| stands(leg, frame));
            assert!((0.35..0.8).contains(&alone), "{walk}, leg {leg}: {alone}");
        }
        // A walk is never in the air.
        let some = share(&|frame| stands(0, frame) || stands(1, frame));
        assert!(some > 0.9, "{walk}: {some}");
    }
}

fn planted_feet_slide_a_third_or_no_more_than_as_captured(graph: &MotionGraph) {
    let slide = graph.foot_slide(3000);
    println!("{slide:?}");
    let is_tried = slide.planted_seconds > 100.0 && slide.steps > 0;
    assert!(is_tried, "{slide:?}");
    // Whatever the captures slide themselves is theirs.
    let bound = (slide.blended / 4.0).max(1.1 * slide.clips);
    assert!(slide.kept < bound, "{slide:?}");
    assert!(slide.kept < slide.blended / 2.5, "{slide:?}");
}

/// The embedded motions with transitions of any speed, which keep planted feet or only blend.
fn of_any_speed(keep: bool) -> MotionGraph {
    embedded_graph(&with(|s: &mut GraphSettings| {
        (s.keep_feet, s.fastest_step) = (keep, None)
    }))
}

/// The same transitions, aligned on the whole body, which only blend, and on the feet that stand. These may dart.
#[test]
fn transitions_are_aligned_on_the_feet_that_stand() {
    let [by_body, by_feet] = [false, true].map(of_any_speed);
    assert!(darting(&by_feet) > 0);
    assert_eq!(by_body.edges().len(), by_feet.edges().len());
    let [body, feet] = [&by_body, &by_feet].map(|graph| graph.foot_slide(usize::MAX));
    println!("{body:?}\n{feet:?}");
    let [median, most, _] = body.displacement;
    assert!(feet.displacement[0] < 0.75 * median && feet.displacement[1] < 0.75 * most);
    assert!(feet.blended < 0.75 * body.blended);

    assert_eq!((body.kept, body.steps), (body.blended, 0));
    assert!(body.planted_seconds > 10.0 && body.blended > 50.0);
    let (mut plain, mut kept) = (Pose::default(), Pose::default());
    for id in transitions(&by_body).step_by(101) {
        BLENDED(&by_body, id, 3.3, &mut plain);
        KEPT(&by_body, id, 3.3, &mut kept);
        assert_eq!(plain, kept);
    }
}

/// The height above which a joint spends all but a twentieth of its time in the clips.
fn ground(graph: &MotionGraph, joint: usize) -> f32 {
    let (mut pose, mut heights) = (Pose::default(), Vec::new());
    for clip in graph.clips() {
        for frame in 0..clip.frames() {
            clip.pose(frame, &mut pose);
            heights.push(places(graph, &pose)[joint].y);
        }
    }
    heights.sort_by(f32::total_cmp);
    heights[heights.len() / 20]
}

/// Metres that feet go near the ground, by places alone: no plant and no plan is asked. Feet that
/// swing low count as well.
fn skated(graph: &MotionGraph, sample: Sample) -> f32 {
    const NEAR: f32 = 0.025;
    let points: Vec<[(usize, f32); 2]> = Leg::all(graph.skeleton())
        .iter()
        .map(|leg| [leg.foot, leg.toe_or_foot()].map(|j| (j.index(), ground(graph, j.index()))))
        .collect();
    let mut sum = 0.0;
    for id in transitions(graph).step_by(29) {
        for pair in played(graph, sample, id, 4).windows(2) {
            for foot in &points {
                let way = foot.map(|(joint, ground)| {
                    let (a, b) = (pair[0][joint], pair[1][joint]);
                    let above = (0.5 * (a.y + b.y) - ground).max(0.0);
                    (b.x - a.x).hypot(b.z - a.z) * (2.0 - (above / NEAR).exp2()).max(0.0)
                });
                sum += way[0].min(way[1]);
            }
        }
    }
    sum
}

fn feet_near_the_ground_go_less_far_by_their_places_alone(graph: &MotionGraph) {
    let (blended, kept) = (skated(graph, BLENDED), skated(graph, KEPT));
    println!("{blended} m, kept {kept} m");
    assert!(kept < 0.45 * blended, "{kept} of {blended}");
}

fn both_ends_of_a_transition_are_the_clips_own(graph: &MotionGraph) {
    for id in transitions(graph).step_by(41) {
        let edge = graph.edge(id);
        let end = edge.frames as f32;
        let (from, to) = (graph.node(edge.from), graph.node(edge.to));
        let mut pose = Pose::default();
        graph.clip(from.clip).pose(from.frame as usize, &mut pose);
        let first = places(graph, &pose);
        graph.clip(to.clip).pose(to.frame as usize, &mut pose);
        pose.place(graph.clip_change(id));
        let last = places(graph, &pose);
        let off_by = |pure: &[Vec3], frame| furthest(pure, &places_at(graph, KEPT, id, frame));
        // Far from the origin a place has few digits left.
        let sizes = first.iter().chain(&last).map(|place| place.length());
        let size = sizes.fold(1.0, f32::max);
        for (pure, frame, inside) in [(&first, 0.0, 1e-3), (&last, end, end - 1e-3)] {
            let off = off_by(pure, frame);
            assert!(off < 1e-5 * size, "{id:?}: {off}");
            // And it is not left by a jump: a thousandth of a frame later it is still there.
            let near = off_by(pure, inside);
            assert!(near < 1e-3, "{id:?}: {near} m within 1/30000 s");
        }
    }
}

/// The furthest that any joint goes in a 120th of a second of a transition, metres.
fn fastest(graph: &MotionGraph, sample: Sample, id: EdgeId) -> f32 {
    let played = played(graph, sample, id, 4);
    let ways = played.windows(2).map(|pair| furthest(&pair[0], &pair[1]));
    ways.fold(0.0, f32::max)
}

fn no_joint_jumps(graph: &MotionGraph) {
    let (mut most, mut most_more) = (0.0f32, 0.0f32);
    for id in transitions(graph).step_by(7) {
        let (blended, kept) = (fastest(graph, BLENDED, id), fastest(graph, KEPT, id));
        (most, most_more) = (most.max(blended), most_more.max(kept - blended));
    }
    println!("{most} m in a 120th of a second, up to {most_more} m more");
    // A step takes a sixth of a second, and the loosest links plant feet 0.3 m apart: nowhere more
    // than 6 m/s on top.
    assert!(most_more < 0.05, "{most_more} m");
}

/// Speed of the fastest toe between places that follow each other `rate` times a second, metres per second.
fn fastest_toe(graph: &MotionGraph, poses: &[Vec<Vec3>], rate: f32) -> f32 {
    let speed = |pair: &[Vec<Vec3>]| {
        let toes = graph.limbs()[..2].iter().flatten();
        let toes = toes.map(|leg| leg.toe.unwrap_or(leg.foot).index());
        toes.map(|toe| pair[0][toe].distance(pair[1][toe]) * rate)
            .fold(0.0, f32::max)
    };
    poses.windows(2).map(speed).fold(0.0, f32::max)
}

/// Speed of the fastest toe in a transition, and in the frames of both clips that it blends.
fn speeds(graph: &MotionGraph, id: EdgeId) -> [f32; 2] {
    let (edge, rate) = (graph.edge(id), graph.frame_rate() as f32);
    let (from, to) = (graph.node(edge.from), graph.node(edge.to));
    let played = played(graph, KEPT, id, 2);
    let clip = |clip, first: u32| {
        let pose = |frame: u32| {
            let mut pose = Pose::default();
            graph.clip(clip).pose(frame as usize, &mut pose);
            places(graph, &pose)
        };
        let poses: Vec<_> = (first..=first + edge.frames).map(pose).collect();
        fastest_toe(graph, &poses, rate)
    };
    let sides = clip(from.clip, from.frame).max(clip(to.clip, to.frame - edge.frames));
    [fastest_toe(graph, &played, 2.0 * rate), sides]
}

fn darting(graph: &MotionGraph) -> usize {
    let darts = |&id: &EdgeId| {
        let [played, sides] = speeds(graph, id);
        played > 1e-3 + (1.3 * sides).max(5.0)
    };
    transitions(graph).filter(darts).count()
}

fn bones_keep_their_lengths_and_nothing_but_legs_moves(graph: &MotionGraph) {
    let legs = Leg::all(graph.skeleton());
    let of_legs = |joint| {
        let mut above = graph.skeleton().ancestry(joint);
        above.any(|above| legs.iter().any(|leg| leg.hip == above))
    };
    let (mut plain, mut pose) = (Pose::default(), Pose::default());
    for id in transitions(graph).step_by(37) {
        for step in 0..=3 * graph.edge(id).frames {
            let frame = step as f32 / 3.0;
            BLENDED(graph, id, frame, &mut plain);
            KEPT(graph, id, frame, &mut pose);
            assert_eq!(pose.translations, plain.translations);
            let mut rotations = pose.rotations.iter();
            assert!(rotations.all(|rotation| rotation.is_normalized()));
            let sunk = plain.root - pose.root;
            assert!((sunk.x, sunk.z) == (0.0, 0.0) && (0.0..0.05).contains(&sunk.y));
            assert_eq!(graph.sample_edge_root(id, frame), pose.root);
            for joint in graph.skeleton().ids().filter(|&joint| !of_legs(joint)) {
                let index = joint.index();
                assert_eq!(pose.rotations[index], plain.rotations[index], "{joint:?}");
            }
        }
    }
}

#[test]
fn the_body_stays_within_its_reach_of_the_root() {
    let baked = embedded();
    let graph = baked.graph();
    let (mut pose, mut centres) = (Pose::default(), Vec::new());
    for id in transitions(graph).step_by(53) {
        for frame in 0..graph.edge(id).frames {
            let frame = frame as f32 + 0.4;
            graph.sample_edge(id, frame, &mut pose);
            let joints = joints_of(graph.skeleton(), &pose);
            baked.body().centres(&joints, &mut centres);
            let root = graph.sample_edge_root(id, frame);
            for (centre, sphere) in centres.iter().zip(&baked.body().spheres) {
                let furthest = centre.distance(root) + sphere.radius;
                assert!(furthest < baked.reach() + 1e-4);
            }
        }
    }
}

/// Kovar's blend as it is written down: two whole poses, then the one moved towards the other.
#[test]
fn the_blend_is_that_of_two_whole_poses() {
    let graph = embedded().graph();
    let (mut pose, mut out, mut target) = (Pose::default(), Pose::default(), Pose::default());
    for id in transitions(graph).step_by(23) {
        let edge = graph.edge(id);
        let (from, to) = (graph.node(edge.from), graph.node(edge.to));
        let end = edge.frames as f32;
        for frame in [0.0, 0.7, 3.0, 0.5 * end + 0.1, end] {
            graph.sample_blend(id, frame, &mut pose);
            let source = graph.clip(from.clip);
            source.sample(from.frame as f32 + frame, &mut out);
            let begin = (to.frame - edge.frames) as f32;
            graph.clip(to.clip).sample(begin + frame, &mut target);
            target.place(graph.clip_change(id));
            out.blend(&target, 1.0 - blend_weight(frame / end));
            // Whole poses are blended by a series in place of sines.
            assert!(pose.root.abs_diff_eq(out.root, 1e-6));
            for (a, b) in pose.rotations.iter().zip(&out.rotations) {
                let b = if a.dot(*b) < 0.0 { -*b } else { *b };
                assert!(a.abs_diff_eq(b, 4e-6), "{a} and {b}");
            }
            assert_eq!(pose.translations, out.translations);
        }
    }
}

#[test]
fn a_turned_or_mirrored_world_changes_nothing() {
    let motions = sabaki_fixtures::demo::motions().unwrap();
    let slide = |skeleton: &Skeleton, change: &dyn Fn(&mut ClipDesc)| {
        let changed = |clip: &Clip| {
            let mut desc = clip.desc().clone();
            change(&mut desc);
            Clip::new(skeleton, desc).unwrap()
        };
        // Half of them: a search takes time with their square.
        let clips: Vec<Clip> = motions.clips.iter().step_by(2).map(changed).collect();
        let settings = with(|s: &mut GraphSettings| s.threshold = 0.06);
        let built = graph::build(source(skeleton, &clips, &[]), &settings);
        built.unwrap().0.foot_slide(2000)
    };
    let turn = Rigid2::new(2.2, 5.0, -3.0);
    let as_it_is = slide(&motions.skeleton, &|_| {});
    let turned = slide(&motions.skeleton, &|desc| {
        let joints = desc.rotations.len() / desc.roots.len();
        desc.roots
            .iter_mut()
            .for_each(|root| *root = turn.point(*root));
        for rotation in desc.rotations.iter_mut().step_by(joints) {
            *rotation = turn.rotation() * *rotation;
        }
    });
    let mirror = |v: Vec3| Vec3::new(-v.x, v.y, v.z);
    let joints = motions.skeleton.joints().iter().map(|joint| Joint {
        offset: mirror(joint.offset),
        ..joint.clone()
    });
    let mirrored = Skeleton::new(joints.collect()).unwrap();
    let mirrored = slide(&mirrored, &|desc| {
        desc.roots.iter_mut().for_each(|root| *root = mirror(*root));
        for q in &mut desc.rotations {
            *q = Quat::from_xyzw(q.x, -q.y, -q.z, q.w);
        }
    });
    for other in [turned, mirrored] {
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 0.05;
        let is_alike = near(other.blended, as_it_is.blended) && near(other.kept, as_it_is.kept);
        assert!(is_alike, "{other:?}, {as_it_is:?}");
        assert!(other.kept < other.blended / 3.0, "{other:?}");
    }
}

on_both!(transitions_are_sound);

fn transitions_are_sound(baked: &BakedGraph) {
    let graph = baked.graph();
    planted_feet_slide_a_third_or_no_more_than_as_captured(graph);
    feet_near_the_ground_go_less_far_by_their_places_alone(graph);
    both_ends_of_a_transition_are_the_clips_own(graph);
    no_joint_jumps(graph);
    bones_keep_their_lengths_and_nothing_but_legs_moves(graph);
    assert_eq!(darting(graph), 0);
}
