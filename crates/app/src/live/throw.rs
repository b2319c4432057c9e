use super::aim::Ball;
use super::asker::Reply;
use super::event::Event;
use sabaki::graph::{Motion, Playhead};
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::{Answer, Enumerate, QuerySettings};
use sabaki_draw::scene::{Dodge, DodgeSettings};

/// A ball that was thrown, and what was done about it.
#[derive(Clone, Debug)]
pub struct Throw<'a> {
    /// Counts from 1.
    pub number: u32,
    /// The ball; its clock starts at the click.
    pub ball: Ball,
    /// Where the fighter was then.
    pub playhead: Playhead,
    /// What the query found, with every candidate.
    pub reply: Reply,
    /// How it was asked.
    pub settings: QuerySettings,
    /// To be shown.
    pub dodge: Dodge<'a>,
    /// What the fighter does, until everything that is shown is over.
    pub motion: Motion,
    /// The maps that were asked by.
    pub maps: MapGrid,
}

impl<'a> Throw<'a> {
    /// From the click to the reply; `baked` with the maps that were asked by.
    #[must_use]
    pub fn new(
        baked: &'a BakedGraph,
        (ball, playhead): (Ball, Playhead),
        (reply, settings): (Reply, QuerySettings),
        shown: &DodgeSettings,
    ) -> Self {
        let case = (playhead, &ball.attack);
        let dodge = Dodge::new(baked, case, &reply.answer, shown);
        let mut motion = reply.answer.motion.clone();
        motion.extend(baked.graph(), dodge.span().1);
        Self {
            number: reply.number,
            ball,
            playhead,
            reply,
            settings,
            dodge,
            motion,
            maps: baked.atlas().grid(),
        }
    }

    /// What the query answered.
    #[must_use]
    pub fn answer(&self) -> &Answer {
        &self.reply.answer
    }

    /// As a line of the trace.
    #[must_use]
    pub fn event(&self) -> Event {
        let answer = self.answer();
        let (clearance, counts) = (answer.clearance(), answer.counts);
        let evades =
            { answer.candidates.get(answer.chosen) }.is_some_and(|chosen| chosen.evasion.is_some());
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
            cull: self.reply.culling.name(),
            slab_height: self.maps.slab_height,
            grid: matches!(self.settings.enumerate, Enumerate::Grid(_)),
            query_ms: 1e3 * self.reply.seconds,
        }
    }
}
