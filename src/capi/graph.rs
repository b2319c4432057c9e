//! Baked graphs, read from a file or from memory.

use std::ffi::{CString, c_char};
use std::path::Path;
use std::ptr::null;
use std::sync::Arc;

use super::{given, given_slice, text};
use crate::anim::Joint;
use crate::archive;
use crate::maps::BakedGraph;
use crate::math::Space;

/// `sabaki_graph`.
pub(super) struct Graph {
    pub(super) baked: Arc<BakedGraph>,
    /// From metres, +Y up, right-handed, to the host's space.
    pub(super) space: Space,
    joint_names: Vec<CString>,
}

impl Graph {
    /// Moves a graph to the heap. C owns it until `sabaki_graph_close`.
    fn new(baked: BakedGraph) -> *mut Self {
        let names = baked.graph().skeleton().joints().iter();
        let joint_names =
            names.map(|joint| CString::new(joint.name.replace('\0', " ")).unwrap_or_default());
        Box::into_raw(Box::new(Self {
            joint_names: joint_names.collect(),
            baked: Arc::new(baked),
            space: Space::Y_UP,
        }))
    }

    fn joint(&self, joint: u32) -> Option<&Joint> {
        let joints = self.baked.graph().skeleton().joints();
        joints.get(joint as usize)
    }
}

/// `sabaki_space`.
fn known_space(space: u32) -> Result<Space, String> {
    let all = [Space::Y_UP, Space::Z_UP, Space::UNITY, Space::UNREAL];
    let known = all.get(space as usize).copied();
    known.ok_or_else(|| format!("there is no space {space}"))
}

exported! {
    unsafe extern "C" fn sabaki_graph_open(path: *const c_char, graph: Option<&mut *mut Graph>) {
        let graph = given(graph, "graph")?;
        // SAFETY: the caller gives a text.
        let path = Path::new(unsafe { text(path) }?);
        *graph = Graph::new(archive::read(path).map_err(|error| error.to_string())?);
    }

    unsafe extern "C" fn sabaki_graph_load(
        bytes: *const u8,
        size: usize,
        graph: Option<&mut *mut Graph>,
    ) {
        let graph = given(graph, "graph")?;
        // SAFETY: the caller gives `size` bytes.
        let bytes = unsafe { given_slice(bytes, size, "bytes") }?;
        let baked = archive::from_bytes(bytes, Path::new("memory"));
        *graph = Graph::new(baked.map_err(|error| error.to_string())?);
    }

    unsafe extern "C" fn sabaki_graph_set_space(graph: Option<&mut Graph>, space: u32) {
        given(graph, "graph")?.space = known_space(space)?;
    }

    unsafe extern "C" fn sabaki_space_matrix(space: u32, matrix: Option<&mut [f32; 16]>) {
        *given(matrix, "matrix")? = known_space(space)?.matrix().to_cols_array();
    }

    unsafe extern "C" fn sabaki_graph_close(graph: *mut Graph) -> () {
        if !graph.is_null() {
            // SAFETY: `sabaki_graph_open` or `sabaki_graph_load` made it, and the caller does not use it any more.
            drop(unsafe { Box::from_raw(graph) });
        }
    }

    unsafe extern "C" fn sabaki_graph_joints(graph: Option<&Graph>) -> u32 {
        graph.map_or(0, |graph| graph.baked.graph().skeleton().len() as u32)
    }

    unsafe extern "C" fn sabaki_graph_spheres(graph: Option<&Graph>) -> u32 {
        graph.map_or(0, |graph| graph.baked.body().spheres.len() as u32)
    }

    unsafe extern "C" fn sabaki_graph_edges(graph: Option<&Graph>) -> u32 {
        graph.map_or(0, |graph| graph.baked.graph().edges().len() as u32)
    }

    unsafe extern "C" fn sabaki_graph_joint_name(graph: Option<&Graph>, joint: u32) -> *const c_char {
        let name = graph.and_then(|graph| graph.joint_names.get(joint as usize));
        name.map_or(null(), |name| name.as_ptr())
    }

    unsafe extern "C" fn sabaki_graph_joint_parent(graph: Option<&Graph>, joint: u32) -> u32 {
        let parent = graph.and_then(|graph| graph.joint(joint)?.parent);
        parent.map_or(u32::MAX, |parent| parent.0.into())
    }

    unsafe extern "C" fn sabaki_graph_joint_offset(
        graph: Option<&Graph>,
        joint: u32,
        offset: Option<&mut [f32; 3]>,
    ) {
        let (graph, out) = (given(graph, "graph")?, given(offset, "offset")?);
        let joint = graph.joint(joint).ok_or_else(|| format!("there is no joint {joint}"))?;
        *out = graph.space.point(joint.offset).to_array();
    }
}
