// A map of texels, laid flat at its height.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_layer.glsl"

layout(location = 0) out vec3 out_place;
layout(location = 1) out vec2 out_texel;

void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    out_texel = corner * vec2(draw.extent.xy);
    vec2 own = (draw.grid.xy + out_texel) * draw.grid.z;
    float cosine = draw.placement.x, sine = draw.placement.y;
    vec2 ground = vec2(cosine * own.x + sine * own.y, cosine * own.y - sine * own.x) + draw.placement.zw;
    out_place = vec3(ground.x, draw.grid.w, ground.y);
    gl_Position = frames[0].camera * vec4(out_place, 1.0);
}
