//! Pictures: pixels in memory on which plotters draws, line charts, and PNG files.

use std::error::Error;
use std::io;
use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use sabaki_app::film::png;

use super::Failure;
use super::output::write_file;

/// The colour of text and axes.
pub(crate) const INK: RGBColor = RGBColor(38, 44, 56);

/// The name under which the embedded font is registered. No font of the system is read.
const FONT: &str = "sans-serif";

/// A part of a picture, in pixels.
pub(crate) type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;

/// Whether something could be drawn.
pub(crate) type Drawn = Result<(), Box<dyn Error + Send + Sync>>;

/// Pixels of a picture: red, green and blue (sRGB), row by row from the upper left.
pub(crate) struct Picture {
    size: [u32; 2],
    pixels: Vec<u8>,
}

/// Text of this height in pixels.
pub(crate) fn text_style(height: u32, colour: RGBColor) -> TextStyle<'static> {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        if register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT).is_err() {
            tracing::error!("the embedded font cannot be read");
        }
    });
    TextStyle {
        color: colour.to_backend_color(),
        ..TextStyle::from((FONT, height).into_font())
    }
}

impl Picture {
    /// A white picture.
    pub(crate) fn new(size: [u32; 2]) -> Self {
        let count = size[0] as usize * size[1] as usize;
        Self {
            size,
            pixels: vec![255; 3 * count],
        }
    }

    /// A picture from pixels of four bytes, the last of which is dropped.
    pub(crate) fn from_rgba(size: [u32; 2], pixels: &[u8]) -> Self {
        let rgb = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2]];
        Self {
            size,
            pixels: pixels.chunks_exact(4).flat_map(rgb).collect(),
        }
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    pub(crate) fn into_pixels(self) -> Vec<u8> {
        self.pixels
    }

    /// What plotters draws into.
    pub(crate) fn area(&mut self) -> Area<'_> {
        let [width, height] = self.size;
        BitMapBackend::with_buffer(&mut self.pixels, (width, height)).into_drawing_area()
    }

    /// Copies another picture into this one. What would lie outside is cut off.
    pub(crate) fn place(&mut self, [x, y]: [u32; 2], other: &Self) {
        let columns = other.size[0].min(self.size[0].saturating_sub(x)) as usize;
        let rows = other.size[1].min(self.size[1].saturating_sub(y));
        for row in 0..rows {
            let to = 3 * ((y + row) * self.size[0] + x) as usize;
            let from = 3 * (row * other.size[0]) as usize;
            self.pixels[to..to + 3 * columns]
                .copy_from_slice(&other.pixels[from..from + 3 * columns]);
        }
    }

    /// Writes a line of text; the place is its upper left corner.
    pub(crate) fn text(&mut self, at: (i32, i32), text: &str, height: u32, colour: RGBColor) {
        // A bitmap in memory has no errors.
        let _ = self
            .area()
            .draw(&Text::new(text, at, text_style(height, colour)));
    }

    /// Draws a straight line, two pixels wide.
    pub(crate) fn line(&mut self, from: (i32, i32), to: (i32, i32), colour: RGBColor) {
        let _ = self
            .area()
            .draw(&PathElement::new([from, to], colour.stroke_width(2)));
    }

    /// Writes the picture as a PNG file.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let bytes = png(self.size, &self.pixels).map_err(io::Error::other);
        write_file(path, &bytes.map_err(Failure::file(path))?)
    }
}

/// Draws a figure and writes it as a PNG file.
pub(crate) fn write_figure(
    path: &Path,
    size: [u32; 2],
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<(), Failure> {
    let mut picture = Picture::new(size);
    let drawn = draw(&picture.area()).map_err(io::Error::other);
    drawn.map_err(Failure::file(path))?;
    picture.write(path)
}

/// Colours of the lines of a chart, in order; they differ for colour-blind readers, too (Okabe & Ito).
const COLOURS: [RGBColor; 5] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(204, 121, 167),
];

/// Lines over common axes.
pub(crate) struct Chart<'a> {
    pub(crate) title: &'a str,
    /// Label of the axis, with the unit.
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
    /// Logarithmic axes, instead of linear ones from 0 on.
    pub(crate) log: bool,
    /// Names and points.
    pub(crate) lines: Vec<(&'a str, Vec<(f64, f64)>)>,
}

impl Chart<'_> {
    pub(crate) fn draw(&self, area: &Area<'_>) -> Drawn {
        let (x, y) = (self.range(|point| point.0), self.range(|point| point.1));
        let mut chart = ChartBuilder::on(area);
        chart
            .caption(self.title, text_style(22, INK))
            .margin(12)
            .x_label_area_size(52)
            .y_label_area_size(78);
        match self.log {
            false => self.fill(chart.build_cartesian_2d(0.0..x.1, 0.0..y.1)?),
            true => {
                self.fill(chart.build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())?)
            }
        }
    }

    fn fill<'a, 'b: 'a, X, Y>(
        &self,
        mut chart: ChartContext<'a, BitMapBackend<'b>, Cartesian2d<X, Y>>,
    ) -> Drawn
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(self.x).y_desc(self.y).x_labels(11).y_labels(9);
        mesh.x_label_formatter(&|value| axis_label(*value));
        mesh.y_label_formatter(&|value| axis_label(*value));
        mesh.label_style(text_style(16, INK))
            .axis_desc_style(text_style(18, INK))
            .bold_line_style(INK.mix(0.2))
            .light_line_style(INK.mix(0.05))
            .draw()?;
        for ((name, points), colour) in self.lines.iter().zip(COLOURS.iter().cycle()) {
            let marks = if points.len() < 100 { 4 } else { 0 };
            let series = LineSeries::new(points.iter().copied(), colour.stroke_width(2));
            chart
                .draw_series(series.point_size(marks))?
                .label(*name)
                .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(3)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .label_font(text_style(17, INK))
            .draw()?;
        Ok(())
    }

    /// The ends of an axis: from 0, or from a little less than the least value.
    fn range(&self, axis: fn((f64, f64)) -> f64) -> (f64, f64) {
        let points = self.lines.iter().flat_map(|(_, points)| points);
        let values = points.map(|&point| axis(point));
        let (least, most) = values.fold((f64::MAX, f64::MIN_POSITIVE), |(least, most), value| {
            (least.min(value), most.max(value))
        });
        match self.log {
            true => (0.8 * least.clamp(1e-9, most), 1.25 * most),
            false => (0.0, 1.04 * most),
        }
    }
}

/// A label of an axis, without digits that say nothing.
fn axis_label(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
