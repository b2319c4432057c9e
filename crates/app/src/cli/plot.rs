//! `--plot FILE.png` and `--plot -`: a picture in a file, or the same in letters on the terminal.

use std::convert::Infallible;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::str::FromStr;

use super::Failure;
use super::picture::Picture;

/// Where a plot goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Plot {
    /// `-`: with the text, in letters.
    Text,
    /// A PNG.
    File(PathBuf),
}

impl FromStr for Plot {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "-" => Self::Text,
            path => Self::File(path.into()),
        })
    }
}

impl Plot {
    /// Before any work is done.
    pub(crate) fn check(plot: Option<&Self>, as_json: bool) -> Result<(), Failure> {
        match plot {
            Some(Self::Text) if as_json => Err(Failure::Usage(
                "--plot - and --json cannot both have stdout; --plot FILE.png can be with --json"
                    .to_owned(),
            )),
            _ => Ok(()),
        }
    }

    /// Writes the picture, or says it in letters.
    pub(crate) fn draw(
        &self,
        picture: impl FnOnce() -> Picture,
        letters: impl FnOnce(Paint) -> String,
    ) -> Result<String, Failure> {
        match self {
            Self::Text => Ok(letters(Paint::for_stdout())),
            Self::File(path) => picture().write(path).map(|()| String::new()),
        }
    }
}

/// Whether letters have colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Paint(bool);

impl Paint {
    /// Colours on a terminal, unless `NO_COLOR` is set to anything or the terminal is dumb (no-color.org).
    fn for_stdout() -> Self {
        let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        Self::of(std::io::stdout().is_terminal(), set("NO_COLOR") || dumb)
    }

    fn of(is_terminal: bool, refused: bool) -> Self {
        Self(is_terminal && !refused)
    }

    /// Letters in a colour, where there are any.
    pub(crate) fn on(self, [red, green, blue]: [u8; 3], letters: &str) -> String {
        match self {
            Self(true) => format!("\x1b[38;2;{red};{green};{blue}m{letters}\x1b[0m"),
            Self(false) => letters.to_owned(),
        }
    }
}

/// From nothing to all.
const SHADES: [char; 5] = ['·', '░', '▒', '▓', '█'];

/// A letter for a share, from 0 to 1.
pub(crate) fn shade(share: f64) -> char {
    let last = SHADES.len() - 1;
    SHADES[(share * last as f64).round().clamp(0.0, last as f64) as usize]
}

/// Bars from the left, as long as their values, which are 0 or more; each with its name and its value in words.
pub(crate) fn bars(rows: &[(String, f64, String)], (colour, paint): ([u8; 3], Paint)) -> String {
    /// Letters of the longest bar.
    const LONGEST: f64 = 48.0;
    const EIGHTHS: [char; 8] = [' ', '▏', '▎', '▍', '▌', '▋', '▊', '▉'];
    let most = rows.iter().map(|row| row.1).fold(0.0, f64::max);
    let wide = rows.iter().map(|row| row.0.chars().count()).max();
    let wide = wide.unwrap_or(0);
    let row = |(name, value, words): &(String, f64, String)| {
        let eighths = if most > 0.0 {
            (8.0 * LONGEST * value / most).round() as usize
        } else {
            0
        };
        let mut bar = "█".repeat(eighths / 8);
        if !eighths.is_multiple_of(8) {
            bar.push(EIGHTHS[eighths % 8]);
        }
        let gap = " ".repeat(wide - name.chars().count());
        format!("{name}{gap} {} {words}\n", paint.on(colour, &bar))
    };
    rows.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_for_terminals_that_want_them() {
        assert_eq!(
            Paint::of(true, false).on([1, 2, 3], "a"),
            "\x1b[38;2;1;2;3ma\x1b[0m"
        );
        for plain in [
            Paint::of(false, false),
            Paint::of(true, true),
            Paint::of(false, true),
        ] {
            assert_eq!(plain.on([1, 2, 3], "a"), "a");
        }
    }

    #[test]
    fn bars_are_as_long_as_their_values() {
        let row = |name: &str, value| (name.to_owned(), value, "w".to_owned());
        let rows = [row("a", 4.0), row("bc", 1.0), row("d", 0.0)];
        let text = bars(&rows, ([0; 3], Paint(false)));
        let full = text.lines().map(|line| line.matches('█').count());
        assert_eq!(full.collect::<Vec<_>>(), [48, 12, 0]);
        assert!(text.starts_with("a  █") && text.contains("\nbc █"));
        assert_eq!(bars(&[row("a", 0.0)], ([0; 3], Paint(false))), "a  w\n");
    }

    #[test]
    fn a_shade_is_of_its_share() {
        let shades: String = [-1.0, 0.0, 0.3, 0.5, 0.7, 1.0, 7.0]
            .map(shade)
            .iter()
            .collect();
        assert_eq!(shades, "··░▒▓██");
        assert_eq!(shade(f64::NAN), '·');
    }
}
