//! Builds a strongly connected motion graph from clips and events.
//!
//! Source: Kovar, Gleicher & Pighin (2002), sections 3.1–3.3; Masaoka & Oshita, section 4.4. No transition blends an event.

use crate::anim::Clip;
use crate::graph::ClipId;
use crate::graph::build::input::GraphBuilder;
use crate::graph::build::prune::largest_component;
use crate::graph::build::report::{BuildReport, Dropped, EventCounts};
use crate::graph::build::transition_test::TransitionTest;
use crate::graph::build::{foot_plans, islands, links};
use crate::graph::error::GraphError;
use crate::graph::motion_graph::{
    Edge, EdgeMotion, EventId, GraphEvent, MotionGraph, Node, NodeId,
};
use crate::graph::search::minima::TransitionList;
use crate::graph::search::transition::Transition;
use crate::graph::settings::{ClipSource, GraphSettings};
use crate::graph::watch::{BakeStage, Stopped};
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

impl GraphBuilder<'_> {
    /// Builds the graph from the minima of all bands.
    ///
    /// # Errors
    /// The graph would have too many transitions, the clips contain no cycle, or the build was stopped.
    pub fn build(
        mut self,
        found: TransitionList,
    ) -> Result<(MotionGraph, BuildReport), GraphError> {
        let mut test = TransitionTest::new(&self);
        let (mut transitions, mut report) = self.choose(found, &mut test)?;
        let islands = islands::find(&self, &transitions);
        if !islands.is_empty() {
            let _span = tracing::trace_span!("bake: join clips").entered();
            transitions.truncate(transitions.len() - report.links.links);
            [report.joined, report.islands] = islands::join(&mut self, &islands, &mut transitions)?;
            test = TransitionTest::new(&self);
            report.links = links::add(&self, &mut transitions, &mut test)?;
        }
        self.assemble(&transitions, report)
    }

    /// Transitions that a body can do and that cut no event, with the links, and a report that counts them.
    fn choose(
        &self,
        found: TransitionList,
        test: &mut Option<TransitionTest>,
    ) -> Result<(Vec<Transition>, BuildReport), GraphError> {
        self.watch.check()?;
        let distances = found.distances;
        let mut transitions = found.finish()?;
        let mut events: Vec<Vec<&GraphEvent>> = vec![Vec::new(); self.clips.len()];
        for event in &self.events {
            events[event.clip.index()].push(event);
        }
        transitions.retain(|transition| {
            let clips = [transition.source_clip, transition.target_clip];
            let mut beside = clips.iter().flat_map(|&clip| &events[clip]);
            !beside.any(|event| transition.cuts(event))
        });
        let under_threshold = transitions.len();
        if let Some(test) = test {
            let _span = tracing::trace_span!("bake: test speed of feet").entered();
            let mut impossible = self.impossible(test, &transitions)?.into_iter();
            transitions.retain(|_| !impossible.next().unwrap_or(false));
        }
        let impossible = under_threshold - transitions.len();
        let links = {
            let _span = tracing::trace_span!("bake: add links").entered();
            links::add(self, &mut transitions, test)?
        };
        let report = BuildReport {
            transitions: under_threshold,
            window_pairs: self.bands().map(|band| band.pairs()).sum(),
            distances,
            impossible: impossible + links.impossible,
            links,
            ..BuildReport::default()
        };
        Ok((transitions, report))
    }

    fn impossible(
        &self,
        test: &mut TransitionTest,
        transitions: &[Transition],
    ) -> Result<Vec<bool>, Stopped> {
        /// Number of transitions that are tested together. Larger numbers take more memory and save no time.
        const BATCH: usize = 8192;
        let stage = self.watch.stage(BakeStage::Feet, self.settings.threads);
        let mut impossible = Vec::with_capacity(transitions.len());
        for batch in transitions.chunks(BATCH) {
            self.watch.check()?;
            impossible.extend(test.impossible(self, batch));
            stage.progress(impossible.len() as u64, transitions.len() as u64);
        }
        Ok(impossible)
    }

    /// Assembles the graph, keeps its largest component and reports what was left out.
    fn assemble(
        mut self,
        transitions: &[Transition],
        counts: BuildReport,
    ) -> Result<(MotionGraph, BuildReport), GraphError> {
        let _span = tracing::trace_span!("bake: assemble the graph").entered();
        let (source, settings) = (self.source, self.settings);
        let nodes = self.nodes(transitions);
        let edges = self.edges(&nodes, transitions);
        let mut full = MotionGraph::new(
            source.skeleton.clone(),
            settings.frame_rate,
            std::mem::take(&mut self.clips),
            std::mem::take(&mut self.events),
            nodes,
            edges,
        );
        full.leads = std::mem::take(&mut self.leads);
        let seconds = source.clips.iter().map(Clip::duration).sum();
        let Some(mut graph) = largest_component(&full) else {
            return Err(GraphError::NoCycle {
                clips: source.clips.len(),
                seconds,
                threshold: settings.threshold,
            });
        };
        graph.feet = self.feet;
        if settings.keep_feet && !graph.feet.legs.is_empty() {
            let planned = foot_plans::all(&graph, settings.threads);
            (graph.feet.blends, graph.feet.root_drops) = planned;
        }
        let report = BuildReport {
            clips: source.clips.len(),
            seconds,
            events: EventCounts::new(source.events),
            dropped: Dropped::between(&full, &graph),
            responsiveness: graph.responsiveness_within(&[0.5, 1.0, 1.5], true, settings.threads),
            ..counts
        };
        tracing::debug!(
            nodes = graph.nodes.len(),
            edges = graph.edges.len(),
            "motion graph built"
        );
        Ok((graph, report))
    }

    // Assembles nodes and edges from clips, events and transitions.
    //
    // Each event is one edge. Where events overlap, additional edges play the parts between their ends.

    /// Nodes at the ends of clips, events and transitions, sorted.
    fn nodes(&self, transitions: &[Transition]) -> Vec<Node> {
        let mut places = Vec::new();
        for (index, clip) in (0..).zip(&self.clips) {
            let place = |frame: usize| Node {
                clip: ClipId(index),
                frame: frame as u32,
            };
            places.extend([0, clip.frames() - 1].map(place));
        }
        for event in &self.events {
            places.extend(event.ends());
        }
        places.extend(transitions.iter().flat_map(Transition::ends));
        places.sort_unstable();
        places.dedup();
        places
    }

    /// All edges, including those that the largest component leaves out.
    fn edges(&self, nodes: &[Node], transitions: &[Transition]) -> Vec<Edge> {
        // An event without motion has no edge.
        let playable = self.events.iter().zip(0..);
        let playable = playable.filter(|(event, _)| event.first < event.last);
        let event_edges = playable.map(|(event, index)| {
            let [from, to] = event.ends().map(|end| node_id(nodes, end));
            Edge {
                event: Some(EventId(index)),
                ..clip_edge(nodes, from, to)
            }
        });
        let mut edges: Vec<Edge> = event_edges.collect();
        let of_events: FxHashSet<(NodeId, NodeId)> =
            edges.iter().map(|edge| (edge.from, edge.to)).collect();
        edges.extend(nodes.windows(2).zip(0..).filter_map(|(pair, index)| {
            let ends = (NodeId(index), NodeId(index + 1));
            let is_new = pair[0].clip == pair[1].clip && !of_events.contains(&ends);
            is_new.then(|| clip_edge(nodes, ends.0, ends.1))
        }));
        edges.extend(in_parallel(
            self.settings.threads,
            transitions.len(),
            |index| {
                let t = &transitions[index];
                let [from, to] = t.ends().map(|end| node_id(nodes, end));
                Edge {
                    from,
                    to,
                    frames: t.frames as u32,
                    motion: EdgeMotion::Transition {
                        align: self.align(t),
                        distance: t.distance,
                    },
                    event: None,
                }
            },
        ));
        edges
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
