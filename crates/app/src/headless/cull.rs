//! Draws maps and counts overlaps, each in one call.

use super::Headless;
use sabaki::gpu::{Culler, GpuError, PassTime};
use sabaki::internal::{BatchMaps, BitMap, Drawing, MapKind, Rasterizer, raster::EvasionMaps};
use sabaki::query::cull::{CullInput, Overlap, cpu};

impl Headless {
    /// Body and evasion maps of many drawings: [`raster::every_frame`](sabaki::internal::raster::every_frame) on the device.
    ///
    /// # Errors
    /// [`Rasterizer::plan`]'s, or those of [`Headless::run`].
    pub fn every_frame(
        &mut self,
        rasterizer: &mut Rasterizer,
        drawings: &[Drawing],
    ) -> Result<Vec<EvasionMaps>, GpuError> {
        let empty = |drawing: &Drawing| EvasionMaps {
            body: BitMap::new(drawing.rect),
            evasion: BitMap::new(drawing.rect),
        };
        let mut maps: Vec<_> = drawings.iter().map(empty).collect();
        for batch in &rasterizer.plan(drawings)? {
            let recorded = BatchMaps {
                drawings,
                batch,
                kind: MapKind::EveryFrame,
            };
            // SAFETY: `run` gives a buffer that is being recorded, and has waited for the batch before.
            self.run(|cmd| unsafe { rasterizer.record(cmd, recorded) })?;
            // SAFETY: `run` has waited.
            unsafe { rasterizer.read_every_frame(drawings, batch, &mut maps) }?;
        }
        Ok(maps)
    }

    /// Attack maps of many drawings: [`raster::any_frame`](sabaki::internal::raster::any_frame) on the device.
    ///
    /// # Errors
    /// [`Rasterizer::plan`]'s, or those of [`Headless::run`].
    pub fn any_frame(
        &mut self,
        rasterizer: &mut Rasterizer,
        drawings: &[Drawing],
    ) -> Result<Vec<BitMap>, GpuError> {
        let mut maps: Vec<_> = drawings
            .iter()
            .map(|drawing| BitMap::new(drawing.rect))
            .collect();
        for batch in &rasterizer.plan(drawings)? {
            let recorded = BatchMaps {
                drawings,
                batch,
                kind: MapKind::AnyFrame,
            };
            // SAFETY: as in `every_frame`.
            self.run(|cmd| unsafe { rasterizer.record(cmd, recorded) })?;
            // SAFETY: `run` has waited.
            unsafe { rasterizer.read_any_frame(drawings, batch, &mut maps) }?;
        }
        Ok(maps)
    }

    /// Overlaps of any number of candidates: [`cpu::count`] on the device, as far as
    /// the culler [counts](sabaki::query::cull::Counted) them.
    ///
    /// Without precise queries the device only says which candidates meet the attack: [`Overlap::body`] and
    /// [`Overlap::outer`] are 0 or not 0, and [`Overlap::evasion`] is counted on the CPU.
    ///
    /// # Errors
    /// [`Culler::record`]'s, or those of [`Headless::run`].
    pub fn cull(
        &mut self,
        culler: &mut Culler,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, GpuError> {
        self.cull_timed(culler, input, &mut Vec::new())
    }

    /// As [`Headless::cull`]. Adds the times of the passes to `times`, if the culler has
    /// [timestamps](sabaki::gpu::CullerDesc::timestamps).
    ///
    /// # Errors
    /// As [`Headless::cull`].
    pub fn cull_timed(
        &mut self,
        culler: &mut Culler,
        input: &CullInput<'_>,
        times: &mut Vec<PassTime>,
    ) -> Result<Vec<Overlap>, GpuError> {
        let mut all = Vec::with_capacity(input.candidates.len());
        let (mut some, mut exact, mut passes) = (Vec::new(), Vec::new(), Vec::new());
        let mut rest = input.candidates;
        let mut most = culler.max_candidates().max(1) as usize;
        while !rest.is_empty() {
            let (candidates, later) = rest.split_at(most.min(rest.len()));
            let part = CullInput {
                candidates,
                ..*input
            };
            // SAFETY: `run` gives a buffer that is being recorded, and has waited for the one before.
            let ticket = match self.run(|cmd| unsafe { culler.record(cmd, 0, &part) }) {
                Err(GpuError::Limit { limit, .. })
                    if limit == "StencilSettings::max_boxes" && candidates.len() > 1 =>
                {
                    most = candidates.len() / 2;
                    continue;
                }
                other => other?,
            };
            if !culler.poll(ticket, &mut some)? {
                return Err(GpuError::Unfinished);
            }
            culler.pass_times(ticket, &mut passes)?;
            add_times(&passes, times);
            if !culler.counts_exact() && culler.counted().evasion {
                cpu::count(&part, &mut exact);
                let pairs = some.iter_mut().zip(&exact);
                pairs.for_each(|(found, exact)| found.evasion = exact.evasion);
            }
            all.append(&mut some);
            rest = later;
        }
        Ok(all)
    }
}

/// Adds the times of passes to sums by name.
fn add_times(passes: &[PassTime], sums: &mut Vec<PassTime>) {
    for pass in passes {
        match sums.iter_mut().find(|sum| sum.name == pass.name) {
            Some(sum) => sum.time += pass.time,
            None => sums.push(*pass),
        }
    }
}
