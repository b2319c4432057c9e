//! Reads the skinned mesh of a glTF file, with its materials and their base colour textures, from PNG or JPEG.
//!
//! Source: Khronos, "glTF 2.0 Specification", 3.7.2 (meshes), 3.7.3 (skins), 3.9 (materials).
//!
//! The mesh belongs to the file's largest skin, like the skeleton of [`GltfFile`](super::GltfFile), and its joints have the same names.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;
use std::rc::Rc;

use glam::{Affine3A, Mat4, Quat, Vec2, Vec3};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;

use super::GltfError;
use super::buffers::{Container, ReadPurpose, fetch};
use super::nodes::{Local, Nodes, World, node_name};
use crate::bvh::UsedNames;

/// Maximum number of vertices, and of triangles, of a mesh. It limits memory.
pub const MOST_VERTICES: usize = 1 << 20;

/// A vertex in the bind pose, in the mesh's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinVertex {
    /// Position, in the file's unit.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Texture coordinates, or `None` for a vertex without texture.
    pub uv: Option<Vec2>,
    /// Linear red, green, blue and alpha, from 0 to 1, which the texture is multiplied with.
    pub colour: [f32; 4],
    /// Indices in [`SkinnedMesh::joints`].
    pub joints: [u16; 4],
    /// Weights of the joints. Their sum is 1.
    pub weights: [f32; 4],
}

/// A joint of a mesh's skin.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinJoint {
    /// Name, unique in the mesh.
    pub name: String,
    /// Index of the nearest joint above it, which comes before it.
    pub parent: Option<usize>,
    /// Rotation of the joint in the bind pose. Positions and rotations are in a space in which the mesh stands as the file's nodes do.
    pub rotation: Quat,
    /// Position of the joint in the bind pose, in the mesh's space.
    pub position: Vec3,
}

/// A skinned mesh in its bind pose.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinnedMesh {
    /// Vertices.
    pub vertices: Vec<SkinVertex>,
    /// Triangles, as indices of vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Joints, parents before children.
    pub joints: Vec<SkinJoint>,
    /// Base colour of the vertices with texture coordinates.
    pub texture: Option<Texture>,
}

impl SkinnedMesh {
    /// Parses a GLB or JSON file. `load` reads an external file, by its path relative to the file's folder.
    ///
    /// All triangles that the largest skin moves become one mesh. Colours of materials, and textures other than the first, become colours of
    /// vertices.
    ///
    /// # Errors
    /// The first error, with its position.
    pub fn parse(
        bytes: &[u8],
        mut load: impl FnMut(&Path) -> Result<Vec<u8>, String>,
    ) -> Result<Self, GltfError> {
        let container = Container::parse(bytes, ReadPurpose::Mesh, &mut load)?;
        let skin = Skin::of(&container)?;
        let mut builder = Builder {
            container: &container,
            skin: &skin,
            materials: Materials::new(&container, &mut load),
            vertices: Vec::new(),
            triangles: Vec::new(),
        };
        // Primitives of each mesh that is used. Once it is read, only those that added vertices are left.
        let mut used: HashMap<usize, Vec<&Primitive>> = HashMap::new();
        for (node, of_mesh) in container.root.nodes.iter().enumerate() {
            let (Some(mesh), Some(with)) = (of_mesh.mesh, of_mesh.skin) else {
                continue;
            };
            if with.value() != skin.index {
                continue;
            }
            let from = || format!("node {node}");
            let index = mesh.value();
            let mesh = container.root.meshes.get(index);
            let mesh = mesh.ok_or_else(|| GltfError::Index {
                from: from(),
                what: "mesh",
                index,
            })?;
            let primitives = used.entry(index);
            let primitives = primitives.or_insert_with(|| mesh.primitives.iter().collect());
            let mut added = Vec::new();
            for &primitive in primitives.iter() {
                let before = builder.vertices.len();
                builder.add(primitive)?;
                if builder.vertices.len() > before {
                    added.push(primitive);
                }
            }
            *primitives = added;
        }
        if builder.triangles.is_empty() {
            return Err(GltfError::NoMesh);
        }
        Ok(Self {
            vertices: builder.vertices,
            triangles: builder.triangles,
            texture: builder.materials.into_texture(),
            joints: skin.joints,
        })
    }
}

/// The skin of the mesh.
struct Skin {
    index: usize,
    joints: Vec<SkinJoint>,
    /// Index in `joints` of each joint of the skin in the file.
    order: Vec<u16>,
    /// Rotation from the mesh's space to one in which it stands as the nodes do.
    turn: Quat,
}

impl Skin {
    fn of(container: &Container) -> Result<Self, GltfError> {
        let root = &container.root;
        let largest = root
            .skins
            .iter()
            .enumerate()
            .rev()
            .max_by_key(|(_, skin)| skin.joints.len())
            .filter(|(_, skin)| !skin.joints.is_empty());
        let (index, skin) = largest.ok_or(GltfError::NoMesh)?;
        let nodes = Nodes::of(root)?;
        let binds = match skin.inverse_bind_matrices {
            Some(accessor) => {
                let from = || format!("skin {index}");
                container.floats::<16>(accessor.value(), from)?
            }
            None => vec![Mat4::IDENTITY.to_cols_array(); skin.joints.len()],
        };
        let mut of_node = HashMap::new();
        for (joint, node) in skin.joints.iter().enumerate() {
            of_node.entry(node.value()).or_insert(joint);
        }
        let (mut joints, mut places) = (Vec::new(), HashMap::new());
        let mut order = vec![0; skin.joints.len()];
        let mut taken = UsedNames::default();
        for &node in &nodes.joints {
            let name = taken.first_free(&node_name(container, node), "_");
            let Some(&joint) = of_node.get(&node) else {
                continue;
            };
            let wrong = |problem| GltfError::Skin { joint, problem };
            let inverse = binds.get(joint).ok_or(wrong("it has no bind matrix"))?;
            let inverse = Affine3A::from_mat4(Mat4::from_cols_array(inverse));
            let bind = inverse.inverse();
            let (_, rotation, position) = bind.to_scale_rotation_translation();
            if !rotation.is_normalized() || !position.is_finite() {
                return Err(wrong("its bind matrix has no inverse"));
            }
            let mut above = std::iter::successors(nodes.parent(node), |&node| nodes.parent(node));
            let parent = above.find_map(|node| places.get(&node).copied());
            places.insert(node, joints.len());
            order[joint] = joints.len() as u16;
            joints.push(SkinJoint {
                name,
                parent,
                rotation,
                position,
            });
        }
        // The skin may be stored lying down, and stand up by the nodes above it.
        let turn = match (nodes.joints.first(), joints.first()) {
            (Some(&node), Some(first)) => {
                let path: Vec<usize> =
                    std::iter::successors(Some(node), |&node| nodes.parent(node)).collect();
                let world = path.iter().rev().fold(World::ORIGIN, |above, &node| {
                    above.below(&Local::of(&root.nodes[node]))
                });
                (world.rotation.as_quat() * first.rotation.conjugate()).normalize()
            }
            _ => Quat::IDENTITY,
        };
        for joint in &mut joints {
            joint.rotation = (turn * joint.rotation).normalize();
            joint.position = turn * joint.position;
        }
        // A node that a skin names twice is one joint.
        for (joint, node) in skin.joints.iter().enumerate() {
            order[joint] = places[&node.value()] as u16;
        }
        Ok(Self {
            index,
            joints,
            order,
            turn,
        })
    }
}

struct Builder<'a, 'l> {
    container: &'a Container,
    skin: &'a Skin,
    materials: Materials<'a, 'l>,
    vertices: Vec<SkinVertex>,
    triangles: Vec<[u32; 3]>,
}

impl Builder<'_, '_> {
    /// Adds the triangles of a primitive. Points, lines, strips and fans are left out, as are triangles without joints.
    fn add(&mut self, primitive: &Primitive) -> Result<(), GltfError> {
        if primitive.mode != Checked::Valid(Mode::Triangles) {
            return Ok(());
        }
        let find = |wanted: Semantic| {
            let wanted = Checked::Valid(wanted);
            primitive.attributes.get(&wanted).map(|index| index.value())
        };
        let (Some(positions), Some(joints), Some(weights)) = (
            find(Semantic::Positions),
            find(Semantic::Joints(0)),
            find(Semantic::Weights(0)),
        ) else {
            return Ok(());
        };
        let container = self.container;
        let from = || "a primitive".to_owned();
        let positions = container.floats::<3>(positions, from)?;
        let joints = container.integers::<4>(joints, from)?;
        let weights = container.floats::<4>(weights, from)?;
        let material = self.materials.get(primitive)?;
        let set = material.texture_set;
        let uvs = set.and_then(|set| find(Semantic::TexCoords(set)));
        let uvs = uvs.map(|index| container.floats::<2>(index, from));
        let uvs = uvs.transpose()?;
        let normals = find(Semantic::Normals).map(|index| container.floats::<3>(index, from));
        let normals = normals.transpose()?;
        let first = self.vertices.len() as u32;
        let triangles = self.triangles_of(primitive, positions.len())?;
        let alike = |length: usize| length == positions.len();
        if !alike(joints.len())
            || !alike(weights.len())
            || uvs.as_ref().is_some_and(|uvs| !alike(uvs.len()))
            || normals.as_ref().is_some_and(|all| !alike(all.len()))
        {
            return Err(GltfError::Mesh(
                "attributes have different numbers of elements",
            ));
        }
        let enough = |held: usize, more: usize| held + more <= MOST_VERTICES;
        if !enough(self.vertices.len(), positions.len())
            || !enough(self.triangles.len(), triangles.len())
        {
            return Err(GltfError::Mesh(
                "it has more than 1,048,576 vertices or triangles",
            ));
        }
        for (index, &position) in positions.iter().enumerate() {
            let uv = uvs.as_ref().map(|uvs| Vec2::from(uvs[index]));
            let (joints, weights) = self.influences(joints[index], weights[index])?;
            let normal = normals.as_ref().map_or(Vec3::ZERO, |all| all[index].into());
            let vertex = SkinVertex {
                position: self.skin.turn * Vec3::from(position),
                normal: self.skin.turn * normal.normalize_or_zero(),
                uv: uv.filter(|_| material.is_first),
                colour: material.colour(uv),
                joints,
                weights,
            };
            if !vertex.position.is_finite() || uv.is_some_and(|uv| !uv.is_finite()) {
                return Err(GltfError::Mesh(
                    "a position or a texture coordinate is not finite",
                ));
            }
            self.vertices.push(vertex);
        }
        let shifted = triangles
            .iter()
            .map(|corners| corners.map(|corner| corner + first));
        self.triangles.extend(shifted);
        if normals.is_none() {
            self.smooth_normals(first as usize, &triangles);
        }
        Ok(())
    }

    fn triangles_of(
        &self,
        primitive: &Primitive,
        vertices: usize,
    ) -> Result<Vec<[u32; 3]>, GltfError> {
        let indices: Vec<u32> = match primitive.indices {
            Some(accessor) => {
                let from = || "a primitive".to_owned();
                let indices = self.container.integers::<1>(accessor.value(), from)?;
                indices.as_flattened().to_vec()
            }
            None => (0..vertices as u32).collect(),
        };
        if indices.iter().any(|&index| index as usize >= vertices) {
            return Err(GltfError::Mesh("an index is beyond its vertices"));
        }
        let (triangles, _) = indices.as_chunks::<3>();
        Ok(triangles.to_vec())
    }

    /// Joints of the mesh and their weights with a sum of 1.
    fn influences(
        &self,
        joints: [u32; 4],
        weights: [f32; 4],
    ) -> Result<([u16; 4], [f32; 4]), GltfError> {
        let weights = weights.map(|weight| weight.max(0.0));
        let sum: f32 = weights.iter().sum();
        if !(1e-6..=1e6).contains(&sum) {
            return Err(GltfError::Mesh("the weights of a vertex have no sum"));
        }
        let mut of_mesh = [0; 4];
        for influence in 0..4 {
            if weights[influence] > 0.0 {
                let joint = self.skin.order.get(joints[influence] as usize);
                let joint = joint.ok_or(GltfError::Mesh("a vertex has a joint beyond its skin"))?;
                of_mesh[influence] = *joint;
            }
        }
        Ok((of_mesh, weights.map(|weight| weight / sum)))
    }

    /// Computes normals from triangles. Vertices with the same position share a normal.
    fn smooth_normals(&mut self, first: usize, triangles: &[[u32; 3]]) {
        let vertices = &mut self.vertices[first..];
        let key = |position: Vec3| position.to_array().map(f32::to_bits);
        let mut sums: HashMap<[u32; 3], Vec3> = HashMap::new();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| vertices[corner as usize].position);
            let area = (b - a).cross(c - a);
            for corner in [a, b, c] {
                *sums.entry(key(corner)).or_default() += area;
            }
        }
        for vertex in vertices {
            let sum = sums.get(&key(vertex.position)).copied();
            vertex.normal = sum.unwrap_or_default().normalize_or(Vec3::Y);
        }
    }
}

/// Colour and texture of a primitive.
struct Material {
    /// Linear colour.
    factor: [f32; 4],
    /// Set of the texture coordinates, if there is a texture.
    texture_set: Option<u32>,
    /// Whether the texture is the mesh's own.
    is_first: bool,
    /// Texture, if it is not the mesh's own.
    own: Option<Rc<Texture>>,
}

impl Material {
    /// Colour of a vertex. A texture that is not the mesh's own is sampled.
    fn colour(&self, uv: Option<Vec2>) -> [f32; 4] {
        let sampled = match (&self.own, uv) {
            (Some(texture), Some(uv)) => texture.nearest(uv),
            _ => [1.0; 4],
        };
        std::array::from_fn(|channel| self.factor[channel] * sampled[channel])
    }
}

/// All materials of a mesh.
struct Materials<'a, 'l> {
    container: &'a Container,
    load: Load<'l>,
    /// Decoded images, by index. The first one that was decoded is the mesh's own.
    images: HashMap<usize, Rc<Texture>>,
    first: Option<usize>,
}

impl<'a, 'l> Materials<'a, 'l> {
    fn new(container: &'a Container, load: Load<'l>) -> Self {
        Self {
            container,
            load,
            images: HashMap::new(),
            first: None,
        }
    }

    /// The mesh's own texture.
    fn into_texture(mut self) -> Option<Texture> {
        let texture = self.images.remove(&self.first?)?;
        Some(Rc::unwrap_or_clone(texture))
    }

    fn get(&mut self, primitive: &Primitive) -> Result<Material, GltfError> {
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
    fn nearest(&self, uv: Vec2) -> [f32; 4] {
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
