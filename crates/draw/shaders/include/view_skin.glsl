// A skinned mesh that is drawn.

layout(push_constant) uniform DrawSkin {
    uint sun;             // 1: as the sun sees it
    uint first_character;
    uint first_bone;
    uint dual;            // 1: rotations are blended as dual quaternions, 0: linearly
    uvec4 texture_place;  // first texel, width, height, number of levels; 0 levels for no texture
} draw;
