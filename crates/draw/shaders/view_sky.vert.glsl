// One triangle over the whole picture, as far away as can be.
#version 460

layout(location = 0) out vec2 out_at;

void main() {
    out_at = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
    gl_Position = vec4(out_at, 0.0, 1.0);
}
