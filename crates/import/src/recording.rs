use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::attacks::StoredAttack;
use crate::file::{parse_json, read_bytes};
use crate::{ReadError, TextError};
use sabaki::anim::Warp;
use sabaki::archive;
use sabaki::graph::{EdgeId, Layer, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::query::{
    Answer, Attack, AttackError, EnteredAt, Evaluation, Query, QueryContext, QuerySettings,
    QuerySettingsError, Request, cull::cpu,
};

/// Reason why a file is not a recording, or cannot be replayed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RecordingError {
    /// The text is not a valid exported answer.
    #[error(transparent)]
    Json(#[from] TextError),
    /// The attack is invalid.
    #[error(transparent)]
    Attack(#[from] AttackError),
    /// A setting is out of range.
    #[error(transparent)]
    Settings(#[from] QuerySettingsError),
    /// The recording belongs to another graph.
    #[error(
        "it was answered on the graph {expected:08x}, and this one is {found:08x}: name the baked graph that it was exported from"
    )]
    Graph {
        /// Checksum of the recording's graph.
        expected: u32,
        /// Checksum of the given graph.
        found: u32,
    },
    /// The graph does not have the playhead's edge or frame.
    #[error("the playhead is no place of the graph")]
    Playhead,
    /// The checksum of the graph cannot be computed, because memory is exhausted.
    #[error("the graph cannot be named: {0}")]
    Unnamed(String),
}

/// The input of a query beside its attack. Together with the graph they determine the answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedRequest {
    /// Checksum of the graph ([`archive::checksum`]).
    pub graph: u32,
    /// Playhead of the character at the query.
    pub playhead: Playhead,
    /// Settings of the query.
    pub settings: QuerySettings,
    /// Which candidates are tested exactly.
    #[serde(rename = "judging")]
    pub evaluation: Evaluation,
}

/// The identifying data of an answer, which are compared bit by bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chosen {
    /// Edges of the path, from the next node on.
    pub edges: Vec<EdgeId>,
    /// Evasion at the end of the path, or `None` if the path has none.
    pub evasion: Option<EdgeId>,
    /// Entry into the evasion without an edge, or `None` if edges lead to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub entry: Option<EnteredAt>,
    /// Layer of the upper body, or `None` if the whole body plays the evasion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer: Option<Layer>,
    /// Rate of the path's retimable edges, or of the entered or layered evasion.
    pub p: f32,
    /// Clearance, in metres, negative for a hit.
    pub clearance: f32,
    /// Whether the answer avoids the attack.
    pub avoided: bool,
    /// Displacement of the motion; `None` if it is not displaced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warp: Option<Warp>,
}

/// An exported answer with its query, which can be repeated.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Input of the query.
    pub request: RecordedRequest,
    /// Attack, in the world of the playhead.
    pub attack: Attack,
    /// Answer of the query.
    pub chosen: Chosen,
}

#[derive(Deserialize)]
struct File {
    attack: StoredAttack,
    query: RecordedRequest,
    answer: Chosen,
}

impl Chosen {
    /// Extracts the identifying data of an answer on `baked`.
    #[must_use]
    pub fn of(baked: &BakedGraph, answer: &Answer) -> Self {
        let report = answer.chosen();
        Self {
            edges: answer.path(baked, report).collect(),
            evasion: report.evasion,
            entry: report.entry,
            layer: report.layer,
            p: report.rate.as_ref().map_or(1.0, |rate| rate.rate),
            clearance: answer.clearance().metres,
            avoided: answer.avoided,
            warp: report.warp,
        }
    }

    /// Whether two answers have the same path, rate and clearance, bit by bit.
    pub fn is_same(&self, other: &Self) -> bool {
        let bits = |one: &Self| (one.p.to_bits(), one.clearance.to_bits());
        self == other && bits(self) == bits(other)
    }
}

impl Recording {
    /// Parses the JSON text of an exported answer.
    ///
    /// # Errors
    /// The first error, with line and column or the position in the attack.
    pub fn parse(text: &[u8]) -> Result<Self, RecordingError> {
        let File {
            attack,
            query,
            answer,
        } = parse_json(text)?;
        Ok(Self {
            request: query,
            attack: Attack::new(attack.spheres)?,
            chosen: answer,
        })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// The first error, with the file and the position in it.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::parse(&read_bytes(path)?).map_err(ReadError::in_file(path))
    }

    /// Repeats the query, with culling on the CPU. All culling paths give the same counts.
    ///
    /// # Errors
    /// The graph is not that of the recording.
    pub fn replay(&self, baked: &BakedGraph) -> Result<Answer, RecordingError> {
        let expected = self.request.graph;
        let unnamed = |error| RecordingError::Unnamed(format!("{error}"));
        let found = archive::checksum(baked).map_err(unnamed)?;
        if found != expected {
            return Err(RecordingError::Graph { expected, found });
        }
        if !self.request.playhead.is_sound(baked.graph()) {
            return Err(RecordingError::Playhead);
        }
        // The answer does not depend on the number of threads, and a file could request any number.
        let settings = QuerySettings {
            threads: 1,
            ..self.request.settings
        };
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let request = Request {
            evaluation: self.request.evaluation,
            ..Request::new(self.request.playhead, &self.attack)
        };
        let mut session = Query::checked(baked, &settings)?.start(request, &mut context);
        session.run_on_cpu(&mut cpu::Culler::default(), &mut answer);
        Ok(answer)
    }
}
