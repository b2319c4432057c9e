//! Converts events from seconds to frames of the resampled clips.

use super::{ClipId, ClipSource, GraphError, GraphEvent};
use crate::anim::{Clip, Event};

/// Events in frames of `clips`, which have the frame rate `frame_rate`. An event shorter than a
/// frame has no motion, so it gets no edge and is reported as dropped.
pub(super) fn in_frames(
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

/// Checks that two events share at most the frame in which one ends and the other starts. Otherwise
/// a node would cut an event.
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
