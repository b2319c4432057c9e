//! What a bench prints at its end: a page of Markdown with tables whose columns stand side by side, and the same as JSON.
//!
//! `cargo bench --bench NAME`, with these options after `--`:
//! `--json FILE` writes the record as JSON, `--record FILE` the page (for `benches/record`), `--seconds S` sets the time for each row (default 3),
//! and `--rows WORDS` measures only rows whose names contain the words.

use std::fmt::{Display, Write};
use std::hint::black_box;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use serde::Serialize;

/// One run of a bench: on what, and the times.
#[derive(Serialize)]
struct Record {
    bench: String,
    cpu: String,
    /// Threads that the machine runs at once.
    threads: usize,
    /// The device that culls, where there is one.
    device: Option<String>,
    motions: String,
    tables: Vec<Table>,
}

/// Rows of times, with the same columns. The first column is what the others are compared with.
#[derive(Serialize)]
struct Table {
    title: String,
    /// What the times are counted in.
    unit: String,
    columns: Vec<String>,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    name: String,
    times: Vec<Times>,
}

/// Times of one call, or of an item of it, in the unit of the table.
#[derive(Clone, Copy, Serialize)]
struct Times {
    median: f64,
    fastest: f64,
    calls: usize,
}

/// A bench that is being measured.
pub(crate) struct Report {
    record: Record,
    settings: Settings,
}

/// What is measured, for how long, and where it is written to.
struct Settings {
    /// For each row.
    time: Duration,
    /// Only rows whose names contain it are measured.
    rows: String,
    json: Option<PathBuf>,
    markdown: Option<PathBuf>,
}

impl Report {
    /// Runs a bench as its options say: `measure` fills the report.
    pub(crate) fn main(bench: &str, measure: impl FnOnce(&mut Self)) -> ExitCode {
        let done = Settings::parse().and_then(|settings| {
            let mut report = Self::new(bench, settings);
            measure(&mut report);
            let Self { record, settings } = report;
            let page = record.page();
            let json = settings.json.map(|path| (path, record.json()));
            let markdown = settings.markdown.map(|path| (path, page.clone()));
            for (path, text) in json.into_iter().chain(markdown) {
                let written = std::fs::write(&path, text);
                written.map_err(|error| format!("{}: {error}", path.display()))?;
            }
            Ok(page)
        });
        match done {
            Ok(page) => {
                print!("\n{page}");
                ExitCode::SUCCESS
            }
            Err(problem) => {
                eprintln!("{problem}");
                ExitCode::from(2)
            }
        }
    }

    fn new(bench: &str, settings: Settings) -> Self {
        let motions = match std::env::var_os("SABAKI_MOCAP") {
            Some(_) => "fight of SABAKI_MOCAP",
            None => "embedded",
        };
        Self {
            record: Record {
                bench: bench.to_owned(),
                cpu: cpu_name(),
                threads: std::thread::available_parallelism().map_or(1, usize::from),
                device: None,
                motions: motions.to_owned(),
                tables: Vec::new(),
            },
            settings,
        }
    }

    /// Names the device that culls.
    pub(crate) fn device(&mut self, name: &str) {
        self.record.device = Some(name.to_owned());
    }

    /// Begins a table of milliseconds.
    pub(crate) fn table(&mut self, title: &str, columns: &[&str]) {
        self.table_in("milliseconds", title, columns);
    }

    /// Begins a table of times in another unit.
    pub(crate) fn table_in(&mut self, unit: &str, title: &str, columns: &[&str]) {
        self.record.tables.push(Table {
            title: title.to_owned(),
            unit: unit.to_owned(),
            columns: columns.iter().map(|&column| column.to_owned()).collect(),
            rows: Vec::new(),
        });
    }

    /// Measures a row of the last table; `run` does what a column, given by its number, stands for.
    ///
    /// All columns take turns until the time is over, so that system noise affects every method equally. A turn
    /// is as many calls as fit into two milliseconds, at least one. The first turn of each is not counted.
    pub(crate) fn row<T>(&mut self, name: impl Display, run: impl FnMut(usize) -> T) {
        self.row_in(name, 1e3, run);
    }

    /// As [`Report::row`], in a unit of which a second of a call has so many.
    pub(crate) fn row_in<T>(
        &mut self,
        name: impl Display,
        of_a_second: f64,
        mut run: impl FnMut(usize) -> T,
    ) {
        const TURN: Duration = Duration::from_millis(2);
        self.measure(name.to_string(), |column| {
            let turn = Instant::now();
            let mut times = Vec::new();
            while turn.elapsed() < TURN {
                let call = Instant::now();
                black_box(run(column));
                times.push(call.elapsed().as_secs_f64() * of_a_second);
            }
            times
        });
    }

    /// Whether a row of this name is measured.
    pub(crate) fn wants(&self, name: &str) -> bool {
        name.contains(&self.settings.rows)
    }

    /// As [`Report::row`], where `run` gives the milliseconds of the one call that it makes.
    pub(crate) fn row_of_times(&mut self, name: impl Display, mut run: impl FnMut(usize) -> f64) {
        self.measure(name.to_string(), |column| vec![run(column)]);
    }

    /// Measures a row of the last table by turns, each of which gives the milliseconds of its calls.
    fn measure(&mut self, name: String, mut turn: impl FnMut(usize) -> Vec<f64>) {
        const LEAST_ROUNDS: usize = 3;
        if !self.wants(&name) {
            return;
        }
        let Some(table) = self.record.tables.last_mut() else {
            return;
        };
        let mut calls = vec![Vec::new(); table.columns.len()];
        let mut started = Instant::now();
        for round in 0.. {
            for (column, calls) in calls.iter_mut().enumerate() {
                calls.extend(turn(column));
            }
            if round == 0 {
                calls.iter_mut().for_each(Vec::clear);
                started = Instant::now();
            }
            if round >= LEAST_ROUNDS && started.elapsed() >= self.settings.time {
                break;
            }
        }
        let times: Vec<Times> = calls.into_iter().map(Times::of).collect();
        let medians = times.iter().map(|times| digits(times.median));
        let medians: Vec<String> = medians.collect();
        let (title, unit) = (&table.title, &table.unit);
        eprintln!("{title}, {name}: {} {unit}", medians.join(", "));
        table.rows.push(Row { name, times });
    }
}

impl Settings {
    fn parse() -> Result<Self, String> {
        let mut settings = Self {
            time: Duration::from_secs(3),
            rows: String::new(),
            json: None,
            markdown: None,
        };
        // Cargo says itself that this is a bench.
        let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or_else(|| format!("{arg} needs a value"));
            match arg.as_str() {
                "--json" => settings.json = Some(value()?.into()),
                "--record" => settings.markdown = Some(value()?.into()),
                "--seconds" => {
                    let seconds = value()?.parse().ok();
                    let seconds = seconds.and_then(|s| Duration::try_from_secs_f64(s).ok());
                    settings.time =
                        seconds.ok_or("--seconds needs a number of seconds, 0 or more")?;
                }
                "--rows" => settings.rows = value()?,
                other => {
                    let known = "--json, --record, --seconds, --rows";
                    return Err(format!("{other}: known are {known}"));
                }
            }
        }
        Ok(settings)
    }
}

impl Times {
    fn of(mut calls: Vec<f64>) -> Self {
        calls.sort_by(f64::total_cmp);
        Self {
            median: calls[calls.len() / 2],
            fastest: calls[0],
            calls: calls.len(),
        }
    }
}

impl Record {
    fn json(&self) -> String {
        // Numbers, texts and lists alone: nothing that has no JSON.
        serde_json::to_string_pretty(self).unwrap() + "\n"
    }

    /// Where and by which command it was measured, and all tables.
    fn page(&self) -> String {
        let args = std::env::args().skip(1).filter(|arg| arg != "--bench");
        let args: Vec<String> = args.collect();
        let mut page = format!(
            "# {}\n\n`cargo bench --bench {} -- {}`, medians.\n",
            self.place(),
            self.bench,
            args.join(" ")
        );
        for table in &self.tables {
            let (title, unit) = (&table.title, &table.unit);
            let _ = write!(page, "\n{title}, {unit}:\n\n{}", table.text());
        }
        page
    }

    /// On what it was measured.
    fn place(&self) -> String {
        let device = self.device.as_deref().unwrap_or("no device");
        format!(
            "{}, {} threads; {device}; motions: {}",
            self.cpu, self.threads, self.motions
        )
    }
}

impl Table {
    /// The times of all columns, then each but the first divided by the first. Columns are as wide as their widest cell.
    fn text(&self) -> String {
        let rows = self.cells();
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
        let widths: Vec<usize> = (0..rows[0].len()).filter_map(width).collect();
        let mut text = String::new();
        for (at, row) in rows.iter().enumerate() {
            for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
                let _ = match column {
                    0 => write!(text, "| {cell:<width$} |"),
                    _ => write!(text, " {cell:>width$} |"),
                };
            }
            text.push('\n');
            if at == 0 {
                let lines = widths.iter().map(|width| "-".repeat(*width));
                let _ = writeln!(text, "| {} |", lines.collect::<Vec<_>>().join(" | "));
            }
        }
        text
    }

    fn cells(&self) -> Vec<Vec<String>> {
        let ratios = self
            .columns
            .iter()
            .skip(1)
            .map(|name| format!("{name} ÷ {}", self.columns[0]));
        let mut rows = vec![vec![String::new()]];
        rows[0].extend(self.columns.iter().cloned().chain(ratios));
        for row in &self.rows {
            let medians = row.times.iter().map(|times| times.median);
            let ratios = medians
                .clone()
                .skip(1)
                .map(|median| median / row.times[0].median);
            let words: Vec<&str> = row.name.split_whitespace().collect();
            let mut cells = vec![words.join(" ")];
            let ratios = ratios.map(|share| format!("{share:.2}x"));
            cells.extend(medians.map(digits).chain(ratios));
            rows.push(cells);
        }
        rows
    }
}

/// Milliseconds with about three digits that say something.
fn digits(ms: f64) -> String {
    let decimals = match ms {
        ms if ms >= 100.0 => 0,
        ms if ms >= 10.0 => 1,
        ms if ms >= 1.0 => 2,
        ms if ms >= 0.1 => 3,
        _ => 4,
    };
    format!("{ms:.decimals$}")
}

fn cpu_name() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = info.lines().find(|line| line.starts_with("model name"));
    let name = line.and_then(|line| line.split_once(':'));
    name.map_or(std::env::consts::ARCH, |(_, name)| name.trim())
        .to_owned()
}
