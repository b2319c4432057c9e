//! Materials and their base colour textures, from PNG or JPEG.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;
use std::rc::Rc;

use glam::Vec2;
use gltf_json::mesh::Primitive;

use super::GltfError;
use super::container::{Container, fetch};

/// Maximum width and height of a texture, in texels. It limits memory.
const MOST_TEXELS: u32 = 4096;

/// A function that reads external files.
type Load<'l> = &'l mut dyn FnMut(&Path) -> Result<Vec<u8>, String>;

/// An image of base colours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Width, in texels.
    pub width: u32,
    /// Height, in texels.
    pub height: u32,
    /// Red, green, blue (sRGB) and alpha, row by row from the top left.
    pub texels: Vec<[u8; 4]>,
}

impl Texture {
    /// Linear colour of the texel at texture coordinates, which repeat.
    pub(super) fn nearest(&self, uv: Vec2) -> [f32; 4] {
        let at =
            |share: f32, side: u32| ((share.rem_euclid(1.0) * side as f32) as u32).min(side - 1);
        let (column, row) = (at(uv.x, self.width), at(uv.y, self.height));
        let texel = self.texels[(row * self.width + column) as usize];
        let [red, green, blue] = [0, 1, 2].map(|channel| linear(texel[channel]));
        [red, green, blue, f32::from(texel[3]) / 255.0]
    }

    /// Decodes a PNG or JPEG file.
    fn decode(bytes: &[u8]) -> Result<Self, String> {
        let texture = match bytes {
            [0xff, 0xd8, ..] => jpeg(bytes)?,
            _ => png(bytes)?,
        };
        let texels = u64::from(texture.width) * u64::from(texture.height);
        if texels == 0 || texture.texels.len() as u64 != texels {
            return Err("it is not whole".to_owned());
        }
        Ok(texture)
    }
}

fn linear(value: u8) -> f32 {
    let value = f32::from(value) / 255.0;
    match value <= 0.04045 {
        true => value / 12.92,
        false => ((value + 0.055) / 1.055).powf(2.4),
    }
}

fn check(width: u32, height: u32) -> Result<(), String> {
    match width.max(height) <= MOST_TEXELS {
        true => Ok(()),
        false => Err(format!(
            "{width} x {height} texels; {MOST_TEXELS} a side are the most"
        )),
    }
}

/// Texels from pixels of one to four channels of a byte: grey, grey and alpha, colours, or colours and alpha.
fn texels(pixels: &[u8], channels: usize) -> Vec<[u8; 4]> {
    let texel = |pixel: &[u8]| match *pixel {
        [grey] => [grey, grey, grey, 255],
        [grey, alpha] => [grey, grey, grey, alpha],
        [red, green, blue] => [red, green, blue, 255],
        [red, green, blue, alpha] => [red, green, blue, alpha],
        _ => [255; 4],
    };
    pixels.chunks_exact(channels).map(texel).collect()
}

fn png(bytes: &[u8]) -> Result<Texture, String> {
    let failed = |error: png::DecodingError| error.to_string();
    let limits = png::Limits {
        bytes: 4 * (MOST_TEXELS as usize).pow(2),
    };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(failed)?;
    let (width, height) = (reader.info().width, reader.info().height);
    check(width, height)?;
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut pixels = vec![0; size];
    let frame = reader.next_frame(&mut pixels).map_err(failed)?;
    pixels.truncate(frame.buffer_size());
    let channels = frame.color_type.samples();
    Ok(Texture {
        width,
        height,
        texels: texels(&pixels, channels),
    })
}

fn jpeg(bytes: &[u8]) -> Result<Texture, String> {
    let failed = |error: jpeg_decoder::Error| error.to_string();
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.set_max_decoding_buffer_size(4 * (MOST_TEXELS as usize).pow(2));
    decoder.read_info().map_err(failed)?;
    let info = decoder.info().ok_or("it has no header")?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    check(width, height)?;
    let channels = match info.pixel_format {
        jpeg_decoder::PixelFormat::L8 => 1,
        jpeg_decoder::PixelFormat::RGB24 => 3,
        _ => return Err("neither grey nor coloured with 8 bits".to_owned()),
    };
    let pixels = decoder.decode().map_err(failed)?;
    Ok(Texture {
        width,
        height,
        texels: texels(&pixels, channels),
    })
}

/// Colour and texture of a primitive.
pub(super) struct Material {
    /// Linear colour.
    pub(super) factor: [f32; 4],
    /// Set of the texture coordinates, if there is a texture.
    pub(super) texture_set: Option<u32>,
    /// Whether the texture is the mesh's own.
    pub(super) is_first: bool,
    /// Texture, if it is not the mesh's own.
    pub(super) own: Option<Rc<Texture>>,
}

/// All materials of a mesh.
pub(super) struct Materials<'a, 'l> {
    container: &'a Container,
    load: Load<'l>,
    /// Decoded images, by index. The first one that was decoded is the mesh's own.
    images: HashMap<usize, Rc<Texture>>,
    first: Option<usize>,
}

impl<'a, 'l> Materials<'a, 'l> {
    pub(super) fn new(container: &'a Container, load: Load<'l>) -> Self {
        Self {
            container,
            load,
            images: HashMap::new(),
            first: None,
        }
    }

    /// The mesh's own texture.
    pub(super) fn into_texture(mut self) -> Option<Texture> {
        let texture = self.images.remove(&self.first?)?;
        Some(Rc::unwrap_or_clone(texture))
    }

    pub(super) fn get(&mut self, primitive: &Primitive) -> Result<Material, GltfError> {
        let mut found = Material {
            factor: [1.0; 4],
            texture_set: None,
            is_first: false,
            own: None,
        };
        let root = &self.container.root;
        let Some(material) = primitive.material else {
            return Ok(found);
        };
        let missing = |what: &'static str, index: usize| GltfError::Index {
            from: "a material".to_owned(),
            what,
            index,
        };
        let material = root
            .materials
            .get(material.value())
            .ok_or_else(|| missing("material", material.value()))?;
        let base = &material.pbr_metallic_roughness;
        found.factor = base.base_color_factor.0.map(|part| part.clamp(0.0, 1.0));
        let Some(info) = &base.base_color_texture else {
            return Ok(found);
        };
        let texture = root
            .textures
            .get(info.index.value())
            .ok_or_else(|| missing("texture", info.index.value()))?;
        let image = texture.source.value();
        let decoded = self.image(image)?;
        found.texture_set = Some(info.tex_coord);
        found.is_first = self.first == Some(image);
        found.own = (!found.is_first).then_some(decoded);
        Ok(found)
    }

    fn image(&mut self, index: usize) -> Result<Rc<Texture>, GltfError> {
        if let Some(texture) = self.images.get(&index) {
            return Ok(Rc::clone(texture));
        }
        let failed = |problem: String| GltfError::Image {
            image: index,
            problem,
        };
        // A second image is kept until the mesh is read; more of them could fill the memory.
        if self.images.len() >= 8 {
            return Err(failed("the mesh has more than 8 textures".to_owned()));
        }
        let images = &self.container.root.images;
        let image = images.get(index).ok_or_else(|| GltfError::Index {
            from: "a texture".to_owned(),
            what: "image",
            index,
        })?;
        let texture = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                let bytes = fetch(uri, &mut |path: &Path| (self.load)(path));
                Texture::decode(&bytes.map_err(failed)?)
            }
            (None, Some(view)) => {
                let bytes = self.container.view(view.value());
                Texture::decode(bytes.ok_or_else(|| failed("it has no bytes".to_owned()))?)
            }
            (None, None) => Err("it has neither a URI nor a buffer view".to_owned()),
        };
        let texture = Rc::new(texture.map_err(failed)?);
        self.first.get_or_insert(index);
        self.images.insert(index, Rc::clone(&texture));
        Ok(texture)
    }
}
