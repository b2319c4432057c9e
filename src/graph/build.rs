//! Clips and events in, one strongly connected motion graph out.
//!
//! Source: Kovar, Gleicher & Pighin (2002), sections 3.1–3.3; Masaoka & Oshita, section 4.4: an
//! event is one edge, which no node cuts and no transition blends.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::component::largest_component;
use super::minima::{self, MinimaSettings, Minimum};
use super::{
    BuildReport, ClipId, Edge, EdgeMotion, EventId, Feet, GraphError, GraphEvent, GraphSettings,
    MotionGraph, Node, NodeId, PointCloud, Transition, distance,
};
use crate::anim::{Clip, Event, Skeleton};

/// What a graph is built from.
#[derive(Clone, Copy, Debug)]
pub struct ClipSource<'a> {
    /// Of all clips.
    pub skeleton: &'a Skeleton,
    /// At any frame rates.
    pub clips: &'a [Clip],
    /// Their labelled ranges; those of one clip do not overlap.
    pub events: &'a [Event],
}

/// Builds the graph of `source`.
///
/// # Errors
/// Clips, events or settings that make no graph.
pub fn build(
    source: ClipSource<'_>,
    settings: &GraphSettings,
) -> Result<(MotionGraph, BuildReport), GraphError> {
    if source.clips.is_empty() {
        return Err(GraphError::NoClips);
    }
    let weights = settings.checked_weights(source.skeleton.len())?;
    check_joints(source)?;
    let clips: Vec<Clip> = source
        .clips
        .iter()
        .map(|clip| clip.resampled(settings.frame_rate))
        .collect::<Result<_, _>>()?;
    let events = events_in_frames(source, &clips, settings)?;
    let clouds: Vec<PointCloud> = clips
        .iter()
        .map(|clip| PointCloud::new(source.skeleton, clip, &weights))
        .collect();
    let window = settings.frames(settings.window);
    let mut transitions = find_transitions(&clouds, window, settings);
    transitions.retain(|transition| !events.iter().any(|event| transition.cuts(event, window)));
    let parts = Parts {
        skeleton: source.skeleton,
        clips,
        events,
        clouds: &clouds,
        transitions: &transitions,
        window,
        frame_rate: settings.frame_rate,
    };
    let full = parts.assemble();
    let graph = largest_component(&full).ok_or_else(|| GraphError::NoCycle {
        clips: source.clips.len(),
        seconds: source.clips.iter().map(Clip::duration).sum(),
        threshold: settings.threshold,
    })?;
    let graph = graph.with_feet(&settings.feet);
    let report = BuildReport::new(
        source,
        (&full, &graph),
        transitions.len(),
        window_pairs(&clouds, window),
    );
    tracing::debug!(
        nodes = graph.nodes.len(),
        edges = graph.edges.len(),
        "motion graph built"
    );
    Ok((graph, report))
}

fn check_joints(source: ClipSource<'_>) -> Result<(), GraphError> {
    let joints = source.skeleton.len();
    for clip in source.clips {
        let found = clip.desc().rotations.len() / clip.frames();
        if found != joints {
            return Err(GraphError::ClipJoints {
                clip: clip.name().to_owned(),
                found,
                joints,
            });
        }
    }
    Ok(())
}

/// The events in frames of the resampled clips. One that is shorter than a frame has no motion to
/// play: no edge will hold it, and so it is reported as dropped.
fn events_in_frames(
    source: ClipSource<'_>,
    clips: &[Clip],
    settings: &GraphSettings,
) -> Result<Vec<GraphEvent>, GraphError> {
    let to_frames = |(index, event): (usize, &Event)| {
        let clip = clips.get(event.clip);
        let last_frame = clip.map_or(0, |clip| clip.frames() - 1) as f64;
        let (first, last) = (
            (event.start * settings.frame_rate).round(),
            (event.end * settings.frame_rate).round(),
        );
        // An event may be labelled to the very end of a capture, which a resampled clip can miss by
        // a part of a frame.
        let inside = first >= 0.0 && first <= last_frame && last <= last_frame + 1.0;
        let joints_known = event
            .joints
            .iter()
            .all(|id| id.index() < source.skeleton.len());
        if clip.is_none() || !inside || !joints_known || event.end <= event.start {
            return Err(GraphError::Event {
                index,
                start: event.start,
                end: event.end,
            });
        }
        Ok(GraphEvent {
            clip: ClipId(event.clip as u32),
            kind: event.kind,
            first: first as u32,
            last: last.min(last_frame) as u32,
            joints: event.joints.clone(),
        })
    };
    let events: Vec<GraphEvent> = source
        .events
        .iter()
        .enumerate()
        .map(to_frames)
        .collect::<Result<_, _>>()?;
    check_apart(&events)?;
    Ok(events)
}

/// No two events share a frame but that in which one ends and the other starts: a node would cut
/// them.
fn check_apart(events: &[GraphEvent]) -> Result<(), GraphError> {
    let mut order: Vec<usize> = (0..events.len()).collect();
    order.sort_by_key(|&index| (events[index].clip, events[index].first, events[index].last));
    for pair in order.windows(2) {
        let [earlier, later] = [pair[0], pair[1]];
        if events[earlier].clip == events[later].clip && events[later].first < events[earlier].last
        {
            return Err(GraphError::EventsOverlap { earlier, later });
        }
    }
    Ok(())
}

/// How many pairs of windows the distance maps have: each pair of clips once, a clip against itself
/// with its whole map.
fn window_pairs(clouds: &[PointCloud], window: usize) -> u64 {
    let windows = || {
        clouds
            .iter()
            .map(|cloud| (cloud.frames() + 1).saturating_sub(window) as u64)
    };
    let total: u64 = windows().sum();
    (total * total + windows().map(|w| w * w).sum::<u64>()) / 2
}

/// All transitions under the threshold, the same list for any number of threads.
fn find_transitions(
    clouds: &[PointCloud],
    window: usize,
    settings: &GraphSettings,
) -> Vec<Transition> {
    let pairs: Vec<(usize, usize)> = (0..clouds.len())
        .flat_map(|a| (a..clouds.len()).map(move |b| (a, b)))
        .collect();
    let threads = match settings.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let next = AtomicUsize::new(0);
    let separation = settings.frames(settings.separation);
    let work = || {
        let mut found: Vec<(usize, Vec<Minimum>)> = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(a, b)) = pairs.get(index) else {
                return found;
            };
            let only_after = (a == b).then_some(separation);
            let minima = MinimaSettings {
                window,
                threshold: settings.threshold,
                separation,
                only_after,
            };
            found.push((index, minima::find(&clouds[a], &clouds[b], &minima)));
        }
    };
    let mut found: Vec<(usize, Vec<Minimum>)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.min(pairs.len()))
            .map(|_| scope.spawn(work))
            .collect();
        workers
            .into_iter()
            .flat_map(|worker| {
                worker
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            })
            .collect()
    });
    found.sort_by_key(|&(index, _)| index);
    found
        .iter()
        .flat_map(|(index, minima)| {
            let (a, b) = pairs[*index];
            minima
                .iter()
                .flat_map(move |minimum| Transition::both_ways(a, b, minimum, window))
        })
        .collect()
}

/// What a graph is put together from.
struct Parts<'a> {
    skeleton: &'a Skeleton,
    clips: Vec<Clip>,
    events: Vec<GraphEvent>,
    clouds: &'a [PointCloud],
    transitions: &'a [Transition],
    /// Frames of a transition.
    window: usize,
    frame_rate: f64,
}

impl Parts<'_> {
    /// All nodes and edges, whether they lead back or not.
    fn assemble(self) -> MotionGraph {
        let nodes = self.nodes();
        let mut edges: Vec<Edge> = nodes
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| pair[0].clip == pair[1].clip)
            .map(|(index, pair)| self.stretch(index as u32, pair[0], pair[1]))
            .collect();
        edges.extend(
            self.transitions
                .iter()
                .map(|transition| self.blend(transition, &nodes)),
        );
        with_index(MotionGraph {
            skeleton: self.skeleton.clone(),
            frame_rate: self.frame_rate,
            clips: self.clips,
            events: self.events,
            nodes,
            edges,
            first_edge: Vec::new(),
            feet: Feet::default(),
        })
    }

    /// The ends of clips, events and transitions, sorted.
    fn nodes(&self) -> Vec<Node> {
        let mut places = BTreeSet::new();
        for (index, clip) in self.clips.iter().enumerate() {
            places.extend([node(index, 0), node(index, clip.frames() - 1)]);
        }
        for event in &self.events {
            places.extend([event.first, event.last].map(|frame| Node {
                clip: event.clip,
                frame,
            }));
        }
        for t in self.transitions {
            places.extend([
                node(t.source_clip, t.source_frame),
                node(t.target_clip, t.target_frame),
            ]);
        }
        places.into_iter().collect()
    }

    /// The clip between two neighbouring nodes; `index` is the first one's.
    fn stretch(&self, index: u32, from: Node, to: Node) -> Edge {
        let whole =
            |e: &GraphEvent| e.clip == from.clip && e.first == from.frame && e.last == to.frame;
        Edge {
            from: NodeId(index),
            to: NodeId(index + 1),
            frames: to.frame - from.frame,
            motion: EdgeMotion::Clip,
            event: self
                .events
                .iter()
                .position(whole)
                .map(|event| EventId(event as u32)),
        }
    }

    fn blend(&self, t: &Transition, nodes: &[Node]) -> Edge {
        let id = |place: Node| NodeId(nodes.partition_point(|other| *other < place) as u32);
        let (source, target) = (&self.clouds[t.source_clip], &self.clouds[t.target_clip]);
        let (source_start, target_start) = (t.source_frame + 1, t.target_frame + 1 - self.window);
        let align = distance::alignment(source, source_start, target, target_start, self.window);
        Edge {
            from: id(node(t.source_clip, t.source_frame)),
            to: id(node(t.target_clip, t.target_frame)),
            frames: self.window as u32,
            motion: EdgeMotion::Transition {
                align,
                distance: t.distance,
            },
            event: None,
        }
    }
}

fn node(clip: usize, frame: usize) -> Node {
    Node {
        clip: ClipId(clip as u32),
        frame: frame as u32,
    }
}

/// Sorts the edges and notes where each node's begin.
pub(super) fn with_index(mut graph: MotionGraph) -> MotionGraph {
    graph
        .edges
        .sort_by_key(|edge| (edge.from, edge.motion != EdgeMotion::Clip, edge.to));
    let nodes = graph.nodes.len() as u32;
    graph.first_edge = (0..=nodes)
        .map(|node| graph.edges.partition_point(|edge| edge.from.0 < node) as u32)
        .collect();
    graph
}
