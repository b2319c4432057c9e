//! Meshes that nobody would draw.
