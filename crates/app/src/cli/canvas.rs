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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use plotters::prelude::*;
    use plotters::style::FontTransform;
    use plotters::style::text_anchor::Pos;

    use super::*;
    use crate::cli::picture::{FONT, embed_font};

    const SIDE: u32 = 80;

    /// How dark each column and each row of a picture is, with a text at its middle.
    fn ink(text: &str, pos: Pos, turn: FontTransform) -> [Vec<f32>; 2] {
        embed_font();
        let mut pixels = vec![255; (3 * SIDE * SIDE) as usize];
        let mut canvas = Canvas(BitMapBackend::with_buffer(&mut pixels, (SIDE, SIDE)));
        let style = (FONT, 16)
            .into_font()
            .transform(turn)
            .color(&BLACK)
            .pos(pos);
        let middle = (SIDE / 2) as i32;
        canvas.draw_text(text, &style, (middle, middle)).unwrap();
        drop(canvas);
        let mut ink = [vec![0.0; SIDE as usize], vec![0.0; SIDE as usize]];
        for (index, pixel) in pixels.chunks_exact(3).enumerate() {
            let dark = f32::from(255 - pixel[0]) / 255.0;
            ink[0][index % SIDE as usize] += dark;
            ink[1][index / SIDE as usize] += dark;
        }
        ink
    }

    /// The first and the last that are not empty.
    fn ends(ink: &[f32]) -> [f32; 2] {
        let first = ink.iter().position(|&dark| dark > 0.3).unwrap();
        let last = ink.iter().rposition(|&dark| dark > 0.3).unwrap();
        [first as f32, last as f32 + 1.0]
    }

    #[test]
    fn digits_are_where_their_anchor_says() {
        let middle = (SIDE / 2) as f32;
        let centred = Pos::new(HPos::Center, VPos::Center);
        for turn in [FontTransform::None, FontTransform::Rotate90] {
            for ink in ink("80", centred, turn) {
                let [first, last] = ends(&ink);
                assert!(
                    ((first + last) / 2.0 - middle).abs() <= 1.0,
                    "{first} to {last}"
                );
            }
        }
        let [columns, rows] = ink("80", Pos::new(HPos::Left, VPos::Top), FontTransform::None);
        for ink in [columns, rows] {
            assert!((ends(&ink)[0] - middle).abs() <= 1.5, "{:?}", ends(&ink));
        }
    }

    #[test]
    fn letters_are_evenly_apart() {
        let pos = Pos::new(HPos::Center, VPos::Center);
        let [columns, _] = ink("l l l l l", pos, FontTransform::None);
        let columns: Vec<(f32, f32)> = (0..SIDE).map(|at| at as f32).zip(columns).collect();
        // The middle of each letter's ink.
        let places: Vec<f32> = columns
            .split(|&(_, dark)| dark < 0.01)
            .filter(|letter| !letter.is_empty())
            .map(|letter| {
                let moment: f32 = letter.iter().map(|&(at, dark)| at * dark).sum();
                moment / letter.iter().map(|&(_, dark)| dark).sum::<f32>()
            })
            .collect();
        assert_eq!(places.len(), 5);
        let gaps: Vec<f32> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mean = gaps.iter().sum::<f32>() / 4.0;
        assert!(gaps.iter().all(|gap| (gap - mean).abs() < 0.3), "{gaps:?}");
    }
}
