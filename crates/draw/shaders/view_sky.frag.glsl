// What is behind everything: the horizon's colour, and another one further up.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"

layout(location = 0) in vec2 at;

layout(location = 0) out vec4 target;

void main() {
    FrameData frame = frames[0];
    vec4 near = frame.unproject * vec4(at, 1.0, 1.0);
    vec3 ray = normalize(near.xyz / near.w - frame.eye.xyz);
    float up = smoothstep(0.0, 0.6, ray.y);
    target = vec4(encoded(mix(frame.horizon.rgb, frame.zenith.rgb, up)), 1.0);
}
