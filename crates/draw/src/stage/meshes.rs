//! Meshes on the device: a capsule, and the skinned meshes with the commands that draw them.

use ash::vk;

use super::StageDesc;
use crate::scene::{Mesh, MeshTexture, MeshVertex};
use sabaki::gpu::internal::{Buffer, BufferDesc, DeviceMemory, within};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};

/// Segments of a capsule, and rings from a pole to the cylinder part. `view_capsule.glsl` computes the vertices from their numbers.
pub(super) const SEGMENTS: u32 = 24;
pub(super) const RINGS: u32 = 7;

/// Indices of a capsule: two triangles between each pair of rings and segments, counter-clockwise seen from outside.
pub(super) fn capsule_indices() -> Vec<u16> {
    let at = |ring: u32, segment: u32| (ring * SEGMENTS + segment % SEGMENTS) as u16;
    let quads = (0..2 * RINGS + 1).flat_map(|ring| (0..SEGMENTS).map(move |at| (ring, at)));
    let triangles = quads.flat_map(|(ring, segment)| {
        let (a, b) = (at(ring, segment), at(ring, segment + 1));
        let (c, d) = (at(ring + 1, segment), at(ring + 1, segment + 1));
        [a, d, b, a, c, d]
    });
    triangles.collect()
}

/// Place of a mesh in the buffers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) first_vertex: i32,
    /// First index and number of indices of each resolution.
    pub(super) details: [(u32, u32); Mesh::DETAILS],
    /// First texel, width, height and number of levels.
    pub(super) texture: [u32; 4],
    /// Number of bones that the vertices refer to.
    pub(super) bones: u32,
}

/// All meshes of a stage. Handles are null by default.
#[derive(Debug, Default)]
pub(super) struct Skins {
    pub(super) vertices: Buffer,
    pub(super) indices: Buffer,
    pub(super) texels: Buffer,
    pub(super) places: Vec<Place>,
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
