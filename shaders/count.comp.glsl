// Counts what one candidate's maps and the attack share: a work group a candidate, or several for different parts of the
// attack. First every block of 4 x 4 texels is held against a tile of the candidate's region, which says what may be near;
// then the texels of the blocks that are left are looked up.
// Layout of the words: src/gpu/compute/pages.rs and gathered.rs. CPU twin: src/avoid/cull/cpu.rs.
#version 460

const uint GROUP = 64u;
// Blocks that are sorted out at a time.
const uint BATCH = 1024u;
const int SHIFT = 15;
const int BLOCK = 4;
const uint BLOCK_TEXELS = 16u;
const int TILE_LOG2 = 3;
const uint TILE_TEXELS = 64u;
// With larger turns a block reaches further than tiles know: `NEAR` in src/gpu/compute/pages.rs.
const int LARGEST_TURN = 32768;
// Words before the counts, and words of a count.
const uint HEADER = 2u;
const uint COUNTS = 3u;

layout(local_size_x = 64) in;

// Host: `Paged` in src/gpu/shader_table.rs.
struct PagedCandidate {
    ivec4 turn;       // a, b, tx, tz of `MapTurn`
    ivec2 origin;     // first texel of the region's tiles
    ivec2 side;       // its tiles across and down, in each slab
    uint tiles;       // position of its first tile
    uint first_slab;
    uint slabs;
    uint first_block; // of its clock
    uint end_block;
    uint padding_x;
    uint padding_y;
    uint padding_z;
};

// Tiles, then pages. A tile: the word where its page starts, 0 for none; then the mask of all that lies in it and near
// it. A page: body masks of its texels, outer masks, evasion bits.
layout(set = 0, binding = 0, std430) readonly buffer Atlas {
    uint atlas[];
};
// Blocks (place and slab; number of its texels), their masks, inner masks of texels, outer masks of texels.
layout(set = 0, binding = 1, std430) readonly buffer Attack {
    uint attack[];
};
layout(set = 0, binding = 2, std430) readonly buffer Candidates {
    PagedCandidate candidates[];
};
// Body, outer, evasion, for each candidate and part.
layout(set = 0, binding = 3, std430) buffer Results {
    uint results[];
};

layout(push_constant) uniform CountCandidates {
    uint first; // group of this dispatch
    uint parts; // groups for each candidate
    uint lanes; // words of a mask
    uint masks; // where in `attack` they start
    uint inner;
    uint outer;
} draw;

shared uint survivors[BATCH];
shared uint survivor_count;
shared uint sums[GROUP * COUNTS];

// Like `MapTurn::texel`, for a place in halves of texels.
ivec2 turned(ivec4 turn, ivec2 place) {
    int x = turn.x * place.x + turn.y * place.y + turn.z;
    int z = turn.x * place.y - turn.y * place.x + turn.w;
    return ivec2(x >> SHIFT, z >> SHIFT);
}

// Column and row of a block's first texel.
ivec2 first_texel(uint place) {
    return ivec2(int(place & 511u), int((place >> 9) & 511u)) * BLOCK;
}

bool has_tile(PagedCandidate candidate, ivec2 tile) {
    return tile.x >= 0 && tile.y >= 0 && tile.x < candidate.side.x && tile.y < candidate.side.y;
}

// Where the tile's words start.
uint tile_word(PagedCandidate candidate, uint slab, ivec2 tile) {
    uint row = slab * uint(candidate.side.y) + uint(tile.y);
    uint index = candidate.tiles + row * uint(candidate.side.x) + uint(tile.x);
    return index * (1u + draw.lanes);
}

// Whether some texel of a block may share something with the candidate's maps.
bool may_meet(PagedCandidate candidate, uint block) {
    uint place = attack[2u * block];
    uint slab = (place >> 18) - candidate.first_slab;
    if (slab >= candidate.slabs) {
        return false;
    }
    if (abs(candidate.turn.x) + abs(candidate.turn.y) > LARGEST_TURN) {
        return true;
    }
    ivec2 middle = 2 * first_texel(place) + BLOCK;
    ivec2 tile = (turned(candidate.turn, middle) - candidate.origin) >> TILE_LOG2;
    if (!has_tile(candidate, tile)) {
        return false;
    }
    uint word = tile_word(candidate, slab, tile) + 1u;
    uint shared_bits = 0u;
    for (uint lane = 0u; lane < draw.lanes; lane++) {
        shared_bits |= attack[draw.masks + block * draw.lanes + lane] & atlas[word + lane];
    }
    return shared_bits != 0u;
}

// What a texel of the attack, with masks from `mask` on, shares with a page, whose texel it is.
uvec3 shared_with(uint page, uint texel, uint mask) {
    uvec3 found = uvec3(0u);
    uint any_inner = 0u;
    for (uint lane = 0u; lane < draw.lanes; lane++) {
        uint inner = attack[draw.inner + mask + lane * BLOCK_TEXELS];
        uint outer = attack[draw.outer + mask + lane * BLOCK_TEXELS];
        uint body = page + texel * draw.lanes + lane;
        if (inner != 0u) {
            found.x += uint(bitCount(inner & atlas[body]));
        }
        if (outer != 0u) {
            found.y += uint(bitCount(outer & atlas[body + TILE_TEXELS * draw.lanes]));
        }
        any_inner |= inner;
    }
    uint evasion = page + 2u * TILE_TEXELS * draw.lanes + (texel >> 5);
    if (any_inner != 0u) {
        found.z = (atlas[evasion] >> (texel & 31u)) & 1u;
    }
    return found;
}

// One row of a block.
uvec3 count_row(PagedCandidate candidate, uint block, int row) {
    uvec3 sum = uvec3(0u);
    uint place = attack[2u * block];
    uint mask = attack[2u * block + 1u] * (BLOCK_TEXELS * draw.lanes) + uint(row * BLOCK);
    uint slab = (place >> 18) - candidate.first_slab;
    ivec2 first = first_texel(place);
    for (int column = 0; column < BLOCK; column++) {
        ivec2 centre = 2 * (first + ivec2(column, row)) + 1;
        ivec2 at = turned(candidate.turn, centre) - candidate.origin;
        ivec2 tile = at >> TILE_LOG2;
        if (has_tile(candidate, tile)) {
            uint page = atlas[tile_word(candidate, slab, tile)];
            if (page != 0u) {
                uint texel = uint(at.y & 7) * 8u + uint(at.x & 7);
                sum += shared_with(page, texel, mask + uint(column));
            }
        }
    }
    return sum;
}

// Sums up the group's counts and writes them.
void write_sum(uint local, uint group, uvec3 sum) {
    sums[local] = sum.x;
    sums[GROUP + local] = sum.y;
    sums[2u * GROUP + local] = sum.z;
    barrier();
    if (local < COUNTS) {
        uint total = 0u;
        for (uint index = 0u; index < GROUP; index++) {
            total += sums[local * GROUP + index];
        }
        results[HEADER + group * COUNTS + local] = total;
    }
}

void main() {
    uint local = gl_LocalInvocationIndex;
    uint group = draw.first + gl_WorkGroupID.x;
    PagedCandidate candidate = candidates[group / draw.parts];
    uint blocks = candidate.end_block - candidate.first_block;
    uint part = group % draw.parts;
    uint start = candidate.first_block + blocks * part / draw.parts;
    uint end = candidate.first_block + blocks * (part + 1u) / draw.parts;

    uvec3 sum = uvec3(0u);
    for (uint batch = start; batch < end; batch += BATCH) {
        if (local == 0u) {
            survivor_count = 0u;
        }
        barrier();
        for (uint block = batch + local; block < min(end, batch + BATCH); block += GROUP) {
            if (may_meet(candidate, block)) {
                survivors[atomicAdd(survivor_count, 1u)] = block;
            }
        }
        barrier();
        uint rows = survivor_count * uint(BLOCK);
        for (uint row = local; row < rows; row += GROUP) {
            sum += count_row(candidate, survivors[row / uint(BLOCK)], int(row % uint(BLOCK)));
        }
        barrier();
    }
    write_sum(local, group, sum);
}
