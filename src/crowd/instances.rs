use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use thiserror::Error;

use super::character::{Character, CharacterId, ClipId, LevelId, Placement};
use super::group::Group;
use super::kernel::Run;
use super::output::{Output, Region};
use super::repertoire::Repertoire;
use super::schedule::{self, Bucket, Kind, Schedule, Sorting, split};
use crate::math::{Crew, Isa, Line, thread_count};

/// How a crowd is posed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdSettings {
    /// What is written.
    pub output: Output,
    /// On which registers.
    pub isa: Isa,
    /// How many threads, the caller's counted in; 0 for as many as the machine has. They stay as
    /// long as the crowd.
    pub threads: usize,
}

impl Default for CrowdSettings {
    /// The widest registers, one thread.
    fn default() -> Self {
        Self {
            output: Output::default(),
            isa: Isa::best(),
            threads: 1,
        }
    }
}

/// Why a character cannot be what it is wanted to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CrowdError {
    /// A clip that the repertoire has not.
    #[error("clip {clip} of a repertoire of {clips}")]
    NoSuchClip {
        /// The clip.
        clip: u16,
        /// How many there are.
        clips: usize,
    },
    /// A character that the crowd has not.
    #[error("character {id} of a crowd of {characters}")]
    NoSuchCharacter {
        /// The character.
        id: u32,
        /// How many there are.
        characters: usize,
    },
    /// No more can be told apart.
    #[error("a crowd has {max} characters at most", max = schedule::MOST)]
    Full,
}

/// Why a crowd was not posed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PoseError {
    /// The memory is too small; nothing was written.
    #[error("the poses take {needed} lines of 64 bytes, the memory has {found}")]
    TooSmall {
        /// Lines that are needed.
        needed: usize,
        /// Lines that are there.
        found: usize,
    },
}

/// Characters that are posed together.
pub struct Crowd {
    repertoire: Arc<Repertoire>,
    settings: CrowdSettings,
    crew: Crew,
    /// One group's joints, for each thread.
    scratch: Vec<Mutex<Vec<Line>>>,
    kinds: Vec<Kind>,
    /// Of each character its group and lane, as one number.
    slots: Vec<u32>,
    groups: Vec<Group>,
    schedule: Schedule,
    /// Seconds since the groups' clocks were set back.
    now: f32,
    is_sorted: bool,
    /// Groups whose characters are not near each other in time: now, and just after sorting.
    apart: usize,
    apart_at_best: Option<usize>,
}

/// The groups' clocks are set back when they have run for so long, seconds: a number of eight digits
/// then still tells a ten-thousandth of a frame.
const LONGEST_RUN: f32 = 8.0;

/// Sorted anew when one group in so many has come apart.
const MOST_APART: usize = 16;

const MOST_THREADS: usize = 64;

/// What one thread writes.
struct Part<'a>(Mutex<&'a mut [Line]>);

impl Part<'_> {
    fn none() -> Self {
        Self(Mutex::new(&mut []))
    }
}

impl Crowd {
    /// Nobody yet.
    #[must_use]
    pub fn new(repertoire: Arc<Repertoire>, settings: CrowdSettings) -> Self {
        let crew = Crew::new(thread_count(settings.threads).min(MOST_THREADS));
        Self {
            repertoire,
            settings,
            scratch: (0..crew.threads()).map(|_| Mutex::default()).collect(),
            crew,
            kinds: Vec::new(),
            slots: Vec::new(),
            groups: Vec::new(),
            schedule: Schedule::default(),
            now: 0.0,
            is_sorted: false,
            apart: 0,
            apart_at_best: None,
        }
    }

    /// What its characters can play.
    #[must_use]
    pub fn repertoire(&self) -> &Repertoire {
        &self.repertoire
    }

    /// How many characters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Whether nobody is there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// One more character.
    ///
    /// # Errors
    /// A clip that is not there; a crowd that is full.
    pub fn add(&mut self, character: &Character) -> Result<CharacterId, CrowdError> {
        if self.kinds.len() >= schedule::MOST {
            return Err(CrowdError::Full);
        }
        let kind = self.kind(character)?;
        // Anywhere, until the next sorting.
        let vacant = |group: &Group| group.ids.iter().position(|&id| id == Group::NOBODY);
        let lane = match self.groups.last().and_then(vacant) {
            Some(lane) => lane,
            None => {
                self.groups.push(Group::EMPTY);
                0
            }
        };
        let (id, group) = (self.kinds.len() as u32, self.groups.len() - 1);
        self.groups[group].ids[lane] = id;
        self.kinds.push(kind);
        self.slots.push((group * Line::LANES + lane) as u32);
        self.write(id as usize, character);
        self.is_sorted = false;
        Ok(CharacterId(id))
    }

    /// Makes a character another one.
    ///
    /// # Errors
    /// A clip or a character that is not there.
    pub fn set(&mut self, id: CharacterId, character: &Character) -> Result<(), CrowdError> {
        self.slot(id)?;
        let (old, new) = (self.kinds[id.index()], self.kind(character)?);
        self.kinds[id.index()] = new;
        self.is_sorted &= old.stands_with(new);
        self.write(id.index(), character);
        Ok(())
    }

    /// Puts a character somewhere else.
    ///
    /// # Errors
    /// A character that is not there.
    pub fn place(&mut self, id: CharacterId, placement: &Placement) -> Result<(), CrowdError> {
        let (group, lane) = self.slot(id)?;
        self.groups[group].place(lane, placement);
        Ok(())
    }

    /// Lets a character go on with more joints or fewer; its motion goes on where it is.
    ///
    /// # Errors
    /// A character that is not there.
    pub fn set_level(&mut self, id: CharacterId, level: LevelId) -> Result<(), CrowdError> {
        let (group, lane) = self.slot(id)?;
        let level = self.repertoire.clamp(level);
        let old = self.kinds[id.index()];
        if level == old.level {
            return Ok(());
        }
        let spans = |clip| {
            let span = |level| self.repertoire.span(clip, level);
            (span(level), span(level).rate / span(old.level).rate)
        };
        let group = &mut self.groups[group];
        group.clock.scale(lane, spans(old.clip).1);
        if let Some(second) = old.second {
            let (span, factor) = spans(second);
            group.fade.clock.scale(lane, factor);
            group.fade.set_span(lane, span);
        }
        self.kinds[id.index()].level = level;
        self.is_sorted = false;
        Ok(())
    }

    /// Time goes on, seconds. Negative or not finite: it stands still.
    pub fn advance(&mut self, seconds: f32) {
        if seconds > 0.0 && seconds.is_finite() {
            self.now += seconds;
        }
        if self.now > LONGEST_RUN {
            self.set_clocks_back();
        }
    }

    /// How many lines [`Crowd::pose`] writes now. Sorts the crowd where that is due.
    pub fn lines(&mut self) -> usize {
        let worn = |best| self.apart > best + self.groups.len() / MOST_APART;
        if !self.is_sorted || self.apart_at_best.is_some_and(worn) {
            self.sort();
        }
        self.schedule.lines
    }

    /// Poses everybody into the beginning of `out`. After it has been called a few times for a crowd
    /// that has not grown, it allocates nothing.
    ///
    /// # Errors
    /// Memory that is too small.
    pub fn pose(&mut self, out: &mut [Line]) -> Result<(), PoseError> {
        let needed = self.lines();
        let found = out.len();
        if found < needed {
            return Err(PoseError::TooSmall { needed, found });
        }
        let mut parts = [(); MOST_THREADS].map(|()| Part::none());
        let mut rest = out;
        for (part, pieces) in parts.iter_mut().zip(self.schedule.parts()) {
            let lines = pieces.iter().map(|piece| piece.lines.len()).sum();
            let (out, others) = rest.split_at_mut(lines);
            *part = Part(Mutex::new(out));
            rest = others;
        }
        let apart = AtomicUsize::new(0);
        let (schedule, groups, now) = (&self.schedule, &self.groups, self.now);
        let (repertoire, settings) = (&*self.repertoire, &self.settings);
        let scratch = &self.scratch;
        self.crew.run(&|thread: usize| {
            let mut out: &mut [Line] = &mut lock(&parts[thread].0);
            for piece in schedule.part(thread) {
                let (own, others) = out.split_at_mut(piece.lines.len());
                out = others;
                let run = Run {
                    bank: &repertoire.banks[piece.kind.level.index()],
                    span: repertoire.span(piece.kind.clip, piece.kind.level),
                    groups: &groups[piece.groups.clone()],
                    fading: piece.kind.second.is_some(),
                    now,
                    output: settings.output,
                    out: own,
                    scratch: &mut lock(&scratch[thread]),
                };
                apart.fetch_add(settings.isa.on_lanes(run), Ordering::Relaxed);
            }
        });
        self.apart = apart.into_inner();
        self.apart_at_best.get_or_insert(self.apart);
        Ok(())
    }

    /// Where the pose of a character is, as [`Crowd::pose`] wrote it last.
    ///
    /// # Errors
    /// A character that is not there, or was added since.
    pub fn region(&self, id: CharacterId) -> Result<Region, CrowdError> {
        let (group, lane) = self.slot(id)?;
        let of = |bucket: &&Bucket| bucket.groups.contains(&group);
        let Some(bucket) = self.schedule.buckets.iter().find(of) else {
            return Err(self.no_such(id));
        };
        Ok(Region {
            first_line: bucket.first_line + (group - bucket.groups.start) * bucket.lines,
            lane,
            joints: self.repertoire.joints(bucket.kind.level),
            output: self.settings.output,
        })
    }

    fn sort(&mut self) {
        self.schedule.sort(Sorting {
            repertoire: &self.repertoire,
            kinds: &self.kinds,
            groups: &mut self.groups,
            slots: &mut self.slots,
            now: self.now,
            output: self.settings.output,
            threads: self.crew.threads(),
        });
        self.is_sorted = true;
        self.apart_at_best = None;
    }

    fn set_clocks_back(&mut self) {
        if !self.is_sorted {
            self.sort();
        }
        for bucket in &self.schedule.buckets {
            let Kind { clip, level, .. } = bucket.kind;
            let length = self.repertoire.span(clip, level).intervals as f32;
            for group in &mut self.groups[bucket.groups.clone()] {
                group.clock.set_back(self.now, |_| length);
                let lengths = group.fade.length;
                group.fade.clock.set_back(self.now, |lane| lengths.0[lane]);
            }
        }
        self.now = 0.0;
    }

    fn slot(&self, id: CharacterId) -> Result<(usize, usize), CrowdError> {
        let slot = self.slots.get(id.index());
        slot.map(|&slot| split(slot)).ok_or(self.no_such(id))
    }

    fn no_such(&self, id: CharacterId) -> CrowdError {
        CrowdError::NoSuchCharacter {
            id: id.0,
            characters: self.len(),
        }
    }

    fn kind(&self, character: &Character) -> Result<Kind, CrowdError> {
        let clips = self.repertoire.clips();
        let known = |clip: ClipId| match clip.index() < clips {
            true => Ok(clip),
            false => Err(CrowdError::NoSuchClip {
                clip: clip.0,
                clips,
            }),
        };
        Ok(Kind {
            clip: known(character.clip)?,
            level: self.repertoire.clamp(character.level),
            second: character.fade.map(|fade| known(fade.clip)).transpose()?,
        })
    }

    /// The lines of a character whose kind is known.
    fn write(&mut self, id: usize, character: &Character) {
        let (group, lane) = split(self.slots[id]);
        let Kind { clip, level, .. } = self.kinds[id];
        let (group, now) = (&mut self.groups[group], self.now);
        let rate = self.repertoire.span(clip, level).rate;
        let in_intervals = |time: f32, speed: f32, rate: f32| (time * rate, speed * rate);
        let (at, speed) = in_intervals(character.time, character.speed, rate);
        group.clock.set(lane, at, speed, now);
        group.place(lane, &character.placement);
        if let Some(fade) = &character.fade {
            let span = self.repertoire.span(fade.clip, level);
            let (at, speed) = in_intervals(fade.time, fade.speed, span.rate);
            group.fade.clock.set(lane, at, speed, now);
            group.fade.set_span(lane, span);
            // NaN is nothing of it, which `clamp` would keep.
            let weight = if fade.weight > 0.0 { fade.weight } else { 0.0 };
            group.fade.weight.0[lane] = weight.min(1.0);
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
