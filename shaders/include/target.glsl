// Corners of quads that lie on texel borders of the target.

// Which corner of a quad drawn as a strip of four vertices.
ivec2 strip_corner() {
    return ivec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
}

// A texel corner of a target of `side` texels, as a clip-space position.
vec4 target_position(ivec2 corner, uvec2 side) {
    return vec4(vec2(corner) * 2.0 / vec2(side) - 1.0, 0.0, 1.0);
}
