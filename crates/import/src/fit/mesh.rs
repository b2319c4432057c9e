use std::ops::Range;

use glam::Vec3;
use thiserror::Error;

use sabaki::anim::{JointTransform, Skeleton};

/// A triangle mesh, for example a body's skin, a staff or a sword. It need not be closed,
/// consistently oriented or manifold.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<MeshPart>,
}

/// A named range of a mesh's triangles, for example a group or an object of an OBJ file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshPart {
    /// Name in the file.
    pub name: String,
    /// Range of triangles.
    pub triangles: Range<u32>,
}

/// Reason why a mesh is invalid. Vertices and triangles are counted from 0.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshError {
    /// There are no triangles.
    #[error("the mesh has no faces")]
    Empty,
    /// There are more triangles than the maximum.
    #[error("the mesh has {0} triangles; {max} is the most: decimate it", max = Mesh::MOST_TRIANGLES)]
    TooMany(usize),
    /// A position is not finite or farther away than [`Skeleton::FURTHEST`].
    #[error("vertex {vertex} at {place} is not within {max} units of the origin", max = Skeleton::FURTHEST)]
    Far {
        /// Index of the vertex.
        vertex: usize,
        /// Position of the vertex.
        place: Vec3,
    },
    /// A triangle or a part has an index out of range.
    #[error("triangle {0} has a vertex that does not exist, or a part such a triangle")]
    Index(usize),
    /// A scale is not positive, or a rotation or translation is not finite.
    #[error(
        "a mesh cannot be placed by a scale of {scale} and {translation}: not finite, or not above 0"
    )]
    Placement {
        /// Scale factor.
        scale: f32,
        /// Translation, in metres.
        translation: Vec3,
    },
}

impl Mesh {
    /// Maximum number of triangles. It keeps the time of a fit within seconds.
    pub const MOST_TRIANGLES: usize = 1_000_000;

    /// Creates a mesh after checking positions and indices. `parts` may be empty, and need not
    /// contain all triangles.
    ///
    /// # Errors
    /// The first invalid vertex or triangle.
    pub fn new(
        positions: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        parts: Vec<MeshPart>,
    ) -> Result<Self, MeshError> {
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if triangles.len() > Self::MOST_TRIANGLES {
            return Err(MeshError::TooMany(triangles.len()));
        }
        if let Some(vertex) = positions.iter().position(|&p| !Skeleton::is_near(p)) {
            let place = positions[vertex];
            return Err(MeshError::Far { vertex, place });
        }
        let is_bad = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= positions.len());
        if let Some(triangle) = triangles.iter().position(is_bad) {
            return Err(MeshError::Index(triangle));
        }
        let ends = |part: &&MeshPart| part.triangles.end as usize > triangles.len();
        if let Some(part) = parts.iter().find(ends) {
            return Err(MeshError::Index(part.triangles.end as usize));
        }
        Ok(Self {
            positions,
            triangles,
            parts,
        })
    }

    /// Positions of the vertices.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Vertex indices of the triangles. Triangles of closed meshes are usually counter-clockwise
    /// seen from outside, but a fit does not depend on that.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Named ranges of triangles.
    pub fn parts(&self) -> &[MeshPart] {
        &self.parts
    }

    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }

    /// Minimum and maximum corner of the box around all triangles.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let used = self.triangles.iter().flatten();
        bounds(used.map(|&vertex| self.positions[vertex as usize]))
    }

    /// Returns the mesh scaled about the origin, then rotated and translated. It converts the mesh
    /// from its own units and axes to metres in the space of the bind pose or in a hand's frame.
    ///
    /// # Errors
    /// The placement is not finite, or it moves a vertex too far away.
    pub fn placed(&self, scale: f32, place: JointTransform) -> Result<Self, MeshError> {
        let JointTransform {
            rotation,
            translation,
        } = place;
        let turns = (rotation.length_squared() - 1.0).abs() < 1e-3;
        if !(scale > 0.0 && scale.is_finite() && turns && Skeleton::is_near(translation)) {
            return Err(MeshError::Placement { scale, translation });
        }
        let positions = self
            .positions
            .iter()
            .map(|&p| place.point(p * scale))
            .collect();
        Self::new(positions, self.triangles.clone(), self.parts.clone())
    }

    /// Translation that aligns the mesh with `joints`: the centres of both boxes coincide on the
    /// ground, and the lowest vertex is as high as the lowest joint. It serves meshes with their
    /// origin between the feet and skeletons with their origin in the hips.
    pub fn to_stand_at(&self, joints: &[JointTransform]) -> Vec3 {
        let (low, high) = bounds(joints.iter().map(|joint| joint.translation));
        let own = self.bounds();
        let middle = 0.5 * (low + high) - 0.5 * (own.0 + own.1);
        Vec3::new(middle.x, low.y - own.0.y, middle.z)
    }
}

/// Minimum and maximum corner of the box around places.
pub(crate) fn bounds(places: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    places.fold(none, |(low, high), place| (low.min(place), high.max(place)))
}
