//! Lower bounds of the distance of two windows, which need a fraction of its work.
//!
//! Sources: that a contraction never loses a near pair is from Faloutsos, Ranganathan & Manolopoulos, "Fast subsequence matching
//! in time-series databases" (1994); that principal components are the contraction that keeps most, from Korn, Jagadish &
//! Faloutsos (1997); balls and the triangle inequality are from Yianilos, "Data structures and algorithms for nearest neighbor
//! search in general metric spaces" (1993).
//!
//! The points of a window are a vector: a real number for each height and, because rotations about the vertical axis are
//! products with a complex number of length 1, a complex number for each place on the ground, relative to the ground mean. Each
//! is scaled by the root of its weight. With the inner products of such vectors, the distance that
//! [`distance`](crate::graph::distance) defines is
//! ```text
//! D²(P, Q) = min over φ of |hP - hQ|² + |gP - e^iφ gQ|²
//! ```
//! - **Contraction.** An orthogonal projection onto k directions does not commute with heights alone: it commutes with φ too.
//!   Of what it leaves out, at least the lengths are known, and lengths do not depend on φ. So, with projections h', g' and
//!   lengths of the remainders r, s:
//!   ```text
//!   d² = |h'P - h'Q|² + (rP - rQ)² + (sP - sQ)² + |g'P|² + |g'Q|² - 2 |<g'P, g'Q>|  ≤  D²
//!   ```
//! - **Balls.** φ acts by isometries, so d is a distance itself, and the triangle inequality holds. For windows within r of a
//!   window C and windows within s of a window E, d is at least d(C, E) - r - s.
//! - **Rounding.** The kernel of the distance map computes in f32. The norms of windows are reduced by more than its error, so
//!   that the bound is below the computed distance too: see `slack` in `features`.

mod features;
mod projection;

pub(super) use features::{Features, NODE, NODES};
pub(super) use projection::Projection;
