//! Line charts with linear axes.

use super::picture::{COLOURS, Picture, RULE};

/// Rules across a chart at most, along either axis.
const RULES: f64 = 10.0;

/// A line of a chart.
pub(crate) struct Line<'a> {
    pub(crate) name: &'a str,
    pub(crate) points: Vec<(f64, f64)>,
    /// Whether each point is marked.
    pub(crate) marks: bool,
}

/// Lines over common axes that start at 0.
pub(crate) struct Chart<'a> {
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
    pub(crate) lines: Vec<Line<'a>>,
}

/// A chart's place in a picture, pixels: from the left and the top, and how large.
#[derive(Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) at: (usize, usize),
    pub(crate) size: (usize, usize),
}

impl Chart<'_> {
    /// Draws the chart so that its axes fill the frame; labels stand outside of it, left and below.
    pub(crate) fn draw(&self, picture: &mut Picture, frame: Frame) {
        let all = || self.lines.iter().flat_map(|line| &line.points);
        let (x_step, x_most) = rules(all().map(|point| point.0).fold(0.0, f64::max));
        let (y_step, y_most) = rules(all().map(|point| point.1).fold(0.0, f64::max));
        let (left, top) = (frame.at.0 as f64, frame.at.1 as f64);
        let (width, height) = (frame.size.0 as f64, frame.size.1 as f64);
        let place =
            |(x, y): (f64, f64)| (left + width * x / x_most, top + height * (1.0 - y / y_most));
        for rule in 0..=(x_most / x_step).round() as usize {
            let x = rule as f64 * x_step;
            let (from, to) = (place((x, 0.0)), place((x, y_most)));
            picture.line(from, to, RULE);
            let label = label(x, x_step);
            let start = (from.0 as usize).saturating_sub(4 * label.len());
            picture.text(start, from.1 as usize + 8, &label);
        }
        for rule in 0..=(y_most / y_step).round() as usize {
            let y = rule as f64 * y_step;
            let (from, to) = (place((0.0, y)), place((x_most, y)));
            picture.line(from, to, RULE);
            let label = label(y, y_step);
            let start = frame.at.0.saturating_sub(8 * label.len() + 8);
            picture.text(start, (from.1 as usize).saturating_sub(4), &label);
        }
        let middle = frame.at.0 + (frame.size.0 / 2).saturating_sub(4 * self.x.len());
        picture.text(middle, frame.at.1 + frame.size.1 + 24, self.x);
        picture.text(frame.at.0, frame.at.1.saturating_sub(18), self.y);
        for (index, (line, colour)) in self.lines.iter().zip(COLOURS.iter().cycle()).enumerate() {
            for pair in line.points.windows(2) {
                picture.line(place(pair[0]), place(pair[1]), *colour);
            }
            for (x, y) in line.points.iter().filter(|_| line.marks).map(|&p| place(p)) {
                let corner = (
                    (x as usize).saturating_sub(2),
                    (y as usize).saturating_sub(2),
                );
                picture.fill(corner, (6, 6), *colour);
            }
            let y = frame.at.1 + 10 + 16 * index;
            picture.fill((frame.at.0 + 12, y), (20, 8), *colour);
            picture.text(frame.at.0 + 40, y, line.name);
        }
    }
}

/// The step between rules, and the last one: a round number of steps that holds `most`.
pub(crate) fn rules(most: f64) -> (f64, f64) {
    if !(most.is_finite() && most > 0.0) {
        return (1.0, 1.0);
    }
    let decade = 10f64.powf((most / RULES).log10().floor());
    let fits = |step: &f64| most / step <= RULES;
    let step = [1.0, 2.0, 5.0, 10.0].map(|part| part * decade);
    let step = step.into_iter().find(fits).unwrap_or(10.0 * decade);
    (step, step * (most / step).ceil())
}

pub(crate) fn label(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_round_and_hold_everything() {
        for most in [1e-6, 0.37, 1.0, 9.99, 10.0, 18.0, 79.5, 123_456.0] {
            let (step, last) = rules(most);
            assert!(
                last >= most && last < most + step * 1.001,
                "{most}: {step} {last}"
            );
            assert!(
                last / step <= RULES + 1e-9 && last / step > 2.0,
                "{most}: {step} {last}"
            );
        }
        assert_eq!(rules(0.0), (1.0, 1.0));
        assert_eq!(rules(f64::NAN), (1.0, 1.0));
        assert_eq!(
            (label(0.2, 0.1).as_str(), label(40.0, 20.0).as_str()),
            ("0.2", "40")
        );
    }
}
