//! The text of a file: its words, the hierarchy of its joints, and the values of its motion.

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use sabaki::anim::{JointKind, Skeleton};

use super::{LARGEST_VALUE, MOST_CHANNELS};
use crate::TextError;
use crate::channels::{Channel, ChannelFile, ChannelJoint};
use crate::file::{quoted, without_mark};

/// Parses the text of a BVH file.
///
/// If the file has more frames than `Frames:` declares, all of them are read. Fewer frames are
/// an error.
///
/// # Errors
/// The first error, with its line and column.
pub fn parse(text: &[u8]) -> Result<ChannelFile, TextError> {
    let mut lexer = Lexer::new(text)?;
    let mut joints = parse_hierarchy(&mut lexer)?;
    let channels = joints.iter().map(|joint| joint.channels.len()).sum();
    let (declared_frames, frame_time, values) = parse_motion(&mut lexer, channels)?;
    let repeated_names = make_unique(&mut joints);
    let frames = values.len() / channels;
    let mut notes = Vec::new();
    if declared_frames != frames as u64 {
        notes.push(format!(
            "the file says that it has {declared_frames} frames, but has {frames}: all of them are read"
        ));
    }
    notes.extend(doubtful_channels(&joints));
    Ok(ChannelFile {
        joints,
        repeated_names,
        frame_rate: 1.0 / frame_time,
        notes,
        degrees: true,
        channels,
        values,
    })
}

/// Notes on joints that rotate about one axis twice in a row, and on scales, which are ignored.
fn doubtful_channels(joints: &[ChannelJoint]) -> Vec<String> {
    let mut notes = Vec::new();
    for joint in joints {
        let is_twice =
            |pair: &[Channel]| matches!(pair[0], Channel::Rotation(_)) && pair[0] == pair[1];
        if joint.channels.windows(2).any(is_twice) {
            let names = joint.channels.iter().map(|channel| channel.name());
            let names: Vec<&str> = names.collect();
            notes.push(format!(
                "joint \"{}\" turns about one axis twice in a row ({}): it cannot turn about all three",
                joint.name,
                names.join(" ")
            ));
        }
    }
    let has_scale = |joint: &&ChannelJoint| {
        let mut channels = joint.channels.iter();
        channels.any(|channel| matches!(channel, Channel::Scale(_)))
    };
    let mut scaled = joints.iter().filter(has_scale);
    if let Some(first) = scaled.next() {
        let more = match scaled.count() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        notes.push(format!(
            "joints have channels of scale, which are ignored: \"{}\"{more}",
            first.name
        ));
    }
    notes
}

/// Parses from `HIERARCHY` to `MOTION`, both included. End Sites have no names yet. It is not recursive, so deep trees do not overflow the
/// stack.
fn parse_hierarchy(lexer: &mut Lexer<'_>) -> Result<Vec<ChannelJoint>, TextError> {
    match lexer.word() {
        None => return Err(lexer.error(0, "the file is empty")),
        Some(word) if word.is("HIERARCHY") => {}
        other => return Err(lexer.expected("HIERARCHY", other)),
    }
    match lexer.word() {
        Some(word) if word.is("ROOT") => {}
        Some(word) if !word.is("MOTION") => return Err(lexer.expected("ROOT", Some(word))),
        other => return Err(lexer.error(lexer.place(other), "the hierarchy has no joints")),
    }
    let mut tree = Tree {
        lexer,
        joints: Vec::new(),
        open: Vec::new(),
    };
    tree.joint()?;
    while !tree.open.is_empty() {
        tree.statement()?;
    }
    let Tree { lexer, joints, .. } = tree;
    match lexer.word() {
        Some(word) if word.is("MOTION") => Ok(joints),
        Some(word) if word.is("ROOT") => Err(lexer.second_root(word)),
        other => Err(lexer.expected("MOTION", other)),
    }
}

/// The joints that were read, and those whose braces are open.
struct Tree<'l, 'a> {
    lexer: &'l mut Lexer<'a>,
    joints: Vec<ChannelJoint>,
    open: Vec<Open>,
}

/// A joint whose braces are open.
struct Open {
    joint: usize,
    has_offset: bool,
    /// Whether channels or a child were read.
    has_channels: bool,
}

impl Tree<'_, '_> {
    /// Parses a keyword and its arguments in the innermost block.
    fn statement(&mut self) -> Result<(), TextError> {
        let word = self.lexer.word();
        let keyword = word.map_or_else(String::new, |word| word.text.to_ascii_uppercase());
        let Some(block) = self.open.last_mut() else {
            return Ok(());
        };
        let joint = block.joint;
        let is_end = self.joints[joint].kind == JointKind::EndSite;
        let problem = match keyword.as_str() {
            "}" if block.has_offset => {
                self.open.pop();
                return Ok(());
            }
            "}" => format!("\"{}\" has no OFFSET", self.name(joint)),
            "OFFSET" if !block.has_offset => {
                block.has_offset = true;
                for axis in 0..3 {
                    self.joints[joint].offset[axis] = self.lexer.number("a number of OFFSET")?;
                }
                return Ok(());
            }
            "" | "MOTION" => format!(
                "the block of \"{}\" is not closed: expected `}}`, found {}",
                self.name(joint),
                found(word)
            ),
            other if is_end && other != "OFFSET" => format!(
                "an End Site has only an OFFSET, found {} in \"{}\"",
                found(word),
                self.name(joint)
            ),
            "CHANNELS" if !block.has_channels => {
                block.has_channels = true;
                return self.channels(joint);
            }
            "OFFSET" | "CHANNELS" => format!(
                "{keyword} of \"{}\" must stand once, before its children",
                self.name(joint)
            ),
            "JOINT" => return self.joint(),
            "END" => return self.end_site(),
            "ENDSITE" => {
                self.lexer.rest_of_line();
                return self.open("", JointKind::EndSite);
            }
            _ => match word.filter(|word| word.is("ROOT")) {
                Some(word) => return Err(self.lexer.second_root(word)),
                None => format!(
                    "expected OFFSET, CHANNELS, JOINT, End Site or `}}` in \"{}\", found {}",
                    self.name(joint),
                    found(word)
                ),
            },
        };
        Err(self.lexer.error(self.lexer.place(word), problem))
    }

    fn joint(&mut self) -> Result<(), TextError> {
        let name = self.lexer.rest_of_line();
        if name.text.is_empty() {
            let next = self.lexer.word();
            return Err(self.lexer.expected("a joint's name", next));
        }
        self.open(name.text, JointKind::Moving)
    }

    fn end_site(&mut self) -> Result<(), TextError> {
        let rest = self.lexer.rest_of_line();
        let first = rest.text.split_ascii_whitespace().next().unwrap_or("");
        let word = match first.is_empty() {
            true => self.lexer.word(),
            false if first.eq_ignore_ascii_case("Site") => {
                return self.open("", JointKind::EndSite);
            }
            false => Some(Word {
                text: first,
                at: rest.at,
            }),
        };
        Err(self.lexer.expected("Site", word))
    }

    fn open(&mut self, name: &str, kind: JointKind) -> Result<(), TextError> {
        match self.lexer.word() {
            Some(word) if word.text == "{" => {
                if self.joints.len() == Skeleton::MAX_JOINTS {
                    let problem = format!("more than {} joints", Skeleton::MAX_JOINTS);
                    return Err(self.lexer.error(word.at, problem));
                }
            }
            other => return Err(self.lexer.expected("`{`", other)),
        }
        let parent = self.open.last_mut().map(|block| {
            block.has_channels = true;
            block.joint
        });
        self.open.push(Open {
            joint: self.joints.len(),
            has_offset: false,
            has_channels: false,
        });
        self.joints.push(ChannelJoint {
            name: name.to_owned(),
            parent,
            offset: DVec3::ZERO,
            kind,
            channels: Vec::new(),
            axes: None,
        });
        Ok(())
    }

    fn channels(&mut self, joint: usize) -> Result<(), TextError> {
        let word = self.lexer.word();
        let count = word.and_then(|word| word.text.parse().ok());
        let Some(count @ 0..=MOST_CHANNELS) = count else {
            let expected = format!("a number of channels from 0 to {MOST_CHANNELS}");
            return Err(self.expected_channel(joint, &expected, word));
        };
        let mut channels = Vec::with_capacity(count);
        for index in 1..=count {
            let word = self.lexer.word();
            let Some(channel) = word.and_then(|word| Channel::by_name(word.text)) else {
                let expected =
                    format!("a channel (Xposition … Zscale) as number {index} of {count}");
                return Err(self.expected_channel(joint, &expected, word));
            };
            // A rotation channel may occur twice, as in the Euler angles Z X Z.
            if matches!(channel, Channel::Position(_)) && channels.contains(&channel) {
                let (name, channel) = (self.name(joint), channel.name());
                let problem = format!("\"{name}\" has the channel {channel} twice");
                return Err(self.lexer.error(self.lexer.place(word), problem));
            }
            channels.push(channel);
        }
        self.joints[joint].channels = channels;
        Ok(())
    }

    fn expected_channel(&self, joint: usize, expected: &str, word: Option<Word<'_>>) -> TextError {
        let (name, found) = (self.name(joint), found(word));
        let problem = format!("\"{name}\": expected {expected}, found {found}");
        self.lexer.error(self.lexer.place(word), problem)
    }

    /// Name of a joint for error messages.
    fn name(&self, joint: usize) -> String {
        let ChannelJoint {
            name, parent, kind, ..
        } = &self.joints[joint];
        match parent {
            Some(parent) if *kind == JointKind::EndSite => {
                format!("{}_End", self.joints[*parent].name)
            }
            _ => name.clone(),
        }
    }
}

/// Parses from `Frames:` to the end of the file. Line breaks between values are ignored. Returns the number of frames that the file states, the
/// time of a frame, and the values, frame by frame.
fn parse_motion(lexer: &mut Lexer<'_>, channels: usize) -> Result<(u64, f64, Vec<f64>), TextError> {
    if channels == 0 {
        let problem = "no joint has a channel: there is no motion to read";
        return Err(lexer.error(lexer.at, problem));
    }
    lexer.key("Frames", "Frames:")?;
    let word = lexer.word();
    let declared_frames: u64 = match word.and_then(|word| word.text.parse().ok()) {
        Some(0) => return Err(lexer.error(lexer.place(word), "the motion has no frames")),
        Some(frames) => frames,
        None => return Err(lexer.expected("a whole number of frames", word)),
    };
    lexer.key("FrameTime", "Frame Time:")?;
    let word = lexer.word();
    let frame_time = lexer.to_number(word, "a frame time")?;
    if !(1e-6..=3600.0).contains(&frame_time) {
        let expected = "a frame time between 0.000001 and 3600 seconds";
        return Err(lexer.expected(expected, word));
    }
    let expected = declared_frames.saturating_mul(channels as u64);
    // Each value takes at least a digit and a blank, which limits the number of values regardless
    // of the header.
    let most = (lexer.text.len() - lexer.at) / 2 + 1;
    let capacity = usize::try_from(expected).map_or(most, |expected| expected.min(most));
    let mut values = Vec::with_capacity(capacity);
    // Errors about missing values point to the end of the last value, not to the blank lines after
    // it.
    let mut end = lexer.at;
    while let Some(word) = lexer.word() {
        let is_whole = values.len() % channels == 0 && values.len() as u64 >= expected;
        if is_whole && word.text.parse::<f64>().is_err() && !has_decimal_comma(word.text) {
            let problem = format!("{} follows the last frame", quoted(word.text));
            return Err(lexer.error(word.at, problem));
        }
        values.push(lexer.to_number(Some(word), "a number of the motion")?);
        end = lexer.at;
    }
    let found = values.len();
    let (whole, extra) = (found / channels, found % channels);
    if (found as u64) < expected {
        let problem = format!(
            "the motion ends early: {declared_frames} frames of {channels} values are {expected} values, found {found} ({whole} whole frames)"
        );
        return Err(lexer.error(end, problem));
    }
    if extra > 0 {
        let problem = format!(
            "after frame {whole}, {extra} of {channels} values: the last frame is not whole"
        );
        return Err(lexer.error(end, problem));
    }
    Ok((declared_frames, frame_time, values))
}

/// Gives every joint a unique name. Returns the names that several moving joints had.
///
/// The first joint with a name keeps it; later ones get `_2`, `_3` or the next free number. End
/// Sites are named after their parents with `_End` or `_End2`; their names in the file are ignored.
fn make_unique(joints: &mut [ChannelJoint]) -> Vec<String> {
    let mut taken = UsedNames::default();
    let is_end = |joint: &&mut ChannelJoint| joint.kind == JointKind::EndSite;
    for joint in joints.iter_mut().filter(|joint| !is_end(joint)) {
        joint.name = taken.first_free(&joint.name, "_");
    }
    let repeated = std::mem::take(&mut taken.repeated);
    for index in 0..joints.len() {
        if joints[index].kind == JointKind::EndSite {
            let parent = joints[index]
                .parent
                .map_or("", |parent| &joints[parent].name);
            joints[index].name = taken.first_free(&format!("{parent}_End"), "");
        }
    }
    repeated
}

/// The names in use and, for each repeated name, the next number to try.
#[derive(Default)]
pub(crate) struct UsedNames {
    names: HashSet<String>,
    next: HashMap<String, usize>,
    /// The names that were in use already, each once.
    pub(crate) repeated: Vec<String>,
}

impl UsedNames {
    /// Returns the name, or the name with the first free number.
    pub(crate) fn first_free(&mut self, name: &str, before_number: &str) -> String {
        let mut free = name.to_owned();
        if self.names.contains(name) {
            let next = self.next.entry(free.clone()).or_insert_with(|| {
                self.repeated.push(free.clone());
                2
            });
            while self.names.contains(&free) {
                free = format!("{name}{before_number}{next}");
                *next += 1;
            }
        }
        self.names.insert(free.clone());
        free
    }
}

/// A sequence of characters without white space, or a brace, with its position.
#[derive(Clone, Copy, Debug)]
struct Word<'a> {
    text: &'a str,
    at: usize,
}

impl Word<'_> {
    fn is(&self, keyword: &str) -> bool {
        self.text.eq_ignore_ascii_case(keyword)
    }
}

/// Splits a text into words. Positions are byte offsets. Line numbers are computed only for errors.
struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    /// # Errors
    /// A byte is NUL or not valid UTF-8.
    fn new(bytes: &'a [u8]) -> Result<Self, TextError> {
        let bytes = without_mark(bytes);
        let valid = match std::str::from_utf8(bytes) {
            Ok(text) => text,
            Err(error) => std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or(""),
        };
        let good = valid.find('\0').unwrap_or(valid.len());
        let lexer = Self { text: valid, at: 0 };
        match good == bytes.len() {
            true => Ok(lexer),
            false => Err(lexer.error(
                good,
                "not text: a BVH file is ASCII or UTF-8, and this byte is neither",
            )),
        }
    }

    fn skip_space(&mut self) {
        let rest = &self.text.as_bytes()[self.at..];
        let blanks = rest.iter().position(|&byte| !is_space(byte));
        self.at += blanks.unwrap_or(rest.len());
    }

    /// The next word, or `None` at the end of the text.
    fn word(&mut self) -> Option<Word<'a>> {
        self.skip_space();
        let at = self.at;
        let rest = &self.text.as_bytes()[at..];
        let ends = |&byte: &u8| is_space(byte) || is_brace(byte);
        let length = match is_brace(*rest.first()?) {
            true => 1,
            false => rest.iter().position(ends).unwrap_or(rest.len()),
        };
        self.at += length;
        let text = &self.text[at..at + length];
        Some(Word { text, at })
    }

    /// The rest of the line up to a brace, trimmed.
    fn rest_of_line(&mut self) -> Word<'a> {
        let rest = &self.text[self.at..];
        let own = rest.trim_start_matches([' ', '\t']);
        let at = self.at + rest.len() - own.len();
        let length = own.find(['{', '}', '\n', '\r']).unwrap_or(own.len());
        self.at = at + length;
        let text = own[..length].trim_matches(|c: char| c.is_ascii_whitespace());
        Word { text, at }
    }

    /// Skips `key` and a colon with any spacing, for example `Frame Time:` or `FRAMETIME :`.
    fn key(&mut self, key: &str, expected: &str) -> Result<(), TextError> {
        self.skip_space();
        let line = self.text[self.at..].split('\n').next();
        if let Some((found, _)) = line.and_then(|line| line.split_once(':')) {
            let letters: String = found.split([' ', '\t']).collect();
            if letters.eq_ignore_ascii_case(key) {
                self.at += found.len() + 1;
                return Ok(());
            }
        }
        let word = self.word();
        Err(self.expected(expected, word))
    }

    /// Parses the next word as a finite number.
    fn number(&mut self, expected: &str) -> Result<f64, TextError> {
        let word = self.word();
        self.to_number(word, expected)
    }

    /// Parses a word as a finite number.
    fn to_number(&self, word: Option<Word<'_>>, expected: &str) -> Result<f64, TextError> {
        let text = word.map_or("", |word| word.text);
        let problem = match text.parse::<f64>() {
            Ok(value) if value.abs() <= LARGEST_VALUE => return Ok(value),
            Ok(value) if value.is_finite() => "is larger than any motion",
            Ok(_) => return Err(self.expected("a finite number", word)),
            Err(_) if has_decimal_comma(text) => "has a decimal comma; BVH numbers have a point",
            Err(_) => return Err(self.expected(expected, word)),
        };
        Err(self.error(self.place(word), format!("{} {problem}", found(word))))
    }

    /// Position of a word, or of the end of the file.
    fn place(&self, word: Option<Word<'_>>) -> usize {
        word.map_or(self.text.len(), |word| word.at)
    }

    fn second_root(&mut self, word: Word<'_>) -> TextError {
        let name = self.rest_of_line().text;
        let problem = format!("a second ROOT, \"{name}\": only files of one skeleton can be read");
        self.error(word.at, problem)
    }

    /// Error for an unexpected word or the end of the file.
    fn expected(&self, expected: &str, word: Option<Word<'_>>) -> TextError {
        let problem = format!("expected {expected}, found {}", found(word));
        self.error(self.place(word), problem)
    }

    fn error(&self, at: usize, problem: impl Into<String>) -> TextError {
        let bytes = self.text.as_bytes();
        let (mut line, mut line_start) = (1, 0);
        for (index, &byte) in bytes[..at].iter().enumerate() {
            let ends_line =
                byte == b'\n' || (byte == b'\r' && bytes.get(index + 1) != Some(&b'\n'));
            if ends_line {
                line += 1;
                line_start = index + 1;
            }
        }
        TextError {
            line,
            column: Some(self.text[line_start..at].chars().count() + 1),
            message: problem.into(),
        }
    }
}

/// A word, formatted for an error message.
fn found(word: Option<Word<'_>>) -> String {
    let quoted = word.map(|word| quoted(word.text));
    quoted.unwrap_or_else(|| "the end of the file".to_owned())
}

fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\n' | b'\r' | 0x0B | 0x0C)
}

fn is_brace(byte: u8) -> bool {
    matches!(byte, b'{' | b'}')
}

fn has_decimal_comma(text: &str) -> bool {
    text.contains(',') && text.replace(',', ".").parse::<f64>().is_ok()
}
