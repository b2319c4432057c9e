// The surface around two spheres and what lies between them, by the number of a vertex of a mesh of rings.

const float QUARTER = 1.57079632679;

// Which view, and how fine the mesh is; the crowd's members by their numbers.
layout(push_constant) uniform DrawBodies {
    uint sun;
    uint segments;
    uint rings;
    uint first_character;
    uint first_part;
    uint parts;
} draw;

struct Surface {
    vec3 place;
    vec3 normal;
};

// Rings 0 to `rings` go from the pole of `a` to where the two spheres' common tangents leave it, the others from there
// to the pole of `b`.
Surface surface(uint vertex, vec4 a, vec4 b) {
    vec3 between = b.xyz - a.xyz;
    float apart = length(between);
    vec3 axis = apart > 1e-5 ? between / apart : vec3(0.0, 1.0, 0.0);
    vec3 side = normalize(cross(axis, abs(axis.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    vec3 front = cross(side, axis);
    float tangent = asin(clamp((a.w - b.w) / max(apart, 1e-5), -1.0, 1.0));
    uint ring = vertex / draw.segments;
    float around = 4.0 * QUARTER * float(vertex % draw.segments) / float(draw.segments);
    bool at_b = ring > draw.rings;
    float along = float(at_b ? ring - draw.rings - 1u : ring) / float(draw.rings);
    float latitude = at_b ? mix(tangent, QUARTER, along) : mix(-QUARTER, tangent, along);
    vec3 out_of = side * cos(around) + front * sin(around);
    vec3 normal = out_of * cos(latitude) + axis * sin(latitude);
    vec4 ball = at_b ? b : a;
    return Surface(ball.xyz + normal * ball.w, normal);
}

vec4 seen(vec3 place) {
    mat4 view = draw.sun == 1u ? frames[0].sun : frames[0].camera;
    return view * vec4(place, 1.0);
}
