// Bodies in the light of a sun and of a sky.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_shadow.glsl"
#include "view_lit.glsl"

layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in vec4 colour;

layout(location = 0) out vec4 target;

void main() {
    vec3 up = normalize(normal);
    target = vec4(encoded(lit_colour(place, up, colour.rgb)), ghost_alpha(place, up, colour.a));
}
