//! Ranges of the numbers that options give.

use std::num::IntErrorKind;
use std::ops::RangeInclusive;

use clap::builder::TypedValueParser;

/// Reads a whole number of a range. The message about any other number, negative or however long, tells the range.
pub(crate) fn whole<T>(range: RangeInclusive<u64>) -> impl TypedValueParser<Value = T>
where
    T: TryFrom<u64> + Clone + Send + Sync + 'static,
{
    move |text: &str| {
        let outside = || format!("{text} is not in {}..={}", range.start(), range.end());
        match text.parse::<i128>() {
            Ok(number) => {
                let number = u64::try_from(number).ok();
                let inside = number.filter(|number| range.contains(number));
                let read = inside.and_then(|number| T::try_from(number).ok());
                read.ok_or_else(outside)
            }
            Err(error) => Err(match error.kind() {
                IntErrorKind::PosOverflow | IntErrorKind::NegOverflow => outside(),
                _ => error.to_string(),
            }),
        }
    }
}

/// Reads a number of a range.
pub(crate) fn number(range: RangeInclusive<f32>) -> impl TypedValueParser<Value = f32> {
    move |text: &str| match text.parse::<f32>() {
        Ok(number) if range.contains(&number) => Ok(number),
        Ok(_) => Err(format!("must be {} to {}", range.start(), range.end())),
        Err(error) => Err(error.to_string()),
    }
}
