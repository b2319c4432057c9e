// Keeps the texels that a disc covers; what they mean is for the stencil test to say.
// CPU twin: `Disc::covers` in src/maps/disc.rs.
#version 460

const int SUB_TEXELS = 16;

layout(location = 0) flat in ivec3 disc;

void main() {
    ivec2 centre = ivec2(gl_FragCoord.xy) * SUB_TEXELS + SUB_TEXELS / 2;
    ivec2 away = centre - disc.xy;
    if (away.x * away.x + away.y * away.y > disc.z * disc.z) {
        discard;
    }
}
