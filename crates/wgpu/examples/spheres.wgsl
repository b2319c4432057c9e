// Spheres as discs that are shaded like spheres, one an instance.
struct Disc {
    @builtin(position) clip: vec4f,
    @location(0) at: vec2f,
    @location(1) colour: vec3f,
}

// Camera space, metres: x, y, radius, and how much lower than wide it is drawn.
@vertex
fn vertex(@builtin(vertex_index) corner: u32, @location(0) place: vec4f, @location(1) colour: vec3f) -> Disc {
    let at = vec2f(f32(corner & 1u), f32(corner >> 1u)) * 2.0 - 1.0;
    let point = place.xy + at * place.z * vec2f(1.0, place.w);
    return Disc(vec4f(point / 1.9, 0.0, 1.0), at, colour);
}

@fragment
fn fragment(disc: Disc) -> @location(0) vec4f {
    let out = dot(disc.at, disc.at);
    if out > 1.0 {
        discard;
    }
    let normal = vec3f(disc.at, sqrt(1.0 - out));
    let light = 0.35 + 0.65 * max(dot(normal, normalize(vec3f(-0.5, 0.8, 0.6))), 0.0);
    return vec4f(disc.colour * light, 1.0);
}
