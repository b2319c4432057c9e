use super::foot_plans::FootPlans;
use super::{Feet, LegBlend, Plant, plan, plants::PlantSearch};
use crate::anim::{Clip, Leg, Skeleton};
use crate::graph::{GraphSettings, MotionGraph};
use crate::math::in_parallel;

impl Feet {
    /// Legs and plants of clips.
    pub(in crate::graph) fn new(
        skeleton: &Skeleton,
        clips: &[Clip],
        settings: &GraphSettings,
    ) -> Self {
        let legs = Leg::all(skeleton);
        let search = PlantSearch {
            skeleton,
            legs: &legs,
            settings: &settings.feet,
        };
        let plants = in_parallel(settings.threads, clips.len(), |clip| {
            search.run(&clips[clip])
        });
        Self {
            legs,
            plants: plants.into_iter().flatten().collect(),
            ..Self::default()
        }
    }
}

impl MotionGraph {
    /// Legs, plants and foot blends.
    #[must_use]
    #[doc(hidden)]
    pub fn feet(&self) -> &Feet {
        &self.feet
    }

    /// Takes the plants of `feet` and, if feet are kept planted, plans the feet of all transitions without a known plan. This is the last step
    /// of building a graph.
    pub(in crate::graph) fn with_feet(
        mut self,
        feet: Feet,
        plans: &FootPlans,
        settings: &GraphSettings,
    ) -> Self {
        self.feet = feet;
        if settings.feet.keep && !self.feet.legs.is_empty() {
            (self.feet.blends, self.feet.root_drops) = plan::all(&self, plans, settings.threads);
        }
        self
    }

    /// Whether the foot data fits the graph. It checks data from a file, after the clips and edges
    /// were found valid.
    pub(in crate::graph) fn feet_fit(&self) -> bool {
        let Feet {
            legs,
            plants,
            blends,
            root_drops,
        } = &self.feet;
        let frames = |table: usize| self.clips[table / legs.len()].frames() as u32;
        let ordered = |plants: &[Plant]| plants.windows(2).all(|pair| pair[0].last < pair[1].first);
        let plants_fit = plants.len() == self.clips.len() * legs.len()
            && plants.iter().enumerate().all(|(table, plants)| {
                let inside =
                    |plant: &Plant| plant.first <= plant.last && plant.last < frames(table);
                ordered(plants) && plants.iter().all(inside)
            });
        let edges = self.edges.len();
        let tables_fit = [[0, 0], [edges * legs.len(), edges]];
        let blend_fits = |(index, blend): (usize, &Option<LegBlend>)| {
            blend.is_none_or(|blend| {
                blend.is_sound(self.edges[index / legs.len()].frames, Skeleton::FURTHEST)
            })
        };
        legs.iter().all(|leg| leg.is_sound(&self.skeleton))
            && plants_fit
            && tables_fit.contains(&[blends.len(), root_drops.len()])
            && blends.iter().enumerate().all(blend_fits)
            && root_drops
                .iter()
                .all(|drop| (0.0..=Skeleton::FURTHEST).contains(drop))
    }
}
