//! What a character does that has nothing to do.

use std::sync::Arc;

use sabaki::character::{CharacterError, CharacterSettings, Characters};
use sabaki::maps::BakedGraph;
use sabaki::math::{Rigid2, in_parallel};

use super::{FRAME, clip_frame};

/// What was measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct IdleReport {
    /// Labelled attacks and evasions that began, an hour.
    pub events_per_hour: f32,
    /// Share of the time in which a frame was played that had been played within the 10 s before.
    pub repeated: f32,
    /// Distance from the start at the end, in metres; the largest.
    pub drift: f32,
}

/// Lets four characters stand for five minutes each.
///
/// # Errors
/// A graph in which nothing can be played.
pub fn idle(baked: &Arc<BakedGraph>, threads: usize) -> Result<IdleReport, CharacterError> {
    const COUNT: usize = 4;
    const SECONDS: f32 = 300.0;
    let frames = (SECONDS / FRAME) as usize;
    let runs = in_parallel(threads, COUNT, |index| stand(baked, index, frames));
    let mut report = IdleReport::default();
    for run in runs {
        let [begun, repeated, drift] = run?;
        report.events_per_hour += begun * 3600.0 / (SECONDS * COUNT as f32);
        report.repeated += repeated / (frames * COUNT) as f32;
        report.drift = report.drift.max(drift);
    }
    Ok(report)
}

/// Events that began, frames that were repeated, and the distance from the start.
fn stand(baked: &Arc<BakedGraph>, index: usize, frames: usize) -> Result<[f32; 3], CharacterError> {
    /// Frames of the clip that lie within this are the same, and times within this are one visit, in frames of the game.
    const SAME: f32 = 0.51;
    const VISIT: usize = 60;
    const REMEMBERED: usize = 600;
    let graph = baked.graph();
    let mut characters = Characters::new(Arc::clone(baked), CharacterSettings::default())?;
    let id = characters.spawn(Rigid2::new(index as f32, 0.0, 0.0))?;
    let start = characters.place(id)?.ground();
    let (mut played, mut events) = (Vec::new(), Vec::new());
    let (mut begun, mut repeated, mut before) = (0.0, 0.0, None);
    for _ in 0..frames {
        characters.step(FRAME, &[], &mut events);
        let playhead = characters.playhead(id)?;
        let event = graph.edge(playhead.edge).event;
        if event.is_some() && event != before {
            begun += 1.0;
        }
        before = event;
        let now = clip_frame(graph, playhead);
        let last = played.len();
        let recent = &played[last.saturating_sub(REMEMBERED)..last.saturating_sub(VISIT)];
        let same = |(a, b): ((u32, f32), (u32, f32))| a.0 == b.0 && (a.1 - b.1).abs() < SAME;
        let was_played = |now: (u32, f32)| recent.iter().flatten().any(|&one| same((now, one)));
        repeated += f32::from(u8::from(now.is_some_and(was_played)));
        played.push(now);
    }
    let drift = characters.place(id)?.ground().distance(start);
    Ok([begun, repeated, drift])
}
