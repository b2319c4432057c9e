//! Builds a strongly connected motion graph from clips and events.
//!
//! Source: Kovar, Gleicher & Pighin (2002), sections 3.1–3.3; Masaoka & Oshita, section 4.4. No transition blends an event.

use super::component::largest_component;
use super::distance::Windows;
use super::feet::{Aligner, DartTest, FootPlans, PlantedClips};
use super::links::{self, LinkSource};
use super::parts::Parts;
use super::report::{BuildCounts, BuiltGraphs};
use super::search::{MapBand, PrunedSearch, SearchSettings, TransitionList};
use super::source::ClipSource;
use super::watch::{BakeStage, BakeWatch, Stopped, Unwatched};
use super::{
    BuildReport, Feet, GraphError, GraphEvent, GraphSettings, MotionGraph, PointCloud, Transition,
    events,
};
use crate::anim::{Clip, ClipError};
use crate::math::in_parallel;

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
        let graph = largest_component(&full).ok_or_else(|| GraphError::NoCycle {
            clips: source.clips.len(),
            seconds: source.clips.iter().map(Clip::duration).sum(),
            threshold: settings.threshold,
        })?;
        let graph = graph.with_feet(self.feet, plans, settings);
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
