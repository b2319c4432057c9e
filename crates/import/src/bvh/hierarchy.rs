use glam::DVec3;

use super::lexer::{Lexer, Word, found, quoted};
use super::{BvhError, BvhProblem, Channel, MOST_CHANNELS};
use sabaki::anim::Skeleton;

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
pub(super) fn parse(lexer: &mut Lexer<'_>) -> Result<Vec<RawJoint>, BvhError> {
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
