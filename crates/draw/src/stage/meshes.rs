//! Meshes on the device: capsules of two resolutions, and the skinned meshes with the commands that draw them.

use ash::vk;

use super::StageDesc;
use crate::scene::{Mesh, MeshTexture, MeshVertex};
use crate::shaders::DrawCommand;
use sabaki::gpu::internal::{Buffer, BufferDesc, DeviceMemory, within};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};

/// Resolution of a mesh, and its range of indices.
#[derive(Clone, Copy, Debug)]
pub(super) struct CapsuleMesh {
    pub(super) segments: u32,
    /// Number of rings from a pole to the cylinder part.
    pub(super) rings: u32,
    pub(super) first_index: u32,
    pub(super) indices: u32,
}

/// Segments and rings of a picture, and of a shadow.
const SIZES: [(u32, u32); 2] = [(24, 7), (10, 3)];

/// Capsules of both resolutions and their shared index buffer. `view_capsule.glsl` computes the vertices from their numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct CapsuleMeshes {
    meshes: Vec<CapsuleMesh>,
    pub(super) indices: Vec<u16>,
}

impl CapsuleMeshes {
    pub(super) fn new() -> Self {
        let mut all = Self::default();
        for (segments, rings) in SIZES {
            let first_index = all.indices.len() as u32;
            // Two triangles between each pair of rings and segments, counter-clockwise seen from
            // outside.
            for ring in 0..2 * rings + 1 {
                for segment in 0..segments {
                    let next = (segment + 1) % segments;
                    let at = |ring: u32, segment: u32| (ring * segments + segment) as u16;
                    let (a, b) = (at(ring, segment), at(ring, next));
                    let (c, d) = (at(ring + 1, segment), at(ring + 1, next));
                    all.indices.extend([a, d, b, a, c, d]);
                }
            }
            all.meshes.push(CapsuleMesh {
                segments,
                rings,
                first_index,
                indices: all.indices.len() as u32 - first_index,
            });
        }
        all
    }

    pub(super) fn of(&self, is_shadow: bool) -> CapsuleMesh {
        self.meshes[usize::from(is_shadow)]
    }
}

/// Place of a mesh in the buffers.
#[derive(Clone, Copy, Debug)]
struct Place {
    first_vertex: i32,
    /// First index and number of indices of each resolution.
    details: [(u32, u32); Mesh::DETAILS],
    /// First texel, width, height and number of levels.
    texture: [u32; 4],
    /// Number of bones that the vertices refer to.
    bones: u32,
}

/// All meshes of a stage. Handles are null by default.
#[derive(Debug, Default)]
pub(super) struct Skins {
    pub(super) vertices: Buffer,
    pub(super) indices: Buffer,
    pub(super) texels: Buffer,
    places: Vec<Place>,
}

impl Skins {
    /// Creates the buffers. After a failure, [`Skins::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &StageDesc<'_>,
    ) -> Result<(), GpuError> {
        let (mut vertices, mut indices): (Vec<MeshVertex>, Vec<u32>) = Default::default();
        let mut texels = Vec::new();
        for mesh in desc.meshes {
            check(mesh)?;
            let first_vertex = vertices.len() as i32;
            vertices.extend(&mesh.vertices);
            let details = std::array::from_fn(|detail| {
                let first = indices.len() as u32;
                indices.extend(mesh.details[detail].as_flattened());
                (first, indices.len() as u32 - first)
            });
            let bones = mesh.vertices.iter().flat_map(|vertex| vertex.bones);
            self.places.push(Place {
                bones: bones.max().map_or(0, |bone| u32::from(bone) + 1),
                first_vertex,
                details,
                texture: add_texture(mesh, &mut texels),
            });
        }
        use vk::BufferUsageFlags as Usage;
        let mut buffer = |what: &str, bytes: &[u8], usage| {
            let made = device.buffer(BufferDesc {
                name: &format!("{}: {what}", desc.name),
                size: bytes.len() as u64,
                usage,
                memory: MemoryUse::Upload,
            })?;
            match made.write(device.context, 0, bytes) {
                Ok(()) => Ok(made),
                Err(error) => {
                    let mut made = made;
                    made.destroy(device.context, device.memory);
                    Err(error)
                }
            }
        };
        let vertices = bytemuck::cast_slice(&vertices);
        self.vertices = buffer("meshes' vertices", vertices, Usage::VERTEX_BUFFER)?;
        let indices = bytemuck::cast_slice(&indices);
        self.indices = buffer("meshes' indices", indices, Usage::INDEX_BUFFER)?;
        let texels = bytemuck::cast_slice(&texels);
        self.texels = buffer("meshes' texels", texels, Usage::STORAGE_BUFFER)?;
        Ok(())
    }

    /// Number of meshes.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Command that draws instances of a mesh.
    pub(super) fn command(&self, mesh: usize, detail: usize, instances: u32) -> DrawCommand {
        let place = &self.places[mesh];
        let (first_index, index_count) = place.details[detail];
        DrawCommand {
            index_count,
            instance_count: instances,
            first_index,
            vertex_offset: place.first_vertex,
            first_instance: 0,
        }
    }

    /// Number of bones that a mesh's vertices refer to.
    pub(super) fn bones(&self, mesh: usize) -> u32 {
        self.places[mesh].bones
    }

    /// Place of a mesh's texture in the layout of the shaders.
    pub(super) fn texture(&self, mesh: usize) -> [u32; 4] {
        self.places[mesh].texture
    }

    /// Frees all buffers. The device must not use them any more.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        for buffer in [&mut self.vertices, &mut self.indices, &mut self.texels] {
            buffer.destroy(context, memory);
        }
    }
}

/// The texture of a mesh, and its number of texels; `None` if there are none.
fn texture_of(mesh: &Mesh) -> Option<(&MeshTexture, u64)> {
    let texture = mesh.texture.as_ref()?;
    let texels = u64::from(texture.width) * u64::from(texture.height);
    (texels > 0 && !texture.texels.is_empty()).then_some((texture, texels))
}

/// Whether a mesh has the vertices and texels that it refers to.
fn check(mesh: &Mesh) -> Result<(), GpuError> {
    let corners = mesh.details.iter().flatten().flatten();
    let needed = corners.max().map_or(0, |&last| u64::from(last) + 1);
    within("vertices of a Mesh", needed, mesh.vertices.len() as u64)?;
    let Some((texture, texels)) = texture_of(mesh) else {
        return Ok(());
    };
    within(
        "texels of a MeshTexture",
        texels,
        texture.texels.len() as u64,
    )
}

/// Appends the texture of a mesh and its coarser levels. Each texel of a level is the mean of four finer ones.
fn add_texture(mesh: &Mesh, out: &mut Vec<[u8; 4]>) -> [u32; 4] {
    let Some((texture, count)) = texture_of(mesh) else {
        return [0; 4];
    };
    let first = out.len() as u32;
    let (mut width, mut height) = (texture.width, texture.height);
    let mut texels = texture.texels[..count as usize].to_vec();
    let mut levels = 1;
    out.extend(&texels);
    while width > 1 || height > 1 {
        let (w, h) = ((width / 2).max(1), (height / 2).max(1));
        let at = |x: u32, y: u32| texels[(y.min(height - 1) * width + x.min(width - 1)) as usize];
        let coarser = (0..w * h).map(|index| {
            let (x, y) = (2 * (index % w), 2 * (index / w));
            let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            std::array::from_fn(|channel| {
                let sum: u32 = four.iter().map(|texel| u32::from(texel[channel])).sum();
                ((sum + 2) / 4) as u8
            })
        });
        texels = coarser.collect();
        (width, height, levels) = (w, h, levels + 1);
        out.extend(&texels);
    }
    [first, texture.width, texture.height, levels]
}
