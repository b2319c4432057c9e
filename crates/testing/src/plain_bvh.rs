//! A BVH reader that shares nothing with the library's: words between spaces, f64, matrices.

pub type V3 = [f64; 3];

pub fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub fn scaled(a: V3, by: f64) -> V3 {
    a.map(|value| value * by)
}

pub fn lerp(a: V3, b: V3, share: f64) -> V3 {
    add(scaled(a, 1.0 - share), scaled(b, share))
}

pub fn apart(a: V3, b: V3) -> f64 {
    let d = add(a, scaled(b, -1.0));
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}

/// Rows of a rotation matrix.
#[derive(Clone, Copy)]
pub struct Turn([V3; 3]);

impl Turn {
    const NONE: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);

    fn about(axis: char, degrees: f64) -> Self {
        let (s, c) = degrees.to_radians().sin_cos();
        Self(match axis {
            'X' => [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
            'Y' => [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
            _ => [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
        })
    }

    pub fn apply(&self, v: V3) -> V3 {
        self.0
            .map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    fn then_inner(&self, inner: &Self) -> Self {
        let column = |c: usize| self.apply([inner.0[0][c], inner.0[1][c], inner.0[2][c]]);
        let columns = [column(0), column(1), column(2)];
        Self([0, 1, 2].map(|row| [columns[0][row], columns[1][row], columns[2][row]]))
    }
}

struct Joint {
    name: String,
    parent: Option<usize>,
    offset: V3,
    channels: Vec<String>,
}

/// A motion as its file has it.
pub struct PlainBvh {
    joints: Vec<Joint>,
    values: Vec<Vec<f64>>,
    pub frame_time: f64,
}

impl PlainBvh {
    pub fn parse(text: &str) -> Self {
        let (tree, motion) = text.split_once("MOTION").unwrap();
        let joints = joints(tree);
        let mut words = motion.split_whitespace();
        let mut labelled = |label: &[&str]| -> f64 {
            label
                .iter()
                .for_each(|&word| assert_eq!(words.next(), Some(word)));
            words.next().unwrap().parse().unwrap()
        };
        let frames = labelled(&["Frames:"]) as usize;
        let frame_time = labelled(&["Frame", "Time:"]);
        let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        let channels: usize = joints.iter().map(|joint| joint.channels.len()).sum();
        assert_eq!(numbers.len(), frames * channels);
        let values = numbers.chunks(channels).map(<[f64]>::to_vec).collect();
        Self {
            joints,
            values,
            frame_time,
        }
    }

    pub fn frames(&self) -> usize {
        self.values.len()
    }

    pub fn find(&self, name: &str) -> usize {
        self.joints
            .iter()
            .position(|joint| joint.name == name)
            .unwrap()
    }

    /// Every joint's rotation and place in the world, in the file's unit.
    pub fn joints_at(&self, frame: usize) -> Vec<(Turn, V3)> {
        let mut values = self.values[frame].iter().copied();
        let mut placed: Vec<(Turn, V3)> = Vec::new();
        for joint in &self.joints {
            let (mut turn, mut offset) = (Turn::NONE, joint.offset);
            for channel in &joint.channels {
                let value = values.next().unwrap();
                let axis = channel.chars().next().unwrap();
                if channel.ends_with("position") {
                    offset[axis as usize - 'X' as usize] = value;
                } else {
                    turn = turn.then_inner(&Turn::about(axis, value));
                }
            }
            placed.push(match joint.parent {
                None => (turn, offset),
                Some(parent) => {
                    let (above, place) = &placed[parent];
                    (above.then_inner(&turn), add(*place, above.apply(offset)))
                }
            });
        }
        placed
    }
}

fn joints(tree: &str) -> Vec<Joint> {
    let (mut joints, mut open): (Vec<Joint>, Vec<usize>) = (Vec::new(), Vec::new());
    let mut words = tree.split_whitespace();
    while let Some(word) = words.next() {
        let mut next = || words.next().unwrap();
        match word {
            "ROOT" | "JOINT" | "End" => {
                let parent = open.last().copied();
                let own = next();
                let name = match (word, parent) {
                    ("End", Some(parent)) => format!("{}_End", joints[parent].name),
                    _ => own.to_owned(),
                };
                joints.push(Joint {
                    name,
                    parent,
                    offset: [0.0; 3],
                    channels: Vec::new(),
                });
            }
            "{" => open.push(joints.len() - 1),
            "}" => drop(open.pop()),
            "OFFSET" => {
                joints.last_mut().unwrap().offset = [0; 3].map(|_| next().parse().unwrap());
            }
            "CHANNELS" => {
                let count = next().parse().unwrap();
                joints.last_mut().unwrap().channels =
                    (0..count).map(|_| next().to_owned()).collect();
            }
            other => assert_eq!(other, "HIERARCHY"),
        }
    }
    joints
}
