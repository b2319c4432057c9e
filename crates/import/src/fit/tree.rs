//! A k-d tree of bounding boxes for nearest-point queries. Each node is divided at the median of
//! its longest axis.
//!
//! Source: Bentley, "Multidimensional Binary Search Trees Used for Associative Searching" (1975).
//! The result is deterministic: of equally near points, the first one in the tree's order is found.

use glam::Vec3;

/// Maximum number of points in a leaf.
const LEAF: usize = 4;

/// A node: a range of [`PointTree::order`].
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub low: Vec3,
    pub high: Vec3,
    /// Start and end of the range.
    pub start: u32,
    pub end: u32,
    /// Indices of the two children, or `None` for a leaf.
    pub children: Option<[u32; 2]>,
}

/// The tree. It does not store the points.
#[derive(Clone, Debug, Default)]
pub(super) struct PointTree {
    /// Nodes, the root first. Empty if there are no points.
    pub nodes: Vec<Node>,
    /// Indices of the points. Those of a node are consecutive.
    pub order: Vec<u32>,
}

impl PointTree {
    /// Builds a tree over the points with the indices `order`.
    pub(super) fn new(points: &[Vec3], order: Vec<u32>) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order,
        };
        let end = tree.order.len();
        if end > 0 {
            tree.add(points, 0, end);
        }
        tree
    }

    fn add(&mut self, points: &[Vec3], start: usize, end: usize) -> u32 {
        let inside = &mut self.order[start..end];
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &index in inside.iter() {
            low = low.min(points[index as usize]);
            high = high.max(points[index as usize]);
        }
        let id = self.nodes.len();
        let (node_start, node_end) = (start as u32, end as u32);
        self.nodes.push(Node {
            low,
            high,
            start: node_start,
            end: node_end,
            children: None,
        });
        if end - start > LEAF {
            let axis = (high - low).max_position();
            let half = (end - start) / 2;
            inside.select_nth_unstable_by(half, |&a, &b| {
                let (x, y) = (points[a as usize][axis], points[b as usize][axis]);
                x.total_cmp(&y).then(a.cmp(&b))
            });
            let first = self.add(points, start, start + half);
            let second = self.add(points, start + half, end);
            self.nodes[id].children = Some([first, second]);
        }
        id as u32
    }

    /// Index of the point that is nearest to `place`, and its squared distance.
    pub(super) fn nearest(&self, points: &[Vec3], place: Vec3) -> Option<(u32, f32)> {
        let mut best: Option<(u32, f32)> = None;
        // The depth is the logarithm of the number of points, and each level leaves one node on the
        // stack.
        let mut open = Vec::with_capacity(64);
        open.extend(
            self.nodes
                .first()
                .map(|root| (0, root.distance_squared(place))),
        );
        while let Some((id, least)) = open.pop() {
            if best.is_some_and(|(_, found)| least > found) {
                continue;
            }
            let node: &Node = &self.nodes[id as usize];
            let Some(children) = node.children else {
                for &index in &self.order[node.start as usize..node.end as usize] {
                    let distance = points[index as usize].distance_squared(place);
                    let is_better = |(at, found): (u32, f32)| (distance, index) < (found, at);
                    if best.is_none_or(is_better) {
                        best = Some((index, distance));
                    }
                }
                continue;
            };
            let mut children =
                children.map(|child| (child, self.nodes[child as usize].distance_squared(place)));
            if children[0].1 <= children[1].1 {
                children.swap(0, 1);
            }
            open.extend(children);
        }
        best
    }
}

impl Node {
    fn distance_squared(&self, place: Vec3) -> f32 {
        place.clamp(self.low, self.high).distance_squared(place)
    }
}
