// A box around one candidate's map, turned into place over the attack's map of the same slab, a little too large.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "target.glsl"
#include "candidate.glsl"

// Texels around the map: more than single precision can lose on the way back through the turn.
const float MARGIN = 2.0;
// Halves of texels, 2^-14: the unit of `MapTurn`.
const float UNIT = 32768.0;

layout(location = 0) flat out uint out_instance;

// From the evasion's frame, texels, back to the attack's map.
vec2 turn_back(ivec4 turn, vec2 place) {
    vec2 from = (place * UNIT - vec2(turn.zw)) * 0.5;
    float a = float(turn.x);
    float b = float(turn.y);
    return vec2(a * from.x - b * from.y, b * from.x + a * from.y) / (a * a + b * b);
}

void main() {
    PlacedMaps candidate = placed[gl_InstanceIndex];
    PackedMaps maps = regions[candidate.maps];
    vec2 map_low = vec2(maps.u, maps.v) - MARGIN;
    vec2 map_high = vec2(maps.u + int(maps.width), maps.v + int(maps.height)) + MARGIN;

    vec2 p0 = turn_back(candidate.turn, map_low);
    vec2 p1 = turn_back(candidate.turn, vec2(map_high.x, map_low.y));
    vec2 p2 = turn_back(candidate.turn, vec2(map_low.x, map_high.y));
    vec2 p3 = turn_back(candidate.turn, map_high);
    vec2 limit = vec2(draw.attack);
    vec2 low = clamp(floor(min(min(p0, p1), min(p2, p3))), vec2(0.0), limit);
    vec2 high = clamp(ceil(max(max(p0, p1), max(p2, p3))), vec2(0.0), limit);
    if (candidate.turn.xy == ivec2(0)) {
        // A turn that is none cannot be turned back; the fragments decide alone.
        low = vec2(0.0);
        high = limit;
    }

    ivec2 corner = mix(ivec2(low), ivec2(high), equal(strip_corner(), ivec2(1)));
    gl_Position = target_position(ivec2(candidate.cell) + corner, draw.side);
    out_instance = uint(gl_InstanceIndex);
}
