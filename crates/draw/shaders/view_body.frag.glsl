// Bodies in the light of a sun and of a sky.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_shadow.glsl"

layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in vec4 colour;

layout(location = 0) out vec4 target;

void main() {
    FrameData frame = frames[0];
    vec3 up = normalize(normal);
    vec3 eyeward = normalize(frame.eye.xyz - place);
    vec3 sunward = frame.sunward.xyz;
    float facing = max(dot(up, sunward), 0.0);
    float lit = facing > 0.0 ? sunlit(place, up) : 0.0;
    // What is near the ground sees less of the sky.
    float open = mix(0.72, 1.0, smoothstep(0.0, 0.7, place.y));
    vec3 sky = mix(frame.below.rgb, frame.above.rgb, up.y * 0.5 + 0.5) * open;
    vec3 light = sky + frame.sunlight.rgb * facing * lit;
    float edge = 1.0 - max(dot(up, eyeward), 0.0);
    float gloss = pow(max(dot(up, normalize(eyeward + sunward)), 0.0), 32.0) * lit * 0.12;
    vec3 seen = colour.rgb * light + gloss + frame.above.rgb * (0.10 * pow(edge, 4.0));
    // Ghosts are clearer where one looks straight at them.
    float alpha = colour.a < 1.0 ? colour.a * mix(0.55, 1.6, edge * edge) : 1.0;
    target = vec4(encoded(mix(frame.horizon.rgb, seen, presence(place))), min(alpha, 1.0));
}
