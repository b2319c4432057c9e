// A candidate's map, over the part of the attack's map that it can reach.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "target.glsl"

layout(location = 0) in uvec4 clip; // first and end texel of the part, in the target
layout(location = 1) in ivec4 turn; // as in candidate.frag.glsl
layout(location = 2) in uvec4 map;

layout(push_constant) uniform DrawTarget {
    uvec2 side;
} target;

layout(location = 0) flat out ivec4 out_turn;
layout(location = 1) flat out uvec4 out_map;

void main() {
    ivec2 corner = mix(ivec2(clip.xy), ivec2(clip.zw), equal(strip_corner(), ivec2(1)));
    gl_Position = target_position(corner, target.side);
    out_turn = turn;
    out_map = map;
}
