// The share of the sun that a place sees: a box of 5 by 5 texels of the shadow map, where its corners and its middle differ. They
// do wherever the edge of a shadow runs through the box, and elsewhere one of them says as much as all.
#extension GL_EXT_samplerless_texture_functions : require

layout(set = 0, binding = 1) uniform texture2D shadow_map;

float texel_lit(ivec2 texel, float depth) {
    return texelFetch(shadow_map, texel, 0).r < depth ? 0.0 : 1.0;
}

float sunlit(vec3 place, vec3 normal) {
    vec3 lifted = place + normal * frames[0].sunward.w;
    vec3 seen = (frames[0].sun * vec4(lifted, 1.0)).xyz;
    ivec2 side = textureSize(shadow_map, 0);
    vec2 at = (seen.xy * 0.5 + 0.5) * vec2(side) - 0.5;
    ivec2 first = ivec2(floor(at)) - 2;
    if (any(lessThan(first, ivec2(0))) || any(greaterThan(first + 5, side - 1)) || seen.z >= 1.0) {
        return 1.0;
    }
    float away = distance(place.xz, frames[0].shade.xy) / frames[0].shade.z;
    float few = texel_lit(first, seen.z) + texel_lit(first + ivec2(5, 0), seen.z) + texel_lit(first + ivec2(0, 5), seen.z)
        + texel_lit(first + 5, seen.z) + texel_lit(first + 2, seen.z);
    if (away >= 1.0 || few == 5.0) {
        return 1.0;
    }
    vec2 part = at - floor(at);
    float sum = 0.0;
    for (int y = 0; y < 6 && few > 0.0; ++y) {
        float row = y == 0 ? 1.0 - part.y : (y == 5 ? part.y : 1.0);
        for (int x = 0; x < 6; ++x) {
            float column = x == 0 ? 1.0 - part.x : (x == 5 ? part.x : 1.0);
            sum += row * column * texel_lit(first + ivec2(x, y), seen.z);
        }
    }
    // The map ends softly.
    return mix(sum / 25.0, 1.0, smoothstep(0.8, 1.0, away));
}
