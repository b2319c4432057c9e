//! Reads the texels of the target into maps of bits.

use super::{
    batch::Batch,
    rasterizer::Rasterizer,
    rules::{EVASION, START},
    shelves::Place,
};
use crate::{
    gpu::GpuError,
    maps::{BitMap, Drawing, MapRect, raster::EvasionMaps},
};

impl Rasterizer {
    /// Reads the maps of a batch recorded with [`MapKind::EveryFrame`](super::MapKind::EveryFrame) into `maps`, by the
    /// positions of the drawings.
    ///
    /// # Errors
    /// The error of an invalidate.
    ///
    /// # Safety
    /// This batch was recorded last, and it has finished on the device.
    pub unsafe fn read_every_frame(
        &self,
        drawings: &[Drawing],
        batch: &Batch,
        maps: &mut [EvasionMaps],
    ) -> Result<(), GpuError> {
        // SAFETY: the caller says that the device has finished.
        let texels = unsafe { self.texels(batch) }?;
        for &(index, cell) in &batch.members {
            let rect = drawings[index].rect;
            maps[index] = EvasionMaps {
                body: texels.map(cell, rect, |value| value > EVASION),
                evasion: texels.map(cell, rect, |value| value == EVASION),
            };
        }
        Ok(())
    }

    /// Reads the maps of a batch recorded with [`MapKind::AnyFrame`](super::MapKind::AnyFrame) into `maps`, by the
    /// positions of the drawings.
    ///
    /// # Errors
    /// The error of an invalidate.
    ///
    /// # Safety
    /// This batch was recorded last, and it has finished on the device.
    pub unsafe fn read_any_frame(
        &self,
        drawings: &[Drawing],
        batch: &Batch,
        maps: &mut [BitMap],
    ) -> Result<(), GpuError> {
        // SAFETY: the caller says that the device has finished.
        let texels = unsafe { self.texels(batch) }?;
        for &(index, cell) in &batch.members {
            let drawn = |value| u32::from(value) > START;
            maps[index] = texels.map(cell, drawings[index].rect, drawn);
        }
        Ok(())
    }

    /// Texels of the part of the target that a batch used.
    ///
    /// # Safety
    /// The device has finished.
    unsafe fn texels(&self, batch: &Batch) -> Result<Texels<'_>, GpuError> {
        let buffer = &self.parts.texels;
        buffer.invalidate(&self.context)?;
        let [width, height] = batch.used;
        Ok(Texels {
            // SAFETY: the caller says that nothing is being written.
            values: unsafe { buffer.bytes(u64::from(width) * u64::from(height)) }?,
            width,
        })
    }
}

/// The part of the target that a batch used. Each texel is one byte.
struct Texels<'a> {
    values: &'a [u8],
    width: u32,
}

impl Texels<'_> {
    /// The map in a cell: texels whose value is `wanted`.
    fn map(&self, cell: Place, rect: MapRect, wanted: impl Fn(u8) -> bool) -> BitMap {
        let mut map = BitMap::new(rect);
        for row in 0..rect.height {
            let start = ((cell.y + row) * self.width + cell.x) as usize;
            let values = &self.values[start..start + rect.width as usize];
            for (&value, column) in values.iter().zip(0..) {
                if wanted(value) {
                    map.set(column, row as i32);
                }
            }
        }
        map
    }
}
