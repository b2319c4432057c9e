// Counts the texels of the attack's map that fall on a set texel of a candidate's map: those that the attack touches, for
// the stencil test comes first. In place of an occlusion query.
// CPU twin: src/query/cull/cpu.rs.
#include "candidate.glsl"

layout(early_fragment_tests) in;

layout(set = 0, binding = 1, std430) buffer Counts {
    uint counts[];
};

void main() {
    // Of two maps, no texel is of both: the second one has the next count.
    uint bits = texel_bits();
    if (bits != 0u) {
        atomicAdd(counts[(map.w >> 6) + (bits >> 1)], 1u);
    }
}
