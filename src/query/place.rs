use super::attack::Attack;
use super::candidate::CandidateKind;
use super::cull::{DrawInput, PlacedRegion};
use super::state::QueryState;
use crate::maps::BakedGraph;

/// The place stage: transforms the evasions of the candidates to the frame of the next node, and draws the attack's maps there.
#[derive(Clone, Copy)]
pub(super) struct PlaceCandidates<'a> {
    pub baked: &'a BakedGraph,
    /// Whether the attack's outer maps are drawn.
    pub outer: bool,
}

/// Scratch of the stage.
#[derive(Clone, Debug)]
pub(super) struct PlaceScratch {
    placed: Vec<PlacedRegion>,
    clocks: Vec<f32>,
    /// The attack in the node's frame.
    attack: Attack,
}

impl Default for PlaceScratch {
    fn default() -> Self {
        Self {
            placed: Vec::new(),
            clocks: Vec::new(),
            attack: Attack::empty(),
        }
    }
}

impl PlaceCandidates<'_> {
    /// Runs the stage.
    pub(super) fn run(&self, state: &mut QueryState, scratch: &mut PlaceScratch) {
        let PlaceScratch {
            placed,
            clocks,
            attack,
        } = scratch;
        let (baked, request) = (self.baked, &state.request);
        placed.clear();
        clocks.clear();
        let attack_start = request.attack.start();
        let counted = &state.candidates.list[..state.candidates.counted];
        placed.extend(counted.iter().filter_map(|candidate| {
            let CandidateKind::Evasion { path, start } = candidate.kind else {
                return None;
            };
            let path = baked.paths().path(path);
            Some(PlacedRegion {
                region: baked.evasions()[path.goal as usize].region,
                placement: path.placement,
                clock: clock(clocks, start - attack_start),
            })
        }));
        attack.place_from(&request.attack, request.node_frame.inverse());
        state.maps.draw(&DrawInput {
            atlas: baked.atlas(),
            attack,
            clocks,
            placed,
            reach: baked.reach(),
            outer: self.outer,
        });
    }
}

/// Index of the clock with an offset, which is the time from the attack's start to the evasion's start in seconds. Adds a clock if there is
/// none. Offsets that single precision cannot distinguish share a clock.
fn clock(clocks: &mut Vec<f32>, offset: f32) -> u32 {
    const ALIKE: f32 = 1e-5;
    let alike = |other: &f32| (other - offset).abs() <= ALIKE;
    let found = clocks.iter().position(alike);
    found.unwrap_or_else(|| {
        clocks.push(offset);
        clocks.len() - 1
    }) as u32
}
