/// Time that each picture of a film is shown: a fraction of a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delay {
    numerator: u16,
    denominator: u16,
}

impl Delay {
    /// The delay at this number of pictures per second.
    #[must_use]
    pub fn of_rate(rate: u16) -> Self {
        Self {
            numerator: 1,
            denominator: rate,
        }
    }

    /// The delay nearest to a number of seconds, 2 at most.
    #[must_use]
    pub fn of_seconds(seconds: f32) -> Self {
        const PARTS: u16 = 30_000;
        Self {
            numerator: (seconds * f32::from(PARTS)).round() as u16,
            denominator: PARTS,
        }
    }

    /// Numerator and denominator, in seconds.
    pub(super) fn fraction(self) -> (u16, u16) {
        (self.numerator, self.denominator.max(1))
    }

    /// The delay of a picture in hundredths of a second. Ends of pictures are rounded, not delays, so that errors do not add up.
    pub(super) fn hundredths(self, picture: usize) -> u16 {
        let (numerator, denominator) = self.fraction();
        let (numerator, denominator) = (u64::from(numerator), u64::from(denominator));
        let start = |picture: u64| (200 * picture * numerator + denominator) / (2 * denominator);
        let picture = picture as u64;
        (start(picture + 1) - start(picture)) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(delay: Delay, pictures: usize) -> u32 {
        let delays = (0..pictures).map(|picture| u32::from(delay.hundredths(picture)));
        delays.sum()
    }

    #[test]
    fn delays_of_any_rate_add_up_to_the_length_of_the_film() {
        let first = |rate| [0, 1, 2, 3].map(|picture| Delay::of_rate(rate).hundredths(picture));
        assert_eq!(first(30), [3, 4, 3, 3]);
        assert_eq!(first(40), [3, 2, 3, 2]);
        assert_eq!(first(25), [4; 4]);
        for rate in 1..=50 {
            for pictures in [1, 7, 100, 1001] {
                let exact = 100.0 * pictures as f64 / f64::from(rate);
                let found = f64::from(sum(Delay::of_rate(rate), pictures));
                assert!((found - exact).abs() <= 0.5, "{rate}: {found} {exact}");
            }
        }
        assert_eq!(sum(Delay::of_seconds(0.073), 100), 730);
        assert_eq!(sum(Delay::default(), 100), 0);
    }
}
