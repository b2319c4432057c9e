use glam::Vec3;
use sabaki::anim::Clip;

/// Smooths places with a triangular window of a half width in seconds. A window narrower than a frame changes nothing.
pub(super) fn smoothed(places: &[Vec3], half_width: f64, rate: f64) -> Vec<Vec3> {
    let frames = half_width * rate;
    let side = frames.ceil() as usize;
    let weights: Vec<f32> = (0..=side)
        .map(|away| (1.0 - away as f64 / frames.max(1e-9)).max(0.0) as f32)
        .collect();
    let last = places.len().saturating_sub(1);
    let at = |frame: usize| {
        let (mut sum, mut total) = (places[frame], 1.0);
        for (away, &weight) in weights.iter().enumerate().skip(1) {
            let pair = places[frame.saturating_sub(away)] + places[(frame + away).min(last)];
            sum += weight * pair;
            total += 2.0 * weight;
        }
        sum / total
    };
    (0..places.len()).map(at).collect()
}

/// Speeds by central differences; at the ends by one-sided ones. `places` has at least two frames.
pub(super) fn speeds(places: &[Vec3], rate: f64) -> Vec<f32> {
    let last = places.len() - 1;
    let at = |frame: usize| {
        let (from, to) = (frame.saturating_sub(1), (frame + 1).min(last));
        places[from].distance(places[to]) * rate as f32 / (to - from) as f32
    };
    (0..places.len()).map(at).collect()
}

/// A curve of a frame rate in the frames of a clip, linear between its values.
pub(super) fn in_frames(curve: &[f32], rate: f64, clip: &Clip) -> Vec<f32> {
    if rate == clip.frame_rate() {
        return curve.to_vec();
    }
    let last = curve.len().saturating_sub(1);
    let at = |frame: usize| {
        let place = frame as f64 * rate / clip.frame_rate();
        let lower = (place as usize).min(last);
        let (from, to) = (curve[lower], curve[(lower + 1).min(last)]);
        from + (to - from) * (place - lower as f64).min(1.0) as f32
    };
    (0..clip.frames()).map(at).collect()
}

/// Differences of two lists of places.
pub(super) fn between(to: &[Vec3], from: &[Vec3]) -> Vec<Vec3> {
    to.iter().zip(from).map(|(&to, &from)| to - from).collect()
}

/// Largest of some values; 0 for none.
pub(super) fn largest(values: impl IntoIterator<Item = f32>) -> f32 {
    values.into_iter().fold(0.0, f32::max)
}

/// Smallest of some values; infinite for none.
pub(super) fn least(values: impl IntoIterator<Item = f32>) -> f32 {
    values.into_iter().fold(f32::INFINITY, f32::min)
}
