// Keeps the texels of the attack's map that fall on a set texel of a candidate's map; the stencil test then keeps
// those that the attack touches, and the occlusion query counts them.
// CPU twin: src/query/cull/cpu.rs.
#include "candidate.glsl"

void main() {
    if (texel_bits() == 0u) {
        discard;
    }
}
