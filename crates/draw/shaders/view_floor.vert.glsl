// A square of the ground around the camera.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"

layout(location = 0) out vec3 out_place;

void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 2.0 - 1.0;
    vec2 ground = frames[0].eye.xz + corner * frames[0].horizon.w * 4.0;
    out_place = vec3(ground.x, 0.0, ground.y);
    gl_Position = frames[0].camera * vec4(out_place, 1.0);
}
