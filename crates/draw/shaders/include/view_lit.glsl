// A surface in the light of a sun and of a sky.

// The colour of a place with a unit normal.
vec3 lit_colour(vec3 place, vec3 up, vec3 base) {
    FrameData frame = frames[0];
    vec3 eyeward = normalize(frame.eye.xyz - place);
    vec3 sunward = frame.sunward.xyz;
    float facing = max(dot(up, sunward), 0.0);
    float lit = facing > 0.0 ? sunlit(place, up) : 0.0;
    // What is near the ground sees less of the sky.
    float open = mix(0.72, 1.0, smoothstep(0.0, 0.7, place.y));
    vec3 sky = mix(frame.below.rgb, frame.above.rgb, up.y * 0.5 + 0.5) * open;
    vec3 light = sky + frame.sunlight.rgb * facing * lit;
    float edge = 1.0 - max(dot(up, eyeward), 0.0);
    float gloss = pow(max(dot(up, normalize(eyeward + sunward)), 0.0), 32.0) * lit * 0.12;
    vec3 seen = base * light + gloss + frame.above.rgb * (0.10 * pow(edge, 4.0));
    return mix(frame.horizon.rgb, seen, presence(place));
}

// Ghosts are clearer where one looks straight at them.
float ghost_alpha(vec3 place, vec3 up, float alpha) {
    float edge = 1.0 - max(dot(up, normalize(frames[0].eye.xyz - place)), 0.0);
    return alpha < 1.0 ? min(alpha * mix(0.55, 1.6, edge * edge), 1.0) : 1.0;
}
