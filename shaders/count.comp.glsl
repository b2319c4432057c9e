// Counts what candidates' maps and the attack share: one invocation per candidate. A work group's candidates share a start time. Several
// work groups for the same candidates take different planes of the attack.
//
// Planes are walked in step, 32 blocks of 8 x 4 texels at most at a time. First every block is held against the rectangle of
// the candidate's plane, without a read; those that may meet it are then looked up, five words for all texels of a block.
// Layout of the words: src/gpu/compute/planes.rs and blocks.rs. CPU twin: src/query/cull/cpu.rs.
#version 460

const int SHIFT = 15;
const int COLUMNS = 8;
const int ROWS = 4;
// Words before the counts, words of a count, words of an entry.
const uint HEADER = 2u;
const uint COUNTS = 3u;
const uint ENTRY = 3u;

layout(local_size_x = 32) in;

// Host: `PlacedPlanes` in src/gpu/shader_table.rs.
struct PlaneCandidate {
    ivec4 turn;     // a, b, tx, tz of `FixedTransform2`
    uint entries;   // word of its region's first entry
    int first_slab;
    uint slabs;
    uint index;     // among the candidates as they were given
};

// Host: `CandidateGroup` in src/gpu/shader_table.rs.
struct GroupRange {
    uint first;
    uint end;
    uint first_plane;
    uint end_plane;
};

layout(set = 0, binding = 0, std430) readonly buffer Atlas {
    uint atlas[];
};
// One chunk. Planes: slab, number, first and end block. Blocks, two in a vector: column and row, bits of the texels.
layout(set = 0, binding = 1, std140) uniform Attack {
    uvec4 attack[1024];
};
layout(set = 0, binding = 2, std430) readonly buffer Candidates {
    PlaneCandidate candidates[];
};
layout(set = 0, binding = 3, std430) readonly buffer Groups {
    GroupRange groups[];
};
// Body, outer, evasion, for each part of a sum and candidate.
layout(set = 0, binding = 4, std430) buffer Results {
    uint results[];
};

layout(push_constant) uniform CountCandidates {
    uint first;      // group of this dispatch
    uint parts;      // groups for the same candidates
    uint candidates;
    uint sums;       // parts of sums of earlier chunks
    uint slices;
    uint planes;     // of a slab
    uint up_to_hits; // whether a candidate is done with when its body is met
} draw;

// A candidate's plane.
struct Plane {
    uint word;
    ivec2 origin;
    uvec2 side; // places for a window's first texel; 0 where there is no plane
};

// Where a block's texels fall: in fixed point, the first one's place.
struct Window {
    ivec2 start;
    ivec2 first; // texel
};

uvec2 block_of(uint block) {
    uvec4 two = attack[block >> 1];
    return (block & 1u) == 0u ? two.xy : two.zw;
}

Window window_of(ivec4 turn, uint place) {
    ivec2 corner = 2 * ivec2(int(place & 0xffffu) * COLUMNS, int(place >> 16) * ROWS) + 1;
    Window window;
    window.start = ivec2(turn.x * corner.x + turn.y * corner.y + turn.z,
                         turn.x * corner.y - turn.y * corner.x + turn.w);
    // Of the corners the one with the least x, and that with the least z.
    ivec2 across = 2 * (COLUMNS - 1) * ivec2(turn.x, -turn.y);
    ivec2 down = 2 * (ROWS - 1) * ivec2(turn.y, turn.x);
    window.first = (window.start + min(across, ivec2(0)) + min(down, ivec2(0))) >> SHIFT;
    return window;
}

Plane plane_of(PlaneCandidate candidate, uint slab, uint number, bool here) {
    Plane plane = Plane(0u, ivec2(0), uvec2(0u));
    if (here && slab < candidate.slabs) {
        uint entry = candidate.entries + ENTRY * (slab * draw.planes + number);
        int origin = int(atlas[entry + 1u]);
        uint side = atlas[entry + 2u];
        plane.word = atlas[entry];
        plane.origin = ivec2((origin << 16) >> 16, origin >> 16);
        plane.side = uvec2(side & 0xffffu, side >> 16);
    }
    return plane;
}

// Where the words of a strip's row pair start.
uint strip_word(Plane plane, uvec2 place) {
    uint rows = ((plane.side.y - 1u) >> 1) + 5u;
    return plane.word + (place.x >> 3) * rows + (place.y >> 1);
}

// How many of a block's texels are set in a plane. They lie in one window: the host refuses turns that enlarge.
uint in_window(ivec4 turn, Plane plane, uint place, uint mask) {
    Window window = window_of(turn, place);
    uvec2 first = uvec2(window.first - plane.origin);
    uint word = strip_word(plane, first);
    uint a = atlas[word];
    uint b = atlas[word + 1u];
    uint c = atlas[word + 2u];
    uint d = atlas[word + 3u];
    uint e = atlas[word + 4u];
    // Counted from the window's words; sums may wrap on the way.
    ivec2 origin = plane.origin + ivec2(first & ~uvec2(7u, 1u));
    ivec2 start = window.start - (origin << SHIFT);
    ivec2 step = 2 * turn.xy;
    uint count = 0u;
    for (int row = 0; row < ROWS; row++) {
        for (int column = 0; column < COLUMNS; column++) {
            int x = (start.x + step.x * column + step.y * row) >> SHIFT;
            int z = (start.y + step.x * row - step.y * column) >> SHIFT;
            uint pair = z < 4 ? (z < 2 ? a : b) : (z < 6 ? c : (z < 8 ? d : e));
            uint found = pair >> uint(((z & 1) << 4) + x);
            count += found & (mask >> uint(row * COLUMNS + column)) & 1u;
        }
    }
    return count;
}

void main() {
    GroupRange range = groups[draw.first + gl_WorkGroupID.x];
    uint part = gl_WorkGroupID.y;
    uint position = range.first + gl_LocalInvocationIndex;
    bool here = position < range.end;
    PlaneCandidate candidate = candidates[min(position, range.end - 1u)];

    uvec3 sum = uvec3(0u);
    uint end = here ? range.end_plane : 0u;
    // Planes of bodies come first.
    for (uint index = range.first_plane + part; index < end; index += draw.parts) {
        uvec4 blocks = attack[index];
        Plane plane = plane_of(candidate, blocks.x - uint(candidate.first_slab), blocks.y, here);
        bool is_body = blocks.y < draw.slices;
        bool stops = is_body && draw.up_to_hits != 0u;
        uint met = 0u;
        for (uint block = blocks.z; block < blocks.w; block++) {
            uvec2 first = uvec2(window_of(candidate.turn, block_of(block).x).first - plane.origin);
            bool meets = first.x < plane.side.x && first.y < plane.side.y;
            met |= meets ? 1u << (block - blocks.z) : 0u;
        }
        uint count = 0u;
        while (met != 0u) {
            uvec2 block = block_of(blocks.z + uint(findLSB(int(met))));
            met &= met - 1u;
            count += in_window(candidate.turn, plane, block.x, block.y);
            met = stops && count > 0u ? 0u : met;
        }
        bool is_evasion = blocks.y == 2u * draw.slices;
        sum.x += is_body ? count : 0u;
        sum.y += is_body || is_evasion ? 0u : count;
        sum.z += is_evasion ? count : 0u;
        end = stops && count > 0u ? 0u : end;
    }
    if (here) {
        uint word = HEADER + ((draw.sums + part) * draw.candidates + candidate.index) * COUNTS;
        results[word] = sum.x;
        results[word + 1u] = sum.y;
        results[word + 2u] = sum.z;
    }
}
