//! A mesh's triangles with the long ones cut into pieces.
//!
//! Source: Rivara, "Algorithms for Refining Triangular Grids Suitable for Adaptive and Multigrid Techniques" (1984): a triangle is
//! halved at the middle of its longest edge, and each half again, until no edge is longer than wanted. Differs: neighbours are not
//! cut with it, since a sum over solid angles needs no shared corners.

use glam::Vec3;

use super::Mesh;

/// Maximum number of pieces beyond the mesh's triangles. The allowed length is doubled until they suffice.
const MOST_ADDED: usize = 150_000;
/// Minimum length of an edge that is halved, as a share of the mesh's size.
const SHORTEST: f32 = 1.0 / 256.0;

/// The corners of all pieces, with the orientation of their triangles.
pub(super) fn pieces(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    let (low, high) = mesh.bounds();
    let triangles = || (0..mesh.triangles().len()).map(|triangle| mesh.corners(triangle));
    let most = mesh.triangles().len() + MOST_ADDED;
    let mut length = low.distance(high) * SHORTEST;
    loop {
        let mut pieces = Vec::with_capacity(mesh.triangles().len());
        let mut take = |piece| {
            pieces.push(piece);
            pieces.len() < most
        };
        if triangles().all(|corners| cut(corners, length, &mut take)) {
            return pieces;
        }
        length *= 2.0;
    }
}

/// Gives the pieces of a triangle to `take`, until that returns false. Returns whether it took all.
pub(super) fn cut(
    corners: [Vec3; 3],
    length: f32,
    take: &mut impl FnMut([Vec3; 3]) -> bool,
) -> bool {
    let mut open = vec![corners];
    while let Some([a, b, c]) = open.pop() {
        // Turned so that the longest edge is from a to b.
        let edges = [a.distance(b), b.distance(c), c.distance(a)];
        let [a, b, c] = if edges[0] >= edges[1] && edges[0] >= edges[2] {
            [a, b, c]
        } else if edges[1] >= edges[2] {
            [b, c, a]
        } else {
            [c, a, b]
        };
        let middle = 0.5 * (a + b);
        // Far from the origin an edge may be too short to have a middle.
        if a.distance(b) <= length || middle == a || middle == b {
            if !take([a, b, c]) {
                return false;
            }
        } else {
            open.extend([[middle, b, c], [a, middle, c]]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area([a, b, c]: [Vec3; 3]) -> Vec3 {
        0.5 * (b - a).cross(c - a)
    }

    #[test]
    fn pieces_are_short_and_make_up_their_triangle() {
        let triangle = [
            Vec3::ZERO,
            Vec3::new(0.4, 0.1, 0.0),
            Vec3::new(0.39, 0.1, 0.004),
        ];
        let mut found = Vec::new();
        assert!(cut(triangle, 0.02, &mut |piece| {
            found.push(piece);
            true
        }));
        assert!(found.len() > 20 && found.len() <= 256, "{}", found.len());
        for &[a, b, c] in &found {
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            assert!(longest <= 0.02);
            assert!(area([a, b, c]).dot(area(triangle)) > 0.0);
        }
        let sum: Vec3 = found.iter().map(|&piece| area(piece)).sum();
        assert!(sum.distance(area(triangle)) < 1e-6);
    }

    #[test]
    fn a_mesh_of_long_triangles_has_a_bounded_number_of_pieces() {
        let places: Vec<Vec3> = (0..3000)
            .map(|index| Vec3::new((index % 3) as f32, (index % 7) as f32, (index % 11) as f32))
            .collect();
        let triangles: Vec<[u32; 3]> = (0..1000).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh::new(places, triangles, Vec::new()).unwrap();
        let found = pieces(&mesh);
        assert!(found.len() > 1000 && found.len() <= 1000 + MOST_ADDED);
    }
}
