// Counts texels, where the maps are in a storage buffer.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tally.glsl"
