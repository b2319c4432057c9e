//! The input of a build: clips at the graph's frame rate, with their events, points, windows and planted feet.

use crate::anim::{Clip, ClipError, JointId, Leg};
use crate::graph::ClipId;
use crate::graph::build::events;
use crate::graph::error::GraphError;
use crate::graph::motion_graph::{Feet, GraphEvent};
use crate::graph::search::bands::{MapBand, SearchSettings};
use crate::graph::search::minima::TransitionList;
use crate::graph::search::pruned::PrunedSearch;
use crate::graph::search::transition::Transition;
use crate::graph::search::windows::{PointCloud, Windows};
use crate::graph::settings::{ClipSource, GraphSettings};
use crate::graph::watch::{BakeWatch, Unwatched};
use crate::math::{Rigid2, in_parallel};

/// A build in two steps: the search for transitions, which can be divided among processes, and the
/// build of the graph from them ([`GraphBuilder::build`]).
#[derive(Debug)]
pub struct GraphBuilder<'a> {
    pub(crate) source: ClipSource<'a>,
    pub(crate) settings: &'a GraphSettings,
    /// Clips at the graph's frame rate.
    pub(crate) clips: Vec<Clip>,
    pub(crate) events: Vec<GraphEvent>,
    /// Points of each clip, and their windows.
    pub(crate) clouds: Vec<PointCloud>,
    pub(crate) windows: Vec<Windows>,
    pub(crate) feet: Feet,
    /// Number of frames that were added before each clip; empty if none were.
    pub(crate) leads: Vec<u32>,
    pub(crate) watch: &'a dyn BakeWatch,
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
        if source.clips.iter().all(|clip| clip.frames() == 1) {
            let clips = source.clips.len();
            return Err(GraphError::NoMotion { clips });
        }
        let weights = settings.checked_weights(source.skeleton)?;
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
        Ok(Self {
            watch: &Unwatched,
            source,
            settings,
            feet: Feet::new(source.skeleton, &clips, settings.threads),
            leads: Vec::new(),
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
    pub fn clouds(&self) -> &[PointCloud] {
        &self.clouds
    }

    /// Settings of the search, in frames.
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
            list.distances += found.computed;
            list.add(band, &found.minima)
        })?;
        Ok(list)
    }

    /// Transform from the space of a transition's target clip to that of its source clip.
    ///
    /// Source: the closed form is that of Kovar, Gleicher & Pighin (2002), section 3.1, whose weights may differ by point. Differs: a
    /// foot that stands in both clips gets most of the weight, so that it stays where it stands and the body, which is free in the air,
    /// moves instead. The distance of the windows, by which transitions are found, is not changed by it.
    pub(crate) fn align(&self, transition: &Transition) -> Rigid2 {
        /// Weight of each joint of a foot that stands. All joints of the body together have weight 1.
        const STANDING: f64 = 1.0;
        let pair = transition.windows(&self.clouds);
        if !self.settings.keep_feet {
            return pair.alignment();
        }
        let stands = |leg: usize, frame: usize| {
            let sides = [
                (transition.source_clip, pair.start_a),
                (transition.target_clip, pair.start_b),
            ];
            sides.iter().all(|&(clip, start)| {
                let frame = (start + frame) as u32;
                self.feet.stands(ClipId(clip as u32), leg, frame)
            })
        };
        pair.weighted_alignment(|joint, frame| {
            let has = |leg: &Leg| [leg.foot, leg.toe_or_foot()].contains(&JointId(joint as u16));
            let leg = self.feet.legs.iter().position(has);
            match leg.is_some_and(|leg| stands(leg, frame)) {
                true => STANDING,
                false => 0.0,
            }
        })
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
    match source.clips.iter().find(|clip| clip.joints() != joints) {
        Some(clip) => Err(GraphError::ClipJoints {
            clip: clip.name().to_owned(),
            found: clip.joints(),
            joints,
        }),
        None => Ok(()),
    }
}
