// What the candidates' vertex shader reads. Host: src/gpu/stencil/maps.rs and src/gpu/shader_table.rs.

// A candidate's map of one slab and slice over the attack's. Two numbers in a word: the first one in the low half.
struct PlacedBits {
    uint low;     // first texel of the target that is drawn, x and y
    uint high;    // end texel, x and y
    uint origin;  // where the first texel of the attack's rectangle lies in the target, x and y, with signs
    uint map;     // 64 times the position in `maps`, and the slice
};

// Where a map lies in its frame, and its bits in `words`.
struct MapBits {
    int u;
    int v;
    uint width;
    uint height;
    uint first_bit;
    uint row_bits;
    uint texel_bits_log2;
    uint padding;
};

layout(set = 0, binding = 1, std430) readonly buffer Maps {
    MapBits maps[];
};
layout(set = 0, binding = 2, std430) readonly buffer Placed {
    PlacedBits placed[];
};
layout(set = 0, binding = 3, std430) readonly buffer Turns {
    ivec4 turns[];  // a, b, tx, tz of `MapTurn`
};
