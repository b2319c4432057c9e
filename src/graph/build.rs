//! Clips and events in, one strongly connected motion graph out.
//!
//! Source: Kovar, Gleicher & Pighin (2002), sections 3.1–3.3; Masaoka & Oshita, section 4.4: an event is one edge, which no
//! node cuts and no transition blends.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::minima::{self, MinimaSettings, Minimum};
use super::{
    ClipId, Edge, EdgeMotion, EventId, GraphEvent, MotionGraph, Node, NodeId, PointCloud,
    Transition, distance, prune,
};
use crate::anim::{Clip, ClipError, Event, EventKind, Skeleton};

/// How a graph is built.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphSettings {
    /// All clips are resampled to it, frames per second. Default 30.
    pub frame_rate: f64,
    /// How long a transition blends, seconds. Default 1/3 (Kovar).
    pub window: f64,
    /// Transitions whose windows lie further apart are not made: root of the mean squared distance of joints, metres. Default
    /// 0.10.
    pub threshold: f32,
    /// Of two transitions that start and end nearer than this to each other the closer one is kept, seconds. Default 1/3.
    pub separation: f64,
    /// Weight of each joint in the distance; empty for all alike.
    pub joint_weights: Vec<f32>,
    /// Threads for the distance maps; 0 for as many as the machine has. The graph is the same for any number.
    pub threads: usize,
}

impl Default for GraphSettings {
    fn default() -> Self {
        Self {
            frame_rate: 30.0,
            window: 1.0 / 3.0,
            threshold: 0.10,
            separation: 1.0 / 3.0,
            joint_weights: Vec::new(),
            threads: 0,
        }
    }
}

impl GraphSettings {
    fn frames(&self, seconds: f64) -> usize {
        ((seconds * self.frame_rate).round() as usize).max(1)
    }
}

/// What a graph is built from.
#[derive(Clone, Copy, Debug)]
pub struct ClipSource<'a> {
    /// Of all clips.
    pub skeleton: &'a Skeleton,
    /// At any frame rates.
    pub clips: &'a [Clip],
    /// Their labelled ranges.
    pub events: &'a [Event],
}

/// What was found on the way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BuildReport {
    /// Clips given.
    pub clips: usize,
    /// Seconds given.
    pub seconds: f64,
    /// Events given: evasions, attacks.
    pub events: (usize, usize),
    /// Transitions under the threshold, before anything was dropped.
    pub transitions: usize,
    /// Pairs of windows that were compared.
    pub window_pairs: u64,
    /// What the largest strongly connected component left out.
    pub dropped: Dropped,
}

/// What is not in the graph since no way leads there and back.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Dropped {
    /// Names of the clips of which no frame was kept.
    pub clips: Vec<String>,
    /// Seconds of clips.
    pub seconds: f64,
    /// Evasions, by clip and seconds: `"duck.bvh 0.77-1.77"`.
    pub evasions: Vec<String>,
    /// Attacks, by clip and seconds.
    pub attacks: Vec<String>,
}

/// Why there is no graph.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GraphError {
    /// No clips.
    #[error("there are no clips to build a graph from")]
    NoClips,
    /// A setting is out of its range.
    #[error("graph setting {name} is {value}; it must be {range}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// Weights for a different number of joints.
    #[error(
        "{found} joint weights for {joints} joints; they must be finite, none negative, one above 0"
    )]
    JointWeights {
        /// How many weights.
        found: usize,
        /// How many joints.
        joints: usize,
    },
    /// An event names a clip that is not there or lies outside it.
    #[error("event {index}: {start} s to {end} s does not lie inside a clip of the set")]
    Event {
        /// Position in the list.
        index: usize,
        /// Seconds.
        start: f64,
        /// Seconds.
        end: f64,
    },
    /// Nothing leads back to where it came from.
    #[error(
        "no motion leads back to where it started: no two moments of the {clips} clips ({seconds:.1} s) that could be joined are within {threshold} m of each other; add clips that return to a common stance, or raise the threshold"
    )]
    NoCycle {
        /// Clips given.
        clips: usize,
        /// Seconds given.
        seconds: f64,
        /// Metres.
        threshold: f32,
    },
    /// Resampling failed.
    #[error(transparent)]
    Clip(#[from] ClipError),
}

/// Builds the graph of `source`.
///
/// # Errors
/// Clips, events or settings that make no graph.
pub fn build(
    source: ClipSource<'_>,
    settings: &GraphSettings,
) -> Result<(MotionGraph, BuildReport), GraphError> {
    let weights = check(source, settings)?;
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
    transitions.retain(|transition| {
        !events
            .iter()
            .any(|e| transition.cuts(e.clip.index(), e.first as usize, e.last as usize, window))
    });
    let full = assemble(
        source.skeleton,
        clips,
        events,
        &clouds,
        &transitions,
        window,
        settings.frame_rate,
    );
    let graph = largest_component(&full).ok_or_else(|| GraphError::NoCycle {
        clips: source.clips.len(),
        seconds: source.clips.iter().map(Clip::duration).sum(),
        threshold: settings.threshold,
    })?;
    let report = report(source, &full, &graph, transitions.len(), &clouds, window);
    tracing::debug!(
        nodes = graph.nodes.len(),
        edges = graph.edges.len(),
        "motion graph built"
    );
    Ok((graph, report))
}

/// Checks settings and events; returns the joint weights.
fn check(source: ClipSource<'_>, settings: &GraphSettings) -> Result<Vec<f32>, GraphError> {
    if source.clips.is_empty() {
        return Err(GraphError::NoClips);
    }
    let in_range = [
        (
            "frame_rate",
            settings.frame_rate,
            (1.0..=480.0).contains(&settings.frame_rate),
            "between 1 and 480",
        ),
        (
            "window",
            settings.window,
            (0.0..=10.0).contains(&settings.window),
            "between 0 and 10 s",
        ),
        (
            "separation",
            settings.separation,
            (0.0..=60.0).contains(&settings.separation),
            "between 0 and 60 s",
        ),
        (
            "threshold",
            f64::from(settings.threshold),
            settings.threshold > 0.0 && settings.threshold.is_finite(),
            "above 0",
        ),
    ];
    if let Some((name, value, _, range)) = in_range.into_iter().find(|&(_, _, ok, _)| !ok) {
        return Err(GraphError::Setting { name, value, range });
    }
    let joints = source.skeleton.len();
    if settings.joint_weights.is_empty() {
        return Ok(vec![1.0; joints]);
    }
    let weights = settings.joint_weights.clone();
    let sound =
        weights.iter().all(|w| w.is_finite() && *w >= 0.0) && weights.iter().any(|&w| w > 0.0);
    if weights.len() == joints && sound {
        Ok(weights)
    } else {
        Err(GraphError::JointWeights {
            found: weights.len(),
            joints,
        })
    }
}

fn events_in_frames(
    source: ClipSource<'_>,
    clips: &[Clip],
    settings: &GraphSettings,
) -> Result<Vec<GraphEvent>, GraphError> {
    let to_frames = |(index, event): (usize, &Event)| {
        let clip = clips.get(event.clip);
        let last_frame = clip.map_or(0, |clip| clip.frames() - 1) as f64;
        let first = (event.start * settings.frame_rate).round();
        // An event may be labelled to the very end of a capture, which a resampled clip can miss by a part of a frame.
        let last = (event.end * settings.frame_rate).round().min(last_frame);
        if clip.is_none() || !(first >= 0.0 && event.end > event.start && first <= last_frame) {
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
            last: last as u32,
            joints: event.joints.clone(),
        })
    };
    let events: Result<Vec<_>, _> = source.events.iter().enumerate().map(to_frames).collect();
    // An event shorter than a frame has no motion to play.
    events.map(|events| {
        events
            .into_iter()
            .filter(|event| event.first < event.last)
            .collect()
    })
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
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
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

fn assemble(
    skeleton: &Skeleton,
    clips: Vec<Clip>,
    events: Vec<GraphEvent>,
    clouds: &[PointCloud],
    transitions: &[Transition],
    window: usize,
    frame_rate: f64,
) -> MotionGraph {
    let node = |clip: usize, frame: usize| Node {
        clip: ClipId(clip as u32),
        frame: frame as u32,
    };
    let mut places = BTreeSet::new();
    for (index, clip) in clips.iter().enumerate() {
        places.extend([node(index, 0), node(index, clip.frames() - 1)]);
    }
    for event in &events {
        places.extend([event.first, event.last].map(|frame| Node {
            clip: event.clip,
            frame,
        }));
    }
    for t in transitions {
        places.extend([
            node(t.source_clip, t.source_frame),
            node(t.target_clip, t.target_frame),
        ]);
    }
    let nodes: Vec<Node> = places.into_iter().collect();
    let id = |place: Node| NodeId(nodes.partition_point(|other| *other < place) as u32);
    let mut edges: Vec<Edge> = nodes
        .windows(2)
        .filter(|pair| pair[0].clip == pair[1].clip)
        .map(|pair| {
            let holds = |e: &GraphEvent| {
                e.clip == pair[0].clip && e.first == pair[0].frame && e.last == pair[1].frame
            };
            Edge {
                from: id(pair[0]),
                to: id(pair[1]),
                frames: pair[1].frame - pair[0].frame,
                motion: EdgeMotion::Clip,
                event: events
                    .iter()
                    .position(holds)
                    .map(|index| EventId(index as u32)),
            }
        })
        .collect();
    edges.extend(transitions.iter().map(|t| {
        let starts = (t.source_frame + 1, t.target_frame + 1 - window);
        let align = distance::alignment(
            &clouds[t.source_clip],
            starts.0,
            &clouds[t.target_clip],
            starts.1,
            window,
        );
        Edge {
            from: id(node(t.source_clip, t.source_frame)),
            to: id(node(t.target_clip, t.target_frame)),
            frames: window as u32,
            motion: EdgeMotion::Transition {
                align,
                distance: t.distance,
            },
            event: None,
        }
    }));
    with_index(MotionGraph {
        skeleton: skeleton.clone(),
        frame_rate,
        clips,
        events,
        nodes,
        edges,
        first_edge: Vec::new(),
    })
}

/// Sorts the edges and notes where each node's begin.
fn with_index(mut graph: MotionGraph) -> MotionGraph {
    graph
        .edges
        .sort_by_key(|edge| (edge.from, edge.motion != EdgeMotion::Clip, edge.to));
    let nodes = graph.nodes.len() as u32;
    graph.first_edge = (0..=nodes)
        .map(|node| graph.edges.partition_point(|edge| edge.from.0 < node) as u32)
        .collect();
    graph
}

/// The strongly connected component with the most motion in it; `None` where none has an edge.
fn largest_component(full: &MotionGraph) -> Option<MotionGraph> {
    let ends: Vec<(u32, u32)> = full
        .edges
        .iter()
        .map(|edge| (edge.from.0, edge.to.0))
        .collect();
    let components = prune::components(full.nodes.len(), &ends);
    let of = |node: NodeId| components[node.index()];
    let inside = |edge: &&Edge| of(edge.from) == of(edge.to);
    let mut frames = vec![(0u32, 0u32); full.nodes.len()];
    for edge in full.edges.iter().filter(inside) {
        let sums = &mut frames[of(edge.from) as usize];
        let clip_frames = if edge.motion == EdgeMotion::Clip {
            edge.frames
        } else {
            0
        };
        *sums = (sums.0 + clip_frames, sums.1 + edge.frames);
    }
    let (best, _) = frames
        .iter()
        .enumerate()
        .rev()
        .max_by_key(|&(_, sums)| *sums)
        .filter(|(_, sums)| sums.1 > 0)?;
    let kept: Vec<bool> = components
        .iter()
        .map(|&component| component as usize == best)
        .collect();
    let mut new_id = vec![NodeId(u32::MAX); full.nodes.len()];
    let mut nodes = Vec::new();
    for (index, node) in full
        .nodes
        .iter()
        .enumerate()
        .filter(|&(index, _)| kept[index])
    {
        new_id[index] = NodeId(nodes.len() as u32);
        nodes.push(*node);
    }
    let mut events = Vec::new();
    let edges = full
        .edges
        .iter()
        .filter(|edge| kept[edge.from.index()] && kept[edge.to.index()])
        .map(|edge| {
            let event = edge.event.map(|event| {
                events.push(full.events[event.index()].clone());
                EventId(events.len() as u32 - 1)
            });
            Edge {
                from: new_id[edge.from.index()],
                to: new_id[edge.to.index()],
                event,
                ..edge.clone()
            }
        })
        .collect();
    Some(with_index(MotionGraph {
        skeleton: full.skeleton.clone(),
        frame_rate: full.frame_rate,
        clips: full.clips.clone(),
        events,
        nodes,
        edges,
        first_edge: Vec::new(),
    }))
}

fn report(
    source: ClipSource<'_>,
    full: &MotionGraph,
    graph: &MotionGraph,
    transitions: usize,
    clouds: &[PointCloud],
    window: usize,
) -> BuildReport {
    let windows: Vec<u64> = clouds
        .iter()
        .map(|cloud| (cloud.frames() + 1).saturating_sub(window) as u64)
        .collect();
    let total: u64 = windows.iter().sum();
    let count = |kind| {
        source
            .events
            .iter()
            .filter(|event| event.kind == kind)
            .count()
    };
    let gone = |kind| -> Vec<String> {
        let lost = |event: &&GraphEvent| event.kind == kind && !graph.events.contains(event);
        full.events
            .iter()
            .filter(lost)
            .map(|event| full.describe_event(event))
            .collect()
    };
    let used: BTreeSet<ClipId> = graph.nodes.iter().map(|node| node.clip).collect();
    let unused = graph
        .clips
        .iter()
        .enumerate()
        .filter(|&(index, _)| !used.contains(&ClipId(index as u32)));
    BuildReport {
        clips: source.clips.len(),
        seconds: source.clips.iter().map(Clip::duration).sum(),
        events: (count(EventKind::Evasion), count(EventKind::Attack)),
        transitions,
        // Each pair of clips once, a clip against itself in half its map.
        window_pairs: (total * total + windows.iter().map(|w| w * w).sum::<u64>()) / 2,
        dropped: Dropped {
            clips: unused.map(|(_, clip)| clip.name().to_owned()).collect(),
            seconds: full.seconds_kept() - graph.seconds_kept(),
            evasions: gone(EventKind::Evasion),
            attacks: gone(EventKind::Attack),
        },
    }
}

impl MotionGraph {
    /// An event in words: its clip and its seconds.
    #[must_use]
    pub fn describe_event(&self, event: &GraphEvent) -> String {
        let seconds = |frame: u32| f64::from(frame) / self.frame_rate;
        format!(
            "{} {:.2}-{:.2}",
            self.clip(event.clip).name(),
            seconds(event.first),
            seconds(event.last)
        )
    }
}
