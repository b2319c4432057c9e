//! Measures what characters without a task do.

use std::sync::Arc;

use sabaki::character::{CharacterError, CharacterId, CharacterSettings, Characters};
use sabaki::graph::EventId;
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;

use super::{FRAME, clip_frame};

/// Measurements of characters without a task.
#[derive(Clone, Copy, Debug, Default)]
pub struct IdleReport {
    /// Labelled attacks and evasions that began, an hour.
    pub events_per_hour: f32,
    /// Share of the time in which a frame was played that had been played within the 10 s before.
    pub repeated: f32,
    /// Largest distance from the start, in metres.
    pub drift: f32,
    /// Share of the time in which two characters played the same frame, of all pairs.
    pub in_step: f32,
}

/// Frames of a clip that lie within this are the same.
const SAME: f32 = 0.51;

/// Lets four characters stand for five minutes.
///
/// # Errors
/// A graph in which nothing can be played.
pub fn idle(baked: &Arc<BakedGraph>, threads: usize) -> Result<IdleReport, CharacterError> {
    const COUNT: usize = 4;
    const SECONDS: f32 = 300.0;
    let frames = (SECONDS / FRAME) as usize;
    let settings = CharacterSettings {
        threads,
        ..CharacterSettings::default()
    };
    let mut characters = Characters::new(Arc::clone(baked), settings)?;
    let mut all = Vec::new();
    for index in 0..COUNT {
        let place = Rigid2::new(index as f32, 10.0 * index as f32, 0.0);
        let id = characters.spawn(place)?;
        all.push(Idle {
            id,
            start: characters.place(id)?,
            played: Vec::new(),
            event: None,
        });
    }
    let mut report = IdleReport::default();
    for _ in 0..frames {
        characters.step(FRAME, &[], &mut Vec::new());
        for idle in &mut all {
            idle.look(&characters, &mut report)?;
        }
        let now = |idle: &Idle| idle.played.last().copied().flatten();
        for (index, one) in all.iter().enumerate() {
            let same = |other: &&Idle| now(one).zip(now(other)).is_some_and(is_same);
            report.in_step += all[..index].iter().filter(same).count() as f32;
        }
    }
    let count = (frames * COUNT) as f32;
    report.events_per_hour *= 3600.0 / (SECONDS * COUNT as f32);
    report.repeated /= count;
    report.in_step /= 0.5 * count * (COUNT - 1) as f32;
    Ok(report)
}

/// A character that stands.
struct Idle {
    id: CharacterId,
    start: Rigid2,
    /// Clip and frame by frame of the game; `None` in a transition.
    played: Vec<Option<(u32, f32)>>,
    /// The event that it plays.
    event: Option<EventId>,
}

impl Idle {
    /// Adds what it does now.
    fn look(
        &mut self,
        characters: &Characters,
        report: &mut IdleReport,
    ) -> Result<(), CharacterError> {
        /// Times within this are one visit, in frames of the game.
        const VISIT: usize = 60;
        const REMEMBERED: usize = 600;
        let graph = characters.baked().graph();
        let playhead = characters.playhead(self.id)?;
        let event = graph.edge(playhead.edge).event;
        if event.is_some() && event != self.event {
            report.events_per_hour += 1.0;
        }
        self.event = event;
        let now = clip_frame(graph, playhead);
        let last = self.played.len();
        let recent = &self.played[last.saturating_sub(REMEMBERED)..last.saturating_sub(VISIT)];
        let was_played = |now| recent.iter().flatten().any(|&one| is_same((now, one)));
        report.repeated += f32::from(u8::from(now.is_some_and(was_played)));
        self.played.push(now);
        let place = characters.place(self.id)?.ground();
        report.drift = report.drift.max(place.distance(self.start.ground()));
        Ok(())
    }
}

/// Whether two frames of clips look the same.
fn is_same((a, b): ((u32, f32), (u32, f32))) -> bool {
    a.0 == b.0 && (a.1 - b.1).abs() < SAME
}

#[cfg(test)]
mod tests {
    use super::*;
    use sabaki_fixtures::baked::embedded;
    use sabaki_fixtures::captures::fight;

    fn stands_without_repeating(baked: &BakedGraph) {
        let report = idle(&Arc::new(baked.clone()), 2).unwrap();
        assert_eq!((report.repeated, report.events_per_hour), (0.0, 0.0));
        assert!(report.drift < 0.7, "{} m", report.drift);
        assert!(report.in_step < 0.02, "{}", report.in_step);
    }

    #[test]
    fn who_stands_repeats_nothing_within_ten_seconds() {
        stands_without_repeating(embedded());
    }

    #[test]
    #[ignore = "needs SABAKI_MOCAP"]
    fn who_stands_repeats_nothing_within_ten_seconds_on_real_capture() {
        let baked = fight();
        stands_without_repeating(baked);
    }
}
