//! `--plot FILE.png`, `--plot FILE.svg` and `--plot -`: a figure in a file, or in letters on the terminal.

use std::error::Error;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use plotters::coord::Shift;
use plotters::prelude::*;
use sabaki::archive;

pub(crate) use super::picture::INK;
use super::picture::{Picture, embed_font};
use super::{Failure, output};

/// A part of a figure, in pixels.
pub(crate) type Area<DB> = DrawingArea<DB, Shift>;

/// Whether a figure could be drawn.
pub(crate) type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// A figure that can be plotted.
pub(crate) trait Figure {
    /// Columns and rows, in pixels.
    fn size(&self) -> (u32, u32);

    /// Draws the figure on a white area of its size.
    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>, format: Format) -> Drawn<DB>;

    /// The figure in letters, for a terminal.
    fn letters(&self, paint: Paint) -> String;
}

/// The format of a plotted file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Png,
    Svg,
}

/// Destination of a plot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Plot {
    /// `-`: letters, after the text on stdout.
    Text,
    /// A file, in the format of its ending.
    File(PathBuf, Format),
}

impl FromStr for Plot {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = Path::new(text);
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_ref().and_then(|ending| ending.to_str()) {
            _ if text == "-" => Ok(Self::Text),
            Some("png") => Ok(Self::File(path.to_owned(), Format::Png)),
            Some("svg") => Ok(Self::File(path.to_owned(), Format::Svg)),
            _ => Err("its name must end in .png or .svg; - writes letters to stdout".to_owned()),
        }
    }
}

impl Plot {
    /// Refuses `--plot -` beside `--json`, and a file that cannot be written, before any work is done.
    pub(crate) fn check(plot: Option<&Self>, as_json: bool) -> Result<(), Failure> {
        match plot {
            Some(Self::Text) if as_json => Err(Failure::Usage(
                "--plot - and --json cannot both have stdout; --plot FILE.png can be with --json"
                    .to_owned(),
            )),
            Some(Self::File(path, _)) => output::check_can_be_written("--plot", path),
            _ => Ok(()),
        }
    }

    /// Writes the figure to its file, or returns it in letters.
    pub(crate) fn draw(&self, figure: &impl Figure) -> Result<String, Failure> {
        let (path, format) = match self {
            Self::Text => return Ok(figure.letters(Paint::for_stdout())),
            Self::File(path, format) => (path, *format),
        };
        write(path, format, figure).map_err(|source| Failure::Write {
            path: path.clone(),
            source,
        })?;
        Ok(String::new())
    }
}

fn write(path: &Path, format: Format, figure: &impl Figure) -> io::Result<()> {
    let (width, height) = figure.size();
    match format {
        Format::Png => {
            let mut picture = Picture::new([width, height]);
            draw(picture.canvas(), figure, format)?;
            picture.write(path)
        }
        Format::Svg => {
            embed_font();
            let mut svg = String::new();
            draw(
                SVGBackend::with_string(&mut svg, (width, height)),
                figure,
                format,
            )?;
            archive::write_atomically(path, |file| file.write_all(svg.as_bytes()))
        }
    }
}

fn draw<DB: DrawingBackend>(backend: DB, figure: &impl Figure, format: Format) -> io::Result<()>
where
    DB::ErrorType: Error + Send + Sync + 'static,
{
    let area = backend.into_drawing_area();
    let drawn = area.fill(&WHITE).and_then(|()| figure.draw(&area, format));
    drawn
        .and_then(|()| area.present())
        .map_err(io::Error::other)
}

/// Whether letters have colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Paint(bool);

impl Paint {
    #[cfg(test)]
    pub(crate) const PLAIN: Self = Self(false);

    /// Colours on a terminal, unless `NO_COLOR` is set to anything or the terminal is dumb (no-color.org).
    fn for_stdout() -> Self {
        let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        Self::of(std::io::stdout().is_terminal(), set("NO_COLOR") || dumb)
    }

    fn of(is_terminal: bool, refused: bool) -> Self {
        Self(is_terminal && !refused)
    }

    /// The letters in a colour, where colours are wanted.
    pub(crate) fn on(self, [red, green, blue]: [u8; 3], letters: &str) -> String {
        match self {
            Self(true) => format!("\x1b[38;2;{red};{green};{blue}m{letters}\x1b[0m"),
            Self(false) => letters.to_owned(),
        }
    }
}

/// Letters from none to all.
const SHADES: [char; 5] = ['·', '░', '▒', '▓', '█'];

/// The letter for a share of 0 to 1.
pub(crate) fn shade(share: f64) -> char {
    let last = SHADES.len() - 1;
    SHADES[(share * last as f64).round().clamp(0.0, last as f64) as usize]
}

/// A bar of a bar chart.
pub(crate) struct Bar {
    pub(crate) name: String,
    /// 0 or more.
    pub(crate) value: f64,
    /// Text behind the bar: the value with its unit.
    pub(crate) label: String,
}

/// A name shortened to `most` letters; an ellipsis replaces the rest.
pub(crate) fn shortened(name: &str, most: usize) -> String {
    if name.chars().count() <= most {
        return name.to_owned();
    }
    name.chars().take(most - 1).chain(['…']).collect()
}

/// Horizontal bars in letters, the longest for the largest value.
pub(crate) fn bars(rows: &[Bar], colour: [u8; 3], paint: Paint) -> String {
    /// Letters of the longest bar.
    const LONGEST: f64 = 48.0;
    const EIGHTHS: [char; 8] = [' ', '▏', '▎', '▍', '▌', '▋', '▊', '▉'];
    let most = rows.iter().map(|row| row.value).fold(0.0, f64::max);
    let wide = rows.iter().map(|row| row.name.chars().count()).max();
    let wide = wide.unwrap_or(0);
    let row = |Bar { name, value, label }: &Bar| {
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
        format!("{name}{gap} {} {label}\n", paint.on(colour, &bar))
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
    fn a_plot_goes_where_its_name_says() {
        let file = |name: &str, format| Ok(Plot::File(name.into(), format));
        assert_eq!(Plot::from_str("-"), Ok(Plot::Text));
        assert_eq!(Plot::from_str("a.png"), file("a.png", Format::Png));
        assert_eq!(Plot::from_str("b/a.SVG"), file("b/a.SVG", Format::Svg));
        for wrong in ["a.gif", "png", "", "a."] {
            assert!(Plot::from_str(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn bars_are_as_long_as_their_values() {
        let row = |name: &str, value| Bar {
            name: name.to_owned(),
            value,
            label: "w".to_owned(),
        };
        let rows = [row("a", 4.0), row("bc", 1.0), row("d", 0.0)];
        let text = bars(&rows, [0; 3], Paint::PLAIN);
        let full = text.lines().map(|line| line.matches('█').count());
        assert_eq!(full.collect::<Vec<_>>(), [48, 12, 0]);
        assert!(text.starts_with("a  █") && text.contains("\nbc █"));
        assert_eq!(bars(&[row("a", 0.0)], [0; 3], Paint::PLAIN), "a  w\n");
    }

    #[test]
    fn a_shade_grows_with_its_share() {
        let shades: String = [-1.0, 0.0, 0.3, 0.5, 0.7, 1.0, 7.0]
            .map(shade)
            .iter()
            .collect();
        assert_eq!(shades, "··░▒▓██");
        assert_eq!(shade(f64::NAN), '·');
    }
}
