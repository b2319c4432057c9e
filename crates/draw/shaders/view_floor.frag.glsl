// A floor with a grid of metres, on which bodies cast shadows, and which fades into the distance.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "view_frame.glsl"
#include "view_shadow.glsl"

struct Capsule {
    vec4 a; // centre and radius
    vec4 b;
    vec4 colour;
};

layout(set = 0, binding = 2, std430) readonly buffer Capsules {
    Capsule capsules[];
};

layout(location = 0) in vec3 place;

layout(location = 0) out vec4 target;

// How much of a line of the grid covers a place.
float grid(vec2 at, float width) {
    vec2 pixel = fwidth(at);
    vec2 away = abs(fract(at - 0.5) - 0.5);
    vec2 cover = clamp((width + pixel - away) / pixel, 0.0, 1.0) * min(width / pixel + 0.25, 1.0);
    return max(cover.x, cover.y);
}

// The share of the sky that a capsule hides from a place on the ground, as if it were its nearest sphere.
float hidden(Capsule capsule) {
    vec3 along = capsule.b.xyz - capsule.a.xyz;
    float share = clamp(dot(place - capsule.a.xyz, along) / max(dot(along, along), 1e-6), 0.0, 1.0);
    vec3 towards = mix(capsule.a.xyz, capsule.b.xyz, share) - place;
    float away = length(towards);
    float radius = min(mix(capsule.a.w, capsule.b.w, share), away);
    return clamp(towards.y / away, 0.0, 1.0) * radius * radius / (away * away);
}

// From here on, and all the more from there on, bodies hide nothing that one could see; metres from the middle of the shadows.
const vec2 FAR = vec2(1.1, 2.0);

void main() {
    FrameData frame = frames[0];
    float open = 1.0;
    float away = distance(place.xz, frame.shade.xy);
    uint count = away < FAR.y ? frame.counts.x : 0u;
    for (uint index = 0u; index < count; ++index) {
        open *= 1.0 - 0.8 * hidden(capsules[index]);
    }
    open = mix(open, 1.0, smoothstep(FAR.x, FAR.y, away));
    float lit = sunlit(place, vec3(0.0, 1.0, 0.0));
    vec3 light = frame.above.rgb * open + frame.sunlight.rgb * frame.sunward.y * lit;
    float lines = max(grid(place.xz, 0.008), 0.35 * grid(place.xz * 4.0, 0.012));
    vec3 seen = frame.ground.rgb * (1.0 - frame.ground.w * lines) * light;
    target = vec4(encoded(mix(frame.horizon.rgb, seen, presence(place))), 1.0);
}
