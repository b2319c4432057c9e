//! Poses groups of sixteen characters with a second clip or an additive layer. The keys of what is mixed in are read
//! character by character, as are those of the first clips if the characters are not near each other in time.

use super::batches::Picked;
use super::chain::Posing;
use super::fetch::Fetch;
use super::group_moments::{ClipRows, ClipWindows};
use super::joint_math::JointMath;
use super::level_clips::LevelClips;
use super::moment::Reach;
use super::moments::Moments;
use super::run::Run;
use super::sampling::{
    AnyColumns, Faded, Layer, Layered, MixedIn, Playing, ReadRows, RowsPart, Window,
};
use super::scratch::AHEAD;
use super::scratch::Scratch;
use super::write::{RunTarget, Target};
use crate::math::{Apart, F32x16, KeyRows, Lanes};

/// The rows of keys that a group reads.
#[derive(Clone, Copy)]
pub(super) struct MixedRows<'a, L: Lanes> {
    /// Rows of the first clips. `None` if the characters share their loads.
    own: Option<KeyRows<'a>>,
    faded: Option<ClipRows<'a, L>>,
    /// Windows in place of the rows of second clips, if the characters share the loads of these, too.
    faded_near: Option<ClipWindows<L>>,
    layer: Option<ClipRows<'a, L>>,
}

impl<L: Lanes> MixedRows<'_, L> {
    pub(super) const NONE: Self = Self {
        own: None,
        faded: None,
        faded_near: None,
        layer: None,
    };
}

impl<L: Lanes> Fetch for MixedRows<'_, L> {
    #[inline(always)]
    fn prefetch_lane(&self, level: &LevelClips, lane: usize) {
        if let Some(rows) = &self.own {
            rows.prefetch_lane(level, lane);
        }
        if let Some(faded) = &self.faded {
            faded.rows.prefetch_lane(level, lane);
        }
        if let Some(layer) = &self.layer {
            layer.rows.prefetch_lane(level, lane);
        }
    }
}

/// A selection of groups to pose.
pub(super) struct MixedWork<'a, 'b, L: Lanes> {
    pub(super) groups: Picked,
    /// Whether the keys of the first of these groups have been prefetched.
    pub(super) is_fetched: bool,
    /// Memory for the rows of these groups, and of the one after them.
    pub(super) rows: &'a mut [MixedRows<'b, L>; AHEAD + 1],
}

/// A group that is posed.
struct MixedGroup<'a, L: Lanes> {
    moments: &'a Moments,
    rows: &'a MixedRows<'a, L>,
    /// Rows of the next group.
    next: Option<&'a MixedRows<'a, L>>,
    /// Moments of the next group.
    windows: &'a Moments,
    columns: &'a mut [Vec<F32x16>; 3],
}

impl Run<'_> {
    /// Poses some groups, whose moments are known.
    #[inline(always)]
    pub(super) fn pose_mixed<'a, L: Lanes, P: JointMath, T: RunTarget>(
        &'a self,
        work: &mut MixedWork<'_, 'a, L>,
        scratch: &mut Scratch,
        to: &mut T,
    ) {
        let Scratch {
            models,
            columns,
            spare,
            moments: ahead,
        } = scratch;
        let MixedWork {
            groups,
            is_fetched,
            rows,
        } = work;
        let places = groups.places();
        for (rows, &place) in rows.iter_mut().zip(places) {
            // Some groups before they are used: numbers that were stored together are not read one by one at once.
            let moments = &ahead[usize::from(place)];
            let run = self;
            L::apart(FindRows { run, moments, rows });
        }
        if !(places.is_empty() || *is_fetched && groups.now() > 0) {
            rows[0].prefetch_all(self.bank);
        }
        for turn in 0..groups.now() {
            let moments = &ahead[groups.place(turn)];
            let rows = &rows[turn..places.len()];
            let group = MixedGroup {
                moments,
                rows: &rows[0],
                next: rows.get(1),
                windows: &ahead[groups.place(turn + 1)],
                columns,
            };
            let out = to.group(moments.group, self.group_lines(), spare);
            self.pose_mixed_group::<L, P, T::Group<'_>>(group, out, models);
        }
    }

    /// Finds the rows of a group. They are large, so they are written in place.
    #[inline(always)]
    fn mixed_rows<'a, L: Lanes>(&'a self, moments: &Moments, to: &mut MixedRows<'a, L>) {
        let cold = &self.cold[moments.group];
        to.own = None;
        if moments.reach == Reach::Apart {
            to.own = Some(self.rows(moments));
        }
        if self.mix.fades {
            let second = self.clip_moments::<L>(&cold.fade);
            to.faded_near = match moments.reach {
                Reach::Apart => None,
                _ if self.mix.is_layered => None,
                _ => self.clip_windows(&cold.fade, &second),
            };
            to.faded = match to.faded_near {
                Some(_) => None,
                None => Some(self.clip_rows(&cold.fade, &second)),
            };
        }
        if self.mix.is_layered {
            let layer = self.clip_moments::<L>(&cold.layer);
            to.layer = Some(self.clip_rows(&cold.layer, &layer));
        }
    }

    #[inline(always)]
    fn pose_mixed_group<L: Lanes, P: JointMath, T: Target>(
        &self,
        group: MixedGroup<'_, L>,
        mut out: T,
        models: &mut [F32x16],
    ) {
        let MixedGroup {
            moments,
            rows,
            next: fetch,
            windows,
            columns: [first, second, third],
        } = group;
        let (bank, cold) = (self.bank, &self.cold[moments.group]);
        let none = KeyRows::none(&self.keys.rows);
        let own_rows = rows.own.as_ref().unwrap_or(&none);
        let unweighted = L::parts(moments.weights::<L>(0));
        let (mut faded, mut layered) = (unweighted, unweighted);
        let (mut fade_rows, mut layer_rows) = (&none, &none);
        if let Some(clip) = &rows.faded {
            (faded, fade_rows) = (clip.weights, &clip.rows);
        }
        if let Some(clip) = &rows.layer {
            (layered, layer_rows) = (clip.weights, &clip.rows);
        }
        for part in 0..L::PARTS {
            let posing: Posing<'_, P> = self.posing(moments, &mut out, models);
            let weights = moments.weights(part);
            let own_from = RowsPart {
                level: bank,
                rows: own_rows,
                part,
            };
            let place = moments.windows(windows, part);
            if let Some(near) = &rows.faded_near {
                let columns = Window::<L, true>::new(self.keys, near.windows[part]);
                let fade = MixedIn {
                    clip: Playing::new(columns, near.weights[part]),
                    weight: L::load(&cold.fade.weight, part),
                };
                let window = Window::<L, true>::new(self.keys, place);
                let own = Playing::new(window, weights);
                posing.joints::<L, _, _>(part, Faded { own, fade }, fetch);
                continue;
            }
            let fade_from = RowsPart {
                rows: fade_rows,
                ..own_from
            };
            let layer_from = RowsPart {
                rows: layer_rows,
                ..own_from
            };
            let fade = MixedIn {
                clip: Playing::new(ReadRows::new::<L>(fade_from, second), faded[part]),
                weight: L::load(&cold.fade.weight, part),
            };
            let own = match moments.reach {
                Reach::Narrow => AnyColumns::Near(Window::new(self.keys, place)),
                Reach::Wide => AnyColumns::Wide(Window::new(self.keys, place)),
                Reach::Apart => AnyColumns::Read(ReadRows::new::<L>(own_from, first)),
            };
            if !self.mix.is_layered {
                // The commonest mixture has a kernel for each kind of columns.
                match own {
                    AnyColumns::Near(window) => {
                        let own = Playing::new(window, weights);
                        posing.joints::<L, _, _>(part, Faded { own, fade }, fetch);
                    }
                    AnyColumns::Wide(window) => {
                        let own = Playing::new(window, weights);
                        posing.joints::<L, _, _>(part, Faded { own, fade }, fetch);
                    }
                    AnyColumns::Read(rows) => {
                        let own = Playing::new(rows, weights);
                        posing.joints::<L, _, _>(part, Faded { own, fade }, fetch);
                    }
                }
                continue;
            }
            let own = Playing::new(own, weights);
            let layer = Layer {
                clip: Playing::new(ReadRows::new::<L>(layer_from, third), layered[part]),
                places: bank.layer_places.iter(),
                weight: L::load(&cold.layer.weight, part),
            };
            if self.mix.fades {
                let own = Faded { own, fade };
                posing.joints::<L, _, _>(part, Layered { own, layer }, fetch);
            } else {
                posing.joints::<L, _, _>(part, Layered { own, layer }, fetch);
            }
        }
        out.write::<L, P>(bank.joints.len(), self.models::<P>(models));
    }
}

/// Finds the rows of a group.
struct FindRows<'a, 'b, L: Lanes> {
    run: &'a Run<'a>,
    moments: &'b Moments,
    rows: &'b mut MixedRows<'a, L>,
}

impl<L: Lanes> Apart<L> for FindRows<'_, '_, L> {
    #[inline(always)]
    fn run(self) {
        self.run.mixed_rows(self.moments, self.rows);
    }
}
