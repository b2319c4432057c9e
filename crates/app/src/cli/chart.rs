//! Line charts: what they show, and how plotters draws them.

use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

use super::picture::FONT;
use super::plot::{Area, Drawn, INK};

/// Colours of the lines of a chart, in order; they differ for colour-blind readers, too (Okabe & Ito).
pub(crate) const COLOURS: [[u8; 3]; 5] = [
    [213, 94, 0],
    [0, 158, 115],
    [0, 114, 178],
    [230, 159, 0],
    [204, 121, 167],
];

/// Scale of both axes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Linear, from 0 on.
    Linear,
    /// Logarithmic. All values are above 0.
    Log,
}

/// A line of a chart.
pub(crate) struct Line<'a> {
    pub(crate) name: &'a str,
    pub(crate) points: Vec<(f64, f64)>,
    /// Whether each point has a marker.
    pub(crate) marks: bool,
}

/// Lines over common axes.
pub(crate) struct Chart<'a> {
    pub(crate) title: &'a str,
    /// Label of the axis, with the unit.
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
    pub(crate) scale: Scale,
    pub(crate) lines: Vec<Line<'a>>,
}

impl Chart<'_> {
    /// Draws the chart over the whole area: title, legend, then the axes with the lines.
    pub(crate) fn draw<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        area.draw(&Text::new(
            self.title,
            (14, 10),
            (FONT, 22).into_font().color(&INK),
        ))?;
        self.legend(area)?;
        let (x, y) = (self.range(|point| point.0), self.range(|point| point.1));
        let mut chart = ChartBuilder::on(area);
        chart
            .margin_top(80)
            .margin_right(28)
            .margin_bottom(10)
            .margin_left(12);
        chart.x_label_area_size(52).y_label_area_size(78);
        match self.scale {
            Scale::Linear => self.fill(chart.build_cartesian_2d(0.0..x.1, 0.0..y.1)?),
            Scale::Log => {
                self.fill(chart.build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())?)
            }
        }
    }

    /// Names and colours of the lines, side by side above the plot: nothing can lie under them.
    fn legend<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        let style = (FONT, 17).into_font().color(&INK);
        let mut left = 14;
        for (line, colour) in self.lines.iter().zip(colours()) {
            let swatch = [(left, 50), (left + 24, 50)];
            area.draw(&PathElement::new(swatch, colour.stroke_width(3)))?;
            area.draw(&Text::new(line.name, (left + 32, 41), style.clone()))?;
            let (width, _) = area.estimate_text_size(line.name, &style)?;
            left += 32 + width as i32 + 28;
        }
        Ok(())
    }

    fn fill<DB: DrawingBackend, X, Y>(
        &self,
        mut chart: ChartContext<'_, DB, Cartesian2d<X, Y>>,
    ) -> Drawn<DB>
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(self.x).y_desc(self.y).x_labels(11).y_labels(9);
        mesh.x_label_formatter(&|value| number(*value));
        mesh.y_label_formatter(&|value| number(*value));
        mesh.label_style((FONT, 16).into_font().color(&INK));
        mesh.axis_desc_style((FONT, 18).into_font().color(&INK));
        mesh.axis_style(INK.mix(0.6));
        mesh.bold_line_style(INK.mix(0.2))
            .light_line_style(INK.mix(match self.scale {
                Scale::Linear => 0.0,
                Scale::Log => 0.07,
            }));
        mesh.draw()?;
        for (line, colour) in self.lines.iter().zip(colours()) {
            let points = line.points.iter().map(|&point| self.lifted(point));
            let size = if line.marks { 4 } else { 0 };
            chart.draw_series(
                LineSeries::new(points, colour.stroke_width(2).filled()).point_size(size),
            )?;
        }
        Ok(())
    }

    /// A point as it can be drawn: a logarithmic axis has no 0.
    fn lifted(&self, (x, y): (f64, f64)) -> (f64, f64) {
        match self.scale {
            Scale::Linear => (x, y),
            Scale::Log => (x.max(LEAST), y.max(LEAST)),
        }
    }

    /// The ends of an axis.
    fn range(&self, axis: fn((f64, f64)) -> f64) -> (f64, f64) {
        let points = self.lines.iter().flat_map(|line| &line.points);
        let values = points.map(|&point| axis(self.lifted(point)));
        let ends = values.fold(None, |ends: Option<(f64, f64)>, value| {
            let (least, most) = ends.unwrap_or((value, value));
            Some((least.min(value), most.max(value)))
        });
        let (least, most) = ends.unwrap_or((1.0, 1.0));
        self.scale.ends(least, most)
    }
}

/// The value at which a logarithmic axis shows values that are not above 0.
const LEAST: f64 = 1e-6;

impl Scale {
    /// The ends of an axis: whole powers of ten, or 0 and a little more than the largest value.
    fn ends(self, least: f64, most: f64) -> (f64, f64) {
        match self {
            Self::Linear if most.is_finite() && most > 0.0 => (0.0, 1.04 * most),
            Self::Linear => (0.0, 1.0),
            Self::Log => {
                let low = least.log10().floor();
                let high = most.log10().ceil().max(low + 1.0);
                (10f64.powf(low), 10f64.powf(high))
            }
        }
    }
}

/// A label of an axis, without digits that say nothing.
fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn colours() -> impl Iterator<Item = RGBColor> {
    let colours = COLOURS.iter().cycle();
    colours.map(|&[red, green, blue]| RGBColor(red, green, blue))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_holds_every_value() {
        for most in [1e-6, 0.37, 1.0, 9.99, 10.0, 18.0, 79.5, 123_456.0] {
            let (low, high) = Scale::Linear.ends(0.0, most);
            assert!(low == 0.0 && high > most && high < 1.1 * most, "{most}");
            let (low, high) = Scale::Log.ends(most / 3.0, most);
            assert!(
                low <= most / 3.0 && high >= most && high <= 100.0 * most,
                "{most}"
            );
        }
        assert_eq!(Scale::Linear.ends(0.0, 0.0), (0.0, 1.0));
        assert_eq!(Scale::Linear.ends(f64::NAN, f64::NAN), (0.0, 1.0));
        assert_eq!(Scale::Log.ends(1.0, 1.0), (1.0, 10.0));
        let labels = [0.0, 0.25, 3.0, 40.0, 0.001].map(number);
        assert_eq!(labels, ["0", "0.25", "3", "40", "0.001"]);
    }
}
