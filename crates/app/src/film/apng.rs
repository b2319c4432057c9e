use png::{BitDepth, BlendOp, ColorType, Compression, DisposeOp, Encoder};

use super::{Delay, FilmError};

/// Encodes a PNG file. `pixels`: red, green and blue (sRGB), row by row from the upper left.
///
/// # Errors
/// The encoder's errors: the number of pixels must match the size.
pub fn png([width, height]: [u32; 2], pixels: &[u8]) -> Result<Vec<u8>, FilmError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// Each picture is stored whole.
pub(super) fn encode(
    [width, height]: [u32; 2],
    delay: Delay,
    pictures: &[Vec<u8>],
) -> Result<Vec<u8>, FilmError> {
    let (numerator, denominator) = delay.fraction();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder.set_animated(pictures.len() as u32, 0)?;
    encoder.set_frame_delay(numerator, denominator)?;
    encoder.set_blend_op(BlendOp::Source)?;
    encoder.set_dispose_op(DisposeOp::None)?;
    let mut writer = encoder.write_header()?;
    for picture in pictures {
        writer.write_image_data(picture)?;
    }
    writer.finish()?;
    Ok(bytes)
}
