// A vertex of a skinned mesh, moved by the joints of one character.
//
// Source: Kavan, Collins, Zara and O'Sullivan, "Skinning with Dual Quaternions", I3D 2007, section 3; without it, linear blending.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_skin.glsl"

const uint NUMBERS = 12u; // of a joint: 3 rows of 4
const uint EVERYWHERE = 0xffffffffu;

struct Character {
    uvec4 place; // first number of its pose, how far apart its numbers stand; first weight of its tint; opacity
    vec4 tint;   // a colour and how much of it
};

struct Bone {
    uvec4 joint;      // that moves it; the rest unused
    vec4 rotation;    // quaternion, from the mesh's space to the joint's frame
    vec4 translation;
    vec4 unused;
};

layout(set = 0, binding = 4, std430) readonly buffer Poses {
    float poses[];
};

layout(set = 0, binding = 5, std430) readonly buffer Characters {
    Character characters[];
};

layout(set = 0, binding = 6, std430) readonly buffer Bones {
    Bone bones[];
};

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 colour;
layout(location = 4) in uvec4 influences;
layout(location = 5) in vec4 weights;

layout(location = 0) out vec3 out_place;
layout(location = 1) out vec3 out_normal;
layout(location = 2) out vec4 out_colour; // and the texture's share
layout(location = 3) out vec2 out_uv;
layout(location = 4) flat out vec4 out_tint; // a colour, and the opacity
layout(location = 5) out float out_tinted;

vec4 times(vec4 a, vec4 b) {
    return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

vec3 turned(vec4 rotation, vec3 v) {
    return v + 2.0 * cross(rotation.xyz, cross(rotation.xyz, v) + rotation.w * v);
}

// The rows of a joint's frame.
void frame_of(uvec4 place, uint joint, out vec4 rows[3]) {
    for (uint row = 0u; row < 3u; ++row) {
        for (uint column = 0u; column < 4u; ++column) {
            rows[row][column] = poses[place.x + place.y * (joint * NUMBERS + 4u * row + column)];
        }
    }
}

// The quaternion of a rotation, by its largest part.
vec4 quaternion(vec4 rows[3]) {
    float x = rows[0].x, y = rows[1].y, z = rows[2].z;
    vec4 q;
    if (x + y + z > 0.0) {
        q = vec4(rows[2].y - rows[1].z, rows[0].z - rows[2].x, rows[1].x - rows[0].y, 1.0 + x + y + z);
    } else if (x > y && x > z) {
        q = vec4(1.0 + x - y - z, rows[0].y + rows[1].x, rows[0].z + rows[2].x, rows[2].y - rows[1].z);
    } else if (y > z) {
        q = vec4(rows[0].y + rows[1].x, 1.0 + y - x - z, rows[1].z + rows[2].y, rows[0].z - rows[2].x);
    } else {
        q = vec4(rows[0].z + rows[2].x, rows[1].z + rows[2].y, 1.0 + z - x - y, rows[1].x - rows[0].y);
    }
    return normalize(q);
}

void main() {
    Character who = characters[draw.first_character + uint(gl_InstanceIndex)];
    vec3 place = vec3(0.0), up = vec3(0.0);
    vec4 real = vec4(0.0), moved = vec4(0.0), first = vec4(0.0);
    float tinted = 0.0;
    for (int index = 0; index < 4; ++index) {
        float weight = weights[index];
        if (weight == 0.0) {
            continue;
        }
        Bone bone = bones[draw.first_bone + influences[index]];
        vec4 rows[3];
        frame_of(who.place, bone.joint.x, rows);
        tinted += weight * (who.place.z == EVERYWHERE ? 1.0 : poses[who.place.z + bone.joint.x]);
        if (draw.dual == 1u) {
            vec4 own = quaternion(rows);
            vec3 by = turned(own, bone.translation.xyz) + vec3(rows[0].w, rows[1].w, rows[2].w);
            vec4 rotation = times(own, bone.rotation);
            first = first == vec4(0.0) ? rotation : first; // of the influences with a weight
            weight *= dot(first, rotation) < 0.0 ? -1.0 : 1.0;
            real += weight * rotation;
            moved += weight * 0.5 * times(vec4(by, 0.0), rotation);
        } else {
            vec4 at = vec4(turned(bone.rotation, position) + bone.translation.xyz, 1.0);
            vec3 facing = turned(bone.rotation, normal);
            place += weight * vec3(dot(rows[0], at), dot(rows[1], at), dot(rows[2], at));
            up += weight * vec3(dot(rows[0].xyz, facing), dot(rows[1].xyz, facing), dot(rows[2].xyz, facing));
        }
    }
    if (draw.dual == 1u) {
        float size = 1.0 / length(real);
        real *= size;
        moved *= size;
        vec3 by = 2.0 * (real.w * moved.xyz - moved.w * real.xyz + cross(real.xyz, moved.xyz));
        place = turned(real, position) + by;
        up = turned(real, normal);
    }
    out_place = place;
    out_normal = up;
    out_colour = colour;
    out_uv = uv;
    out_tint = vec4(who.tint.rgb, uintBitsToFloat(who.place.w));
    out_tinted = who.tint.a * tinted;
    mat4 view = draw.sun == 1u ? frames[0].sun : frames[0].camera;
    gl_Position = view * vec4(place, 1.0);
}
