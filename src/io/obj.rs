use std::path::Path;

use thiserror::Error;
use tobj::LoadOptions;

use super::ReadError;
use super::read::read_bytes;
use crate::region::fit::{Mesh, MeshError, MeshPart};

/// Why an OBJ file holds no mesh.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ObjError {
    /// The text is no OBJ; what the reader says, which does not know the line.
    #[error("not an OBJ mesh: {0}")]
    Text(String),
    /// The mesh has no faces, a bad vertex, or too much of something.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// The mesh of an OBJ text, in the text's own units and axes. Polygons become fans of triangles; each group or object is a part;
/// lines, points and materials are passed over, and so are vertices that no face uses.
///
/// # Errors
/// What is wrong.
pub fn parse_obj(text: &[u8]) -> Result<Mesh, ObjError> {
    let options = LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    // Editors put a byte order mark before the first line.
    let mut text = text.strip_prefix("\u{FEFF}".as_bytes()).unwrap_or(text);
    let no_materials = |_: &Path| Ok(Default::default());
    let read = tobj::load_obj_buf(&mut text, &options, no_materials);
    let (models, _) = read.map_err(|error| ObjError::Text(error.to_string()))?;
    let (mut positions, mut triangles, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    for model in models {
        let (first, start) = (positions.len() as u32, triangles.len() as u32);
        positions.extend(
            model
                .mesh
                .positions
                .chunks_exact(3)
                .map(glam::Vec3::from_slice),
        );
        let corners = model.mesh.indices.chunks_exact(3);
        triangles
            .extend(corners.map(|t| [t[0], t[1], t[2]].map(|vertex| first.saturating_add(vertex))));
        let triangles = start..triangles.len() as u32;
        parts.push(MeshPart {
            name: model.name,
            triangles,
        });
    }
    Ok(Mesh::new(positions, triangles, parts)?)
}

/// Reads an OBJ file, in its own units and axes.
///
/// # Errors
/// What is wrong, with the file.
pub fn read_obj(path: &Path) -> Result<Mesh, ReadError> {
    parse_obj(&read_bytes(path)?).map_err(|error| ReadError::Obj {
        path: path.to_owned(),
        error,
    })
}
