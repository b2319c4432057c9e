use super::lexer::{Lexer, quoted};
use super::{BvhError, BvhProblem};

/// The part of a file after `MOTION`.
pub(super) struct Motion {
    pub(super) declared_frames: u64,
    pub(super) frame_time: f64,
    /// Values, frame by frame.
    pub(super) values: Vec<f64>,
}

/// Parses from `Frames:` to the end of the file. Line breaks between values are ignored.
pub(super) fn parse(lexer: &mut Lexer<'_>, channels: usize) -> Result<Motion, BvhError> {
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
