//! Line charts in letters.

use std::fmt::Write;

use super::chart::{Chart, label, rules};
use super::picture::COLOURS;
use super::plot::Paint;

/// Letters of the chart.
const COLUMNS: usize = 72;
const ROWS: usize = 18;
/// Of the lines, one after the other.
const MARKS: [char; 5] = ['●', '▲', '■', '◆', '○'];

impl Chart<'_> {
    /// The chart in letters: a mark for each line, where it passes.
    pub(crate) fn text(&self, paint: Paint) -> String {
        let all = || self.lines.iter().flat_map(|line| &line.points);
        let range = |axis: &dyn Fn(&(f64, f64)) -> f64| {
            let (least, most) = all()
                .map(axis)
                .fold((0.0f64, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
            let (step, top) = rules(most.max(-least));
            let least = (least / step).floor() * step;
            (least, if most > 0.0 { top } else { least + top }, step)
        };
        let (x_least, x_most, x_step) = range(&|point| point.0);
        let (y_least, y_most, y_step) = range(&|point| point.1);
        let mut cells = vec![[None; COLUMNS]; ROWS];
        let cell = |value: f64, (least, most): (f64, f64), count: usize| {
            let share = (value - least) / (most - least);
            (share * (count - 1) as f64)
                .round()
                .clamp(0.0, (count - 1) as f64) as usize
        };
        for (number, line) in self.lines.iter().enumerate() {
            let mut put = |(x, y): (f64, f64)| {
                let column = cell(x, (x_least, x_most), COLUMNS);
                let row = cell(y, (y_least, y_most), ROWS);
                cells[ROWS - 1 - row][column] = Some(number);
            };
            line.points.iter().for_each(|&point| put(point));
            for pair in line.points.windows(2) {
                for step in 0..COLUMNS {
                    let share = step as f64 / COLUMNS as f64;
                    let between = |a: f64, b: f64| a + (b - a) * share;
                    put((between(pair[0].0, pair[1].0), between(pair[0].1, pair[1].1)));
                }
            }
        }
        let (top, bottom) = (label(y_most, y_step), label(y_least, y_step));
        let wide = top.len().max(bottom.len());
        let mut text = format!("{}\n", self.y);
        for (row, letters) in cells.iter().enumerate() {
            let value = match row {
                0 => top.as_str(),
                _ if row == ROWS - 1 => bottom.as_str(),
                _ => "",
            };
            let _ = write!(text, "{value:>wide$} │");
            let drawn = letters.iter().map(|mark| match mark {
                Some(line) => paint.on(
                    COLOURS[line % COLOURS.len()],
                    &MARKS[line % MARKS.len()].to_string(),
                ),
                None => " ".to_owned(),
            });
            let row: String = drawn.collect();
            text.push_str(row.trim_end());
            text.push('\n');
        }
        let (left, right) = (label(x_least, x_step), label(x_most, x_step));
        let gap = COLUMNS.saturating_sub(left.len() + right.len());
        let _ = writeln!(text, "{:wide$} └{}", "", "─".repeat(COLUMNS));
        let _ = writeln!(text, "{:wide$}  {left}{:^gap$}{right}", "", self.x);
        for (number, line) in self.lines.iter().enumerate() {
            let mark = MARKS[number % MARKS.len()].to_string();
            let mark = paint.on(COLOURS[number % COLOURS.len()], &mark);
            let _ = write!(text, "{:wide$}  {mark} {}", "", line.name);
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use std::str::FromStr;

    use super::super::chart::Line;
    use super::super::plot::Plot;
    use super::*;

    #[test]
    fn a_line_goes_from_corner_to_corner() {
        let line = Line {
            name: "rising",
            points: vec![(0.0, 0.0), (10.0, 5.0)],
            marks: false,
        };
        let chart = Chart {
            x: "time",
            y: "height",
            lines: vec![line],
        };
        assert_eq!(Plot::from_str("-"), Ok(Plot::Text));
        let mut text = String::new();
        let drawn = Plot::Text.draw(
            || unreachable!("letters are wanted"),
            |paint| chart.text(paint),
        );
        if let Ok(letters) = drawn {
            text = letters;
        }
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "height");
        assert!(
            lines[1].starts_with("5.0 │") && lines[1].ends_with('●'),
            "{text}"
        );
        assert!(lines[ROWS].starts_with("0.0 │●"), "{text}");
        assert!(text.contains("time") && text.contains("● rising"));
    }
}
