//! Ranges of the numbers that options give.

use std::ops::RangeInclusive;

use clap::builder::TypedValueParser;

use super::Failure;

/// Reads a whole number of a range. Of a number outside it, negative ones too, the message tells the range.
pub(crate) fn whole<T>(range: RangeInclusive<i64>) -> impl TypedValueParser<Value = T>
where
    T: TryFrom<i64, Error: std::error::Error + Send + Sync + 'static>
        + Clone
        + Send
        + Sync
        + 'static,
{
    clap::value_parser!(i64).range(range).try_map(T::try_from)
}

/// Refuses a number that an option gives and that is not allowed; `what` names the option and its range.
pub(crate) fn check_number(is_allowed: bool, what: impl FnOnce() -> String) -> Result<(), Failure> {
    match is_allowed {
        true => Ok(()),
        false => Err(Failure::Usage(what())),
    }
}
