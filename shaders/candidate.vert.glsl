// A corner of the box of texels in which a candidate's map may meet the attack's. All that is known of the box comes with
// its corners: llvmpipe reads vertices far faster than storage buffers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "target.glsl"

layout(location = 0) in uvec2 corner; // parts of texels of the target, as its side
layout(location = 1) in ivec4 turn;   // from texels of the target to those of the map
layout(location = 2) in uvec4 map;    // as in candidate.glsl

layout(push_constant) uniform DrawTarget {
    uvec2 side;
} target;

layout(location = 0) flat out ivec4 out_turn;
layout(location = 1) flat out uvec4 out_map; // as in candidate.glsl

void main() {
    gl_Position = target_position(ivec2(corner), target.side);
    out_turn = turn;
    out_map = map;
}
