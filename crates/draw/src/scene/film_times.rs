//! Times of the pictures of a film whose playback slows down.

/// Range of the durations before and after what a film shows, in seconds.
pub(super) const AROUND: [f32; 2] = [0.0, 60.0];
/// Range of the slowest playback speed, relative to real time.
pub(super) const SLOWEST: [f32; 2] = [0.01, 1.0];
/// Range of the number of pictures per second.
const RATE: [f32; 2] = [1.0, 1000.0];

/// The nearest value in a range. For NaN the least one.
pub(super) fn bounded(value: f32, [least, most]: [f32; 2]) -> f32 {
    value.max(least).min(most)
}

/// Times of the pictures in a span, with `rate` pictures per second. `pace` is the playback speed at a time.
pub(super) fn film_times([start, end]: [f32; 2], rate: f32, pace: impl Fn(f32) -> f32) -> Vec<f32> {
    let rate = f64::from(bounded(rate, RATE));
    let (mut times, mut t) = (Vec::new(), f64::from(start));
    while t < f64::from(end) {
        times.push(t as f32);
        t += f64::from(pace(t as f32)) / rate;
    }
    times
}
