// Keeps the texels of the attack's map that fall on a set texel of a candidate's map; the stencil test then keeps
// those that the attack touches, and the occlusion query counts them.
// CPU twin: src/query/cull/cpu.rs.
#version 460

const int SHIFT = 15;

layout(location = 0) flat in ivec4 turn; // from texels of the target to texels of the map, in fixed point
layout(location = 1) flat in uvec4 map;  // width and height in one, first bit, bits a row, log2 of bits a texel

layout(set = 0, binding = 0, std430) readonly buffer Words {
    uint words[];
};

void main() {
    ivec2 c = 2 * ivec2(gl_FragCoord.xy) + 1;
    // Texels before the map's first one become very large.
    uint x = uint((turn.x * c.x + turn.y * c.y + turn.z) >> SHIFT);
    uint z = uint((turn.x * c.y - turn.y * c.x + turn.w) >> SHIFT);
    if (x >= (map.x & 0xffffu) || z >= (map.x >> 16)) {
        discard;
    }
    uint bit = map.y + z * map.z + (x << map.w);
    if (((words[bit >> 5] >> (bit & 31u)) & 1u) == 0u) {
        discard;
    }
}
