//! The attack as blocks of 8 × 4 texels, a bit each: plane by plane, clock by clock, in chunks that shaders read as
//! uniforms. Texels are as wide as those of the evasions' maps; where the attack's are wider, the first one of every
//! [pitch](crate::region::MapGrid::attack_pitch) stands for it.

use std::ops::Range;

use crate::{
    avoid::cull::{AttackDrawing, Counted, TimedDisc},
    region::{MapGrid, MapRect, for_each_row},
};

/// Words of a chunk: 16 KiB, the uniform buffer that every device takes.
pub(super) const CHUNK: usize = 4096;
/// Sides of a block, texels.
const COLUMNS: usize = 8;
const ROWS: usize = 4;
/// Words of a plane: slab, plane of the slab, first block, end block.
const PLANE: usize = 4;
/// Words of a block: its place, and a bit for each texel.
const BLOCK: usize = 2;

/// The planes of one clock in a chunk.
#[derive(Clone, Debug)]
struct ClockPlanes {
    clock: u32,
    chunk: u32,
    planes: Range<u32>,
}

/// Blocks of one plane.
#[derive(Clone, Copy, Debug)]
struct Plane {
    clock: u32,
    slab: i32,
    /// Slices of body, slices of outer, evasion.
    number: u32,
    first: u32,
    end: u32,
}

/// The attack of one cull. Used again and again: it allocates nothing once it has held as much.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    /// Chunk after chunk: planes from the front, their blocks from the back.
    pub(super) words: Vec<u32>,
    clocks: Vec<ClockPlanes>,
    planes: Vec<Plane>,
    blocks: Vec<[u32; BLOCK]>,
    canvas: Canvas,
}

/// Before anything is drawn.
const NOTHING: Range<usize> = Range {
    start: usize::MAX,
    end: 0,
};

/// One plane, dense: a word a block.
#[derive(Debug, Default)]
struct Canvas {
    rect: MapRect,
    /// From one texel of the attack to the next.
    pitch: usize,
    columns: usize,
    words: Vec<u32>,
    /// Rows and columns of blocks that may hold something.
    drawn: Option<[Range<usize>; 2]>,
}

impl Blocks {
    /// Draws an attack for maps of a grid. Returns the number of blocks.
    pub(super) fn draw(
        &mut self,
        attack: &AttackDrawing,
        grid: MapGrid,
        counted: Counted,
    ) -> usize {
        let slices = grid.slices;
        self.planes.clear();
        self.blocks.clear();
        self.canvas.stretch(attack.rect, grid.attack_pitch as usize);
        for layer in &attack.layers {
            let [inner, outer] = attack.discs_of(layer);
            let place = (layer.clock, layer.slab.0);
            if counted.body {
                for discs in inner.chunk_by(|a, b| a.slice == b.slice) {
                    self.plane(place, discs[0].slice, discs);
                }
            }
            if counted.outer {
                for discs in outer.chunk_by(|a, b| a.slice == b.slice) {
                    self.plane(place, slices + discs[0].slice, discs);
                }
            }
            if counted.evasion {
                self.plane(place, 2 * slices, inner);
            }
        }
        self.planes
            .sort_unstable_by_key(|plane| (plane.clock, plane.number, plane.slab));
        self.pack();
        self.blocks.len()
    }

    /// One plane; none where nothing is covered.
    fn plane(&mut self, (clock, slab): (u32, i32), number: u32, discs: &[TimedDisc]) {
        let first = self.blocks.len() as u32;
        discs.iter().for_each(|one| self.canvas.draw(one));
        self.canvas.take(&mut self.blocks);
        let end = self.blocks.len() as u32;
        if first < end {
            self.planes.push(Plane {
                clock,
                slab,
                number,
                first,
                end,
            });
        }
    }

    /// Deals planes out to chunks; one that does not fit is cut.
    fn pack(&mut self) {
        self.words.clear();
        self.clocks.clear();
        let (mut front, mut back) = (CHUNK, CHUNK);
        for plane in &self.planes {
            let mut first = plane.first;
            while first < plane.end {
                if back - front < PLANE + BLOCK {
                    self.words.resize(self.words.len() + CHUNK, 0);
                    (front, back) = (0, CHUNK);
                }
                let room = (back - front - PLANE) / BLOCK;
                let count = room.min((plane.end - first) as usize);
                let chunk = self.words.len() / CHUNK - 1;
                let words = &mut self.words[chunk * CHUNK..];
                let blocks = &self.blocks[first as usize..first as usize + count];
                let end = back;
                back -= BLOCK * count;
                words[back..end].copy_from_slice(blocks.as_flattened());
                let range = [back, end].map(|word| (word / BLOCK) as u32);
                words[front..front + PLANE].copy_from_slice(&[
                    plane.slab as u32,
                    plane.number,
                    range[0],
                    range[1],
                ]);
                let number = (front / PLANE) as u32;
                note(&mut self.clocks, plane.clock, (chunk as u32, number));
                front += PLANE;
                first += count as u32;
            }
        }
    }

    /// The planes of a clock in a chunk.
    pub(super) fn planes_of(&self, chunk: u32, clock: u32) -> Range<u32> {
        let mut clocks = self.clocks.iter();
        let found = clocks.find(|one| (one.chunk, one.clock) == (chunk, clock));
        found.map_or(0..0, |one| one.planes.clone())
    }

    /// Chunks of this attack.
    pub(super) fn chunks(&self) -> u32 {
        (self.words.len() / CHUNK) as u32
    }

    /// Chunks of any attack of so many blocks: no chunk but the last one has room for a plane of one block.
    pub(super) fn most_chunks(blocks: u32) -> u64 {
        u64::from(blocks).div_ceil((CHUNK / (PLANE + BLOCK)) as u64)
    }
}

/// Lists a plane of a chunk with those of its clock.
fn note(clocks: &mut Vec<ClockPlanes>, clock: u32, (chunk, number): (u32, u32)) {
    match clocks.last_mut() {
        Some(last) if (last.clock, last.chunk) == (clock, chunk) => last.planes.end = number + 1,
        _ => clocks.push(ClockPlanes {
            clock,
            chunk,
            planes: number..number + 1,
        }),
    }
}

impl Canvas {
    /// Makes room for maps of a rectangle. What is there is 0, whatever its place was.
    fn stretch(&mut self, rect: MapRect, pitch: usize) {
        self.rect = rect;
        self.pitch = pitch;
        self.columns = (pitch * rect.width as usize).div_ceil(COLUMNS);
        let words = self.columns * (pitch * rect.height as usize).div_ceil(ROWS);
        if self.words.len() < words {
            self.words.resize(words, 0);
        }
    }

    fn draw(&mut self, one: &TimedDisc) {
        let (columns, pitch, words) = (self.columns, self.pitch, &mut self.words);
        // The texels of a row of a block that stand for one of the attack's.
        let every = match pitch {
            1 => 0xff,
            2 => 0x55,
            _ => 0x11,
        };
        let mut drawn = self.drawn.take().unwrap_or([NOTHING, NOTHING]);
        for_each_row(one.disc, self.rect, |row, first, last| {
            let [row, first, last] = [row, first, last].map(|texel| texel * pitch);
            let (from, to) = (first / COLUMNS, last / COLUMNS);
            drawn[0] = drawn[0].start.min(row / ROWS)..drawn[0].end.max(row / ROWS + 1);
            drawn[1] = drawn[1].start.min(from)..drawn[1].end.max(to + 1);
            let (low, high) = (0xff << (first % COLUMNS), 0xff >> (7 - last % COLUMNS));
            let shift = COLUMNS * (row % ROWS);
            let words = &mut words[row / ROWS * columns + from..=row / ROWS * columns + to];
            let end = words.len() - 1;
            for (index, word) in words.iter_mut().enumerate() {
                let low = if index == 0 { low } else { 0xff };
                let high = if index == end { high } else { 0xff };
                *word |= (low & high & every) << shift;
            }
        });
        self.drawn = (drawn[0].start < drawn[0].end).then_some(drawn);
    }

    /// Moves what is drawn to the end of the list.
    fn take(&mut self, blocks: &mut Vec<[u32; BLOCK]>) {
        let Some([rows, columns]) = self.drawn.take() else {
            return;
        };
        for row in rows {
            for column in columns.clone() {
                let word = std::mem::take(&mut self.words[row * self.columns + column]);
                if word != 0 {
                    blocks.push([(column | row << 16) as u32, word]);
                }
            }
        }
    }
}
