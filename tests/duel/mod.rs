//! Tests of `sabaki::duel`.
mod duel;
