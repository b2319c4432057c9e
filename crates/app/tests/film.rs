//! Promise: a GIF shows what was drawn, an APNG loses nothing, and a film is as long as its pictures at their rate.

use sabaki_app::film::{Film, FilmError};

/// A square that moves over a slope of colours.
fn film() -> Film {
    let [width, height] = [40u32, 24];
    let picture = |number: u32| {
        let pixel = |at: u32| {
            let (x, y) = (at % width, at / width);
            match (x.wrapping_sub(4 * number) < 6, (5..12).contains(&y)) {
                (true, true) => [220, 60, 30],
                _ => [150 + x as u8, 160 + 2 * y as u8, 200],
            }
        };
        (0..width * height).flat_map(pixel).collect()
    };
    Film {
        size: [width, height],
        delay: 1.0 / 25.0,
        pictures: (0..5).map(picture).collect(),
    }
}

#[test]
fn a_gif_shows_what_was_drawn_and_only_writes_what_changes() {
    let film = film();
    let bytes = film.gif().unwrap();
    assert_eq!(bytes, film.gif().unwrap());
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(&bytes[..]).unwrap();
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let width = film.size[0] as usize;
    let mut canvas = vec![0u8; film.pictures[0].len()];
    let mut shown = 0;
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert_eq!(frame.delay, 4);
        let columns = usize::from(frame.width);
        for (at, pixel) in frame.buffer.chunks_exact(4).enumerate() {
            let (x, y) = (
                at % columns + usize::from(frame.left),
                at / columns + usize::from(frame.top),
            );
            if pixel[3] > 0 {
                canvas[3 * (y * width + x)..][..3].copy_from_slice(&pixel[..3]);
            }
        }
        assert!(shown == 0 || columns < width / 2);
        let pairs = canvas.iter().zip(&film.pictures[shown]);
        let apart: Vec<u8> = pairs.map(|(a, b)| a.abs_diff(*b)).collect();
        let mean = apart.iter().map(|&apart| f64::from(apart)).sum::<f64>() / apart.len() as f64;
        assert!(mean < 4.0, "picture {shown}: {mean} apart");
        assert!(*apart.iter().max().unwrap() < 40, "picture {shown}");
        shown += 1;
    }
    assert_eq!(shown, film.pictures.len());
}

#[test]
fn an_animated_png_loses_nothing_and_a_film_of_nothing_is_an_error() {
    let mut film = film();
    let bytes = film.apng().unwrap();
    let decoder = png::Decoder::new(std::io::Cursor::new(&bytes));
    let mut reader = decoder.read_info().unwrap();
    for picture in &film.pictures {
        let mut pixels = vec![0; picture.len()];
        reader.next_frame(&mut pixels).unwrap();
        assert!(pixels == *picture);
    }
    film.pictures[2].pop();
    let wrong = |result: Result<Vec<u8>, FilmError>| result.unwrap_err().to_string();
    assert_eq!(wrong(film.gif()), "picture 2 has 2879 bytes, not 2880");
    film.pictures.clear();
    assert_eq!(wrong(film.apng()), "a film needs a picture");
    film.size[0] = 0;
    assert_eq!(wrong(film.gif()), "0 by 24 pixels are no picture");
}
