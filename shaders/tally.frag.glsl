// Counts the texels of the attack's map that fall on a set texel of a candidate's map: those that the attack touches, for
// the stencil test comes first. In place of an occlusion query.
// CPU twin: src/avoid/cull/cpu.rs.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "candidate.glsl"

layout(early_fragment_tests) in;

layout(set = 0, binding = 1, std430) buffer Counts {
    uint counts[];
};

void main() {
    if (is_set()) {
        atomicAdd(counts[map.w >> 5], 1u);
    }
}
