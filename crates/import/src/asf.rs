//! Reads Acclaim skeletons (ASF) and motions (AMC).
//!
//! Source: J. Schafer, "Acclaim Skeleton File Definition" (Acclaim Advanced Technologies, 1994).
//! Where the definition is ambiguous, files are read as CMU's library intends them. A bone rotates
//! about its own axes C, which are fixed in the skeleton. Its rotation relative to its parent is C
//! M C⁻¹, where M is the product of the motion's rotations, the first named applied first. A bone's
//! joint is at its start, so a joint's offset is its parent's bone.
//!
//! A bone's translations (`tx`) are along its axes C.
//!
//! Differs: bones that change their length (`l`) are rejected. The unit of
//! length is estimated as for BVH files, because the units in the files are not reliable. Frames whose numbers are skipped are filled
//! linearly; a bone that a frame leaves out keeps its values.

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use sabaki::anim::{JointKind, Skeleton};

use crate::bvh::LARGEST_VALUE;
use crate::channels::{Channel, ChannelFile, ChannelJoint, skeleton_of};
use crate::file::{quoted, without_mark};
use crate::motion_file::AMC_RATES;
use crate::{MOST_ENTRIES, TextError};

/// A line that is neither empty nor a comment.
#[derive(Clone, Copy, Debug)]
struct Line<'a> {
    /// Line number, from 1.
    number: usize,
    text: &'a str,
}

/// Lines of a file that are neither empty nor comments.
fn lines(bytes: &[u8]) -> Result<impl Iterator<Item = Line<'_>>, TextError> {
    let bytes = without_mark(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let before = &bytes[..error.valid_up_to()];
        let number = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        Line { number, text: "" }.error("not a text file")
    })?;
    // A line ends with LF or CR LF; of old files, with CR.
    let of_lf = text.split('\n');
    let all = of_lf.flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'));
    let all = (1..).zip(all).map(|(number, text)| Line {
        number,
        text: text.trim(),
    });
    Ok(all.filter(|line| !line.text.is_empty() && !line.text.starts_with('#')))
}

impl<'a> Line<'a> {
    fn words(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.text.split_whitespace()
    }

    fn first(&self) -> &'a str {
        self.words().next().unwrap_or("")
    }

    fn error(&self, message: impl Into<String>) -> TextError {
        TextError {
            line: self.number,
            column: None,
            message: message.into(),
        }
    }

    fn expected(&self, expected: &str, found: Option<&str>) -> TextError {
        let found = found.map_or_else(|| "the line's end".to_owned(), quoted);
        self.error(format!("expected {expected}, found {found}"))
    }

    fn missing(&self, what: &str) -> TextError {
        self.error(format!("the file has no {what}"))
    }

    fn twice(&self, what: &str) -> TextError {
        self.error(format!("\"{what}\" stands here a second time"))
    }

    fn no_bone(&self, name: &str) -> TextError {
        self.error(format!("there is no bone \"{name}\""))
    }

    /// Parses a word as a number.
    fn number(&self, word: Option<&str>) -> Result<f64, TextError> {
        let number = word.and_then(|word| word.parse().ok());
        number
            .filter(|number: &f64| number.abs() <= LARGEST_VALUE)
            .ok_or_else(|| self.expected("a number", word))
    }

    /// Parses the three numbers after the first word.
    fn vector(&self) -> Result<DVec3, TextError> {
        let mut words = self.words().skip(1);
        let mut next = || self.number(words.next());
        Ok(DVec3::new(next()?, next()?, next()?))
    }
}

/// Frame rate of CMU's captures, in frames per second. Few AMC files contain it.
pub const USUAL_RATE: f64 = 120.0;

/// An ASF file: a skeleton, and the axes about which motions rotate its bones. Each bone has a joint at its start. Each bone without children
/// also has an end site at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct AsfFile {
    /// The bones' joints, the root first, then the end sites.
    joints: Vec<ChannelJoint>,
    /// Whether angles are in degrees, unless the motion says otherwise.
    degrees: bool,
}

impl AsfFile {
    /// Parses a file.
    ///
    /// # Errors
    /// The first error, with its line.
    pub fn parse(bytes: &[u8]) -> Result<Self, TextError> {
        let root = Part {
            name: "root".to_owned(),
            ..Part::default()
        };
        let mut reader = AsfReader {
            degrees: true,
            parts: vec![root],
            hierarchy: Vec::new(),
            is_open: false,
        };
        let (number, text) = (1, "");
        let (mut section, mut end) = (String::new(), Line { number, text });
        for line in lines(bytes)? {
            match line.first().strip_prefix(':') {
                Some(name) => section = name.to_ascii_lowercase(),
                None => reader.line(&section, line)?,
            }
            end = line;
        }
        reader.finish(end)
    }

    /// Parses the text of an AMC file: a motion of this skeleton. Its frame rate is what it names after `:SAMPLES-PER-SECOND`, or
    /// [`USUAL_RATE`].
    ///
    /// # Errors
    /// The first error, with its line.
    pub fn motion(&self, bytes: &[u8]) -> Result<ChannelFile, TextError> {
        let (mut firsts, mut channels) = (HashMap::new(), 0);
        let bones = self.joints.iter();
        let bones = bones.filter(|joint| joint.kind == JointKind::Moving);
        for (index, bone) in bones.enumerate() {
            firsts.insert(&bone.name[..], (index, channels));
            channels += bone.channels.len();
        }
        let mut reader = AmcReader {
            bones: &self.joints[..firsts.len()],
            firsts,
            file: ChannelFile {
                joints: self.joints.clone(),
                repeated_names: Vec::new(),
                frame_rate: USUAL_RATE,
                notes: Vec::new(),
                degrees: self.degrees,
                channels,
                values: Vec::new(),
            },
            seen: Vec::new(),
            frames: 0,
            number: 0,
            missing: 0,
            held: None,
            skipped: None,
        };
        let (number, text) = (1, "");
        let mut end = Line { number, text };
        for line in lines(bytes)? {
            reader.line(line)?;
            end = line;
        }
        reader.end_frame();
        if reader.frames == 0 {
            return Err(end.missing("frames"));
        }
        let mut file = reader.file;
        file.notes.extend(reader.held.map(|(bone, frame, count)| {
            format!("frames leave out bones, which keep their values: {count} times, first \"{bone}\" in frame {frame}")
        }));
        file.notes.extend(reader.skipped.map(|(frame, count)| {
            format!("{count} frames are missing, the first after frame {frame}: they are filled")
        }));
        Ok(file)
    }
}

/// A bone as it is written in the file.
#[derive(Clone, Debug, Default)]
struct Part {
    name: String,
    direction: DVec3,
    length: f64,
    /// Rotations of the axes, and their order, the first one applied first.
    angles: DVec3,
    axis: Option<[usize; 3]>,
    freedoms: Vec<Channel>,
    position: DVec3,
}

/// State of the parser.
struct AsfReader<'a> {
    degrees: bool,
    /// The root, and the bones in the order of the file.
    parts: Vec<Part>,
    /// Child, parent and their line in the file.
    hierarchy: Vec<(&'a str, &'a str, Line<'a>)>,
    /// Whether the last bone has no end yet.
    is_open: bool,
}

impl<'a> AsfReader<'a> {
    fn line(&mut self, section: &str, line: Line<'a>) -> Result<(), TextError> {
        let word = line.first().to_ascii_lowercase();
        let root = &mut self.parts[0];
        match (section, word.as_str()) {
            ("units", "angle") => {
                let unit = line.words().nth(1);
                self.degrees = match unit.map(str::to_ascii_lowercase).as_deref() {
                    Some("deg") => true,
                    Some("rad") => false,
                    _ => return Err(line.expected("deg or rad", unit)),
                };
            }
            ("root", "order") => root.freedoms = freedoms(line, "root")?,
            ("root", "axis") => root.axis = Some(order(line, line.words().nth(1))?),
            ("root", "position") => root.position = line.vector()?,
            ("root", "orientation") => root.angles = line.vector()?,
            ("bonedata", _) => self.bone(&word, line)?,
            ("hierarchy", word) if !["begin", "end"].contains(&word) => {
                let children = line.words().skip(1);
                self.hierarchy
                    .extend(children.map(|child| (child, line.first(), line)));
            }
            // Names, documentation and meshes are ignored.
            _ => {}
        }
        Ok(())
    }

    fn bone(&mut self, word: &str, line: Line<'_>) -> Result<(), TextError> {
        let (count, bone) = (self.parts.len(), self.parts.last_mut());
        let Some(bone) = bone.filter(|_| self.is_open) else {
            if word != "begin" {
                return Err(line.expected("begin", Some(line.first())));
            }
            self.is_open = true;
            self.parts.push(Part::default());
            return Ok(());
        };
        match word {
            "name" => match line.words().nth(1) {
                Some(name) => name.clone_into(&mut bone.name),
                None => return Err(line.expected("a name", None)),
            },
            "direction" => bone.direction = line.vector()?,
            "length" => bone.length = line.number(line.words().nth(1))?,
            "axis" => {
                bone.angles = line.vector()?;
                bone.axis = Some(order(line, line.words().nth(4))?);
            }
            "dof" => bone.freedoms = freedoms(line, &bone.name)?,
            "end" if bone.name.is_empty() => {
                return Err(line.missing("name of the bone that ends here"));
            }
            "end" if count > Skeleton::MAX_JOINTS => {
                return Err(line.error(format!("more than {} joints", Skeleton::MAX_JOINTS)));
            }
            "end" => self.is_open = false,
            // The bone's number is ignored, and so are limits, which motions respect anyway.
            _ => {}
        }
        Ok(())
    }

    fn finish(self, end: Line<'_>) -> Result<AsfFile, TextError> {
        let parts = &self.parts;
        if self.is_open {
            return Err(end.missing("end of its last bone"));
        }
        if parts[0].freedoms.is_empty() {
            return Err(end.missing("order of the root"));
        }
        let mut numbers = HashMap::new();
        for (index, part) in parts.iter().enumerate() {
            if numbers.insert(part.name.as_str(), index).is_some() {
                return Err(end.twice(&part.name));
            }
        }
        let mut parents = vec![None; parts.len()];
        for &(child, parent, line) in &self.hierarchy {
            let find = |name: &str| numbers.get(name).ok_or_else(|| line.no_bone(name));
            let (&index, &parent) = (find(child)?, find(parent)?);
            if index == 0 || parents[index].replace(parent).is_some() {
                return Err(line.twice(child));
            }
        }
        // Breadth first from the root.
        let (mut order, mut next) = (vec![0], 0);
        while let Some(&above) = order.get(next) {
            order.extend((0..parts.len()).filter(|&index| parents[index] == Some(above)));
            next += 1;
        }
        let place = |index: usize| order.iter().position(|&own| own == index);
        if let Some(loose) = (0..parts.len()).find(|&index| place(index).is_none()) {
            let name = &parts[loose].name;
            return Err(end.error(format!("bone \"{name}\" does not hang on the root")));
        }
        let along = |index: usize| parts[index].direction.normalize_or_zero() * parts[index].length;
        let bone = |&index: &usize| {
            let part = &parts[index];
            let turns = part.axis.unwrap_or([0, 1, 2]).into_iter().map(|axis| {
                let angle = part.angles[axis];
                let angle = if self.degrees {
                    angle.to_radians()
                } else {
                    angle
                };
                DQuat::from_axis_angle(DVec3::AXES[axis], angle)
            });
            ChannelJoint {
                name: part.name.clone(),
                parent: parents[index].and_then(place),
                offset: parents[index].map_or(part.position, along),
                kind: JointKind::Moving,
                channels: part.freedoms.clone(),
                axes: Some(turns.fold(DQuat::IDENTITY, |so_far, turn| turn * so_far)),
            }
        };
        let end_site = |(place, &index): (usize, &usize)| ChannelJoint {
            name: format!("{}_End", parts[index].name),
            parent: Some(place),
            offset: along(index),
            kind: JointKind::EndSite,
            channels: Vec::new(),
            axes: None,
        };
        let is_leaf = |&(_, index): &(usize, &usize)| !parents.contains(&Some(*index));
        let leaves = order.iter().enumerate().skip(1).filter(is_leaf);
        let joints: Vec<_> = order.iter().map(bone).chain(leaves.map(end_site)).collect();
        match skeleton_of(&joints, 1.0) {
            Ok(_) => Ok(AsfFile {
                joints,
                degrees: self.degrees,
            }),
            Err(error) => Err(end.error(error.to_string())),
        }
    }
}

/// Parses an order of axes, for example `XYZ`.
fn order(line: Line<'_>, word: Option<&str>) -> Result<[usize; 3], TextError> {
    let axis = |letter: u8| {
        b"XYZ"
            .iter()
            .position(|&name| name == letter.to_ascii_uppercase())
    };
    let found: Option<Vec<usize>> = word.unwrap_or("XYZ").bytes().map(axis).collect();
    match found.as_deref() {
        Some(&[a, b, c]) if a != b && b != c && a != c => Ok([a, b, c]),
        _ => Err(line.expected("an order of X, Y and Z", word)),
    }
}

/// Parses the words after `dof` or `order`.
fn freedoms(line: Line<'_>, bone: &str) -> Result<Vec<Channel>, TextError> {
    let mut found = Vec::new();
    for word in line.words().skip(1) {
        let freedom = match word.to_ascii_lowercase().as_bytes() {
            [b'r', axis @ b'x'..=b'z'] => Channel::Rotation(usize::from(axis - b'x')),
            [b't', axis @ b'x'..=b'z'] => Channel::Position(usize::from(axis - b'x')),
            _ => {
                return Err(line.error(format!(
                    "bone \"{bone}\" has the degree of freedom \"{word}\"; only rx, ry, rz, tx, ty and tz are read"
                )));
            }
        };
        if found.contains(&freedom) {
            return Err(line.twice(word));
        }
        found.push(freedom);
    }
    Ok(found)
}

/// State of the parser.
struct AmcReader<'a> {
    bones: &'a [ChannelJoint],
    /// For each bone, its index and its first value in a frame.
    firsts: HashMap<&'a str, (usize, usize)>,
    file: ChannelFile,
    /// Bones that the current frame has values for.
    seen: Vec<bool>,
    frames: usize,
    /// Number of the current frame, as the file counts.
    number: usize,
    /// Number of missing frames before the current one.
    missing: usize,
    /// The first bone that a frame leaves out, the frame, and how often that happens.
    held: Option<(String, usize, usize)>,
    /// The frame before the first gap in the frames' numbers, and how many frames are missing in all.
    skipped: Option<(usize, usize)>,
}

impl AmcReader<'_> {
    fn line(&mut self, line: Line<'_>) -> Result<(), TextError> {
        let first = line.first();
        match first.to_ascii_lowercase().as_str() {
            ":degrees" => self.file.degrees = true,
            ":radians" => self.file.degrees = false,
            ":samples-per-second" => {
                let word = line.words().nth(1);
                let rate = Some(line.number(word)?).filter(|rate| AMC_RATES.contains(rate));
                let expected = || line.expected("a frame rate", word);
                self.file.frame_rate = rate.ok_or_else(expected)?;
            }
            keyword if keyword.starts_with(':') => {}
            number if number.bytes().all(|byte| byte.is_ascii_digit()) => {
                self.end_frame();
                let number = first.parse().unwrap_or(0usize);
                let missing = match self.frames {
                    0 => 0,
                    _ => number.saturating_sub(self.number.saturating_add(1)),
                };
                self.begin_frame(missing, line)?;
                self.number = number;
            }
            _ if self.frames == 0 => {
                return Err(line.expected("the number of a frame", Some(first)));
            }
            _ => self.values(line)?,
        }
        Ok(())
    }

    fn values(&mut self, line: Line<'_>) -> Result<(), TextError> {
        let name = line.first();
        let Some(&(index, first)) = self.firsts.get(name) else {
            return Err(line.no_bone(name));
        };
        if std::mem::replace(&mut self.seen[index], true) {
            return Err(line.twice(name));
        }
        let expected = self.bones[index].channels.len();
        let found = line.words().count() - 1;
        if found != expected {
            let frame = self.frames;
            return Err(line.error(format!(
                "frame {frame}: {found} numbers for \"{name}\", which has {expected}"
            )));
        }
        let frame = self.file.values.len() - self.file.channels + first;
        let values = self.file.values[frame..].iter_mut();
        for (value, word) in values.zip(line.words().skip(1)) {
            *value = line.number(Some(word))?;
        }
        Ok(())
    }

    /// Adds the values of a frame, and before it those of frames that are missing. All of them begin with the values of the frame before.
    fn begin_frame(&mut self, missing: usize, line: Line<'_>) -> Result<(), TextError> {
        let frames = self.frames.saturating_add(missing).saturating_add(1);
        if (frames as u64).saturating_mul(self.bones.len() as u64) > MOST_ENTRIES {
            let bones = self.bones.len();
            return Err(line.error(format!(
                "more frames of {bones} bones than {MOST_ENTRIES} rotations in all, which are the most"
            )));
        }
        if missing > 0 {
            self.skipped.get_or_insert((self.number, 0)).1 += missing;
        }
        let values = &mut self.file.values;
        match values.len().checked_sub(self.file.channels) {
            Some(last) => (self.frames..frames)
                .for_each(|_| values.extend_from_within(last..last + self.file.channels)),
            None => values.resize(self.file.channels, 0.0),
        }
        self.missing = missing;
        self.frames = frames;
        self.seen = vec![false; self.bones.len()];
        Ok(())
    }

    /// Notes the moving bones that the frame has no values for, and fills the missing frames before it. Angles take the shorter way.
    fn end_frame(&mut self) {
        let pairs = self.seen.iter().zip(self.bones);
        for (_, bone) in pairs.filter(|(seen, bone)| !**seen && !bone.channels.is_empty()) {
            let first = || (bone.name.clone(), self.number, 0);
            self.held.get_or_insert_with(first).2 += 1;
        }
        let (missing, channels) = (std::mem::take(&mut self.missing), self.file.channels);
        if missing == 0 {
            return;
        }
        let whole = match self.file.degrees {
            true => 360.0,
            false => std::f64::consts::TAU,
        };
        let freedoms = self.bones.iter().flat_map(|bone| &bone.channels);
        let last = self.file.values.len() - channels;
        let before = last - (missing + 1) * channels;
        for (channel, freedom) in freedoms.enumerate() {
            let from = self.file.values[before + channel];
            let mut change = self.file.values[last + channel] - from;
            if matches!(freedom, Channel::Rotation(_)) {
                change -= whole * (change / whole).round();
            }
            for step in 1..=missing {
                let share = step as f64 / (missing + 1) as f64;
                self.file.values[before + step * channels + channel] = from + share * change;
            }
        }
    }
}
