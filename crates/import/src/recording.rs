use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::ReadError;
use super::attacks::AttackEntry;
use super::json::{self, JsonError};
use super::read::read_bytes;
use sabaki::archive;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::query::{
    Answer, Attack, AttackError, Evaluation, Query, QueryContext, QuerySettings,
    QuerySettingsError, Request, cull::cpu,
};

/// With the graph, everything that an answer depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// Names the graph: [`archive::checksum`].
    pub graph: u32,
    /// Where the character is.
    pub playhead: Playhead,
    /// In the world of the playhead.
    pub attack: Attack,
    /// How the query is answered.
    pub settings: QuerySettings,
    /// How many candidates are tested exactly.
    pub evaluation: Evaluation,
}

/// A [`Question`] as it stands in a file, without the attack, which has a place of its own.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Asked {
    pub graph: u32,
    pub playhead: Playhead,
    pub settings: QuerySettings,
    #[serde(rename = "judging")]
    pub evaluation: Evaluation,
}

/// What an answer is known by, to the bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chosen {
    /// The path from the next node on.
    pub edges: Vec<EdgeId>,
    /// The evasion that follows; `None` for a path that only moves.
    pub evasion: Option<EdgeId>,
    /// The rate of the path's retimable edges.
    pub p: f32,
    /// Metres; negative where it is hit.
    pub clearance: f32,
    /// Whether it is clean.
    pub avoided: bool,
}

/// An exported answer and what it was an answer to: it can be asked again.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What was asked.
    pub question: Question,
    /// What was answered.
    pub chosen: Chosen,
}

/// Why a file is no recording, or cannot be asked again here.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RecordingError {
    /// The text is not what an exported answer holds.
    #[error(transparent)]
    Json(#[from] JsonError),
    /// The attack is none.
    #[error(transparent)]
    Attack(#[from] AttackError),
    /// A setting is out of its range.
    #[error(transparent)]
    Settings(#[from] QuerySettingsError),
    /// It was asked of another graph.
    #[error(
        "it was answered on the graph {expected:08x}, and this one is {found:08x}: name the baked graph that it was exported from"
    )]
    Graph {
        /// The recording's.
        expected: u32,
        /// The one that is here.
        found: u32,
    },
    /// The graph has no such place.
    #[error("the playhead is no place of the graph")]
    Playhead,
    /// The graph is beyond what memory can hold twice.
    #[error("the graph cannot be named: {0}")]
    Unnamed(String),
}

#[derive(Deserialize)]
struct File {
    attack: AttackEntry,
    query: Asked,
    answer: Chosen,
}

impl Chosen {
    /// Of an answer from `baked`.
    #[must_use]
    pub fn of(baked: &BakedGraph, answer: &Answer) -> Self {
        let report = answer.chosen();
        Self {
            edges: answer.path(baked, report).collect(),
            evasion: report.evasion,
            p: report.rate.as_ref().map_or(1.0, |rate| rate.rate),
            clearance: answer.clearance().metres,
            avoided: answer.avoided,
        }
    }

    /// Whether two answers are the same path at the same rate with the same clearance, to the bit.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        let bits = |one: &Self| (one.p.to_bits(), one.clearance.to_bits());
        self == other && bits(self) == bits(other)
    }
}

impl Question {
    pub(super) fn asked(&self) -> Asked {
        Asked {
            graph: self.graph,
            playhead: self.playhead,
            settings: self.settings,
            evaluation: self.evaluation,
        }
    }
}

impl Recording {
    /// Reads the JSON text of an exported answer.
    ///
    /// # Errors
    /// What is wrong, with line and column or the place in the attack.
    pub fn parse(text: &[u8]) -> Result<Self, RecordingError> {
        let File {
            attack,
            query,
            answer,
        } = json::parse(text)?;
        Ok(Self {
            question: Question {
                graph: query.graph,
                playhead: query.playhead,
                attack: Attack::new(attack.spheres)?,
                settings: query.settings,
                evaluation: query.evaluation,
            },
            chosen: answer,
        })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// What is wrong, with the file and the place in it.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::parse(&read_bytes(path)?).map_err(|error| ReadError::Recording {
            path: path.to_owned(),
            error,
        })
    }

    /// Asks again, culled on the CPU: all paths count the same.
    ///
    /// # Errors
    /// Another graph than that of the recording.
    pub fn replay(&self, baked: &BakedGraph) -> Result<Answer, RecordingError> {
        let Question {
            graph: expected,
            playhead,
            attack,
            settings,
            evaluation,
        } = &self.question;
        let found =
            archive::checksum(baked).map_err(|error| RecordingError::Unnamed(error.to_string()))?;
        if found != *expected {
            return Err(RecordingError::Graph {
                expected: *expected,
                found,
            });
        }
        if !playhead.is_sound(baked.graph()) {
            return Err(RecordingError::Playhead);
        }
        // The answer is the same for any number, and a file may ask for any.
        let settings = QuerySettings {
            threads: 1,
            ..*settings
        };
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let request = Request {
            evaluation: *evaluation,
            ..Request::new(*playhead, attack)
        };
        let mut session = Query::checked(baked, &settings)?.start(request, &mut context);
        session.run_on_cpu(&mut cpu::Culler::default(), &mut answer);
        Ok(answer)
    }
}
