//! Events in frames of the resampled clips, and the parts of the clips that they cover. Events may overlap.

use crate::anim::{Clip, Event, EventKind};
use crate::graph::ClipId;
use crate::graph::error::GraphError;
use crate::graph::motion_graph::{GraphEvent, twice};
use crate::graph::settings::ClipSource;

/// Events in frames of `clips`, which have the frame rate `frame_rate`. An event shorter than a
/// frame has no motion, so it gets no edge and is reported as dropped.
pub(crate) fn in_frames(
    source: ClipSource<'_>,
    clips: &[Clip],
    frame_rate: f64,
) -> Result<Vec<GraphEvent>, GraphError> {
    let to_frames = |(index, event): (usize, &Event)| {
        let clip = clips.get(event.clip);
        let last_frame = clip.map_or(0, |clip| clip.frames() - 1) as f64;
        let (first, last) = (
            (event.start * frame_rate).round(),
            (event.end * frame_rate).round(),
        );
        // An event may end at the very end of a capture. The resampled clip can end up to one frame
        // earlier.
        let inside = first >= 0.0 && first <= last_frame && last <= last_frame + 1.0;
        let joints_known = event
            .joints
            .iter()
            .all(|id| id.index() < source.skeleton.len());
        if clip.is_none() || !inside || !joints_known || event.end <= event.start {
            return Err(GraphError::Event {
                index,
                clip: clip.map(|clip| clip.name().to_owned()),
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
    match twice(&events) {
        Some([first, second]) => {
            let event = &source.events[first];
            Err(GraphError::EventTwice {
                first,
                second,
                clip: clips[event.clip].name().to_owned(),
                start: event.start,
                end: event.end,
            })
        }
        None => Ok(events),
    }
}

/// Merges overlapping events. Each group of them becomes one event from the first start to the last end, in the order of the groups' first
/// events. It is an evasion if an evasion starts at the start of the group.
pub(crate) fn merged(events: &[GraphEvent]) -> Vec<GraphEvent> {
    let start = |&index: &usize| (events[index].clip, events[index].first);
    let mut groups: Vec<(usize, GraphEvent)> = Vec::new();
    let mut order: Vec<usize> = (0..events.len()).collect();
    order.sort_by_key(start);
    for index in order {
        let event = &events[index];
        match groups.last_mut() {
            Some((first, group)) if group.clip == event.clip && event.first < group.last => {
                if event.kind == EventKind::Evasion && event.first == group.first {
                    group.kind = EventKind::Evasion;
                }
                group.last = group.last.max(event.last);
                *first = index.min(*first);
            }
            _ => groups.push((index, event.clone())),
        }
    }
    groups.sort_by_key(|group| group.0);
    groups.into_iter().map(|(_, group)| group).collect()
}
