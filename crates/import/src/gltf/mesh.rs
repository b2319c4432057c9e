//! Reads the skinned mesh of a glTF file, with its materials and their base colour textures, from PNG or JPEG.
//!
//! Source: Khronos, "glTF 2.0 Specification", 3.7.2 (meshes), 3.7.3 (skins), 3.9 (materials).
//!
//! The joints of the largest skin are those of the skeleton of [`GltfFile`](super::GltfFile), with the same names. Meshes of other skins are
//! moved into the bind pose of the largest.

use std::collections::{BTreeSet, HashMap};
use std::io::Cursor;
use std::path::Path;

use glam::{Affine2, Affine3A, Mat3A, Mat4, Quat, Vec2, Vec3};
use gltf_json::accessor::Type;
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::texture::Info;
use gltf_json::validation::Checked;

use super::buffers::{COORDINATES, Container, Decoder, FLOATS, INTEGERS, unread};
use super::named;
use super::nodes::{Local, Nodes, World, largest_skin, node_name, too_many_joints};
use crate::FileError;
use crate::bvh::UsedNames;
use sabaki::anim::Skeleton;

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
    /// What was left out or simplified, one line each.
    pub notes: Vec<String>,
    /// Name of the program that wrote the file, or an empty string.
    pub generator: String,
}

impl SkinnedMesh {
    /// Parses a GLB or JSON file. `load` reads an external file, by its path relative to the file's folder.
    ///
    /// All triangles that skins move become one mesh. Colours of materials, and textures other than that of most vertices, become colours of
    /// vertices. Of more than four joints of a vertex, the four with the largest weights are kept.
    ///
    /// # Errors
    /// The first error, with its position.
    pub fn parse(
        bytes: &[u8],
        mut load: impl FnMut(&Path) -> Result<Vec<u8>, String>,
    ) -> Result<Self, FileError> {
        let container = Container::parse(bytes, &mut load)?;
        if let Some(name) = unread(&container.root.extensions_required).next() {
            return Err(FileError::Invalid(format!(
                "it requires the extension {name}, which is not read"
            )));
        }
        let (mut parts, [unskinned, no_triangles, morphs]) = parts(&container)?;
        let skins: BTreeSet<usize> = parts.iter().map(|part| part.skin).collect();
        let mut of_images = HashMap::new();
        for part in &parts {
            *of_images.entry(part.image()).or_insert(0) += part.vertices;
        }
        of_images.remove(&None);
        let main = of_images
            .iter()
            .max_by_key(|&(&image, &vertices)| (vertices, std::cmp::Reverse(image)));
        let main = main.and_then(|(&image, _)| image);
        parts.sort_by_key(Part::image);
        let mut builder = Builder {
            container: &container,
            rig: Rig::of(&container, &skins)?,
            vertices: Vec::new(),
            triangles: Vec::new(),
            many_joints: 0,
        };
        // Each image is decoded once, and only the mesh's own and the current one are in memory.
        let mut texture = None;
        for parts in parts.chunk_by(|a, b| a.image() == b.image()) {
            let image = parts[0].image();
            let decoded = image.map(|image| decoded(&container, image)).transpose()?;
            let other = decoded.as_ref().filter(|_| image != main);
            for part in parts {
                builder.add(part, other)?;
            }
            if image == main {
                texture = decoded;
            }
        }
        let Builder {
            vertices,
            triangles,
            many_joints,
            rig,
            ..
        } = builder;
        if triangles.is_empty() {
            return Err(FileError::NoMesh);
        }
        let mut notes: Vec<String> = Container::note_of_extensions(&container.root.extensions_used)
            .into_iter()
            .collect();
        let simplified = [
            (unskinned, "meshes without a skin are left out"),
            (
                no_triangles,
                "points, lines, strips and fans, and triangles without joints, are left out",
            ),
            (
                morphs,
                "parts keep the shape that they have without morph targets",
            ),
            (
                of_images.len().saturating_sub(1),
                "textures beside that of most vertices become colours of vertices",
            ),
            (
                many_joints,
                "vertices with more than four joints keep the strongest four",
            ),
        ];
        let simplified = simplified.iter().filter(|(count, _)| *count > 0);
        notes.extend(simplified.map(|(count, what)| format!("{what}: {count}")));
        Ok(Self {
            vertices,
            triangles,
            texture,
            joints: rig.joints,
            notes,
            generator: container.root.asset.generator.clone().unwrap_or_default(),
        })
    }
}

/// Triangles of one material that a skin moves.
struct Part<'a> {
    skin: usize,
    primitive: &'a Primitive,
    /// Number of its vertices, above 0.
    vertices: u64,
    /// Linear colour of its material.
    factor: [f32; 4],
    /// Texture of its base colour, and the image of that.
    texture: Option<(&'a Info, usize)>,
}

impl Part<'_> {
    fn image(&self) -> Option<usize> {
        self.texture.map(|(_, image)| image)
    }
}

/// All triangles that skins move, node by node; and numbers of nodes without a skin, of parts that are no skinned triangles, and of parts
/// with morph targets.
fn parts<'a>(container: &'a Container<'a>) -> Result<(Vec<Part<'a>>, [usize; 3]), FileError> {
    const NEEDED: [Semantic; 3] = [
        Semantic::Positions,
        Semantic::Joints(0),
        Semantic::Weights(0),
    ];
    let root = &container.root;
    let is_read = |primitive: &Primitive| {
        let has = |wanted| attribute(primitive, wanted).is_some();
        primitive.mode == Checked::Valid(Mode::Triangles) && NEEDED.into_iter().all(has)
    };
    let vertices = |primitive: &Primitive| {
        let accessor = attribute(primitive, Semantic::Positions);
        let accessor = accessor.and_then(|index| root.accessors.get(index));
        // An accessor that is not there is reported when it is read.
        accessor.map_or(1, |accessor| accessor.count.0)
    };
    let (mut parts, mut used, mut total) = (Vec::new(), HashMap::new(), 0u64);
    let [mut unskinned, mut no_triangles, mut morphs] = [0; 3];
    for (node, of_mesh) in root.nodes.iter().enumerate() {
        let Some(mesh) = of_mesh.mesh else { continue };
        let Some(skin) = of_mesh.skin else {
            unskinned += 1;
            continue;
        };
        let index = mesh.value();
        let mesh = named(&root.meshes, index, format!("node {node}"), "mesh")?;
        let primitives = used.entry(index).or_insert_with(|| {
            let all = mesh.primitives.iter();
            let count = |is_it: &dyn Fn(&&Primitive) -> bool| all.clone().filter(is_it).count();
            no_triangles += count(&|primitive| !is_read(primitive));
            morphs += count(&|primitive| primitive.targets.is_some());
            all.filter(|primitive| is_read(primitive) && vertices(primitive) > 0)
                .collect::<Vec<_>>()
        });
        for &primitive in primitives.iter() {
            let vertices = vertices(primitive);
            total = total.saturating_add(vertices);
            if total > MOST_VERTICES as u64 {
                return Err(too_large());
            }
            let (factor, texture) = material(container, primitive)?;
            parts.push(Part {
                skin: skin.value(),
                primitive,
                vertices,
                factor,
                texture,
            });
        }
    }
    Ok((parts, [unskinned, no_triangles, morphs]))
}

fn too_large() -> FileError {
    no_mesh("it has more than 1,048,576 vertices or triangles")
}

fn no_mesh(problem: &str) -> FileError {
    FileError::part("the skinned mesh", problem)
}

fn attribute(primitive: &Primitive, wanted: Semantic) -> Option<usize> {
    let found = primitive.attributes.get(&Checked::Valid(wanted));
    found.map(|index| index.value())
}

/// Linear colour of a primitive's material, and its texture with the image.
type Base<'a> = ([f32; 4], Option<(&'a Info, usize)>);

fn material<'a>(
    container: &'a Container<'a>,
    primitive: &Primitive,
) -> Result<Base<'a>, FileError> {
    let root = &container.root;
    let Some(material) = primitive.material else {
        return Ok(([1.0; 4], None));
    };
    const FROM: &str = "a material";
    let material = named(&root.materials, material.value(), FROM, "material")?;
    let base = &material.pbr_metallic_roughness;
    let factor = base.base_color_factor.0.map(|part| part.clamp(0.0, 1.0));
    let Some(info) = &base.base_color_texture else {
        return Ok((factor, None));
    };
    let texture = named(&root.textures, info.index.value(), FROM, "texture")?;
    Ok((factor, Some((info, texture.source.value()))))
}

/// How the joints of a skin of the file move vertices.
struct Skin {
    /// For each joint, its index in the mesh's joints.
    order: Vec<u16>,
    /// For each joint, how it moves vertices in the bind pose to the space of the mesh.
    moves: Vec<Affine3A>,
}

/// The joints of all skins that move something.
struct Rig<'a> {
    container: &'a Container<'a>,
    nodes: Nodes,
    /// Names of the nodes that are joints of the skeleton.
    names: HashMap<usize, String>,
    taken: UsedNames,
    joints: Vec<SkinJoint>,
    /// By node, the joints' indices and frames in the bind pose of the largest skin.
    known: HashMap<usize, (usize, Affine3A)>,
    /// From the space of that pose to one in which it stands as the nodes do: the skin may be stored lying down or mirrored.
    turn: Mat3A,
    /// From the file's space to that of the bind pose, by the first joint.
    to_bind: Affine3A,
    skins: HashMap<usize, Skin>,
}

impl<'a> Rig<'a> {
    fn of(container: &'a Container<'a>, used: &BTreeSet<usize>) -> Result<Self, FileError> {
        let root = &container.root;
        let largest = largest_skin(root).filter(|(_, skin)| !skin.joints.is_empty());
        let (largest, _) = largest.ok_or(FileError::NoMesh)?;
        let mut rig = Self {
            container,
            nodes: Nodes::of(root)?,
            names: HashMap::new(),
            taken: UsedNames::default(),
            joints: Vec::new(),
            known: HashMap::new(),
            turn: Mat3A::IDENTITY,
            to_bind: Affine3A::IDENTITY,
            skins: HashMap::new(),
        };
        for &node in &rig.nodes.joints {
            let name = rig.taken.first_free(&node_name(container, node), "_");
            rig.names.insert(node, name);
        }
        rig.add_skin(largest, true)?;
        for &index in used.iter().filter(|&&index| index != largest) {
            rig.add_skin(index, false)?;
        }
        Ok(rig)
    }

    /// Adds a skin. The joints of the largest one have the frames of its own bind pose; new ones of another skin have those that the joints
    /// above them, or the nodes as they stand, move it to.
    fn add_skin(&mut self, index: usize, is_largest: bool) -> Result<(), FileError> {
        let root = &self.container.root;
        let skin = named(&root.skins, index, "a node", "skin")?;
        let inverses = match skin.inverse_bind_matrices {
            Some(accessor) => {
                let from = format!("skin {index}");
                self.container
                    .elements::<_, 16>(accessor.value(), &from, &FLOATS)?
            }
            None => vec![Mat4::IDENTITY.to_cols_array(); skin.joints.len()],
        };
        let joints = skin.joints.iter().map(|node| node.value());
        let mut own: Vec<(usize, usize)> = joints.enumerate().collect();
        for &(_, node) in &own {
            named(&root.nodes, node, "a skin", "node")?;
        }
        // Parents before children, and the joints of the skeleton in its order.
        let places: HashMap<usize, usize> = self.nodes.joints.iter().copied().zip(0..).collect();
        own.sort_by_cached_key(|&(_, node)| {
            (
                places.get(&node).copied().unwrap_or(usize::MAX),
                self.nodes.depths[node],
            )
        });
        let mut found = Skin {
            order: vec![0; own.len()],
            moves: vec![Affine3A::IDENTITY; own.len()],
        };
        let mut moves: HashMap<usize, Affine3A> = HashMap::new();
        for (joint, node) in own {
            let wrong =
                |problem: &str| FileError::part(format!("joint {joint} of skin {index}"), problem);
            let inverse = inverses.get(joint);
            let inverse = inverse.ok_or_else(|| wrong("it has no bind matrix"))?;
            let inverse = Affine3A::from_mat4(Mat4::from_cols_array(inverse));
            let own_frame = inverse.inverse();
            let (_, rotation, place) = own_frame.to_scale_rotation_translation();
            if !rotation.is_normalized() || !place.is_finite() {
                return Err(wrong("its bind matrix has no inverse"));
            }
            let (known, frame) = match self.known.get(&node) {
                Some(&known) => known,
                None => {
                    let moved = |node| moves.get(&node).copied();
                    let above = self.nodes.ancestry(node).find_map(moved);
                    let as_it_stands =
                        || self.to_bind * self.world(node).points.as_affine3a() * inverse;
                    let frame = match is_largest {
                        true => own_frame,
                        false => above.unwrap_or_else(as_it_stands) * own_frame,
                    };
                    (self.add_joint(node, frame)?, frame)
                }
            };
            moves.entry(node).or_insert(frame * inverse);
            found.order[joint] = known as u16;
            found.moves[joint] = Affine3A::from_mat3(self.turn.into()) * frame * inverse;
        }
        self.skins.insert(index, found);
        Ok(())
    }

    /// The frame of a node without animation.
    fn world(&self, node: usize) -> World {
        let path: Vec<usize> = self.nodes.ancestry(node).collect();
        path.iter().rev().fold(World::ORIGIN, |above, &node| {
            above.below(&Local::of(&self.container.root.nodes[node]))
        })
    }

    fn add_joint(&mut self, node: usize, frame: Affine3A) -> Result<usize, FileError> {
        let index = self.joints.len();
        if index >= Skeleton::MAX_JOINTS {
            return Err(too_many_joints());
        }
        let world = self.world(node);
        let standing = Mat3A::from_quat(world.rotation.as_quat())
            * Mat3A::from_diagonal(world.signs.as_vec3());
        let own = orthogonal(&frame);
        if index == 0 {
            self.turn = standing * own.transpose();
            self.to_bind = frame * world.points.inverse().as_affine3a();
        }
        let mut axes = self.turn * own * Mat3A::from_diagonal(world.signs.as_vec3());
        if axes.determinant() < 0.0 {
            axes.x_axis = -axes.x_axis;
        }
        let name = match self.names.remove(&node) {
            Some(name) => name,
            None => self.taken.first_free(&node_name(self.container, node), "_"),
        };
        let mut above = self.nodes.ancestry(node).skip(1);
        let parent = above.find_map(|node| Some(self.known.get(&node)?.0));
        self.joints.push(SkinJoint {
            name,
            parent,
            rotation: Quat::from_mat3a(&axes).normalize(),
            position: (self.turn * frame.translation).into(),
        });
        self.known.insert(node, (index, frame));
        Ok(index)
    }
}

/// The rotation of a frame, with its mirroring but without its scale.
fn orthogonal(frame: &Affine3A) -> Mat3A {
    let (scale, rotation, _) = frame.to_scale_rotation_translation();
    Mat3A::from_quat(rotation) * Mat3A::from_diagonal(scale.signum())
}

struct Builder<'a> {
    container: &'a Container<'a>,
    rig: Rig<'a>,
    vertices: Vec<SkinVertex>,
    triangles: Vec<[u32; 3]>,
    /// Number of vertices with more than four joints.
    many_joints: usize,
}

/// An object that refers to an accessor, for error messages.
const FROM: &str = "a primitive";

impl Builder<'_> {
    /// Adds the triangles of a part. `other` is their texture, if it is not the mesh's own; then it is sampled.
    fn add(&mut self, part: &Part, other: Option<&Texture>) -> Result<(), FileError> {
        let (container, primitive) = (self.container, part.primitive);
        let Some(positions) = attribute(primitive, Semantic::Positions) else {
            return Ok(());
        };
        let positions = container.elements::<_, 3>(positions, FROM, &COORDINATES)?;
        let count = positions.len();
        let mut influences = Vec::new();
        for set in 0..MOST_SETS {
            let joints = self.values::<_, 4>(primitive, Semantic::Joints(set), &INTEGERS, count)?;
            let weights = self.values::<_, 4>(primitive, Semantic::Weights(set), &FLOATS, count)?;
            let Some(both) = joints.zip(weights) else {
                break;
            };
            influences.push(both);
        }
        let (uv_set, placement) = part.texture.map(|(info, _)| placement(info)).unzip();
        let placement = placement.unwrap_or(Affine2::IDENTITY);
        let of_uvs =
            |set| self.values::<_, 2>(primitive, Semantic::TexCoords(set), &COORDINATES, count);
        let uvs = uv_set.map(of_uvs).transpose()?.flatten();
        let normals = self.values::<_, 3>(primitive, Semantic::Normals, &COORDINATES, count)?;
        let colours = self.colours(primitive, count)?;
        let first = self.vertices.len() as u32;
        let mut triangles = self.triangles_of(primitive, count)?;
        let enough = |held: usize, more: usize| held + more <= MOST_VERTICES;
        if !enough(self.vertices.len(), positions.len())
            || !enough(self.triangles.len(), triangles.len())
        {
            return Err(too_large());
        }
        let Some(skin) = self.rig.skins.get(&part.skin) else {
            return Ok(());
        };
        for (index, &position) in positions.iter().enumerate() {
            let uv = uvs.as_ref().map(|uvs| Vec2::from(uvs[index]));
            let uv = uv.map(|uv| placement.transform_point2(uv));
            let of_vertex = influences
                .iter()
                .flat_map(|(joints, weights)| joints[index].into_iter().zip(weights[index]));
            let (joints, weights) = strongest(of_vertex, &mut self.many_joints)?;
            let mut moves = Affine3A::ZERO;
            let mut of_mesh = [0; 4];
            for ((joint, &weight), found) in joints.into_iter().zip(&weights).zip(&mut of_mesh) {
                if weight > 0.0 {
                    let joint = joint as usize;
                    let beyond = || no_mesh("a vertex has a joint beyond its skin");
                    *found = *skin.order.get(joint).ok_or_else(beyond)?;
                    moves.matrix3 += skin.moves[joint].matrix3 * weight;
                    moves.translation += skin.moves[joint].translation * weight;
                }
            }
            let normal = normals.as_ref().map_or(Vec3::ZERO, |all| all[index].into());
            let texel = other.zip(uv).map(|(texture, uv)| texture.nearest(uv));
            let texel = texel.unwrap_or([1.0; 4]);
            let own = colours.as_ref().map_or([1.0; 4], |all| all[index]);
            let vertex = SkinVertex {
                position: moves.transform_point3(position.into()),
                normal: moves.transform_vector3(normal).normalize_or_zero(),
                uv: uv.filter(|_| other.is_none()),
                colour: [0, 1, 2, 3]
                    .map(|channel| part.factor[channel] * texel[channel] * own[channel]),
                joints: of_mesh,
                weights,
            };
            if !vertex.position.is_finite() || uv.is_some_and(|uv| !uv.is_finite()) {
                return Err(no_mesh("a position or a texture coordinate is not finite"));
            }
            self.vertices.push(vertex);
        }
        if self.rig.turn.determinant() < 0.0 {
            triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
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

    /// The values of an attribute, as many as vertices; `None` if the primitive does not have it.
    fn values<T: Copy + Default, const N: usize>(
        &self,
        primitive: &Primitive,
        wanted: Semantic,
        decoder: &Decoder<T>,
        vertices: usize,
    ) -> Result<Option<Vec<[T; N]>>, FileError> {
        let Some(index) = attribute(primitive, wanted) else {
            return Ok(None);
        };
        let values = self.container.elements(index, FROM, decoder)?;
        match values.len() == vertices {
            true => Ok(Some(values)),
            false => Err(no_mesh("attributes have different numbers of elements")),
        }
    }

    /// Linear colours of vertices, from 0 to 1.
    fn colours(
        &self,
        primitive: &Primitive,
        vertices: usize,
    ) -> Result<Option<Vec<[f32; 4]>>, FileError> {
        let wanted = || Semantic::Colors(0);
        let accessor = attribute(primitive, wanted());
        let accessor = accessor.and_then(|index| self.container.root.accessors.get(index));
        let mut colours = match accessor.map(|accessor| accessor.type_) {
            Some(Checked::Valid(Type::Vec3)) => {
                let colours = self.values::<_, 3>(primitive, wanted(), &FLOATS, vertices)?;
                let opaque = |[red, green, blue]: [f32; 3]| [red, green, blue, 1.0];
                colours.map(|colours| colours.into_iter().map(opaque).collect())
            }
            _ => self.values::<_, 4>(primitive, wanted(), &FLOATS, vertices)?,
        };
        for part in colours
            .iter_mut()
            .flat_map(|all: &mut Vec<_>| all.as_flattened_mut())
        {
            *part = part.clamp(0.0, 1.0);
        }
        Ok(colours)
    }

    fn triangles_of(
        &self,
        primitive: &Primitive,
        vertices: usize,
    ) -> Result<Vec<[u32; 3]>, FileError> {
        let indices: Vec<u32> = match primitive.indices {
            Some(accessor) => {
                let indices = self
                    .container
                    .elements::<_, 1>(accessor.value(), FROM, &INTEGERS)?;
                indices.as_flattened().to_vec()
            }
            None => (0..vertices as u32).collect(),
        };
        if indices.iter().any(|&index| index as usize >= vertices) {
            return Err(no_mesh("an index is beyond its vertices"));
        }
        let (triangles, _) = indices.as_chunks::<3>();
        Ok(triangles.to_vec())
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

/// The joints of the largest weights, and the weights with a sum of 1. Counts vertices with more than four.
fn strongest(
    influences: impl Iterator<Item = (u32, f32)>,
    many_joints: &mut usize,
) -> Result<([u32; 4], [f32; 4]), FileError> {
    let mut all: Vec<(u32, f32)> = influences.filter(|&(_, weight)| weight > 0.0).collect();
    if all.len() > 4 {
        *many_joints += 1;
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all.truncate(4);
    }
    let sum: f32 = all.iter().map(|&(_, weight)| weight).sum();
    if !(1e-6..=1e6).contains(&sum) {
        return Err(no_mesh("the weights of a vertex have no sum"));
    }
    let (mut joints, mut weights) = ([0; 4], [0.0; 4]);
    for (at, (joint, weight)) in all.into_iter().enumerate() {
        (joints[at], weights[at]) = (joint, weight / sum);
    }
    Ok((joints, weights))
}

/// Most sets of four joints that a vertex may have.
const MOST_SETS: u32 = 8;

/// Set of a texture's coordinates, and how they become those of the image (`KHR_texture_transform`).
fn placement(info: &Info) -> (u32, Affine2) {
    let extensions = info.extensions.as_ref();
    let Some(transform) = extensions.and_then(|all| all.texture_transform.as_ref()) else {
        return (info.tex_coord, Affine2::IDENTITY);
    };
    let (scale, offset) = (transform.scale.0.into(), transform.offset.0.into());
    // Its angle turns the image, and with it v downwards.
    let angle = -transform.rotation.0;
    (
        transform.tex_coord.unwrap_or(info.tex_coord),
        Affine2::from_scale_angle_translation(scale, angle, offset),
    )
}

/// An image of the file.
fn decoded(container: &Container, index: usize) -> Result<Texture, FileError> {
    let image = named(&container.root.images, index, "a texture", "image")?;
    let texture = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => container
            .fetch(uri)
            .and_then(|bytes| Texture::decode(&bytes)),
        (None, Some(view)) => {
            let bytes = container.view(view.value(), &format!("image {index}"))?;
            let bytes = bytes.ok_or_else(|| "it has no bytes".to_owned());
            bytes.and_then(Texture::decode)
        }
        (None, None) => Err("it has neither a URI nor a buffer view".to_owned()),
    };
    texture.map_err(|problem| FileError::part(format!("image {index}"), problem))
}

/// Maximum width and height of a texture, in texels. It limits memory.
const MOST_TEXELS: u32 = 4096;

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

/// A texture of pixels of one to four channels of a byte: grey, grey and alpha, colours, or colours and alpha. `pixels` decodes them; then
/// the size is known to be within the limit.
fn texture(
    width: u32,
    height: u32,
    channels: usize,
    pixels: impl FnOnce() -> Result<Vec<u8>, String>,
) -> Result<Texture, String> {
    if width.max(height) > MOST_TEXELS {
        return Err(format!(
            "{width} x {height} texels; {MOST_TEXELS} a side are the most"
        ));
    }
    let texel = |pixel: &[u8]| match *pixel {
        [grey] => [grey, grey, grey, 255],
        [grey, alpha] => [grey, grey, grey, alpha],
        [red, green, blue] => [red, green, blue, 255],
        [red, green, blue, alpha] => [red, green, blue, alpha],
        _ => [255; 4],
    };
    Ok(Texture {
        width,
        height,
        texels: pixels()?.chunks_exact(channels).map(texel).collect(),
    })
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
    let channels = reader.output_color_type().0.samples();
    texture(width, height, channels, || {
        let size = reader.output_buffer_size().ok_or("it is too large")?;
        let mut pixels = vec![0; size];
        let frame = reader.next_frame(&mut pixels).map_err(failed)?;
        pixels.truncate(frame.buffer_size());
        Ok(pixels)
    })
}

fn jpeg(bytes: &[u8]) -> Result<Texture, String> {
    let failed = |error: jpeg_decoder::Error| error.to_string();
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.set_max_decoding_buffer_size(4 * (MOST_TEXELS as usize).pow(2));
    decoder.read_info().map_err(failed)?;
    let info = decoder.info().ok_or("it has no header")?;
    let channels = match info.pixel_format {
        jpeg_decoder::PixelFormat::L8 => 1,
        jpeg_decoder::PixelFormat::RGB24 => 3,
        _ => return Err("neither grey nor coloured with 8 bits".to_owned()),
    };
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    texture(width, height, channels, || decoder.decode().map_err(failed))
}
