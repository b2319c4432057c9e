// A capsule whose ends have radii of their own.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_capsule.glsl"

struct Capsule {
    vec4 a; // centre and radius
    vec4 b;
    vec4 colour;
};

layout(set = 0, binding = 2, std430) readonly buffer Capsules {
    Capsule capsules[];
};

layout(location = 0) out vec3 out_place;
layout(location = 1) out vec3 out_normal;
layout(location = 2) flat out vec4 out_colour;

void main() {
    Capsule capsule = capsules[gl_InstanceIndex];
    Surface at = surface(uint(gl_VertexIndex), capsule.a, capsule.b);
    out_place = at.place;
    out_normal = at.normal;
    out_colour = capsule.colour;
    gl_Position = seen(at.place);
}
