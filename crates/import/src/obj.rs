use std::path::Path;

use earcut::Earcut;
use glam::{Vec2, Vec3};
use rustc_hash::FxHashMap;

use crate::file::{quoted, read_bytes, without_mark};
use crate::fit::{Mesh, MeshPart};
use crate::{FileError, ReadError, TextError};

/// Parses the mesh of an OBJ text, in the text's own units and axes. Convex polygons are divided into
/// triangle fans, others by ear clipping. Each group or object becomes a part. Lines, points, materials and unused vertices
/// are ignored.
///
/// # Errors
/// The first error, with its line, or that of the mesh.
pub fn parse_obj(text: &[u8]) -> Result<Mesh, FileError> {
    // Names may be in any encoding.
    let text = String::from_utf8_lossy(without_mark(text));
    let (mut reader, mut begun) = (Reader::default(), String::new());
    for (line, row) in (1..).zip(text.split('\n')) {
        let is_comment = begun.is_empty() && row.starts_with('#');
        if let Some(part) = row.trim_end().strip_suffix('\\').filter(|_| !is_comment) {
            // It goes on.
            begun.push_str(part);
            begun.push(' ');
            continue;
        }
        begun.push_str(row);
        reader.read(&begun).map_err(|message| TextError {
            line,
            column: None,
            message,
        })?;
        begun.clear();
    }
    reader.end_part("");
    Ok(Mesh::new(reader.positions, reader.triangles, reader.parts)?)
}

/// What was read so far.
#[derive(Default)]
struct Reader {
    /// All vertices of the text.
    vertices: Vec<Vec3>,
    /// The vertices of faces, part by part.
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Parts that have ended, and the name of the one that has not.
    parts: Vec<MeshPart>,
    name: String,
    /// Of the vertices of the current part, the indices of their positions.
    used: FxHashMap<usize, u32>,
}

impl Reader {
    fn read(&mut self, row: &str) -> Result<(), String> {
        let mut words = row.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || {
                    let word = words.next().unwrap_or_default();
                    let expected = || format!("expected a coordinate, found {}", quoted(word));
                    word.parse().map_err(|_| expected())
                };
                self.vertices.push(Vec3::new(next()?, next()?, next()?));
            }
            Some("f") => {
                let corners = words.map(|word| self.vertex(word));
                let corners: Vec<usize> = corners.collect::<Result<_, String>>()?;
                if corners.len() > 2 {
                    let face: Vec<u32> = corners.into_iter().map(|at| self.position(at)).collect();
                    divide(&face, &self.positions, |triangle| {
                        self.triangles.push(triangle)
                    });
                }
            }
            Some("g" | "o") => self.end_part(row.trim()[1..].trim()),
            // Textures, normals, lines, points and materials.
            _ => {}
        }
        Ok(())
    }

    /// Index of the vertex that a corner (`7`, `7/1/2`, `-1//3`) refers to.
    fn vertex(&self, corner: &str) -> Result<usize, String> {
        let number = corner.split('/').next().unwrap_or(corner);
        let index = match number.parse::<isize>() {
            Ok(back @ ..0) => self.vertices.len().checked_add_signed(back),
            Ok(number) => usize::try_from(number - 1).ok(),
            Err(_) => None,
        };
        let index = index.filter(|&index| index < self.vertices.len());
        index.ok_or_else(|| format!("a face's corner names vertex {}", quoted(number)))
    }

    /// Index of the position of a vertex in the current part.
    fn position(&mut self, vertex: usize) -> u32 {
        let (positions, place) = (&mut self.positions, self.vertices[vertex]);
        *self.used.entry(vertex).or_insert_with(|| {
            positions.push(place);
            positions.len() as u32 - 1
        })
    }

    /// Ends the current part, and begins one of this name.
    fn end_part(&mut self, next: &str) {
        let start = self.parts.last().map_or(0, |part| part.triangles.end);
        let name = std::mem::replace(&mut self.name, next.to_owned());
        let triangles = start..self.triangles.len() as u32;
        if !triangles.is_empty() {
            self.parts.push(MeshPart { name, triangles });
        }
        self.used.clear();
    }
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

/// Reads an OBJ file, in its own units and axes.
///
/// # Errors
/// The first error, with the file.
pub fn read_obj(path: &Path) -> Result<Mesh, ReadError> {
    parse_obj(&read_bytes(path)?).map_err(ReadError::in_file(path))
}
