// Which texels of the attack's map fall on a set texel of a candidate's map.

const int SHIFT = 15;

layout(location = 0) flat in ivec4 turn;
layout(location = 1) flat in uvec4 map; // width and height in one, first bit, bits a row, log2 of bits a texel, whether it is two maps (bit 5), and number (from bit 6)

#ifdef TEXELS
layout(set = 0, binding = 0) uniform usamplerBuffer words;
#else
layout(set = 0, binding = 0, std430) readonly buffer Words {
    uint words[];
};
#endif

uint word(uint index) {
#ifdef TEXELS
    return texelFetch(words, int(index)).x;
#else
    return words[index];
#endif
}

// The bits of this texel in the candidate's map: one, or two where the map is two maps.
uint texel_bits() {
    ivec2 c = 2 * ivec2(gl_FragCoord.xy) + 1;
    // Texels before the map's first one become very large.
    uint x = uint((turn.x * c.x + turn.y * c.y + turn.z) >> SHIFT);
    uint z = uint((turn.x * c.y - turn.y * c.x + turn.w) >> SHIFT);
    if (x >= (map.x & 0xffffu) || z >= (map.x >> 16)) {
        return 0u;
    }
    uint bit = map.y + z * map.z + (x << (map.w & 31u));
    uint mask = 1u | ((map.w >> 4) & 2u);
    return (word(bit >> 5) >> (bit & 31u)) & mask;
}
