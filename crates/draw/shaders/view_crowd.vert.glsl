// A part of a member of a crowd: a capsule between two of the joints that the crowd's kernels have posed.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_capsule.glsl"

const uint NUMBERS = 12u; // of a joint: 3 rows of 4

struct Character {
    uvec4 place; // first number of its pose, how far apart its numbers stand; the rest unused
    vec4 tint;   // a colour and how much of it
};

struct Part {
    uvec4 joints; // of its two ends; the rest unused
    vec4 a;       // in the joint's frame, and the radius
    vec4 b;
    vec4 colour;
};

layout(set = 0, binding = 4, std430) readonly buffer Poses {
    float poses[];
};

layout(set = 0, binding = 5, std430) readonly buffer Characters {
    Character characters[];
};

layout(set = 0, binding = 6, std430) readonly buffer Parts {
    Part parts[];
};

layout(location = 0) out vec3 out_place;
layout(location = 1) out vec3 out_normal;
layout(location = 2) flat out vec4 out_colour;

// An end of a part in the world.
vec4 end_of(uvec4 place, uint joint, vec4 end) {
    vec3 at;
    for (uint row = 0u; row < 3u; ++row) {
        uint first = joint * NUMBERS + 4u * row;
        vec4 numbers;
        for (uint column = 0u; column < 4u; ++column) {
            numbers[column] = poses[place.x + place.y * (first + column)];
        }
        at[row] = dot(numbers, vec4(end.xyz, 1.0));
    }
    return vec4(at, end.w);
}

void main() {
    uint instance = uint(gl_InstanceIndex);
    Character who = characters[draw.first_character + instance / draw.parts];
    Part part = parts[draw.first_part + instance % draw.parts];
    vec4 a = end_of(who.place, part.joints.x, part.a);
    vec4 b = end_of(who.place, part.joints.y, part.b);
    Surface at = surface(uint(gl_VertexIndex), a, b);
    out_place = at.place;
    out_normal = at.normal;
    out_colour = vec4(mix(part.colour.rgb, who.tint.rgb, who.tint.a), part.colour.a);
    gl_Position = seen(at.place);
}
