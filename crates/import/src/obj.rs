use std::path::Path;

use earcut::Earcut;
use glam::{Vec2, Vec3};
use tobj::LoadOptions;

use crate::file::{quoted, read_bytes, without_mark};
use crate::fit::{Mesh, MeshPart};
use crate::{FileError, ReadError, TextError};

/// Parses the mesh of an OBJ text, in the text's own units and axes. Convex polygons are divided into
/// triangle fans, others by ear clipping. Each group or object becomes a part. Lines, points, materials and unused vertices
/// are ignored.
///
/// # Errors
/// The first error; that of a corner of a face with its line.
pub fn parse_obj(text: &[u8]) -> Result<Mesh, FileError> {
    let options = LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    let plain = without_extras(without_mark(text))?;
    let mut text = plain.as_bytes();
    let no_materials = |_: &Path| Ok(Default::default());
    let read = tobj::load_obj_buf(&mut text, &options, no_materials);
    let (models, _) = read.map_err(|error| FileError::part("not an OBJ mesh", error))?;
    let (mut positions, mut triangles, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    for model in models {
        let (first, start) = (positions.len() as u32, triangles.len() as u32);
        let own: Vec<Vec3> = model
            .mesh
            .positions
            .chunks_exact(3)
            .map(Vec3::from_slice)
            .collect();
        let mut corners = &model.mesh.indices[..];
        let mut arities = model.mesh.face_arities.iter().map(|&arity| arity as usize);
        while let Some((face, rest)) = corners.split_at_checked(arities.next().unwrap_or(3)) {
            divide(face, &own, |triangle| {
                triangles.push(triangle.map(|vertex| first.saturating_add(vertex)));
            });
            corners = rest;
        }
        positions.extend(own);
        let triangles = start..triangles.len() as u32;
        parts.push(MeshPart {
            name: model.name,
            triangles,
        });
    }
    Ok(Mesh::new(positions, triangles, parts)?)
}

/// Divides a face into triangles that turn as it does.
fn divide(face: &[u32], positions: &[Vec3], mut add: impl FnMut([u32; 3])) {
    /// Ear clipping may take time that grows with the square of the corners.
    const MOST_CLIPPED: usize = 4096;
    let place = |corner: usize| positions[face[corner % face.len()] as usize];
    let corners = 0..face.len();
    // The normal of a polygon that need not be plane (M. Newell). Along its largest axis the polygon is seen from outside.
    let crosses = corners
        .clone()
        .map(|corner| place(corner).cross(place(corner + 1)));
    let normal: Vec3 = crosses.sum();
    let axis = normal.abs().max_position();
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (u, v) = (v, u);
    }
    let flat: Vec<Vec2> = corners
        .clone()
        .map(|corner| Vec2::new(place(corner)[u], place(corner)[v]))
        .collect();
    let area = |[a, b, c]: [usize; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| flat[corner % flat.len()]);
        (b - a).perp_dot(c - a)
    };
    let is_convex = corners
        .clone()
        .all(|corner| area([corner, corner + 1, corner + 2]) >= 0.0);
    let mut ears: Vec<usize> = Vec::new();
    if !is_convex && face.len() <= MOST_CLIPPED && flat.iter().all(|place| place.is_finite()) {
        Earcut::new().earcut(flat.iter().map(|place| place.to_array()), &[], &mut ears);
    }
    if ears.is_empty() {
        ears.extend((2..face.len()).flat_map(|corner| [0, corner - 1, corner]));
    }
    for ear in ears.as_chunks::<3>().0 {
        let [a, b, c] = ear.map(|corner| face[corner]);
        add(if area(*ear) < 0.0 && !is_convex {
            [a, c, b]
        } else {
            [a, b, c]
        });
    }
}

/// Joins continued lines. Removes textures, normals, lines and points from the text, and makes vertex indices absolute.
/// This limits the memory of the parser, which allocates before it checks indices.
fn without_extras(text: &[u8]) -> Result<String, TextError> {
    // Names may be in any encoding.
    let text = String::from_utf8_lossy(text);
    let mut plain = String::with_capacity(text.len());
    let mut vertices = 0i64;
    let mut begun = String::new();
    for (line, row) in (1..).zip(text.split('\n')) {
        let is_comment = begun.is_empty() && row.starts_with('#');
        if let Some(part) = row.trim_end().strip_suffix('\\').filter(|_| !is_comment) {
            begun.push_str(part);
            begun.push(' ');
            plain.push('\n');
            continue;
        }
        let row = match begun.is_empty() {
            true => row,
            false => &(std::mem::take(&mut begun) + row),
        };
        let mut words = row.split_whitespace();
        match words.next() {
            Some("vt" | "vn" | "l" | "p") => {}
            Some("f") => {
                plain.push('f');
                for word in words {
                    let vertex = corner(word, vertices).map_err(|found| TextError {
                        line,
                        column: None,
                        message: format!("a face's corner names vertex {}", quoted(found)),
                    })?;
                    plain.push(' ');
                    plain.push_str(&vertex.to_string());
                }
            }
            first => {
                vertices += i64::from(first == Some("v"));
                plain.push_str(row);
            }
        }
        // Line numbers are preserved, so that the parser's messages fit the file.
        plain.push('\n');
    }
    Ok(plain)
}

/// Index from 1 of the vertex that a corner (`7`, `7/1/2`, `-1//3`) refers to. An invalid corner is
/// returned as the error.
fn corner(word: &str, vertices: i64) -> Result<i64, &str> {
    let number = word.split('/').next().unwrap_or(word);
    let vertex = match number.parse() {
        Ok(back @ ..0) => vertices.saturating_add(1).saturating_add(back),
        Ok(vertex) => vertex,
        Err(_) => 0,
    };
    match (1..=i64::from(u32::MAX)).contains(&vertex) {
        true => Ok(vertex),
        false => Err(number),
    }
}

/// Reads an OBJ file, in its own units and axes.
///
/// # Errors
/// The first error, with the file.
pub fn read_obj(path: &Path) -> Result<Mesh, ReadError> {
    parse_obj(&read_bytes(path)?).map_err(ReadError::in_file(path))
}
