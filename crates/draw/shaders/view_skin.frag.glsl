// A skinned mesh with its base colour, in the light of a sun and of a sky.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_shadow.glsl"
#include "view_lit.glsl"
#include "view_skin.glsl"

// All levels of all textures: one byte each of red, green, blue (sRGB) and alpha.
layout(set = 0, binding = 7, std430) readonly buffer Texels {
    uint texels[];
};

layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;
layout(location = 3) in vec2 uv;
layout(location = 4) flat in vec4 tint;
layout(location = 5) in float tinted;

layout(location = 0) out vec4 target;

vec3 texel(uint first, uvec2 side, ivec2 at) {
    // Neighbours are at most one texel before the first.
    uvec2 within = uvec2(at + ivec2(side)) % side;
    vec3 encoded_colour = unpackUnorm4x8(texels[first + within.y * side.x + within.x]).rgb;
    vec3 high = pow((encoded_colour + 0.055) / 1.055, vec3(2.4));
    return mix(high, encoded_colour / 12.92, lessThanEqual(encoded_colour, vec3(0.04045)));
}

vec3 level_colour(uint level, vec2 coordinates) {
    uint first = draw.texture_place.x;
    uvec2 side = draw.texture_place.yz;
    for (uint finer = 0u; finer < level; ++finer) {
        first += side.x * side.y;
        side = max(side >> 1u, uvec2(1u));
    }
    vec2 at = fract(coordinates) * vec2(side) - 0.5;
    ivec2 corner = ivec2(floor(at));
    vec2 share = at - vec2(corner);
    vec3 above = mix(texel(first, side, corner), texel(first, side, corner + ivec2(1, 0)), share.x);
    vec3 below = mix(texel(first, side, corner + ivec2(0, 1)), texel(first, side, corner + ivec2(1, 1)), share.x);
    return mix(above, below, share.y);
}

vec3 texture_colour() {
    vec2 side = vec2(draw.texture_place.yz);
    float across = max(length(dFdx(uv) * side), length(dFdy(uv) * side));
    float level = clamp(log2(max(across, 1e-6)), 0.0, float(draw.texture_place.w) - 1.0);
    uint finer = uint(level);
    vec3 fine = level_colour(finer, uv);
    float share = level - float(finer);
    return share > 0.0 ? mix(fine, level_colour(finer + 1u, uv), share) : fine;
}

void main() {
    vec3 up = normalize(normal);
    vec3 base = colour.rgb;
    if (draw.texture_place.w > 0u) {
        base *= mix(vec3(1.0), texture_colour(), colour.a);
    }
    base = mix(base, tint.rgb, tinted);
    target = vec4(encoded(lit_colour(place, up, base)), ghost_alpha(place, up, tint.a));
}
