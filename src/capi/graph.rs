//! Baked graphs, read from a file or from memory.

use std::ffi::{CString, c_char};
use std::path::Path;
use std::ptr::null;
use std::sync::Arc;

use super::status::{OK, Status, call};
use super::{given_mut, given_slice, text};
use crate::archive;
use crate::maps::BakedGraph;

/// `sabaki_graph`.
pub(super) struct Graph {
    pub(super) baked: Arc<BakedGraph>,
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
        }))
    }
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_graph_open(path: *const c_char, graph: *mut *mut Graph) -> Status {
    call(|| {
        // SAFETY: the caller gives a text, and a place for the graph.
        let (path, graph) = unsafe { (text(path)?, given_mut(graph, "graph")?) };
        let baked = archive::read(Path::new(path)).map_err(|error| error.to_string())?;
        *graph = Graph::new(baked);
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_graph_load(
    bytes: *const u8,
    size: usize,
    graph: *mut *mut Graph,
) -> Status {
    call(|| {
        // SAFETY: the caller gives `size` bytes, and a place for the graph.
        let (bytes, graph) = unsafe {
            let bytes = given_slice(bytes, size, "bytes")?;
            (bytes, given_mut(graph, "graph")?)
        };
        let baked = archive::from_bytes(bytes, Path::new("memory"));
        *graph = Graph::new(baked.map_err(|error| error.to_string())?);
        Ok(OK)
    })
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_graph_close(graph: *mut Graph) {
    if !graph.is_null() {
        // SAFETY: `sabaki_graph_open` or `sabaki_graph_load` made it, and the caller does not use it any more.
        drop(unsafe { Box::from_raw(graph) });
    }
}

/// Returns a number of a graph, or 0 if the graph is null.
///
/// # Safety
/// `graph` is null or valid.
unsafe fn number(graph: *const Graph, of: impl FnOnce(&BakedGraph) -> usize) -> u32 {
    // SAFETY: the caller vouches for the pointer.
    unsafe { graph.as_ref() }.map_or(0, |graph| of(&graph.baked) as u32)
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_graph_joints(graph: *const Graph) -> u32 {
    // SAFETY: the caller's graph.
    unsafe { number(graph, |baked| baked.graph().skeleton().len()) }
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_graph_spheres(graph: *const Graph) -> u32 {
    // SAFETY: the caller's graph.
    unsafe { number(graph, |baked| baked.body().spheres.len()) }
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_graph_edges(graph: *const Graph) -> u32 {
    // SAFETY: the caller's graph.
    unsafe { number(graph, |baked| baked.graph().edges().len()) }
}

/// # Safety
/// As `sabaki.h` says.
#[cfg_attr(not(test), unsafe(no_mangle))]
unsafe extern "C" fn sabaki_graph_joint_name(graph: *const Graph, joint: u32) -> *const c_char {
    // SAFETY: the caller's graph.
    let name = unsafe { graph.as_ref() }.and_then(|graph| graph.joint_names.get(joint as usize));
    name.map_or(null(), |name| name.as_ptr())
}
