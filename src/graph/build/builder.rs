//! Builds a strongly connected motion graph from clips and events.
//!
//! Source: Kovar, Gleicher & Pighin (2002), sections 3.1–3.3; Masaoka & Oshita, section 4.4. No transition blends an event.

use crate::anim::{Clip, ClipError, Skeleton};
use crate::graph::ClipId;
use crate::graph::build::align::Aligner;
use crate::graph::build::candidates::LinkSource;
use crate::graph::build::darts::{DartTest, PlantedClips};
use crate::graph::build::foot_plans::{DartKey, FootPlans};
use crate::graph::build::prune::largest_component;
use crate::graph::build::report::{BuildCounts, BuildReport, BuiltGraphs};
use crate::graph::build::{events, foot_plans, links};
use crate::graph::error::GraphError;
use crate::graph::motion_graph::{
    Edge, EdgeMotion, EventId, Feet, GraphEvent, MotionGraph, Node, NodeId,
};
use crate::graph::search::bands::{MapBand, SearchSettings};
use crate::graph::search::cloud::PointCloud;
use crate::graph::search::minima::TransitionList;
use crate::graph::search::pruned::PrunedSearch;
use crate::graph::search::transition::Transition;
use crate::graph::search::windows::Windows;
use crate::graph::settings::{ClipSource, GraphSettings};
use crate::graph::watch::{BakeStage, BakeWatch, Stopped, Unwatched};
use crate::math::in_parallel;
use rustc_hash::FxHashSet;

/// Builds a motion graph from `source`.
///
/// # Errors
/// The clips, events or settings are invalid, or the clips contain no cycle.
pub fn build(
    source: ClipSource<'_>,
    settings: &GraphSettings,
) -> Result<(MotionGraph, BuildReport), GraphError> {
    let builder = GraphBuilder::new(source, settings)?;
    let transitions = builder.find_transitions()?;
    builder.build(transitions)
}

/// A build in two steps: the search for transitions, which can be divided among processes, and the
/// build of the graph from them.
#[derive(Debug)]
pub struct GraphBuilder<'a> {
    source: ClipSource<'a>,
    settings: &'a GraphSettings,
    /// Clips at the graph's frame rate.
    clips: Vec<Clip>,
    events: Vec<GraphEvent>,
    clouds: Vec<PointCloud>,
    windows: Vec<Windows>,
    feet: Feet,
    watch: &'a dyn BakeWatch,
}

impl<'a> GraphBuilder<'a> {
    /// Checks the input and computes the points of all clips.
    ///
    /// # Errors
    /// The clips, events or settings are invalid.
    pub fn new(source: ClipSource<'a>, settings: &'a GraphSettings) -> Result<Self, GraphError> {
        if source.clips.is_empty() {
            return Err(GraphError::NoClips);
        }
        let weights = settings.checked_weights(source.skeleton.len())?;
        check_joints(source)?;
        settings.check_size(source)?;
        let clips = clips(source, settings)?;
        let events = events::in_frames(source, &clips, settings.frame_rate)?;
        let _span = tracing::trace_span!("bake: measure clips").entered();
        let window = settings.frames(settings.window);
        let measured = in_parallel(settings.threads, clips.len(), |clip| {
            let cloud = PointCloud::new(source.skeleton, &clips[clip], &weights);
            let windows = Windows::new(&cloud, window);
            (cloud, windows)
        });
        let (clouds, windows) = measured.into_iter().unzip();
        let feet = Feet::new(source.skeleton, &clips, settings);
        Ok(Self {
            watch: &Unwatched,
            source,
            settings,
            feet,
            clips,
            events,
            clouds,
            windows,
        })
    }

    /// Sets the object that follows the build, and may stop it. Default: [`Unwatched`].
    #[must_use]
    pub fn watched(self, watch: &'a dyn BakeWatch) -> Self {
        Self { watch, ..self }
    }

    /// Points of each clip. They are the only data of the clips that the search reads.
    #[must_use]
    pub fn clouds(&self) -> &[PointCloud] {
        &self.clouds
    }

    /// Settings of the search, in frames.
    #[must_use]
    pub fn search(&self) -> SearchSettings {
        SearchSettings {
            window: self.settings.frames(self.settings.window),
            separation: self.settings.frames(self.settings.separation),
            threshold: self.settings.threshold,
        }
    }

    /// All bands of the search, in the order in which a [`TransitionList`] takes their minima.
    pub fn bands(&self) -> impl Iterator<Item = MapBand> + Clone + use<> {
        let frames: Vec<usize> = self.clouds.iter().map(PointCloud::frames).collect();
        self.search().bands(&frames)
    }

    /// An empty list for the minima of all bands.
    #[must_use]
    pub fn transition_list(&self) -> TransitionList {
        TransitionList::new(self.search())
    }

    /// Searches all bands in this process. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// The graph would have too many transitions, or the search was stopped.
    pub fn find_transitions(&self) -> Result<TransitionList, GraphError> {
        let threads = self.settings.threads;
        let search = PrunedSearch::new(self.search(), self.windows.iter().collect(), threads);
        let mut list = self.transition_list();
        search.search(self.bands(), threads, self.watch, |band, found| {
            list.count(found.computed);
            list.add(band, &found.minima)
        })?;
        Ok(list)
    }

    /// Builds the graph from the minima of all bands.
    ///
    /// # Errors
    /// The graph would have too many transitions, the clips contain no cycle, or the build was stopped.
    pub fn build(self, found: TransitionList) -> Result<(MotionGraph, BuildReport), GraphError> {
        let mut darts = self.dart_test();
        let (transitions, counts) = self.choose(found, &mut darts)?;
        let plans = darts.map_or_else(FootPlans::default, DartTest::into_plans);
        self.assemble(&transitions, &plans, counts)
    }

    /// Transitions in which no foot darts and that cut no event, with the links, and the counts of the build.
    fn choose(
        &self,
        found: TransitionList,
        darts: &mut Option<DartTest>,
    ) -> Result<(Vec<Transition>, BuildCounts), GraphError> {
        self.watch.check()?;
        let distances = found.distances();
        let mut transitions = found.finish()?;
        let by_clip = EventsByClip::new(&self.events, self.clips.len());
        transitions.retain(|transition| !by_clip.is_cut(transition));
        let under_threshold = transitions.len();
        let darting = match darts {
            Some(test) => {
                let _span = tracing::trace_span!("bake: test for darting feet").entered();
                let before = transitions.len();
                let mut darts = self.darts(test, &transitions)?.into_iter();
                transitions.retain(|_| !darts.next().unwrap_or(false));
                before - transitions.len()
            }
            None => 0,
        };
        let source = LinkSource {
            clips: &self.clips,
            aligner: self.aligner(),
            windows: &self.windows,
            events: &events::merged(&self.events),
            settings: self.settings,
            watch: self.watch,
        };
        let links = {
            let _span = tracing::trace_span!("bake: add links").entered();
            links::add(source, &mut transitions, darts)?
        };
        let counts = BuildCounts {
            transitions: under_threshold,
            window_pairs: self.bands().map(|band| band.pairs()).sum(),
            distances,
            darting: darting + links.darting,
            links,
            threads: self.settings.threads,
        };
        Ok((transitions, counts))
    }

    fn aligner(&self) -> Aligner<'_> {
        Aligner {
            clouds: &self.clouds,
            feet: self.settings.feet.keep.then_some(&self.feet),
        }
    }

    fn dart_test(&self) -> Option<DartTest> {
        let clips = PlantedClips {
            skeleton: self.source.skeleton,
            clips: &self.clips,
            feet: &self.feet,
        };
        DartTest::new(clips, self.settings)
    }

    /// For each transition, whether a foot darts in it.
    fn darts(&self, test: &mut DartTest, transitions: &[Transition]) -> Result<Vec<bool>, Stopped> {
        /// Number of transitions that are tested together. Larger numbers take more memory and save no time.
        const BATCH: usize = 8192;
        let stage = self.watch.stage(BakeStage::Feet, self.settings.threads);
        let mut darts = Vec::with_capacity(transitions.len());
        for batch in transitions.chunks(BATCH) {
            self.watch.check()?;
            darts.extend(test.darts(batch, |transition| self.aligner().align(transition)));
            stage.progress(darts.len() as u64, transitions.len() as u64);
        }
        Ok(darts)
    }

    /// Assembles the graph, keeps its largest component and reports what was left out.
    fn assemble(
        mut self,
        transitions: &[Transition],
        plans: &FootPlans,
        counts: BuildCounts,
    ) -> Result<(MotionGraph, BuildReport), GraphError> {
        let _span = tracing::trace_span!("bake: assemble the graph").entered();
        let (source, settings) = (self.source, self.settings);
        let parts = Parts {
            skeleton: source.skeleton,
            clips: std::mem::take(&mut self.clips),
            events: std::mem::take(&mut self.events),
            aligner: self.aligner(),
            transitions,
            plans,
            frame_rate: settings.frame_rate,
            threads: settings.threads,
        };
        let full = parts.assemble();
        let mut graph = largest_component(&full).ok_or_else(|| GraphError::NoCycle {
            clips: source.clips.len(),
            seconds: source.clips.iter().map(Clip::duration).sum(),
            threshold: settings.threshold,
        })?;
        graph.feet = self.feet;
        if settings.feet.keep && !graph.feet.legs.is_empty() {
            let planned = foot_plans::all(&graph, plans, settings.threads);
            (graph.feet.blends, graph.feet.root_drops) = planned;
        }
        let graphs = BuiltGraphs {
            full: &full,
            kept: &graph,
        };
        let report = BuildReport::new(source, &graphs, counts);
        tracing::debug!(
            nodes = graph.nodes.len(),
            edges = graph.edges.len(),
            "motion graph built"
        );
        Ok((graph, report))
    }
}

/// The clips at the graph's frame rate, compressed if the settings say so.
fn clips(source: ClipSource<'_>, settings: &GraphSettings) -> Result<Vec<Clip>, ClipError> {
    let _span = tracing::trace_span!("bake: compress clips").entered();
    let made = in_parallel(settings.threads, source.clips.len(), |index| {
        let clip = source.clips[index].resampled(settings.frame_rate)?;
        Ok(match &settings.compression {
            Some(compression) => clip.compressed(source.skeleton, compression),
            None => clip,
        })
    });
    made.into_iter().collect()
}

fn check_joints(source: ClipSource<'_>) -> Result<(), GraphError> {
    let joints = source.skeleton.len();
    for clip in source.clips {
        let found = clip.joints();
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

/// Events of each clip.
struct EventsByClip<'a>(Vec<Vec<&'a GraphEvent>>);

impl<'a> EventsByClip<'a> {
    fn new(events: &'a [GraphEvent], clips: usize) -> Self {
        let mut of_clips = vec![Vec::new(); clips];
        for event in events {
            of_clips[event.clip.index()].push(event);
        }
        Self(of_clips)
    }

    /// Whether a transition would blend a part of an event.
    fn is_cut(&self, transition: &Transition) -> bool {
        let clips = [transition.source_clip, transition.target_clip];
        clips
            .iter()
            .flat_map(|&clip| &self.0[clip])
            .any(|event| transition.cuts(event))
    }
}

// Assembles nodes and edges from clips, events and transitions.
//
// Each event is one edge. Where events overlap, additional edges play the parts between their ends.

/// Data from which the graph is assembled.
pub(crate) struct Parts<'a> {
    pub(crate) skeleton: &'a Skeleton,
    pub(crate) clips: Vec<Clip>,
    pub(crate) events: Vec<GraphEvent>,
    pub(crate) aligner: Aligner<'a>,
    pub(crate) transitions: &'a [Transition],
    /// Known plans of how transitions move their feet.
    pub(crate) plans: &'a FootPlans,
    pub(crate) frame_rate: f64,
    pub(crate) threads: usize,
}

impl Parts<'_> {
    /// Assembles all nodes and edges, including those that the largest component leaves out.
    pub(crate) fn assemble(self) -> MotionGraph {
        let nodes = self.nodes();
        let mut edges: Vec<Edge> = self.event_edges(&nodes).collect();
        let of_events: FxHashSet<(NodeId, NodeId)> =
            edges.iter().map(|edge| (edge.from, edge.to)).collect();
        let of_clips = nodes.windows(2).zip(0..).filter_map(|(pair, index)| {
            let ends = (NodeId(index), NodeId(index + 1));
            let is_new = pair[0].clip == pair[1].clip && !of_events.contains(&ends);
            is_new.then(|| clip_edge(&nodes, ends.0, ends.1))
        });
        edges.extend(of_clips);
        edges.extend(in_parallel(self.threads, self.transitions.len(), |index| {
            self.blend(&self.transitions[index], &nodes)
        }));
        MotionGraph {
            skeleton: self.skeleton.clone(),
            frame_rate: self.frame_rate,
            clips: self.clips,
            events: self.events,
            nodes,
            edges,
            first_edge: Vec::new(),
            feet: Feet::default(),
            rig: crate::graph::motion_graph::KnownRig::default(),
        }
        .with_index()
    }

    /// Nodes at the ends of clips, events and transitions, sorted.
    fn nodes(&self) -> Vec<Node> {
        let mut places = Vec::new();
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
        places.sort_unstable();
        places.dedup();
        places
    }

    /// The edges of events that have motion.
    fn event_edges<'a>(&'a self, nodes: &'a [Node]) -> impl Iterator<Item = Edge> + 'a {
        let playable = self.events.iter().zip(0..);
        let playable = playable.filter(|(event, _)| event.first < event.last);
        playable.map(|(event, index)| {
            let ends = [event.first, event.last].map(|frame| Node {
                clip: event.clip,
                frame,
            });
            let [from, to] = ends.map(|end| node_id(nodes, end));
            Edge {
                event: Some(EventId(index)),
                ..clip_edge(nodes, from, to)
            }
        })
    }

    fn blend(&self, t: &Transition, nodes: &[Node]) -> Edge {
        let align = match self.plans.get(&DartKey::of(t)) {
            Some(plan) => plan.root.align,
            None => self.aligner.align(t),
        };
        Edge {
            from: node_id(nodes, node(t.source_clip, t.source_frame)),
            to: node_id(nodes, node(t.target_clip, t.target_frame)),
            frames: t.frames as u32,
            motion: EdgeMotion::Transition {
                align,
                distance: t.distance,
            },
            event: None,
        }
    }
}

/// Edge that plays the clip between two of its nodes, without an event.
fn clip_edge(nodes: &[Node], from: NodeId, to: NodeId) -> Edge {
    Edge {
        from,
        to,
        frames: nodes[to.index()].frame - nodes[from.index()].frame,
        motion: EdgeMotion::Clip,
        event: None,
    }
}

fn node_id(nodes: &[Node], place: Node) -> NodeId {
    NodeId(nodes.partition_point(|other| *other < place) as u32)
}

fn node(clip: usize, frame: usize) -> Node {
    Node {
        clip: ClipId(clip as u32),
        frame: frame as u32,
    }
}
