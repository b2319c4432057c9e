use std::ops::Range;

use glam::Vec3;
use thiserror::Error;

use sabaki::anim::{JointTransform, Skeleton};

/// Triangles in space: a body's skin, a staff, a sword. They need not be closed, nor of one orientation, nor manifold.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<MeshPart>,
}

/// A stretch of a mesh's triangles that has a name, as an OBJ file's groups and objects have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshPart {
    /// As the file has it.
    pub name: String,
    /// Which triangles.
    pub triangles: Range<u32>,
}

/// Why data are no mesh. Vertices and triangles are counted from 0.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshError {
    /// There is no triangle.
    #[error("the mesh has no faces")]
    Empty,
    /// More triangles than a fit takes.
    #[error("the mesh has {0} triangles; {max} is the most: decimate it", max = Mesh::MOST_TRIANGLES)]
    TooMany(usize),
    /// A place is NaN, infinite or further away than [`Skeleton::FURTHEST`].
    #[error("vertex {vertex} at {place} is not within {max} units of the origin", max = Skeleton::FURTHEST)]
    Far {
        /// Its index.
        vertex: usize,
        /// Where it is.
        place: Vec3,
    },
    /// A triangle, or a part, names what is not there.
    #[error("triangle {0} has a vertex that does not exist, or a part such a triangle")]
    Index(usize),
    /// A placement's scale is not above 0, or its rotation or translation not finite.
    #[error(
        "a mesh cannot be placed by a scale of {scale} and {translation}: not finite, or not above 0"
    )]
    Placement {
        /// Factor.
        scale: f32,
        /// Metres.
        translation: Vec3,
    },
}

impl Mesh {
    /// More are refused, so that a fit ends in seconds.
    pub const MOST_TRIANGLES: usize = 1_000_000;

    /// Checks positions and indices. `parts` may be empty, and may leave triangles out.
    ///
    /// # Errors
    /// The first vertex or triangle that is wrong.
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

    /// The vertices.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Three vertices each, counter-clockwise seen from outside where the mesh has an outside; a fit does without that.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Stretches of triangles that have names.
    #[must_use]
    pub fn parts(&self) -> &[MeshPart] {
        &self.parts
    }

    /// The corners of a triangle.
    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }

    /// The lowest and highest corner of the box around all triangles.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let used = self.triangles.iter().flatten();
        let places = used.map(|&vertex| self.positions[vertex as usize]);
        places.fold(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |(low, high), place| (low.min(place), high.max(place)),
        )
    }

    /// The mesh scaled about the origin, then turned and moved: from its own units and axes into metres, in the space of the bind
    /// pose or in a hand's frame.
    ///
    /// # Errors
    /// A placement that is not finite, or that takes a vertex too far away.
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

    /// How far to move the mesh so that it stands where `joints` do: the middles of both boxes over one another, the soles as
    /// high as the lowest joint. For meshes whose origin lies between the feet and skeletons whose origin lies in the hips.
    #[must_use]
    pub fn to_stand_at(&self, joints: &[JointTransform]) -> Vec3 {
        let places = joints.iter().map(|joint| joint.translation);
        let (low, high) = places.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        let own = self.bounds();
        let middle = 0.5 * (low + high) - 0.5 * (own.0 + own.1);
        Vec3::new(middle.x, low.y - own.0.y, middle.z)
    }
}
