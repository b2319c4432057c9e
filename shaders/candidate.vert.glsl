// The box of texels in which a candidate's map may meet the attack's: two triangles for each, of six vertices in a row.
// Draws are not instanced: the instance's number is the candidate's.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "target.glsl"
#include "candidate.glsl"

const int SHIFT = 15;

layout(push_constant) uniform DrawTarget {
    uvec2 side;
} target;

layout(location = 0) flat out ivec4 out_turn;  // from texels of the target to those of the map
layout(location = 1) flat out uvec4 out_map;   // width and height in one, first bit, bits a row, log2 of bits a texel

ivec2 halves(uint two) {
    return ivec2(two & 0xffffu, two >> 16);
}

void main() {
    PlacedBits place = placed[gl_VertexIndex / 6];
    ivec4 turn = turns[gl_InstanceIndex];
    MapBits map = maps[place.map >> 6];

    int vertex = gl_VertexIndex % 6;
    int corner = vertex < 3 ? vertex : 6 - vertex;
    ivec2 low = halves(place.low);
    ivec2 high = halves(place.high);
    ivec2 at = ivec2((corner & 1) == 0 ? low.x : high.x, (corner & 2) == 0 ? low.y : high.y);
    gl_Position = target_position(at, target.side);

    // `MapTurn::texel`, with both maps' places in the translation. Sums may wrap on the way; what they end as fits.
    ivec2 origin = 2 * ivec2(int(place.origin << 16) >> 16, int(place.origin) >> 16);
    int x = turn.z - turn.x * origin.x - turn.y * origin.y - (map.u << SHIFT);
    int z = turn.w - turn.x * origin.y + turn.y * origin.x - (map.v << SHIFT);
    out_turn = ivec4(turn.xy, x, z);
    uint slice = place.map & 63u;
    out_map = uvec4(map.width | map.height << 16, map.first_bit + slice, map.row_bits, map.texel_bits_log2);
}
