// Counts texels, where the maps are in a texel buffer.
#version 460
#extension GL_GOOGLE_include_directive : require
#define TEXELS
#include "tally.glsl"
