// Keeps the texels of the attack's map that fall on a set texel of a candidate's map; the stencil test then keeps
// those that the attack touches, and the occlusion query counts them.
// CPU twin: src/avoid/cull/cpu.rs.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "candidate.glsl"

const int SHIFT = 15;

layout(location = 0) flat in uint instance;

// `MapTurn::texel`.
ivec2 turned_texel(ivec4 turn, ivec2 texel) {
    ivec2 c = 2 * texel + 1;
    int x = turn.x * c.x + turn.y * c.y + turn.z;
    int z = turn.x * c.y - turn.y * c.x + turn.w;
    return ivec2(x >> SHIFT, z >> SHIFT);
}

void main() {
    PlacedMaps candidate = placed[instance];
    PackedMaps maps = regions[candidate.maps];
    ivec2 texel = ivec2(gl_FragCoord.xy) - ivec2(candidate.cell);
    ivec2 at = turned_texel(candidate.turn, texel) - ivec2(maps.u, maps.v);
    if (at.x < 0 || at.y < 0 || at.x >= int(maps.width) || at.y >= int(maps.height)) {
        discard;
    }
    uint first = draw.evasion == 0u ? maps.body_word : maps.evasion_word;
    uint word = words[first + uint(at.y) * maps.words_per_row + (uint(at.x) >> 5)];
    if (((word >> (uint(at.x) & 31u)) & 1u) == 0u) {
        discard;
    }
}
