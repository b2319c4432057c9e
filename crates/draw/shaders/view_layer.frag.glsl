// The texels of a map that are set.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_layer.glsl"

layout(set = 0, binding = 3, std430) readonly buffer Words {
    uint words[];
};

layout(location = 0) in vec3 place;
layout(location = 1) in vec2 texel;

layout(location = 0) out vec4 target;

float is_set(vec2 at) {
    ivec2 cell = ivec2(floor(at));
    if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, ivec2(draw.extent.xy)))) {
        return 0.0;
    }
    uint word = words[draw.extent.z + uint(cell.y) * draw.extent.w + uint(cell.x >> 5)];
    return float(word >> (uint(cell.x) & 31u) & 1u);
}

void main() {
    // Four places of the pixel, so that borders are smooth.
    vec2 right = dFdx(texel), down = dFdy(texel);
    float cover = is_set(texel + 0.125 * right + 0.375 * down) + is_set(texel - 0.375 * right + 0.125 * down)
        + is_set(texel - 0.125 * right - 0.375 * down) + is_set(texel + 0.375 * right - 0.125 * down);
    if (cover == 0.0) {
        discard;
    }
    target = vec4(encoded(draw.colour.rgb), draw.colour.a * 0.25 * cover * presence(place));
}
