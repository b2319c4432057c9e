use super::{BvhError, BvhProblem, LARGEST_VALUE};

/// A sequence of characters without white space, or a brace, with its position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'a> {
    pub(super) text: &'a str,
    pub(super) at: usize,
}

impl Word<'_> {
    pub(super) fn is(&self, keyword: &str) -> bool {
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

    pub(super) fn at(&self) -> usize {
        self.at
    }

    /// Returns to a position from [`Self::at`].
    pub(super) fn rewind(&mut self, at: usize) {
        self.at = at;
    }

    pub(super) fn bytes_left(&self) -> usize {
        self.text.len() - self.at
    }

    pub(super) fn skip_space(&mut self) {
        let rest = &self.text.as_bytes()[self.at..];
        self.at += rest
            .iter()
            .position(|&byte| !is_space(byte))
            .unwrap_or(rest.len());
    }

    /// The next word, or `None` at the end of the text.
    pub(super) fn word(&mut self) -> Option<Word<'a>> {
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
    pub(super) fn rest_of_line(&mut self) -> Word<'a> {
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
    pub(super) fn key(&mut self, key: &str, expected: &'static str) -> Result<(), BvhError> {
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
    pub(super) fn number(&mut self, expected: &'static str) -> Result<f64, BvhError> {
        match self.word() {
            Some(word) => self.to_number(word, expected),
            None => Err(self.expected(expected, None)),
        }
    }

    /// Parses a word as a finite number.
    pub(super) fn to_number(
        &self,
        word: Word<'_>,
        expected: &'static str,
    ) -> Result<f64, BvhError> {
        match word.text.parse::<f64>() {
            Ok(value) if value.abs() <= LARGEST_VALUE => Ok(value),
            Ok(value) if value.is_finite() => Err(self.error(
                word.at,
                BvhProblem::TooLarge {
                    found: quoted(word.text),
                },
            )),
            Ok(_) => Err(self.error(
                word.at,
                BvhProblem::NotFinite {
                    found: quoted(word.text),
                },
            )),
            Err(_) if has_decimal_comma(word.text) => Err(self.error(
                word.at,
                BvhProblem::DecimalComma {
                    found: quoted(word.text),
                },
            )),
            Err(_) => Err(self.expected(expected, Some(word))),
        }
    }

    /// Error for an unexpected word or the end of the file.
    pub(super) fn expected(&self, expected: &'static str, word: Option<Word<'_>>) -> BvhError {
        let at = word.map_or(self.text.len(), |word| word.at);
        let found = found(word);
        self.error(at, BvhProblem::Expected { expected, found })
    }

    pub(super) fn error(&self, at: usize, problem: BvhProblem) -> BvhError {
        error_at(self.text, at, problem)
    }
}

/// A word, formatted for an error message.
pub(super) fn found(word: Option<Word<'_>>) -> String {
    word.map_or_else(
        || "the end of the file".to_owned(),
        |word| quoted(word.text),
    )
}

/// A quoted text, shortened to 40 characters.
pub(super) fn quoted(text: &str) -> String {
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
