//! The growth of a bake with the length of its library, drawn on logarithmic axes.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

/// What the bake of one library took.
pub struct Bake {
    /// Length of the library, in minutes.
    pub minutes: f64,
    /// Seconds from clips in memory to the written file.
    pub seconds: f64,
    /// Largest memory of the process so far, in megabytes.
    pub memory: f64,
    /// Size of the file, in megabytes.
    pub file: f64,
    /// Seconds to load the file.
    pub load: f64,
}

/// A quantity that grows.
struct Curve {
    name: &'static str,
    of: fn(&Bake) -> f64,
    color: RGBColor,
}

const CURVES: [Curve; 4] = [
    Curve {
        name: "bake, s",
        of: |bake| bake.seconds,
        color: RGBColor(31, 119, 180),
    },
    Curve {
        name: "memory, MB",
        of: |bake| bake.memory,
        color: RGBColor(214, 39, 40),
    },
    Curve {
        name: "file, MB",
        of: |bake| bake.file,
        color: RGBColor(44, 160, 44),
    },
    Curve {
        name: "load, s",
        of: |bake| bake.load,
        color: RGBColor(148, 103, 189),
    },
];

/// The exponents of a power of the length, between each bake and the next.
pub fn exponents(bakes: &[Bake], of: fn(&Bake) -> f64) -> Vec<f64> {
    let pairs = bakes.windows(2);
    pairs
        .map(|pair| (of(&pair[1]) / of(&pair[0])).ln() / (pair[1].minutes / pair[0].minutes).ln())
        .collect()
}

/// Prints how each quantity grows.
pub fn print(bakes: &[Bake]) {
    for curve in &CURVES {
        let exponents = exponents(bakes, curve.of);
        let exponents: Vec<_> = exponents.iter().map(|e| format!("n^{e:.2}")).collect();
        println!("growth of {}: {}", curve.name, exponents.join(", "));
    }
}

/// Draws all quantities to an SVG file. A dashed line from the first time of a bake grows as n^1.3.
pub fn draw(path: &Path, bakes: &[Bake]) -> Result<(), Box<dyn std::error::Error>> {
    let (Some(first), Some(last)) = (bakes.first(), bakes.last()) else {
        return Ok(());
    };
    let values = || CURVES.iter().flat_map(|curve| bakes.iter().map(curve.of));
    let least = values().fold(f64::INFINITY, f64::min);
    let most = values().fold(0.0, f64::max);
    // It measures the text; what shows the file has its own.
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    let _ = register_font("sans-serif", FontStyle::Normal, font);
    let root = SVGBackend::new(path, (900, 560)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(20)
        .caption("Bakes of growing libraries", ("sans-serif", 22))
        .x_label_area_size(50)
        .y_label_area_size(70)
        .build_cartesian_2d(
            // Wide enough for a label at a power of ten, and for the legend above the curves.
            (0.5 * first.minutes..2.0 * last.minutes).log_scale(),
            (0.5 * least..10.0 * most).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc("length of the library, minutes")
        .y_desc("seconds, megabytes")
        .label_style(("sans-serif", 15))
        .light_line_style(TRANSPARENT)
        .x_labels(4)
        .x_label_formatter(&|minutes| format!("{minutes:.0}"))
        .draw()?;
    for curve in &CURVES {
        let points: Vec<_> = bakes.iter().map(|b| (b.minutes, (curve.of)(b))).collect();
        let style = curve.color.stroke_width(2);
        chart
            .draw_series(LineSeries::new(points.clone(), style))?
            .label(curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], style));
        let dots = points.into_iter();
        chart.draw_series(dots.map(|point| Circle::new(point, 4, curve.color.filled())))?;
    }
    let bound = |minutes: f64| first.seconds * (minutes / first.minutes).powf(1.3);
    let ends = [first.minutes, last.minutes].map(|minutes| (minutes, bound(minutes)));
    chart
        .draw_series(DashedLineSeries::new(ends, 6, 5, BLACK.into()))?
        .label("n^1.3 from the first bake ")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 24, y)], BLACK));
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.filled())
        .border_style(BLACK)
        .label_font(("sans-serif", 15))
        .draw()?;
    root.present()?;
    Ok(())
}
