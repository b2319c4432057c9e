//! Line charts in letters.

use std::fmt::Write;

use super::chart::{COLOURS, Chart, Scale};
use super::plot::Paint;

/// Columns and rows of the chart, in letters.
const COLUMNS: usize = 72;
const ROWS: usize = 18;
/// Marks of the lines, in order.
const MARKS: [char; 5] = ['●', '▲', '■', '◆', '○'];
/// The largest number of steps along an axis.
const STEPS: f64 = 10.0;

/// One axis: its ends, and the step of its labels.
struct Axis {
    least: f64,
    most: f64,
    step: f64,
}

impl Axis {
    /// An axis from 0, or the least value below 0, to a whole number of steps that contains all values.
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let (least, most) = values.fold((0.0f64, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        let (step, top) = steps(most.max(-least));
        let least = (least / step).floor() * step;
        Self {
            least,
            most: if most > 0.0 { top } else { least + top },
            step,
        }
    }

    /// Index of a value's cell, of `count` cells.
    fn cell(&self, value: f64, count: usize) -> usize {
        let last = (count - 1) as f64;
        let share = (value - self.least) / (self.most - self.least);
        (share * last).round().clamp(0.0, last) as usize
    }

    /// The labels of both ends.
    fn labels(&self) -> [String; 2] {
        [self.least, self.most].map(|value| label(value, self.step))
    }
}

impl Chart<'_> {
    /// The chart in letters: each line as its marks. A logarithmic chart shows the powers of ten.
    pub(crate) fn text(&self, paint: Paint) -> String {
        let note = match self.scale {
            Scale::Linear => "",
            Scale::Log => ", powers of ten",
        };
        let lines: Vec<_> = self
            .lines
            .iter()
            .map(|line| self.values(&line.points))
            .collect();
        let points = || lines.iter().flatten();
        let (x, y) = (
            Axis::new(points().map(|p| p.0)),
            Axis::new(points().map(|p| p.1)),
        );
        let [bottom, top] = y.labels();
        let wide = top.len().max(bottom.len());
        let mut text = format!("{}{note}\n", self.y);
        for (row, marks) in cells(&lines, &x, &y).iter().enumerate() {
            let value = match row {
                0 => top.as_str(),
                _ if row == ROWS - 1 => bottom.as_str(),
                _ => "",
            };
            let drawn = marks.iter().map(|mark| match mark {
                Some(line) => painted_mark(*line, paint),
                None => " ".to_owned(),
            });
            let drawn: String = drawn.collect();
            let _ = writeln!(text, "{value:>wide$} │{}", drawn.trim_end());
        }
        let [left, right] = x.labels();
        let gap = COLUMNS.saturating_sub(left.len() + right.len());
        let name = format!("{}{note}", self.x);
        let _ = writeln!(text, "{:wide$} └{}", "", "─".repeat(COLUMNS));
        let _ = writeln!(text, "{:wide$}  {left}{name:^gap$}{right}", "");
        for (number, line) in self.lines.iter().enumerate() {
            let mark = painted_mark(number, paint);
            let _ = writeln!(text, "{:wide$}  {mark} {}", "", line.name);
        }
        text
    }

    /// The values that stand on the axes.
    fn values(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let log = |value: f64| value.max(1e-6).log10();
        match self.scale {
            Scale::Linear => points.to_vec(),
            Scale::Log => points.iter().map(|&(x, y)| (log(x), log(y))).collect(),
        }
    }
}

/// The line that each cell shows, row by row from the top.
fn cells(lines: &[Vec<(f64, f64)>], x: &Axis, y: &Axis) -> Vec<[Option<usize>; COLUMNS]> {
    let mut cells = vec![[None; COLUMNS]; ROWS];
    for (number, points) in lines.iter().enumerate() {
        let mut put = |at: (f64, f64)| {
            let (column, row) = (x.cell(at.0, COLUMNS), y.cell(at.1, ROWS));
            cells[ROWS - 1 - row][column] = Some(number);
        };
        points.iter().for_each(|&point| put(point));
        for pair in points.windows(2) {
            for step in 0..COLUMNS {
                let share = step as f64 / COLUMNS as f64;
                let between = |a: f64, b: f64| a + (b - a) * share;
                put((between(pair[0].0, pair[1].0), between(pair[0].1, pair[1].1)));
            }
        }
    }
    cells
}

fn painted_mark(line: usize, paint: Paint) -> String {
    let mark = MARKS[line % MARKS.len()].to_string();
    paint.on(COLOURS[line % COLOURS.len()], &mark)
}

/// The step between labels, and the last label: a round number of steps that holds `most`.
fn steps(most: f64) -> (f64, f64) {
    if !(most.is_finite() && most > 0.0) {
        return (1.0, 1.0);
    }
    let decade = 10f64.powf((most / STEPS).log10().floor());
    let fits = |step: &f64| most / step <= STEPS;
    let step = [1.0, 2.0, 5.0, 10.0].map(|part| part * decade);
    let step = step.into_iter().find(fits).unwrap_or(10.0 * decade);
    (step, step * (most / step).ceil())
}

fn label(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::super::chart::Line;
    use super::super::plot::Paint;
    use super::*;

    #[test]
    fn steps_are_round_and_hold_everything() {
        for most in [1e-6, 0.37, 1.0, 9.99, 10.0, 18.0, 79.5, 123_456.0] {
            let (step, last) = steps(most);
            assert!(
                last >= most && last < most + step * 1.001,
                "{most}: {step} {last}"
            );
            assert!(
                last / step <= STEPS + 1e-9 && last / step > 2.0,
                "{most}: {step} {last}"
            );
        }
        assert_eq!(steps(0.0), (1.0, 1.0));
        assert_eq!(steps(f64::NAN), (1.0, 1.0));
        assert_eq!(
            (label(0.2, 0.1).as_str(), label(40.0, 20.0).as_str()),
            ("0.2", "40")
        );
    }

    fn lines_of(scale: Scale, points: Vec<(f64, f64)>) -> Vec<String> {
        let line = Line {
            name: "rising",
            points,
            marks: false,
        };
        let chart = Chart {
            title: "growth",
            x: "time",
            y: "height",
            scale,
            lines: vec![line],
        };
        chart
            .text(Paint::PLAIN)
            .lines()
            .map(str::to_owned)
            .collect()
    }

    #[test]
    fn a_line_goes_from_corner_to_corner() {
        let linear = lines_of(Scale::Linear, vec![(0.0, 0.0), (10.0, 5.0)]);
        let log = lines_of(Scale::Log, vec![(1.0, 1.0), (1e10, 1e5)]);
        for (lines, note) in [(linear, ""), (log, ", powers of ten")] {
            assert_eq!(lines[0], format!("height{note}"));
            assert!(
                lines[1].starts_with("5.0 │") && lines[1].ends_with('●'),
                "{lines:?}"
            );
            assert!(lines[ROWS].starts_with("0.0 │●"), "{lines:?}");
            assert!(
                lines[ROWS + 2].contains(&format!("time{note}")),
                "{lines:?}"
            );
            assert!(lines[ROWS + 3].ends_with("● rising"), "{lines:?}");
        }
    }
}
