//! Index buffers of capsule meshes. `view_capsule.glsl` computes the vertices from their numbers.

use crate::scene::Detail;

/// Resolution of a mesh, and its range of indices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mesh {
    pub(super) segments: u32,
    /// Number of rings from a pole to the cylinder part.
    pub(super) rings: u32,
    pub(super) first_index: u32,
    pub(super) indices: u32,
}

/// Segments and rings for each [`Detail`].
const SIZES: [(u32, u32); 4] = [(24, 7), (10, 3), (5, 1), (5, 1)];

/// All meshes and their shared index buffer.
#[derive(Clone, Debug, Default)]
pub(super) struct Meshes {
    meshes: Vec<Mesh>,
    pub(super) indices: Vec<u16>,
}

impl Meshes {
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
            all.meshes.push(Mesh {
                segments,
                rings,
                first_index,
                indices: all.indices.len() as u32 - first_index,
            });
        }
        all
    }

    pub(super) fn of(&self, detail: Detail) -> Mesh {
        self.meshes[detail as usize]
    }
}
