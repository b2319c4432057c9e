//! Determines which nodes are joints, and their hierarchy.

use std::collections::HashSet;

use glam::{DAffine3, DMat4, DQuat, DVec3, Quat, Vec3};
use gltf_json::animation::Property;
use gltf_json::validation::Checked;
use gltf_json::{Root, Skin, scene};

use super::buffers::Container;
use super::named;
use crate::FileError;
use sabaki::anim::Skeleton;

/// The tree of all nodes, and the nodes of the skeleton.
pub(super) struct Nodes {
    pub(super) parents: Vec<Option<usize>>,
    /// Number of nodes above each node, below [`Skeleton::MAX_JOINTS`].
    pub(super) depths: Vec<usize>,
    /// Nodes above the skeleton's root, from the top down. They move the skeleton as a whole.
    pub(super) above: Vec<usize>,
    /// Joints, the root first, parents before children.
    pub(super) joints: Vec<usize>,
}

/// Transform of a node relative to its parent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    pub(super) translation: Vec3,
    pub(super) rotation: Quat,
    pub(super) scale: Vec3,
}

impl Nodes {
    pub(super) fn of(root: &Root) -> Result<Self, FileError> {
        let parents = parents(&root.nodes)?;
        let order = top_down(&root.nodes, &parents);
        if order.len() < parents.len() {
            let known: HashSet<usize> = order.into_iter().collect();
            let lost = (0..parents.len()).find(|node| !known.contains(node));
            return Err(no_tree(lost.unwrap_or(0)));
        }
        let wanted = wanted(root)?;
        let &first = wanted
            .first()
            .ok_or_else(|| FileError::invalid("the file has no skin and no animated node"))?;
        // Number of wanted nodes from each node on downwards.
        let mut below = vec![0; parents.len()];
        for &node in &wanted {
            below[node] = 1;
        }
        for &node in order.iter().rev() {
            if let Some(parent) = parents[node] {
                below[parent] += below[node];
            }
        }
        let mut depths = vec![0; parents.len()];
        for &node in &order {
            depths[node] = parents[node].map_or(0, |parent| depths[parent] + 1);
        }
        if depths.iter().any(|&depth| depth >= Skeleton::MAX_JOINTS) {
            return Err(too_many_joints());
        }
        let mut nodes = Self {
            parents,
            depths,
            above: Vec::new(),
            joints: Vec::new(),
        };
        // Those that carry all are each above the next.
        let carries_all = |&node: &usize| below[node] == wanted.len();
        let Some(top) = order.iter().rposition(carries_all) else {
            let root = |&node: &usize| nodes.ancestry(node).last();
            let other = wanted.iter().find(|node| root(node) != root(&first));
            let other = other.unwrap_or(&first);
            return Err(FileError::Invalid(format!(
                "the joints hang on several roots: nodes {first} and {other} have no ancestor in common"
            )));
        };
        nodes.above = nodes.ancestry(order[top]).skip(1).collect();
        nodes.above.reverse();
        let inside = order[top..].iter().filter(|&&node| below[node] > 0);
        nodes.joints.extend(inside);
        match nodes.joints.len() > Skeleton::MAX_JOINTS {
            true => Err(too_many_joints()),
            false => Ok(nodes),
        }
    }

    /// Leaves out unmoved leaves below joints that are ends by their names, as `HeadTop_End_end` below `HeadTop_End`. Exporters add a leaf of
    /// any length to each last bone, and where that is an end itself, the leaf lies beyond the body. Returns the nodes that were left out.
    pub(super) fn leave_out_ends_of_ends(&mut self, root: &Root) -> Vec<usize> {
        let is_end =
            |node: usize| is_end_name(root.nodes[node].name.as_deref().unwrap_or_default());
        let moved: HashSet<usize> = animated(root).into_iter().collect();
        let children = |node: usize| root.nodes[node].children.iter().flatten().count();
        let parents = &self.parents;
        let is_beyond = |&mut node: &mut usize| {
            let is_leaf = is_end(node) && children(node) == 0 && !moved.contains(&node);
            let is_last = |parent| is_end(parent) && children(parent) == 1;
            is_leaf && parents[node].is_some_and(is_last)
        };
        self.joints.extract_if(.., is_beyond).collect()
    }

    /// A node and its ancestors, up to the top.
    pub(super) fn ancestry(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(node), |&node| self.parents[node])
    }
}

/// Whether a name is one that programs give to the end of a last bone.
pub(super) fn is_end_name(name: &str) -> bool {
    let ends = [
        "End", "_end", ".end", "Tip", "_tip", "Nub", "_nub", "Site", "_site",
    ];
    ends.iter().any(|end| name.ends_with(end))
}

pub(super) fn node_name(container: &Container, node: usize) -> String {
    let named = container.root.nodes.get(node);
    let name = named.and_then(|node| node.name.clone());
    name.unwrap_or_else(|| format!("node_{node}"))
}

/// A node is its own ancestor or has two parents.
fn no_tree(node: usize) -> FileError {
    FileError::Invalid(format!("node {node} hangs on itself or on two nodes"))
}

/// There are more joints, or nodes one below the other, than the maximum.
pub(super) fn too_many_joints() -> FileError {
    FileError::Invalid(format!("more than {} joints", Skeleton::MAX_JOINTS))
}

fn parents(nodes: &[scene::Node]) -> Result<Vec<Option<usize>>, FileError> {
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            let child = child.value();
            named(nodes, child, format!("node {index}"), "node")?;
            if parents[child].replace(index).is_some() {
                return Err(no_tree(child));
            }
        }
    }
    Ok(parents)
}

/// The nodes of all trees, parents before children. Nodes on a cycle are in none.
fn top_down(nodes: &[scene::Node], parents: &[Option<usize>]) -> Vec<usize> {
    let roots = (0..nodes.len()).filter(|&node| parents[node].is_none());
    let mut open: Vec<usize> = roots.rev().collect();
    let mut order = Vec::with_capacity(nodes.len());
    while let Some(node) = open.pop() {
        order.push(node);
        let children = nodes[node].children.iter().flatten().rev();
        open.extend(children.map(|child| child.value()));
    }
    order
}

/// The skin of most joints, with its index; of several the first.
pub(super) fn largest_skin(root: &Root) -> Option<(usize, &Skin)> {
    let skins = root.skins.iter().enumerate().rev();
    skins.max_by_key(|(_, skin)| skin.joints.len())
}

/// Nodes of the largest skin or, without skins, the animated nodes and all their descendants.
fn wanted(root: &Root) -> Result<Vec<usize>, FileError> {
    let largest = largest_skin(root);
    let (from, mut wanted) = match largest {
        Some((index, skin)) => {
            let joints = skin.joints.iter().map(|joint| joint.value());
            (format!("skin {index}"), joints.collect::<Vec<_>>())
        }
        None => ("an animation".to_owned(), animated(root)),
    };
    for &node in &wanted {
        named(&root.nodes, node, &from, "node")?;
    }
    let mut seen = HashSet::new();
    wanted.retain(|&node| seen.insert(node));
    if largest.is_none() {
        let mut next = 0;
        while let Some(&node) = wanted.get(next) {
            let children = root.nodes[node].children.iter().flatten();
            wanted.extend(
                children
                    .map(|child| child.value())
                    .filter(|&child| seen.insert(child)),
            );
            next += 1;
        }
    }
    Ok(wanted)
}

fn animated(root: &Root) -> Vec<usize> {
    let channels = root
        .animations
        .iter()
        .flat_map(|animation| &animation.channels);
    let moves = |path: &Checked<Property>| {
        matches!(
            path,
            Checked::Valid(Property::Rotation | Property::Translation)
        )
    };
    channels
        .filter(|channel| moves(&channel.target.path))
        .map(|channel| channel.target.node.value())
        .collect()
}

impl Local {
    /// Transform of a node without animation.
    pub(super) fn of(node: &scene::Node) -> Self {
        if let Some(matrix) = &node.matrix {
            let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
            let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
            return Self {
                translation: translation.as_vec3(),
                rotation: rotation.as_quat(),
                scale: scale.as_vec3(),
            };
        }
        Self {
            translation: node.translation.map_or(Vec3::ZERO, Vec3::from),
            rotation: node
                .rotation
                .map_or(Quat::IDENTITY, |q| Quat::from_array(q.0)),
            scale: node.scale.map_or(Vec3::ONE, Vec3::from),
        }
    }
}

/// A node's frame in the space of the file: a transform for points, and a rotation without scale and mirroring.
#[derive(Clone, Copy, Debug)]
pub(super) struct World {
    pub(super) points: DAffine3,
    pub(super) rotation: DQuat,
    /// Signs of the scale along the node's axes: where all scales are uniform, the linear part of `points` is `rotation` times the signs
    /// times a factor. Below a mirrored node, rotations are about mirrored axes.
    pub(super) signs: DVec3,
    /// Whether the scale of the node and of those above it is the same along all axes.
    pub(super) is_uniform: bool,
}

impl World {
    pub(super) const ORIGIN: Self = Self {
        points: DAffine3::IDENTITY,
        rotation: DQuat::IDENTITY,
        signs: DVec3::ONE,
        is_uniform: true,
    };

    pub(super) fn below(&self, local: &Local) -> Self {
        let rotation = local.rotation.as_dquat().normalize();
        let (scale, translation) = (local.scale.as_dvec3(), local.translation.as_dvec3());
        let points = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
        let axis = self.signs * self.signs.element_product() * rotation.xyz();
        let mirrored = DQuat::from_vec4(axis.extend(rotation.w));
        let size = scale.abs();
        Self {
            points: self.points * points,
            rotation: (self.rotation * mirrored).normalize(),
            signs: self.signs * scale.signum(),
            is_uniform: self.is_uniform
                && size.max_element() - size.min_element() <= 1e-4 * size.max_element(),
        }
    }

    pub(super) fn place(&self) -> DVec3 {
        self.points.translation
    }
}
