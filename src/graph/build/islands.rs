//! Joins clips that the graph would drop, whatever that costs: clips of libraries of short motions, which nothing near leads to and from.
//!
//! The method is ours. A clip whose last pose is its first one is a loop: it continues with its own next cycle. Any other clip gets frames before
//! its start and after its end, in which its motion slows down to a halt (the offsets of inertialization, Bollo 2018, at constant speed of the
//! other motion), so that a blend into it or out of it needs none of its own frames. Then each clip gets its closest links from and to the graph.
//!
//! ```text
//! islands = clips of which most is not in the largest component, loops of which much is not in it, clips of events that are not
//! pad the islands with frames before and after
//! join the last frame of each loop to its first
//! component = the largest one, or the island whose end is closest to its own start; what it drops is an island, too
//! for each island outside: the closest links from the component to its start, and from its end to the component
//! ```

use crate::anim::{Clip, ClipError, Pose, Skeleton};
use crate::graph::build::candidates::LinkSpace;
use crate::graph::build::input::GraphBuilder;
use crate::graph::build::moments::{Jump, Moments};
use crate::graph::error::GraphError;
use crate::graph::motion_graph::Feet;
use crate::graph::push::PushTest;
use crate::graph::search::distance::{DistanceMap, WindowPair};
use crate::graph::search::transition::Transition;
use crate::graph::search::windows::{PointCloud, Windows};
use crate::math::{Rigid2, in_parallel, smooth_step};
use glam::Quat;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Largest distance of the last pose of a loop from its first, in metres.
const LOOP: f32 = 0.01;
/// Frames that are added at each end of a clip, in seconds: the longest blend into it or out of it.
const PAD: f64 = 0.8;
/// Time in which a motion that a clip begins or ends with slows down, in seconds.
const HALT: f64 = 0.2;
/// Maximum number of links from and to an island, and their largest distance, as a multiple of the closest one's.
const LINKS: (usize, f32) = (4, 1.5);

/// A clip that nothing near leads to or from, and the links that join it, or would.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JoinedClip {
    /// Name of the clip.
    pub clip: String,
    /// Whether it is a loop, whose end continues with its start.
    pub is_loop: bool,
    /// Distance of the closest link to it and of the closest one from it, in metres; `None` for a loop that the graph consists of.
    pub links: [Option<f32>; 2],
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Island {
    clip: usize,
    is_loop: bool,
    /// Number of frames of the clip itself.
    frames: usize,
}

/// The clips that the largest component drops, or most of them, as far as they have motion.
pub(crate) fn find(input: &GraphBuilder<'_>, transitions: &[Transition]) -> Vec<Island> {
    if input.settings.farthest_join == Some(0.0) {
        return Vec::new();
    }
    let moments = Moments::new(input.clouds.iter().map(PointCloud::frames));
    let mut jumps: Vec<Jump> = transitions.iter().map(|t| moments.jump(t)).collect();
    let core = largest(&moments, &jumps);
    let lost_event = |clip: usize| {
        let mut own = input
            .events
            .iter()
            .filter(|event| event.clip.index() == clip);
        own.any(|event| {
            let ends = moments.ends(event);
            event.first < event.last && ends.iter().any(|&end| !core[end as usize])
        })
    };
    let islands = (0..input.clouds.len()).map(|clip| Island {
        clip,
        is_loop: is_loop(&input.clouds[clip]),
        frames: input.clouds[clip].frames(),
    });
    let islands = islands.filter(|island| island.frames > 2);
    let lost = |island: &Island, core: &[bool]| {
        let moments = moments.of_clip(island.clip);
        moments.filter(|&moment| !core[moment]).count()
    };
    let loses_most = |island: &Island, core: &[bool]| 4 * lost(island, core) > 3 * island.frames;
    let is_lost = |island: &Island| {
        // Blends take a window at each end of any clip, which is little of a long one.
        let (frames, lost) = (island.frames, lost(island, &core));
        let window = input.settings.frames(input.settings.window);
        let loses_much = 5 * lost > 2 * frames || 4 * lost > frames && lost > 2 * window + 2;
        loses_most(island, &core) || island.is_loop && loses_much || lost_event(island.clip)
    };
    let (mut found, mut others): (Vec<Island>, Vec<Island>) = islands.partition(is_lost);
    let mut closed = 0;
    // With closed loops, another component may be the largest.
    while closed < found.len() {
        let loops = found[closed..].iter().filter(|island| island.is_loop);
        jumps.extend(loops.map(|island| Jump {
            from: moments.at(island.clip, island.frames - 2),
            to: moments.at(island.clip, 0),
            frames: 1,
        }));
        closed = found.len();
        let core = largest(&moments, &jumps);
        found.extend(others.extract_if(.., |island| loses_most(island, &core)));
    }
    found.sort_by_key(|island| island.clip);
    found
}

/// Joins islands to the graph, and returns those that are joined and those whose links are too far. Frames of transitions and events of these clips are moved by the frames that are added before.
pub(crate) fn join(
    input: &mut GraphBuilder<'_>,
    islands: &[Island],
    transitions: &mut Vec<Transition>,
) -> Result<[Vec<JoinedClip>; 2], GraphError> {
    let pad = input
        .settings
        .frames(PAD)
        .max(input.settings.frames(input.settings.window));
    add_frames(input, islands, pad, transitions)?;
    let input = &*input;
    let own = |island: &Island| pad..pad + island.frames;
    for island in islands.iter().filter(|island| island.is_loop) {
        let range = own(island);
        transitions.push(transition(
            input,
            [island.clip; 2],
            [range.end - 2, range.start],
            1,
        ));
    }
    let settings = input.settings.links.clone().unwrap_or_default();
    let space = LinkSpace::new(input, &settings);
    let farthest = input.settings.farthest_join.unwrap_or(f32::INFINITY);
    if !component(&space.moments, transitions).contains(&true) {
        let to_itself = islands.iter().map(|island| {
            let (range, window) = (own(island), space.lengths.window);
            transition(
                input,
                [island.clip; 2],
                [range.end - 1, range.start],
                window,
            )
        });
        let closest = to_itself.min_by(|a, b| a.distance.total_cmp(&b.distance));
        transitions.extend(closest.filter(|link| link.distance <= farthest));
    }
    let core = component(&space.moments, transitions);
    let push = PushTest::new(&input.clouds, input.settings.frame_rate);
    let found = in_parallel(input.settings.threads, islands.len(), |index| {
        let island = &islands[index];
        let is_in = core[space.moments.at(island.clip, pad) as usize];
        [true, false].map(|leads_in| match is_in {
            true => Vec::new(),
            false => links(&space, &core, island, own(island), &push, leads_in),
        })
    });
    let [mut joined, mut apart] = [Vec::new(), Vec::new()];
    for (island, mut links) in islands.iter().zip(found) {
        let is_in = core[space.moments.at(island.clip, pad) as usize];
        let clip = JoinedClip {
            clip: input.clips[island.clip].name().to_owned(),
            is_loop: island.is_loop,
            links: std::array::from_fn(|way| links[way].first().map(|link| link.distance)),
        };
        let mut ways = links.iter_mut();
        let is_near = ways.all(|links| {
            links.retain(|link| link.distance <= farthest);
            !links.is_empty()
        });
        if is_in || is_near {
            joined.push(clip);
            transitions.extend(links.into_iter().flatten());
        } else {
            apart.push(clip);
        }
    }
    Ok([joined, apart])
}

/// For each moment, whether it belongs to the largest component.
fn component(moments: &Moments, transitions: &[Transition]) -> Vec<bool> {
    let jumps: Vec<Jump> = transitions.iter().map(|t| moments.jump(t)).collect();
    largest(moments, &jumps)
}

/// [`component`] by the jumps between moments.
fn largest(moments: &Moments, jumps: &[Jump]) -> Vec<bool> {
    let core = moments.component(jumps);
    core.unwrap_or_else(|| vec![false; moments.len()])
}

/// The last frame and the first.
fn ends(cloud: &PointCloud) -> WindowPair<'_> {
    WindowPair {
        a: cloud,
        start_a: cloud.frames() - 1,
        b: cloud,
        start_b: 0,
        frames: 1,
    }
}

fn is_loop(cloud: &PointCloud) -> bool {
    cloud.frames() > 2 && ends(cloud).distance() <= LOOP
}

fn transition(
    input: &GraphBuilder<'_>,
    [source_clip, target_clip]: [usize; 2],
    [source_frame, target_frame]: [usize; 2],
    frames: usize,
) -> Transition {
    let mut transition = Transition {
        source_clip,
        source_frame,
        target_clip,
        target_frame,
        frames,
        distance: 0.0,
    };
    transition.distance = transition.windows(&input.clouds).distance();
    transition
}

// Frames before and after a clip.

fn add_frames(
    input: &mut GraphBuilder<'_>,
    islands: &[Island],
    pad: usize,
    transitions: &mut [Transition],
) -> Result<(), GraphError> {
    let (source, settings) = (input.source, input.settings);
    let weights = settings.checked_weights(source.skeleton)?;
    let window = settings.frames(settings.window);
    let made = in_parallel(settings.threads, islands.len(), |index| {
        let Island { clip, is_loop, .. } = islands[index];
        let seam = is_loop.then(|| ends(&input.clouds[clip]).alignment());
        let plain = source.clips[clip].resampled(settings.frame_rate)?;
        let halt = settings.frames(HALT);
        let padded = padded(source.skeleton, &plain, seam, [pad, halt])?;
        let padded = match &settings.compression {
            Some(compression) => padded.compressed(source.skeleton, compression),
            None => padded,
        };
        let cloud = PointCloud::new(source.skeleton, &padded, &weights);
        let windows = Windows::new(&cloud, window);
        Ok::<_, ClipError>((padded, cloud, windows))
    });
    let mut lead = vec![0; input.clips.len()];
    for (island, made) in islands.iter().zip(made) {
        let clip = island.clip;
        lead[clip] = pad as u32;
        (input.clips[clip], input.clouds[clip], input.windows[clip]) = made?;
    }
    for transition in transitions {
        transition.source_frame += lead[transition.source_clip] as usize;
        transition.target_frame += lead[transition.target_clip] as usize;
    }
    for event in &mut input.events {
        let lead = lead[event.clip.index()];
        (event.first, event.last) = (event.first + lead, event.last + lead);
    }
    input.leads = lead;
    input.feet = Feet::new(source.skeleton, &input.clips, settings.threads);
    Ok(())
}

/// The clip with `pad` frames before and after it. `seam` moves the first pose of a loop onto its last, which becomes exact.
fn padded(
    skeleton: &Skeleton,
    clip: &Clip,
    seam: Option<Rigid2>,
    [pad, halt]: [usize; 2],
) -> Result<Clip, ClipError> {
    let mut poses: Vec<Pose> = vec![Pose::default(); clip.frames()];
    for (frame, pose) in poses.iter_mut().enumerate() {
        clip.pose(frame, pose);
    }
    let last = poses.len() - 1;
    if let Some(seam) = seam {
        let mut next = poses[0].clone();
        next.place(seam);
        let end = poses[last].clone();
        let closed = pad.min(last);
        for step in 1..=closed {
            let weight = smooth_step(step as f32 / closed as f32);
            moved(&mut poses[last - closed + step], [&end, &next], weight);
        }
    }
    let outside = |steps: usize, is_before: bool| match seam {
        Some(seam) => {
            // The cycle after the last frame begins with the frame after the first.
            let (cycles, frame) = match is_before {
                true => (steps.div_ceil(last), steps.div_ceil(last) * last - steps),
                false => ((steps - 1) / last + 1, (steps - 1) % last + 1),
            };
            let turn = if is_before { seam.inverse() } else { seam };
            let mut pose = poses[frame].clone();
            (0..cycles).for_each(|_| pose.place(turn));
            pose
        }
        None => {
            let [at, beside] = if is_before { [0, 1] } else { [last, last - 1] };
            let left = |step: usize, halt: usize| (1.0 - step as f32 / halt as f32).max(0.0);
            let turned: f32 = (1..=steps).map(|step| left(step, halt).powi(2)).sum();
            let way: f32 = (1..=steps).map(|step| left(step, pad)).sum();
            let mut pose = poses[at].clone();
            moved(&mut pose, [&poses[beside], &poses[at]], turned);
            pose.root = poses[at].root + way * (poses[at].root - poses[beside].root);
            pose
        }
    };
    let before = (1..=pad).rev().map(|steps| outside(steps, true));
    let after = (1..=pad).map(|steps| outside(steps, false));
    let all: Vec<Pose> = before.chain(poses.iter().cloned()).chain(after).collect();
    let mut desc = clip.desc();
    desc.roots = all.iter().map(|pose| pose.root).collect();
    desc.rotations = all.iter().flat_map(|pose| pose.rotations.clone()).collect();
    desc.translations = all
        .iter()
        .flat_map(|pose| pose.translations.clone())
        .collect();
    Clip::new(skeleton, desc)
}

/// Moves a pose by a multiple of the difference between two others.
fn moved(pose: &mut Pose, [from, to]: [&Pose; 2], weight: f32) {
    pose.root += weight * (to.root - from.root);
    let pairs = from.rotations.iter().zip(&to.rotations);
    for (rotation, (from, to)) in pose.rotations.iter_mut().zip(pairs) {
        let turn = *to * from.conjugate();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let turn = Quat::from_scaled_axis(weight * turn.to_scaled_axis());
        *rotation = (turn * *rotation).normalize();
    }
    let pairs = from.translations.iter().zip(&to.translations);
    for (place, (from, to)) in pose.translations.iter_mut().zip(pairs) {
        *place += weight * (*to - *from);
    }
}

/// The closest links to the island, or from it, at most one of each clip, the closest first. A blend takes longer if the body pushes less hard
/// then, and links in which it pushes too hard anyway are only taken if there are no others.
fn links(
    space: &LinkSpace<'_>,
    core: &[bool],
    island: &Island,
    own: Range<usize>,
    push: &PushTest,
    leads_in: bool,
) -> Vec<Transition> {
    /// The share of the limit up to which the body pushes easily.
    const EASY: f32 = 0.4;
    let (clip, window) = (island.clip, space.lengths.window);
    // First frames of the windows of the island: those that end with its first frame, or begin after its last one; of a loop all.
    let length = if island.is_loop { own.len() } else { 1 };
    let first = match leads_in {
        true => own.start + 1 - window,
        false => own.end + 1 - length,
    };
    let rows = space.input.clouds[clip].part(first..first + length + window - 1);
    let rows = Windows::new(&rows, window);
    let push = |link: &Transition| push.share(link, space.input.align(link));
    let is_gentle = |link: &Transition| push(link) <= 1.0;
    let fits = |own, window| fits(space, core, clip, leads_in, own, window);
    let mut links: Vec<Transition> = Vec::new();
    for other in 0..space.input.clouds.len() {
        let columns = &space.input.windows[other];
        let mut closest: Option<(f32, [usize; 2])> = None;
        let mut take = |row: usize, squares: &[f32]| {
            for (column, &square) in squares.iter().enumerate() {
                let is_closer = closest.is_none_or(|(least, _)| square < least);
                if is_closer && fits(first + row, (other, column)).is_some() {
                    closest = Some((square, [first + row, column]));
                }
            }
        };
        if other != clip && columns.count() > 0 {
            DistanceMap::new(&rows, columns).for_each_row(&mut take);
        }
        let found = closest.and_then(|(square, [row, column])| {
            let [source, target] = fits(row, (other, column))?;
            let available = space.available(source, target);
            let shortest = space.lengths.blend(square.sqrt(), available)?;
            let (clips, places) = ([source.0, target.0], [source.1, target.1]);
            let link = |frames| transition(space.input, clips, places, frames);
            let longer = (shortest..=available).map(link);
            let pushes = longer.map(|link| (push(&link).max(EASY), link));
            Some(pushes.min_by(|a, b| a.0.total_cmp(&b.0))?.1)
        });
        links.extend(found);
    }
    links.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let least = links.first().map_or(0.0, |link| link.distance);
    links.retain(|link| link.distance <= LINKS.1 * least);
    if links.iter().any(is_gentle) {
        links.retain(is_gentle);
    }
    links.truncate(LINKS.0);
    links
}

/// Clip and frame at which a link between two windows starts and ends, if it starts or ends in the graph and blends no event.
fn fits(
    space: &LinkSpace<'_>,
    core: &[bool],
    clip: usize,
    leads_in: bool,
    own: usize,
    (other, start): (usize, usize),
) -> Option<[(usize, usize); 2]> {
    let window = space.lengths.window;
    let ends = match leads_in {
        true => [(other, start.checked_sub(1)?), (clip, own + window - 1)],
        false => [(clip, own - 1), (other, start + window - 1)],
    };
    let (in_graph, frame) = if leads_in { ends[0] } else { ends[1] };
    let is_core = core[space.moments.at(in_graph, frame) as usize];
    (is_core && space.available(ends[0], ends[1]) >= window).then_some(ends)
}
