//! The output of a subcommand, and its errors.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::builder::{PathBufValueParser, TypedValueParser};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use sabaki::archive;
use sabaki::graph::GraphError;
use sabaki::maps::BakeError;
use sabaki::query::AttackError;
use sabaki_import::ReadError;
use thiserror::Error;

/// The output of a subcommand, with its exit code.
pub(crate) struct Done {
    text: String,
    code: u8,
}

impl Done {
    /// Output with exit code 0.
    pub(crate) fn ok(text: String) -> Self {
        Self::answer(text, true)
    }

    /// Output with exit code 0 or 1.
    pub(crate) fn answer(text: String, yes: bool) -> Self {
        let code = u8::from(!yes);
        Self { text, code }
    }

    /// Output with exit code 3 where a part of the input was left out.
    pub(crate) fn without(text: String, left_out: &[String]) -> Self {
        let code = if left_out.is_empty() { 0 } else { 3 };
        Self { text, code }
    }

    /// The text of a JSON document.
    pub(crate) fn json(document: &serde_json::Value) -> String {
        format!("{document:#}\n")
    }

    /// Writes all output at once. A closed pipe (`| head`) is not an error.
    pub(crate) fn print(self) -> Result<ExitCode, Failure> {
        let mut stdout = std::io::stdout().lock();
        match stdout
            .write_all(self.text.as_bytes())
            .and_then(|()| stdout.flush())
        {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Failure::Stdout(error))
            }
            _ => Ok(ExitCode::from(self.code)),
        }
    }
}

/// Bad input or usage, or a stop by Ctrl-C: one line, or one for each file that cannot be used.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("{0}; see --retarget and --keep-going")]
    Clips(ReadError),
    #[error(transparent)]
    Archive(#[from] archive::ArchiveError),
    #[error(transparent)]
    Graph(GraphError),
    #[error("{0}; --memory sets another limit")]
    Memory(GraphError),
    #[error(transparent)]
    Bake(BakeError),
    #[error("attack {index}: {error}")]
    Attack { index: u64, error: AttackError },
    #[error("{path}: {source}")]
    File {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("cannot write to stdout: {0}")]
    Stdout(std::io::Error),
    #[error("{0}")]
    Device(String),
    #[error("cancelled; no file is left half-written")]
    Cancelled,
    #[error("{0}")]
    Usage(String),
    #[error("{} of {all} shards are lacking", lacking.len())]
    Shards {
        /// One line for each shard that is missing or damaged.
        lacking: Vec<String>,
        all: usize,
    },
    #[error("{place}: {failure}")]
    Within {
        place: String,
        failure: Box<Failure>,
    },
}

impl From<BakeError> for Failure {
    fn from(error: BakeError) -> Self {
        match error {
            BakeError::Stopped => Self::Cancelled,
            error => Self::Bake(error),
        }
    }
}

impl From<GraphError> for Failure {
    fn from(error: GraphError) -> Self {
        match error {
            GraphError::Memory { .. } => Self::Memory(error),
            GraphError::Stopped => Self::Cancelled,
            error => Self::Graph(error),
        }
    }
}

/// An error in what the user gave, by its words.
pub(crate) fn usage(error: impl std::fmt::Display) -> Failure {
    Failure::Usage(error.to_string())
}

/// Writes a file at once or not at all.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let written = archive::write_atomically(path, |file| file.write_all(bytes));
    written.map_err(Failure::file(path))
}

impl Failure {
    /// Names the attack that is none.
    pub(crate) fn attack(index: u64) -> impl FnOnce(AttackError) -> Self {
        move |error| Self::Attack { index, error }
    }

    /// Names the file or folder that could not be read or written.
    pub(crate) fn file(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        |source| Self::File { path, source }
    }

    /// The error with the path of the file that caused it.
    pub(crate) fn within(self, place: &Path) -> Self {
        Self::Within {
            place: place.display().to_string(),
            failure: Box::new(self),
        }
    }

    /// 130 after Ctrl-C, as of a command that the signal ends; otherwise 2.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Cancelled => 130,
            Self::Within { failure, .. } => failure.exit_code(),
            _ => 2,
        }
    }

    /// Writes the error to stderr as one line; control characters are escaped. Files that cannot be used have a line each. A closed
    /// stderr is ignored.
    pub(crate) fn print(&self) {
        let line = |text: &dyn std::fmt::Display| {
            let text = text.to_string().replace(char::is_control, " ");
            notice(&text);
        };
        if let Self::Read(error) | Self::Clips(error) = self
            && let ReadError::Files { errors, .. } = error
        {
            errors.iter().for_each(|error| line(error));
        }
        if let Self::Shards { lacking, .. } = self {
            lacking.iter().for_each(|shard| line(shard));
        }
        line(self);
    }
}

/// Writes a line to stderr, which nobody may read.
pub(crate) fn notice(text: &str) {
    let _ = writeln!(std::io::stderr(), "sabaki: {text}");
}

/// Refuses a file to write that is one of the files to read, or that lies in a folder of them and would be read with it.
pub(crate) fn check_is_no_input(option: &str, out: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    // What is not there yet cannot be an input.
    let Ok(out_place) = out.canonicalize() else {
        return Ok(());
    };
    let is_input = |input: &&&Path| match input.canonicalize() {
        Ok(folder) if folder.is_dir() => {
            sabaki_import::is_motion_file(out) && out_place.parent() == Some(folder.as_path())
        }
        Ok(file) => file == out_place,
        Err(_) => false,
    };
    match inputs.iter().find(is_input) {
        None => Ok(()),
        Some(input) => Err(Failure::Usage(format!(
            "{option} {}: this would overwrite an input ({})",
            out.display(),
            input.display()
        ))),
    }
}

/// Refuses a file that cannot be written, before any work is done: a folder, or a file in a folder that does not exist.
pub(crate) fn check_can_be_written(option: &str, out: &Path) -> Result<(), Failure> {
    writable(out).map_err(|why| Failure::Usage(format!("{option} {}: {why}", out.display())))
}

/// Reads the name of a file to write, with a check of [`check_can_be_written`]'s kind and of the name's ending.
pub(crate) fn file_to_write(
    endings: &'static [&'static str],
) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| {
        let ending = path.extension().and_then(|ending| ending.to_str());
        let ending = ending.map(str::to_ascii_lowercase).unwrap_or_default();
        match endings.contains(&&*ending) {
            true => writable(&path).map(|()| path),
            false => Err(format!("its name must end in .{}", endings.join(" or ."))),
        }
    })
}

/// Whether a file can be written: it is no folder, and lies in a folder that exists.
fn writable(out: &Path) -> Result<(), String> {
    if out.is_dir() {
        return Err("this is a folder, and not a file".to_owned());
    }
    match out.parent() {
        None => Err("this is not the name of a file".to_owned()),
        Some(folder) if folder.as_os_str().is_empty() || folder.is_dir() => Ok(()),
        Some(folder) => Err(format!("there is no folder {}", folder.display())),
    }
}

/// Refuses a folder that cannot be made, before any work is done: a part of its path is a file. `what` names it.
pub(crate) fn check_can_be_folder(what: &str, folder: &Path) -> Result<(), Failure> {
    match folder.ancestors().find(|place| place.exists()) {
        Some(place) if !place.is_dir() => Err(Failure::Usage(format!(
            "{what}: {} is not a folder",
            place.display()
        ))),
        _ => Ok(()),
    }
}

/// A table with a header, at most 100 columns wide. The first `left` columns are aligned to the left, the others to the right.
pub(crate) fn table(head: &[&str], left: usize) -> Table {
    let mut table = Table::new();
    table
        .load_style(presets::ASCII_MARKDOWN)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(100);
    table.set_header(head.to_vec());
    for (index, column) in table.column_iter_mut().enumerate() {
        column.set_cell_alignment(if index < left {
            CellAlignment::Left
        } else {
            CellAlignment::Right
        });
    }
    table
}

/// A number of things, as `1 clip` or `2 clips`.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// A heading, and what stands below it.
pub(crate) type Column<'a, T> = (&'a str, &'a dyn Fn(&T) -> String);

/// A [`table`] with a row for each item.
pub(crate) fn table_of<T>(
    left: usize,
    items: impl IntoIterator<Item = T>,
    columns: &[Column<'_, T>],
) -> Table {
    let head: Vec<&str> = columns.iter().map(|(head, _)| *head).collect();
    let mut table = table(&head, left);
    for item in items {
        table.add_row(columns.iter().map(|(_, cell)| cell(&item)));
    }
    table
}

/// A progress bar on stderr; hidden where stderr is not a terminal.
pub(crate) fn progress(what: &'static str, steps: u64) -> ProgressBar {
    let bar = ProgressBar::new(steps).with_message(what);
    match ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
