//! The text of a file: its words, the hierarchy of its joints, and the values of its motion.

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use sabaki::anim::Skeleton;

use super::{BvhError, BvhProblem, Channel, LARGEST_VALUE, MOST_CHANNELS};

/// A joint as it is written in the hierarchy.
pub(super) struct RawJoint {
    /// Name in the file. It is unused for End Sites.
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    pub(super) offset: Option<DVec3>,
    pub(super) channels: Option<Vec<Channel>>,
    pub(super) is_end: bool,
    has_children: bool,
}

/// Parses from `HIERARCHY` to `MOTION`, both included. It is not recursive, so deep trees do not
/// overflow the stack.
pub(super) fn parse_hierarchy(lexer: &mut Lexer<'_>) -> Result<Vec<RawJoint>, BvhError> {
    match lexer.word() {
        None => return Err(lexer.error(0, BvhProblem::Empty)),
        Some(word) if word.is("HIERARCHY") => {}
        other => return Err(lexer.expected("HIERARCHY", other)),
    }
    match lexer.word() {
        Some(word) if word.is("ROOT") => {}
        Some(word) if word.is("MOTION") => {
            return Err(lexer.error(word.at, BvhProblem::NoJoints));
        }
        None => return Err(lexer.error(lexer.at(), BvhProblem::NoJoints)),
        other => return Err(lexer.expected("ROOT", other)),
    }
    let mut tree = Tree {
        lexer,
        joints: Vec::new(),
        open: Vec::new(),
    };
    tree.open_joint()?;
    while let Some(&joint) = tree.open.last() {
        tree.statement(joint)?;
    }
    let Tree { lexer, joints, .. } = tree;
    match lexer.word() {
        Some(word) if word.is("MOTION") => Ok(joints),
        Some(word) if word.is("ROOT") => Err(second_root(lexer, word)),
        other => Err(lexer.expected("MOTION", other)),
    }
}

fn second_root(lexer: &mut Lexer<'_>, word: Word<'_>) -> BvhError {
    let name = lexer.rest_of_line().text.to_owned();
    lexer.error(word.at, BvhProblem::SecondRoot { name })
}

/// The joints that were read, and the joints whose braces are open.
struct Tree<'l, 'a> {
    lexer: &'l mut Lexer<'a>,
    joints: Vec<RawJoint>,
    open: Vec<usize>,
}

impl Tree<'_, '_> {
    /// Parses a keyword and its arguments in the block of `joint`.
    fn statement(&mut self, joint: usize) -> Result<(), BvhError> {
        let Some(word) = self.lexer.word() else {
            return Err(self.unclosed(joint, None));
        };
        if word.text == "}" {
            return self.close(joint, word);
        }
        if word.is("OFFSET") {
            return self.offset(joint, word);
        }
        if word.is("MOTION") {
            return Err(self.unclosed(joint, Some(word)));
        }
        if self.joints[joint].is_end {
            let problem = BvhProblem::InEndSite {
                joint: self.name(joint),
                found: quoted(word.text),
            };
            return Err(self.lexer.error(word.at, problem));
        }
        if word.is("CHANNELS") {
            self.channels(joint, word)
        } else if word.is("JOINT") {
            self.open_joint()
        } else if word.is("End") {
            self.open_end_site()
        } else if word.is("EndSite") {
            self.lexer.rest_of_line();
            self.open("", true)
        } else if word.is("ROOT") {
            Err(second_root(self.lexer, word))
        } else {
            let problem = BvhProblem::UnknownKeyword {
                joint: self.name(joint),
                found: quoted(word.text),
            };
            Err(self.lexer.error(word.at, problem))
        }
    }

    fn open_joint(&mut self) -> Result<(), BvhError> {
        let name = self.lexer.rest_of_line();
        if name.text.is_empty() {
            let next = self.lexer.word();
            return Err(self.lexer.expected("a joint's name", next));
        }
        self.open(name.text, false)
    }

    fn open_end_site(&mut self) -> Result<(), BvhError> {
        let rest = self.lexer.rest_of_line();
        let first = rest.text.split_ascii_whitespace().next().unwrap_or("");
        if first.eq_ignore_ascii_case("Site") {
            return self.open("", true);
        }
        let word = if first.is_empty() {
            self.lexer.word()
        } else {
            Some(Word {
                text: first,
                at: rest.at,
            })
        };
        Err(self.lexer.expected("Site", word))
    }

    fn open(&mut self, name: &str, is_end: bool) -> Result<(), BvhError> {
        match self.lexer.word() {
            Some(word) if word.text == "{" => {
                if self.joints.len() == Skeleton::MAX_JOINTS {
                    return Err(self.lexer.error(word.at, BvhProblem::TooManyJoints));
                }
            }
            other => return Err(self.lexer.expected("`{`", other)),
        }
        let parent = self.open.last().copied();
        if let Some(parent) = parent {
            self.joints[parent].has_children = true;
        }
        self.open.push(self.joints.len());
        self.joints.push(RawJoint {
            name: name.to_owned(),
            parent,
            offset: None,
            channels: None,
            is_end,
            has_children: false,
        });
        Ok(())
    }

    fn close(&mut self, joint: usize, word: Word<'_>) -> Result<(), BvhError> {
        if self.joints[joint].offset.is_none() {
            let joint = self.name(joint);
            return Err(self.lexer.error(word.at, BvhProblem::NoOffset { joint }));
        }
        self.open.pop();
        Ok(())
    }

    fn offset(&mut self, joint: usize, word: Word<'_>) -> Result<(), BvhError> {
        if self.joints[joint].offset.is_some() {
            return Err(self.misplaced(joint, "OFFSET", word));
        }
        let mut offset = DVec3::ZERO;
        for axis in 0..3 {
            offset[axis] = self.lexer.number("a number of OFFSET")?;
        }
        self.joints[joint].offset = Some(offset);
        Ok(())
    }

    fn channels(&mut self, joint: usize, word: Word<'_>) -> Result<(), BvhError> {
        if self.joints[joint].channels.is_some() || self.joints[joint].has_children {
            return Err(self.misplaced(joint, "CHANNELS", word));
        }
        let word = self.lexer.word();
        let count = word.and_then(|word| word.text.parse().ok());
        let Some(count @ 0..=MOST_CHANNELS) = count else {
            let problem = BvhProblem::ChannelCount {
                joint: self.name(joint),
                found: found(word),
            };
            let at = word.map_or(self.lexer.at(), |word| word.at);
            return Err(self.lexer.error(at, problem));
        };
        let mut channels = Vec::with_capacity(count);
        for index in 1..=count {
            let word = self.lexer.word();
            let at = word.map_or(self.lexer.at(), |word| word.at);
            let Some(channel) = word.and_then(|word| Channel::by_name(word.text)) else {
                let problem = BvhProblem::ChannelName {
                    joint: self.name(joint),
                    index,
                    count,
                    found: found(word),
                };
                return Err(self.lexer.error(at, problem));
            };
            // A rotation channel may occur twice, as in the Euler angles Z X Z.
            if matches!(channel, Channel::Position(_)) && channels.contains(&channel) {
                let problem = BvhProblem::ChannelTwice {
                    joint: self.name(joint),
                    channel: channel.name(),
                };
                return Err(self.lexer.error(at, problem));
            }
            channels.push(channel);
        }
        self.joints[joint].channels = Some(channels);
        Ok(())
    }

    fn misplaced(&self, joint: usize, keyword: &'static str, word: Word<'_>) -> BvhError {
        let joint = self.name(joint);
        self.lexer
            .error(word.at, BvhProblem::Misplaced { keyword, joint })
    }

    fn unclosed(&self, joint: usize, word: Option<Word<'_>>) -> BvhError {
        let at = word.map_or(self.lexer.at(), |word| word.at);
        let problem = BvhProblem::Unclosed {
            joint: self.name(joint),
            found: found(word),
        };
        self.lexer.error(at, problem)
    }

    /// Name of a joint for error messages.
    fn name(&self, joint: usize) -> String {
        let raw = &self.joints[joint];
        match raw.parent {
            Some(parent) if raw.is_end => format!("{}_End", self.joints[parent].name),
            _ => raw.name.clone(),
        }
    }
}

/// The part of a file after `MOTION`.
pub(super) struct Motion {
    pub(super) declared_frames: u64,
    pub(super) frame_time: f64,
    /// Values, frame by frame.
    pub(super) values: Vec<f64>,
}

/// Parses from `Frames:` to the end of the file. Line breaks between values are ignored.
pub(super) fn parse_motion(lexer: &mut Lexer<'_>, channels: usize) -> Result<Motion, BvhError> {
    if channels == 0 {
        return Err(lexer.error(lexer.at(), BvhProblem::NoChannels));
    }
    let declared_frames = frames(lexer)?;
    let frame_time = frame_time(lexer)?;
    let expected = declared_frames.saturating_mul(channels as u64);
    let values = values(lexer, expected, channels)?;
    let found = values.len();
    if (found as u64) < expected {
        let problem = BvhProblem::TooFewValues {
            frames: declared_frames,
            channels,
            expected,
            found,
        };
        return Err(lexer.error(lexer.at(), problem));
    }
    let extra = found % channels;
    if extra > 0 {
        let frames = found / channels;
        let problem = BvhProblem::LeftOver {
            extra,
            frames,
            channels,
        };
        return Err(lexer.error(lexer.at(), problem));
    }
    Ok(Motion {
        declared_frames,
        frame_time,
        values,
    })
}

fn frames(lexer: &mut Lexer<'_>) -> Result<u64, BvhError> {
    lexer.key("Frames", "Frames:")?;
    let word = lexer.word();
    match word.and_then(|word| Some((word.at, word.text.parse().ok()?))) {
        Some((at, 0)) => Err(lexer.error(at, BvhProblem::NoFrames)),
        Some((_, frames)) => Ok(frames),
        None => Err(lexer.expected("a whole number of frames", word)),
    }
}

fn frame_time(lexer: &mut Lexer<'_>) -> Result<f64, BvhError> {
    lexer.key("FrameTime", "Frame Time:")?;
    let Some(word) = lexer.word() else {
        return Err(lexer.expected("a frame time", None));
    };
    let seconds = lexer.to_number(word, "a frame time")?;
    if (1e-6..=3600.0).contains(&seconds) {
        Ok(seconds)
    } else {
        let found = quoted(word.text);
        Err(lexer.error(word.at, BvhProblem::FrameTime { found }))
    }
}

fn values(lexer: &mut Lexer<'_>, expected: u64, channels: usize) -> Result<Vec<f64>, BvhError> {
    // Each value takes at least a digit and a blank, which limits the number of values regardless
    // of the header.
    let most = lexer.bytes_left() / 2 + 1;
    let capacity = usize::try_from(expected).map_or(most, |expected| expected.min(most));
    let mut values = Vec::with_capacity(capacity);
    let mut end = lexer.at();
    while let Some(word) = lexer.word() {
        let whole = values.len() % channels == 0 && values.len() as u64 >= expected;
        match lexer.to_number(word, "a number of the motion") {
            Ok(value) => values.push(value),
            Err(error) if whole && matches!(error.problem, BvhProblem::Expected { .. }) => {
                let found = quoted(word.text);
                return Err(lexer.error(word.at, BvhProblem::Trailing { found }));
            }
            Err(error) => return Err(error),
        }
        end = lexer.at();
    }
    // Errors about missing values point to the end of the last value, not to the blank lines after
    // it.
    lexer.rewind(end);
    Ok(values)
}

/// Computes a unique name for every joint.
///
/// The first joint with a name keeps it; later ones get `_2`, `_3` or the next free number. End
/// Sites are named after their parents with `_End` or `_End2`; their names in the file are ignored.
pub(super) fn unique_names(raw: &[RawJoint]) -> Vec<String> {
    let mut taken = UsedNames::default();
    let mut names = vec![String::new(); raw.len()];
    for (index, joint) in raw.iter().enumerate().filter(|(_, joint)| !joint.is_end) {
        names[index] = taken.first_free(&joint.name, "_");
    }
    for (index, joint) in raw.iter().enumerate().filter(|(_, joint)| joint.is_end) {
        let parent = joint.parent.map_or("", |parent| names[parent].as_str());
        names[index] = taken.first_free(&format!("{parent}_End"), "");
    }
    names
}

/// The names that several joints have in the file, each once, in the order of the file.
pub(super) fn repeated_names(raw: &[RawJoint]) -> Vec<String> {
    let mut counts: HashMap<&str, usize> = HashMap::new();
    let joints = raw.iter().filter(|joint| !joint.is_end);
    let names = joints.map(|joint| joint.name.as_str());
    let second = names.filter(|&name| {
        let count = counts.entry(name).or_default();
        *count += 1;
        *count == 2
    });
    second.map(str::to_owned).collect()
}

/// The names in use and, for each repeated name, the next number to try.
#[derive(Default)]
pub(crate) struct UsedNames {
    names: HashSet<String>,
    next: HashMap<String, usize>,
}

impl UsedNames {
    /// Returns the name, or the name with the first free number.
    pub(crate) fn first_free(&mut self, name: &str, before_number: &str) -> String {
        let mut free = name.to_owned();
        if self.names.contains(name) {
            let next = self.next.entry(free.clone()).or_insert(2);
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
pub(super) struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    /// # Errors
    /// A byte is NUL or not valid UTF-8.
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, BvhError> {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let not_text = |good: usize| {
            let before = std::str::from_utf8(&bytes[..good]).unwrap_or("");
            error_at(before, good, BvhProblem::NotText)
        };
        let text = std::str::from_utf8(bytes).map_err(|error| not_text(error.valid_up_to()))?;
        match bytes.iter().position(|&byte| byte == 0) {
            Some(at) => Err(not_text(at)),
            None => Ok(Self { text, at: 0 }),
        }
    }

    fn at(&self) -> usize {
        self.at
    }

    /// Returns to a position from [`Self::at`].
    fn rewind(&mut self, at: usize) {
        self.at = at;
    }

    fn bytes_left(&self) -> usize {
        self.text.len() - self.at
    }

    fn skip_space(&mut self) {
        let rest = &self.text.as_bytes()[self.at..];
        self.at += rest
            .iter()
            .position(|&byte| !is_space(byte))
            .unwrap_or(rest.len());
    }

    /// The next word, or `None` at the end of the text.
    fn word(&mut self) -> Option<Word<'a>> {
        self.skip_space();
        let at = self.at;
        let rest = &self.text.as_bytes()[at..];
        let first = *rest.first()?;
        let length = if is_brace(first) {
            1
        } else {
            rest.iter()
                .position(|&byte| is_space(byte) || is_brace(byte))
                .unwrap_or(rest.len())
        };
        self.at += length;
        Some(Word {
            text: &self.text[at..at + length],
            at,
        })
    }

    /// The rest of the line up to a brace, trimmed.
    fn rest_of_line(&mut self) -> Word<'a> {
        let rest = &self.text.as_bytes()[self.at..];
        let blanks = rest.iter().position(|&byte| !matches!(byte, b' ' | b'\t'));
        self.at += blanks.unwrap_or(rest.len());
        let at = self.at;
        let rest = &self.text.as_bytes()[at..];
        let length = rest
            .iter()
            .position(|&byte| is_brace(byte) || matches!(byte, b'\n' | b'\r'))
            .unwrap_or(rest.len());
        self.at += length;
        Word {
            text: self.text[at..at + length].trim_matches(|c: char| c.is_ascii_whitespace()),
            at,
        }
    }

    /// Skips `key` and a colon with any spacing, for example `Frame Time:` or `FRAMETIME :`.
    fn key(&mut self, key: &str, expected: &'static str) -> Result<(), BvhError> {
        self.skip_space();
        let mut wanted = key.bytes();
        for (index, byte) in self.text.bytes().enumerate().skip(self.at) {
            match byte {
                b':' if wanted.len() == 0 => {
                    self.at = index + 1;
                    return Ok(());
                }
                b' ' | b'\t' => {}
                _ if wanted
                    .next()
                    .is_some_and(|due| due.eq_ignore_ascii_case(&byte)) => {}
                _ => break,
            }
        }
        let word = self.word();
        Err(self.expected(expected, word))
    }

    /// Parses the next word as a finite number.
    fn number(&mut self, expected: &'static str) -> Result<f64, BvhError> {
        match self.word() {
            Some(word) => self.to_number(word, expected),
            None => Err(self.expected(expected, None)),
        }
    }

    /// Parses a word as a finite number.
    fn to_number(&self, word: Word<'_>, expected: &'static str) -> Result<f64, BvhError> {
        let found = || quoted(word.text);
        let problem = match word.text.parse::<f64>() {
            Ok(value) if value.abs() <= LARGEST_VALUE => return Ok(value),
            Ok(value) if value.is_finite() => BvhProblem::TooLarge { found: found() },
            Ok(_) => BvhProblem::NotFinite { found: found() },
            Err(_) if has_decimal_comma(word.text) => BvhProblem::DecimalComma { found: found() },
            Err(_) => return Err(self.expected(expected, Some(word))),
        };
        Err(self.error(word.at, problem))
    }

    /// Error for an unexpected word or the end of the file.
    fn expected(&self, expected: &'static str, word: Option<Word<'_>>) -> BvhError {
        let at = word.map_or(self.text.len(), |word| word.at);
        let found = found(word);
        self.error(at, BvhProblem::Expected { expected, found })
    }

    fn error(&self, at: usize, problem: BvhProblem) -> BvhError {
        error_at(self.text, at, problem)
    }
}

/// A word, formatted for an error message.
fn found(word: Option<Word<'_>>) -> String {
    word.map_or_else(
        || "the end of the file".to_owned(),
        |word| quoted(word.text),
    )
}

/// A quoted text, shortened to 40 characters.
pub(crate) fn quoted(text: &str) -> String {
    const MOST: usize = 40;
    let mut short: String = text
        .chars()
        .take(MOST)
        .flat_map(char::escape_debug)
        .collect();
    if text.chars().nth(MOST).is_some() {
        short.push('…');
    }
    format!("\"{short}\"")
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

fn error_at(text: &str, at: usize, problem: BvhProblem) -> BvhError {
    let bytes = text.as_bytes();
    let at = at.min(bytes.len());
    let (mut line, mut line_start) = (1, 0);
    for (index, &byte) in bytes[..at].iter().enumerate() {
        let ends_line = byte == b'\n' || (byte == b'\r' && bytes.get(index + 1) != Some(&b'\n'));
        if ends_line {
            line += 1;
            line_start = index + 1;
        }
    }
    BvhError {
        line,
        column: text[line_start..at].chars().count() + 1,
        problem,
    }
}
