//! Warps: small displacements that make a motion clean if the attack hits it only slightly.
//!
//! Source: motion warping (Witkin & Popović 1995), which Masaoka & Oshita propose as future work (section 7). The warp is solved by
//! sequential linearisation (Gleicher 1997): the distances of the attack from near body spheres are linearised in the warp's
//! parameters, the smallest warp that satisfies all conditions is computed, the body is posed with it, and the step is repeated. The
//! warped motion is accepted only if the exact test finds it clean.

mod limits;
mod linear;
mod ticks;
mod warper;

pub(super) use warper::{Warper, adjust, warp_hits};
