use std::collections::HashMap;

use glam::{DQuat, DVec3};

use super::lines::{Line, lines};
use super::{AsfError, AsfProblem};
use sabaki::anim::{Joint, JointId, JointKind, Skeleton, SkeletonError};

/// One value of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freedom {
    /// A rotation about an axis, 0 to 2.
    Turn(usize),
    /// A translation along an axis. Only the root has them.
    Way(usize),
}

/// A bone and the joint at its start.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bone {
    pub(super) name: String,
    /// Index of the parent, or `None` for the root. Parents come before their children.
    pub(super) parent: Option<usize>,
    /// Vector from the bone's start to its end, in the file's unit.
    along: DVec3,
    /// Rotation of the bone's axes.
    pub(super) axes: DQuat,
    pub(super) freedoms: Vec<Freedom>,
}

/// An ASF file: a skeleton, and the axes about which motions rotate its bones.
#[derive(Clone, Debug, PartialEq)]
pub struct AsfFile {
    /// Bones, the root first.
    pub(super) bones: Vec<Bone>,
    /// Whether angles are in degrees, unless the motion says otherwise.
    pub(super) degrees: bool,
    /// Offset that is added to the root's position.
    pub(super) position: DVec3,
}

impl AsfFile {
    /// Parses a file.
    ///
    /// # Errors
    /// The first error, with its line.
    pub fn parse(bytes: &[u8]) -> Result<Self, AsfError> {
        let mut reader = Reader {
            degrees: true,
            root: Part {
                name: "root".to_owned(),
                ..Part::default()
            },
            bones: Vec::new(),
            hierarchy: Vec::new(),
            open: None,
        };
        let (mut section, mut last) = ("", None);
        for line in lines(bytes)? {
            match line.first().strip_prefix(':') {
                Some(name) => section = name,
                None => reader.line(section, line)?,
            }
            last = Some(line);
        }
        let end = last.ok_or(AsfError {
            line: 1,
            problem: AsfProblem::Missing(":root"),
        })?;
        reader.finish(end)
    }

    /// The skeleton in metres, if `metres_per_unit` is correct. Each bone has a joint at its start.
    /// Each bone without children also has an end site at its end.
    ///
    /// # Errors
    /// The scale makes an offset too large, or there are too many joints.
    pub fn skeleton(&self, metres_per_unit: f64) -> Result<Skeleton, SkeletonError> {
        let offset = |along: DVec3| (along * metres_per_unit).as_vec3();
        let joint = |bone: &Bone| Joint {
            name: bone.name.clone(),
            parent: bone.parent.map(|parent| JointId(parent as u16)),
            offset: offset(
                bone.parent
                    .map_or(DVec3::ZERO, |parent| self.bones[parent].along),
            ),
            kind: JointKind::Moving,
        };
        let mut joints: Vec<Joint> = self.bones.iter().map(joint).collect();
        let mut is_leaf = vec![true; self.bones.len()];
        for parent in self.bones.iter().filter_map(|bone| bone.parent) {
            is_leaf[parent] = false;
        }
        for (index, bone) in self
            .bones
            .iter()
            .enumerate()
            .skip(1)
            .filter(|(i, _)| is_leaf[*i])
        {
            joints.push(Joint {
                name: format!("{}_End", bone.name),
                parent: Some(JointId(index as u16)),
                offset: offset(bone.along),
                kind: JointKind::EndSite,
            });
        }
        Skeleton::new(joints)
    }
}

/// A bone as it is written in the file.
#[derive(Clone, Debug, Default)]
struct Part {
    name: String,
    direction: DVec3,
    length: f64,
    /// Rotations of the axes, the first one applied first.
    axis: Option<(DVec3, [usize; 3])>,
    freedoms: Vec<Freedom>,
    position: DVec3,
    orientation: DVec3,
}

/// State of the parser.
struct Reader<'a> {
    degrees: bool,
    root: Part,
    bones: Vec<Part>,
    /// Child, parent and their line in the file.
    hierarchy: Vec<(&'a str, &'a str, Line<'a>)>,
    open: Option<Part>,
}

impl<'a> Reader<'a> {
    fn line(&mut self, section: &str, line: Line<'a>) -> Result<(), AsfError> {
        match section.to_ascii_lowercase().as_str() {
            "units" => self.unit(line),
            "root" => self.of_root(line),
            "bonedata" => self.of_bone(line),
            "hierarchy" => self.of_hierarchy(line),
            // Names, documentation and meshes are ignored.
            _ => Ok(()),
        }
    }

    fn unit(&mut self, line: Line<'_>) -> Result<(), AsfError> {
        let mut words = line.words();
        if words
            .next()
            .is_some_and(|word| word.eq_ignore_ascii_case("angle"))
        {
            self.degrees = match words.next() {
                Some(word) if word.eq_ignore_ascii_case("deg") => true,
                Some(word) if word.eq_ignore_ascii_case("rad") => false,
                found => return Err(line.expected("deg or rad", found)),
            };
        }
        Ok(())
    }

    fn of_root(&mut self, line: Line<'_>) -> Result<(), AsfError> {
        match line.first().to_ascii_lowercase().as_str() {
            "order" => self.root.freedoms = freedoms(line, "root")?,
            "axis" => self.root.axis = Some((DVec3::ZERO, order(line, line.words().nth(1))?)),
            "position" => self.root.position = line.vector()?,
            "orientation" => self.root.orientation = line.vector()?,
            _ => {}
        }
        Ok(())
    }

    fn of_bone(&mut self, line: Line<'_>) -> Result<(), AsfError> {
        let word = line.first().to_ascii_lowercase();
        let Some(bone) = &mut self.open else {
            return match word.as_str() {
                "begin" => {
                    self.open = Some(Part::default());
                    Ok(())
                }
                _ => Err(line.expected("begin", Some(line.first()))),
            };
        };
        match word.as_str() {
            "name" => match line.words().nth(1) {
                Some(name) => name.clone_into(&mut bone.name),
                None => return Err(line.expected("a name", None)),
            },
            "direction" => bone.direction = line.vector()?,
            "length" => bone.length = line.number(line.words().nth(1))?,
            "axis" => bone.axis = Some((line.vector()?, order(line, line.words().nth(4))?)),
            "dof" => bone.freedoms = freedoms(line, &bone.name)?,
            "end" => return self.close(line),
            // The bone's number is ignored, and so are limits, which motions respect anyway.
            _ => {}
        }
        Ok(())
    }

    fn close(&mut self, line: Line<'_>) -> Result<(), AsfError> {
        let Some(bone) = self.open.take() else {
            return Ok(());
        };
        if bone.name.is_empty() {
            return Err(line.error(AsfProblem::Missing("name of the bone that ends here")));
        }
        if let Some(found) = bone
            .freedoms
            .iter()
            .find(|one| matches!(one, Freedom::Way(_)))
        {
            let found = format!("{found:?}");
            return Err(line.error(AsfProblem::Freedom {
                bone: bone.name,
                found,
            }));
        }
        if self.bones.len() + 1 >= Skeleton::MAX_JOINTS {
            return Err(line.error(AsfProblem::TooManyJoints));
        }
        self.bones.push(bone);
        Ok(())
    }

    fn of_hierarchy(&mut self, line: Line<'a>) -> Result<(), AsfError> {
        let mut words = line.words();
        let parent = words.next().unwrap_or("");
        if !["begin", "end"].contains(&parent) {
            self.hierarchy
                .extend(words.map(|child| (child, parent, line)));
        }
        Ok(())
    }

    fn finish(self, end: Line<'_>) -> Result<AsfFile, AsfError> {
        if self.open.is_some() {
            return Err(end.error(AsfProblem::Missing("end of its last bone")));
        }
        if self.root.freedoms.is_empty() {
            return Err(end.error(AsfProblem::Missing("order of the root")));
        }
        let mut numbers = HashMap::from([("root", 0usize)]);
        for (part, index) in self.bones.iter().zip(1..) {
            if numbers.insert(part.name.as_str(), index).is_some() {
                return Err(end.error(AsfProblem::Twice(part.name.clone())));
            }
        }
        let mut parents = vec![None; self.bones.len() + 1];
        for &(child, parent, line) in &self.hierarchy {
            let find = |name: &str| {
                let found = numbers.get(name).copied();
                found.ok_or_else(|| line.error(AsfProblem::NoBone(name.to_owned())))
            };
            let (child_index, parent) = (find(child)?, find(parent)?);
            if child_index == 0 || parents[child_index].replace(parent).is_some() {
                return Err(line.error(AsfProblem::Twice(child.to_owned())));
            }
        }
        let order = breadth_first(&parents);
        if let Some(loose) = (1..parents.len()).find(|index| !order.contains(index)) {
            let name = self.bones[loose - 1].name.clone();
            return Err(end.error(AsfProblem::Loose(name)));
        }
        let mut places = vec![0; parents.len()];
        for (place, &index) in order.iter().enumerate() {
            places[index] = place;
        }
        let all: Vec<&Part> = std::iter::once(&self.root).chain(&self.bones).collect();
        let bone = |&index: &usize| {
            let part = all[index];
            let (angles, order) = part.axis.unwrap_or((DVec3::ZERO, [0, 1, 2]));
            let angles = if index == 0 { part.orientation } else { angles };
            Bone {
                name: part.name.clone(),
                parent: parents[index].map(|parent: usize| places[parent]),
                along: part.direction.normalize_or_zero() * part.length,
                axes: order.iter().fold(DQuat::IDENTITY, |so_far, &axis| {
                    turn(axis, angles[axis], self.degrees) * so_far
                }),
                freedoms: part.freedoms.clone(),
            }
        };
        let file = AsfFile {
            bones: order.iter().map(bone).collect(),
            degrees: self.degrees,
            position: self.root.position,
        };
        match file.skeleton(1.0) {
            Ok(_) => Ok(file),
            Err(error) => Err(end.error(error.into())),
        }
    }
}

/// Orders the bones breadth first from the root. Bones that are not connected to the root are left
/// out.
fn breadth_first(parents: &[Option<usize>]) -> Vec<usize> {
    let mut children = vec![Vec::new(); parents.len()];
    for (child, parent) in parents.iter().enumerate() {
        if let Some(parent) = parent {
            children[*parent].push(child);
        }
    }
    let mut order = vec![0];
    let mut at = 0;
    while at < order.len() {
        order.append(&mut children[order[at]]);
        at += 1;
    }
    order
}

/// Rotation about an axis, 0 to 2.
pub(super) fn turn(axis: usize, angle: f64, degrees: bool) -> DQuat {
    let angle = if degrees { angle.to_radians() } else { angle };
    DQuat::from_axis_angle(DVec3::AXES[axis], angle)
}

/// Parses an order of axes, for example `XYZ`.
fn order(line: Line<'_>, word: Option<&str>) -> Result<[usize; 3], AsfError> {
    let axis = |letter: u8| {
        b"XYZ"
            .iter()
            .position(|&name| name == letter.to_ascii_uppercase())
    };
    let found: Option<Vec<usize>> = word.unwrap_or("XYZ").bytes().map(axis).collect();
    match found.as_deref() {
        Some(&[a, b, c]) if a != b && b != c && a != c => Ok([a, b, c]),
        _ => Err(line.expected("an order of X, Y and Z", word)),
    }
}

/// Parses the words after `dof` or `order`.
fn freedoms(line: Line<'_>, bone: &str) -> Result<Vec<Freedom>, AsfError> {
    let mut found = Vec::new();
    for word in line.words().skip(1) {
        let freedom = match word.to_ascii_lowercase().as_str() {
            "rx" => Freedom::Turn(0),
            "ry" => Freedom::Turn(1),
            "rz" => Freedom::Turn(2),
            "tx" => Freedom::Way(0),
            "ty" => Freedom::Way(1),
            "tz" => Freedom::Way(2),
            _ => {
                let (bone, found) = (bone.to_owned(), word.to_owned());
                return Err(line.error(AsfProblem::Freedom { bone, found }));
            }
        };
        if found.contains(&freedom) {
            return Err(line.error(AsfProblem::Twice(word.to_owned())));
        }
        found.push(freedom);
    }
    Ok(found)
}
