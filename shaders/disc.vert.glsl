// A quad a texel larger than a disc, cut off at the rectangle of the map that the disc belongs to.
// CPU twin: `for_each_texel` in src/maps/raster.rs.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "target.glsl"

const int SUB_TEXELS_LOG2 = 4;

layout(location = 0) in ivec3 disc; // centre and radius, sub-texels of the target
layout(location = 1) in uvec4 clip; // first and end texel of the map, in the target

layout(push_constant) uniform DrawTarget {
    uvec2 side;
} target;

layout(location = 0) flat out ivec3 out_disc;

void main() {
    ivec2 low = ((disc.xy - disc.z) >> SUB_TEXELS_LOG2) - 1;
    ivec2 high = ((disc.xy + disc.z) >> SUB_TEXELS_LOG2) + 2;
    ivec2 corner = mix(low, high, equal(strip_corner(), ivec2(1)));
    gl_Position = target_position(clamp(corner, ivec2(clip.xy), ivec2(clip.zw)), target.side);
    out_disc = disc;
}
