// What both stages of a candidate's draw read. Host: src/gpu/stencil/candidates.rs.

// One candidate in one slab.
struct PlacedMaps {
    ivec4 turn;  // a, b, tx, tz of `MapTurn`
    uvec2 cell;  // first texel of the slab's attack map, in the target
    uint maps;   // position in `regions`
    uint padding;
};

// Where the maps of one region and slab lie: `PackedMaps` in src/region/atlas.rs.
struct PackedMaps {
    int u;
    int v;
    uint width;
    uint height;
    uint words_per_row;
    uint body_word;
    uint evasion_word;
    uint padding;
};

layout(set = 0, binding = 0, std430) readonly buffer Words {
    uint words[];
};
layout(set = 0, binding = 1, std430) readonly buffer Regions {
    PackedMaps regions[];
};
layout(set = 0, binding = 2, std430) readonly buffer Placed {
    PlacedMaps placed[];
};

layout(push_constant) uniform DrawCandidates {
    uvec2 side;    // of the target, texels
    uvec2 attack;  // size of the attack's maps, texels
    uint evasion;  // 0: body maps, 1: evasion maps
} draw;
