// The whole rectangle of a map: for stencil operations on all its texels.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "target.glsl"

layout(location = 1) in uvec4 clip; // first and end texel of the map, in the target

layout(push_constant) uniform DrawTarget {
    uvec2 side;
} target;

void main() {
    ivec2 corner = mix(ivec2(clip.xy), ivec2(clip.zw), equal(strip_corner(), ivec2(1)));
    gl_Position = target_position(corner, target.side);
}
