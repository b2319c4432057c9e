//! Meshes made in code, as the text of OBJ files.

use std::fmt::Write;

use glam::Vec3;
use sabaki::anim::{JointTransform, Skeleton};

/// Vertices and faces, written as an OBJ file.
#[derive(Default)]
pub struct Shape {
    pub places: Vec<Vec3>,
    /// Triangles, or the start of a group.
    pub lines: Vec<Line>,
}

pub enum Line {
    Group(String),
    Face([usize; 3]),
}

impl Shape {
    /// A tube with round ends, closed, its triangles' normals outwards.
    pub fn capsule(&mut self, from: Vec3, to: Vec3, radius: f32, around: usize) {
        let axis = (to - from).normalize_or(Vec3::Y);
        let side = axis.any_orthonormal_vector();
        let other = axis.cross(side);
        let rings = around / 2;
        let length = from.distance(to);
        let tube = (length / radius * around as f32 / 16.0).ceil().max(1.0) as usize;
        let mut profile = Vec::new();
        for ring in 1..=rings {
            let angle = std::f32::consts::FRAC_PI_2 * ring as f32 / rings as f32;
            profile.push((-angle.cos() * radius, angle.sin() * radius));
        }
        for step in 1..=tube {
            profile.push((length * step as f32 / tube as f32, radius));
        }
        for ring in 1..rings {
            let angle = std::f32::consts::FRAC_PI_2 * ring as f32 / rings as f32;
            profile.push((length + angle.sin() * radius, angle.cos() * radius));
        }
        let first = self.places.len();
        for &(along, out) in &profile {
            for step in 0..around {
                let angle = std::f32::consts::TAU * step as f32 / around as f32;
                let round = side * angle.cos() + other * angle.sin();
                self.places.push(from + axis * along + round * out);
            }
        }
        let (bottom, top) = (self.places.len(), self.places.len() + 1);
        self.places
            .extend([from - axis * radius, to + axis * radius]);
        let at = |ring: usize, step: usize| first + ring * around + step % around;
        for step in 0..around {
            self.face([bottom, at(0, step + 1), at(0, step)]);
            for ring in 1..profile.len() {
                self.face([at(ring - 1, step), at(ring - 1, step + 1), at(ring, step)]);
                self.face([at(ring - 1, step + 1), at(ring, step + 1), at(ring, step)]);
            }
            self.face([
                top,
                at(profile.len() - 1, step),
                at(profile.len() - 1, step + 1),
            ]);
        }
    }

    /// A closed capsule as modelling programs write one: a grid of `around` by `rings` quads whose seam and poles have a vertex for
    /// each column, welded nowhere. Half of the quads at the poles have no area.
    pub fn shell(&mut self, [from, to]: [Vec3; 2], radius: f32, [around, rings]: [usize; 2]) {
        let axis = (to - from).normalize_or(Vec3::Y);
        let side = axis.any_orthonormal_vector();
        let other = axis.cross(side);
        let first = self.places.len();
        for ring in 0..=rings {
            let angle = std::f32::consts::PI * (ring as f32 / rings as f32 - 0.5);
            let centre = if 2 * ring < rings { from } else { to };
            for step in 0..=around {
                let turn = std::f32::consts::TAU * step as f32 / around as f32;
                let round = side * turn.cos() + other * turn.sin();
                let out = axis * angle.sin() + round * angle.cos();
                self.places.push(centre + radius * out);
            }
        }
        for ring in 0..rings {
            for step in 0..around {
                let [a, b] = [ring, ring + 1].map(|ring| first + ring * (around + 1) + step);
                self.face([a, a + 1, b]);
                self.face([a + 1, b + 1, b]);
            }
        }
    }

    pub fn face(&mut self, face: [usize; 3]) {
        self.lines.push(Line::Face(face));
    }

    pub fn group(&mut self, name: &str) {
        self.lines.push(Line::Group(name.to_owned()));
    }

    /// A man of tubes: one for each bone that is not very short. `radius` gives a bone's by the name of its end.
    pub fn man(
        skeleton: &Skeleton,
        joints: &[JointTransform],
        radius: impl Fn(&str) -> f32,
    ) -> Self {
        let mut shape = Self::default();
        for id in skeleton.ids().skip(1) {
            let joint = skeleton.joint(id);
            let from = joints[joint.parent.unwrap().index()].translation;
            let to = joints[id.index()].translation;
            if from.distance(to) > 0.02 {
                shape.capsule(from, to, radius(&joint.name), 16);
            }
        }
        shape
    }

    pub fn triangles(&self) -> Vec<[usize; 3]> {
        let face = |line: &Line| match line {
            Line::Face(face) => Some(*face),
            Line::Group(_) => None,
        };
        self.lines.iter().filter_map(face).collect()
    }

    /// The text of an OBJ file, lengths divided by `metres_per_unit`.
    pub fn obj(&self, metres_per_unit: f32) -> String {
        let mut text = String::from("# made by a test\n");
        for place in &self.places {
            let Vec3 { x, y, z } = *place / metres_per_unit;
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        for line in &self.lines {
            match line {
                Line::Group(name) => writeln!(text, "g {name}").unwrap(),
                Line::Face([a, b, c]) => writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap(),
            }
        }
        text
    }
}
