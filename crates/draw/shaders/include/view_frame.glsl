// What all shaders of a picture know: camera, light, and how things fade into the distance.

struct FrameData {
    mat4 camera;    // world to clip space
    mat4 sun;       // world to the clip space of the shadow map
    mat4 unproject; // clip space to world
    vec4 eye;       // the camera's place; w: 1 where the target does not encode sRGB by itself
    vec4 sunward;   // unit, towards the sun; w: metres that a surface is lifted off its own shadow
    vec4 sunlight;
    vec4 above;     // light from above
    vec4 below;     // light from below
    vec4 horizon;   // what distance fades into; w: metres at which it has faded to 1/e
    vec4 zenith;
    vec4 ground;    // the floor's colour; w: how dark the grid is
    vec4 shade;     // x, z of the middle of the shadow map on the ground, its radius; w: unused
    uvec4 counts;   // capsules that darken the floor; the rest unused
};

layout(set = 0, binding = 0, std140) uniform Frames {
    FrameData frames[1];
};

// A colour as the target takes it.
vec3 encoded(vec3 linear) {
    if (frames[0].eye.w == 0.0) {
        return linear;
    }
    vec3 low = linear * 12.92;
    vec3 high = 1.055 * pow(max(linear, vec3(1e-5)), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, lessThan(linear, vec3(0.0031308)));
}

// How much of a thing is left at a place.
float presence(vec3 place) {
    float away = distance(place, frames[0].eye.xyz) / frames[0].horizon.w;
    return exp(-away * away);
}
