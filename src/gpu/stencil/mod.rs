//! The paper's own path: maps drawn and compared with the stencil buffer, counted by occlusion queries.
//!
//! Source: Masaoka & Oshita, sections 4.3 (maps) and 5.3 (culling). Where the paper uses OpenGL, this records Vulkan. The files in the
//! order of the paper:
//!
//! | section | file | what |
//! | --- | --- | --- |
//! | 4.3 | `screen.rs` | the virtual screen on the GPU: a stencil target, in which maps lie side by side |
//! | 4.3 | `rules.rs` | the stencil rules of body, evasion and attack maps |
//! | 4.3 | `rasterizer.rs` | draws these maps and reads them back |
//! | 4.3 | `maps.rs` | the evasions' maps, kept on the device |
//! | 5.3 | `attack.rs` | the attack's maps, drawn for each interval of height |
//! | 5.3, 5.4 | `candidates.rs` | a candidate's maps, moved and turned over the attack's, with a query for each |
//! | 5.3 | `path.rs` | the commands of a cull: attack, candidates, counts |

mod attack;
mod candidates;
mod maps;
mod path;
mod rasterizer;
mod rules;
mod screen;

pub(super) use path::StencilPath;
pub use rasterizer::{Batch, MapKind, Rasterizer, RasterizerDesc};
