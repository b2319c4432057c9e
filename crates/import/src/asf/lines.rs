use glam::DVec3;

use super::error::quoted;
use super::{AsfError, AsfProblem};
use crate::bvh::LARGEST_VALUE;
use crate::file::without_mark;

/// A line that is neither empty nor a comment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Line number, from 1.
    pub(super) number: usize,
    text: &'a str,
}

/// Lines of a file that are neither empty nor comments.
///
/// # Errors
/// The bytes are not text.
pub(super) fn lines(bytes: &[u8]) -> Result<impl Iterator<Item = Line<'_>>, AsfError> {
    let bytes = without_mark(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| AsfError {
        line: 1 + bytes[..error.valid_up_to()]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count(),
        problem: AsfProblem::NotText,
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
    pub(super) fn words(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.text.split_whitespace()
    }

    pub(super) fn first(&self) -> &'a str {
        self.words().next().unwrap_or("")
    }

    pub(super) fn error(&self, problem: AsfProblem) -> AsfError {
        AsfError {
            line: self.number,
            problem,
        }
    }

    pub(super) fn expected(&self, expected: &'static str, found: Option<&str>) -> AsfError {
        let found = found.map_or_else(|| "the line's end".to_owned(), quoted);
        self.error(AsfProblem::Expected { expected, found })
    }

    /// Parses a word as a number.
    pub(super) fn number(&self, word: Option<&str>) -> Result<f64, AsfError> {
        let number = word.and_then(|word| word.parse().ok());
        number
            .filter(|number: &f64| number.abs() <= LARGEST_VALUE)
            .ok_or_else(|| self.expected("a number", word))
    }

    /// Parses the three numbers after the first word.
    pub(super) fn vector(&self) -> Result<DVec3, AsfError> {
        let mut words = self.words().skip(1);
        let mut next = || self.number(words.next());
        Ok(DVec3::new(next()?, next()?, next()?))
    }
}
