//! Size of a graph's clips, and the error that compressing them has caused.

use sabaki::graph::MotionGraph;
use serde_json::{Value, json};

/// Sizes of all clips together.
pub(crate) struct ClipSizes {
    clips: usize,
    compressed: usize,
    bytes: usize,
    plain_bytes: usize,
    /// Largest errors of any clip, at the joints and at the ends, in metres.
    errors: [f32; 2],
}

impl ClipSizes {
    pub(crate) fn of(graph: &MotionGraph) -> Self {
        let mut sizes = Self {
            clips: graph.clips().len(),
            compressed: 0,
            bytes: 0,
            plain_bytes: 0,
            errors: [0.0; 2],
        };
        for clip in graph.clips() {
            let [bytes, plain] = clip.stored_bytes();
            sizes.bytes += bytes;
            sizes.plain_bytes += plain;
            if let Some(errors) = clip.compression_errors() {
                sizes.compressed += 1;
                for (largest, error) in sizes.errors.iter_mut().zip(errors) {
                    *largest = largest.max(error);
                }
            }
        }
        sizes
    }

    fn ratio(&self) -> f64 {
        self.plain_bytes as f64 / self.bytes.max(1) as f64
    }

    pub(crate) fn text(&self) -> String {
        let megabytes = 1e-6 * self.bytes as f64;
        if self.compressed == 0 {
            return format!("clips of {megabytes:.2} MB, not compressed");
        }
        let plain = match self.clips - self.compressed {
            0 => String::new(),
            plain => format!("; {plain} of {} clips not compressed", self.clips),
        };
        let [joints, ends] = self.errors.map(|metres| 1e3 * metres);
        format!(
            "clips of {megabytes:.2} MB, {:.1} times smaller than plain, with at most {joints:.3} mm of error at the joints and {ends:.3} mm at the ends{plain}",
            self.ratio()
        )
    }

    pub(crate) fn to_json(&self) -> Value {
        json!({
            "stored": self.bytes,
            "plain": self.plain_bytes,
            "ratio": self.ratio(),
            "compressed_clips": self.compressed,
            "joint_error": self.errors[0],
            "end_error": self.errors[1],
        })
    }
}
