// A map that is drawn.

layout(push_constant) uniform DrawLayer {
    vec4 placement; // cosine and sine of its turn, and its place on the ground
    vec4 grid;      // first column and row in texels, side of a texel, height, metres
    vec4 colour;    // with alpha
    uvec4 extent;   // columns, rows, first word, words of a row
} draw;
