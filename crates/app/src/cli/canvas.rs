//! What plotters draws into: its bitmap, with letters between whole pixels.

use std::collections::HashMap;

use plotters::prelude::{BitMapBackend, DrawingBackend};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{FontDesc, TextStyle};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind,
};

/// A bitmap. Plotters puts letters on whole pixels, which leaves uneven gaps in small text: here text is laid out some times as large,
/// and each pixel takes the share of it that is covered.
pub(crate) struct Canvas<'a>(pub(crate) BitMapBackend<'a>);

type Drawn = Result<(), DrawingErrorKind<<BitMapBackend<'static> as DrawingBackend>::ErrorType>>;

impl DrawingBackend for Canvas<'_> {
    type ErrorType = <BitMapBackend<'static> as DrawingBackend>::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.0.get_size()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Drawn {
        self.0.present()
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Drawn {
        self.0.draw_pixel(at, color)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.0.draw_line(from, to, style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        self.0.draw_rect(from, to, style, fill)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        const LARGER: i32 = 4;
        /// Upper edge and middle of the embedded font's digits below the upper edge of the layout, in sizes. They reach out of it.
        const DIGITS: [f64; 2] = [-0.12, 0.19];
        let size = style.size() * f64::from(LARGER);
        let large = TextStyle {
            font: FontDesc::new(style.family(), size, style.style()),
            color: style.color(),
            pos: style.anchor(),
        };
        let font_error = |error| DrawingErrorKind::FontError(Box::new(error));
        let (least, most) = large.layout_box(text).map_err(font_error)?;
        let (width, height) = (most.0 - least.0, most.1 - least.1);
        let left = match large.pos.h_pos {
            HPos::Left => 0,
            HPos::Center => width / 2,
            HPos::Right => width,
        };
        let top = match large.pos.v_pos {
            VPos::Top => (DIGITS[0] * size) as i32,
            VPos::Center => (DIGITS[1] * size) as i32,
            VPos::Bottom => height,
        };
        let mut pixels: HashMap<BackendCoord, f64> = HashMap::new();
        let covered = large.draw(text, (0, 0), |x, y, color| {
            let turn = style.transform();
            let (x, y) = turn.transform(x - left - least.0, y - top - least.1);
            let pixel = (at.0 + x.div_euclid(LARGER), at.1 + y.div_euclid(LARGER));
            *pixels.entry(pixel).or_default() += color.alpha / f64::from(LARGER * LARGER);
            Ok(())
        });
        covered.map_err(font_error)??;
        let (columns, rows) = self.get_size();
        let is_inside = |place: i32, side: u32| u32::try_from(place).is_ok_and(|at| at < side);
        for (pixel, alpha) in pixels {
            if is_inside(pixel.0, columns) && is_inside(pixel.1, rows) {
                let rgb = style.color().rgb;
                self.draw_pixel(pixel, BackendColor { alpha, rgb })?;
            }
        }
        Ok(())
    }
}
