//! Nothing but a test (`tests/spirv.rs`): the committed SPIR-V of every package is what its GLSL compiles to.
