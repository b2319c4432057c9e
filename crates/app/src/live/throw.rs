use super::aim::Ball;
use super::event::Event;
use super::worker_request::WorkerResponse;
use sabaki::graph::{Motion, Playhead};
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::{Answer, QuerySettings};
use sabaki_draw::scene::{AnsweredAttack, Dodge, DodgeSettings};

/// A thrown ball with the answer to it.
#[derive(Clone, Debug)]
pub struct Throw<'a> {
    /// Number of the throw, counted from 1.
    pub number: u32,
    /// Attack of the ball; its time starts at the click.
    pub ball: Ball,
    /// Place of the fighter at the click.
    pub playhead: Playhead,
    /// Answer of the query, with all candidates.
    pub response: WorkerResponse,
    /// Settings of the query.
    pub settings: QuerySettings,
    /// Motion and candidates to draw.
    pub dodge: Dodge<'a>,
    /// Motion of the fighter, until everything that is shown is over.
    pub motion: Motion,
    /// Maps of the query.
    pub maps: MapGrid,
}

/// A thrown ball without its answer.
pub(super) struct OpenThrow {
    pub(super) number: u32,
    pub(super) ball: Ball,
    pub(super) playhead: Playhead,
    pub(super) settings: QuerySettings,
}

impl<'a> Throw<'a> {
    /// Combines a click and the response to it. `baked` has the maps of the query.
    pub(super) fn new(baked: &'a BakedGraph, open: &OpenThrow, response: WorkerResponse) -> Self {
        let (ball, playhead) = (open.ball.clone(), open.playhead);
        let shown = DodgeSettings {
            ghost: false,
            ..DodgeSettings::default()
        };
        let answered = AnsweredAttack {
            playhead,
            attack: &ball.attack,
            answer: &response.answer,
        };
        let dodge = Dodge::new(baked, answered, &shown);
        let mut motion = response.answer.motion.clone();
        motion.extend(baked.graph(), dodge.span()[1]);
        Self {
            number: response.number,
            ball,
            playhead,
            response,
            settings: open.settings,
            dodge,
            motion,
            maps: baked.atlas().grid(),
        }
    }

    /// The answer as an event.
    #[must_use]
    pub fn answer(&self) -> &Answer {
        &self.response.answer
    }

    /// The throw as an event.
    #[must_use]
    pub fn event(&self) -> Event {
        let answer = self.answer();
        let (clearance, counts) = (answer.clearance(), answer.counts);
        let evades = answer
            .candidates
            .get(answer.chosen)
            .is_some_and(|chosen| chosen.evasion.is_some());
        Event::Answer {
            number: self.number,
            avoided: answer.avoided,
            chosen: if evades { "evasion" } else { "move" },
            clearance: clearance.metres,
            nearest_at: clearance.time,
            source: answer.source,
            candidates: counts.candidates,
            culled: counts.culled,
            hits: counts.hits,
            clean: counts.clean,
            cull: self.response.culling.name(),
            slab_height: self.maps.slab_height,
            grid: self.settings.enumerate.uses_grid(),
            query_ms: 1e3 * self.response.seconds,
        }
    }
}
