use std::path::Path;

use serde::{Deserialize, Serialize};

use super::motion_file::is_gltf;
use crate::error::shortened;
use crate::file::{composed, parse_json, read_bytes};
use crate::{FileError, ReadError};
use sabaki::anim::{Clip, Event, EventKind, Skeleton};

/// An events file: the events of clips. Unknown keys are ignored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EventsFile {
    /// Clips, in the order of the file.
    pub clips: Vec<ClipEvents>,
}

/// The events of one clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClipEvents {
    /// Name of the clip's file, with or without its folder. Of a glTF file with several animations, with the animation behind it:
    /// `fox.glb:Walk`.
    pub file: String,
    /// Events, in any order.
    #[serde(default)]
    pub events: Vec<EventEntry>,
}

/// An event as it is written in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventEntry {
    /// Kind: `attack` or `evasion`.
    pub kind: EventKind,
    /// Start, in seconds from the clip's first frame.
    pub start: f64,
    /// End, in seconds from the clip's first frame.
    pub end: f64,
    /// Names of the joints that take part. An evasion may have none, which stands for all joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
    /// Time of an attack's contact, in seconds from the clip's first frame. A bake does not use it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<f64>,
    /// Confidence of an event that [`annotate::propose`](crate::annotate::propose) found, 0 to 1. A bake does not use it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confidence: Option<f64>,
}

impl EventsFile {
    /// Parses JSON text.
    ///
    /// # Errors
    /// The first error, with line and column.
    pub fn parse(text: &[u8]) -> Result<Self, FileError> {
        let mut file: Self = parse_json(text)?;
        for clip in &mut file.clips {
            clip.file = composed(&clip.file);
        }
        Ok(file)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// The first error, with the file, line and column.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::parse(&read_bytes(path)?).map_err(ReadError::in_file(path))
    }

    /// Resolves the names of clips and joints. The result is sorted by clip and start. An end up to
    /// half a frame after the clip's last frame is moved to that frame.
    ///
    /// # Errors
    /// The first event that does not fit.
    pub fn resolve(&self, clips: &[Clip], skeleton: &Skeleton) -> Result<Vec<Event>, FileError> {
        let mut events = Vec::new();
        for entry in &self.clips {
            let clip = entry.clip(clips)?;
            for (index, event) in entry.events.iter().enumerate() {
                let resolved = event.resolve(clip, &clips[clip], skeleton);
                events.push(resolved.map_err(|problem| entry.wrong(index, problem))?);
            }
        }
        events.sort_by(|a, b| a.clip.cmp(&b.clip).then(a.start.total_cmp(&b.start)));
        Ok(events)
    }

    /// Events of the clip with this name, with or without its folder; empty if the file does not have the clip.
    pub fn events_of(&self, clip: &str) -> Vec<EventEntry> {
        let own = self.clips.iter().filter(|entry| entry.is_of(clip));
        own.flat_map(|entry| &entry.events).cloned().collect()
    }

    /// Refuses joints by names that several joints have.
    pub(super) fn check_names(&self, repeated: &[String]) -> Result<(), FileError> {
        for clip in &self.clips {
            for (event, entry) in clip.events.iter().enumerate() {
                if let Some(joint) = entry.joints.iter().find(|joint| repeated.contains(joint)) {
                    return Err(clip.wrong(event, several_joints(joint)));
                }
            }
        }
        Ok(())
    }

    /// Removes the events of all animations of these files, but those of the clips that were read.
    pub(super) fn forget(&mut self, files: &[String], read: &[Clip]) {
        self.clips.retain(|entry| {
            let is_of_file = |file: &String| {
                let name = without_folder(&entry.file);
                name == file || &name[..file_length(name)] == file
            };
            read.iter().any(|clip| entry.is_of(clip.name())) || !files.iter().any(is_of_file)
        });
    }

    /// Whether the file has events for a clip.
    pub(super) fn names(&self, clip: &str) -> bool {
        self.clips.iter().any(|entry| entry.is_of(clip))
    }

    /// Converts events to a file, so that [`Self::resolve`] returns them again. Clips without
    /// events are left out.
    ///
    /// Returns `None` if an event refers to a clip that does not exist.
    #[must_use]
    pub fn of(events: &[Event], clips: &[Clip], skeleton: &Skeleton) -> Option<Self> {
        let mut file = Self::default();
        for (index, clip) in clips.iter().enumerate() {
            let of_clip = events.iter().filter(|event| event.clip == index);
            let entries = of_clip.map(|event| EventEntry::of(event, skeleton));
            let entries: Vec<EventEntry> = entries.collect();
            if !entries.is_empty() {
                file.clips.push(ClipEvents {
                    file: clip.name().to_owned(),
                    events: entries,
                });
            }
        }
        let all_known = events.iter().all(|event| event.clip < clips.len());
        all_known.then_some(file)
    }
}

impl EventEntry {
    /// Converts an event to its form in files.
    #[must_use]
    pub fn of(event: &Event, skeleton: &Skeleton) -> Self {
        let names = event.joints.iter();
        Self {
            kind: event.kind,
            start: event.start,
            end: event.end,
            joints: names.map(|&id| skeleton.joint(id).name.clone()).collect(),
            contact: None,
            confidence: None,
        }
    }

    fn resolve(&self, index: usize, clip: &Clip, skeleton: &Skeleton) -> Result<Event, String> {
        let &Self {
            kind, start, end, ..
        } = self;
        if !(start.is_finite() && end.is_finite() && start >= 0.0 && end > start) {
            return Err(format!(
                "from {start} s to {end} s is no time range (0 <= start < end)"
            ));
        }
        let duration = clip.duration();
        let last = end.min(duration);
        if end > duration + 0.5 / clip.frame_rate() || last <= start {
            return Err(format!("ends at {end} s, but the clip at {duration} s"));
        }
        if self.joints.is_empty() && kind == EventKind::Attack {
            return Err("an attack needs the joints that strike".to_owned());
        }
        let find = |joint: &String| {
            let id = skeleton.find(joint);
            id.ok_or_else(|| format!("the skeleton has no joint \"{joint}\""))
        };
        Ok(Event {
            clip: index,
            kind,
            start,
            end: last,
            joints: self.joints.iter().map(find).collect::<Result<_, _>>()?,
        })
    }
}

/// The problem of a joint that is named by a name of several.
pub(super) fn several_joints(joint: &str) -> String {
    format!(
        "several joints are called \"{joint}\"; name one of them, as \"{joint}_2\", or rename them in the file"
    )
}

impl ClipEvents {
    fn wrong(&self, event: usize, problem: String) -> FileError {
        FileError::part(format!("\"{}\", event {event}", self.file), problem)
    }

    /// Whether a clip has this name, where one of both may have a folder.
    fn is_of(&self, clip: &str) -> bool {
        let file = &self.file[..];
        file == clip || without_folder(file) == clip || file == without_folder(clip)
    }

    /// The clip of exactly this name, otherwise the only one that has it where one of both has a folder.
    fn clip(&self, clips: &[Clip]) -> Result<usize, FileError> {
        let all = |is_it: &dyn Fn(&str) -> bool| -> Vec<usize> {
            let found = clips.iter().enumerate();
            let found = found.filter(|(_, clip)| is_it(clip.name()));
            found.map(|(index, _)| index).collect()
        };
        let mut found = all(&|clip| clip == self.file);
        if found.is_empty() {
            found = all(&|clip| self.is_of(clip));
        }
        let problem = match found[..] {
            [only] => return Ok(only),
            [] => "but there is no such clip".to_owned(),
            _ => {
                let name = |&index: &usize| clips[index].name().to_owned();
                let names: Vec<String> = found.iter().map(name).collect();
                format!("which may be any of the clips {}", shortened(&names))
            }
        };
        Err(FileError::Invalid(format!(
            "events for \"{}\", {problem}",
            self.file
        )))
    }
}

/// Length of the file's part of a clip's name: up to the `:` before the name of a glTF file's animation.
fn file_length(clip: &str) -> usize {
    let mut colons = clip.match_indices(':').map(|(at, _)| at);
    let is_end = |at: &usize| is_gltf(Path::new(&clip[..*at]));
    colons.find(is_end).unwrap_or(clip.len())
}

/// A clip's name without the folder of its file, for paths of Unix and Windows. The name of an animation stays whole.
fn without_folder(clip: &str) -> &str {
    let folder = clip[..file_length(clip)].rfind(['/', '\\']);
    folder.map_or(clip, |end| &clip[end + 1..])
}
