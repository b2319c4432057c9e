//! The shapes of a clothed person. Lengths are of a body 1.75 m tall.

use glam::{Quat, Vec3};

use super::anatomy::{Anatomy, LEFT};
use super::shapes::{Carrier, Form, Shape, Shapes};
use crate::scene::Look;
use sabaki::anim::{JointId, Leg};

/// Height that lengths are given for, in metres.
const HEIGHT: f32 = 1.75;
/// Width over which shapes blend, and over which the hems of clothes do, in metres.
const SOFT: f32 = 0.035;
const HEM: f32 = 0.006;

pub(super) fn shapes(anatomy: &Anatomy, look: &Look) -> Shapes {
    let mut builder = BodyBuilder {
        anatomy,
        look,
        scale: anatomy.height / HEIGHT,
        limb: 0,
        all: Vec::new(),
    };
    builder.trunk();
    for side in 0..2 {
        builder.limb = 1 + side as u32;
        builder.leg(side);
        builder.foot(side);
    }
    for side in 0..2 {
        builder.limb = 3 + side as u32;
        builder.arm(side);
        builder.fist(side);
    }
    builder.limb = 5;
    builder.head();
    let trunk = anatomy.trunk.iter();
    let [left, right] = [0, 1].map(|side| [anatomy.legs[side].hip, anatomy.arms[side].hip]);
    Shapes {
        all: builder.all,
        sole: anatomy.sole,
        trunk: trunk.map(|&id| (id, anatomy.at(id).y)).collect(),
        wide: [left[0], left[1], right[0], right[1]].map(|id| anatomy.at(id)),
        height: anatomy.height,
    }
}

/// Builds the shapes of a body, part by part.
struct BodyBuilder<'a> {
    anatomy: &'a Anatomy,
    look: &'a Look,
    scale: f32,
    /// Number of the limb whose shapes are added.
    limb: u32,
    all: Vec<Shape>,
}

/// The part whose shapes are added: the joint that moves them, their colour, and the width over which they blend.
#[derive(Clone, Copy)]
struct Part(Carrier, Vec3, f32);

impl Part {
    fn of(joint: JointId, colour: Vec3, blend: f32) -> Self {
        Self(Carrier::Joint(joint), colour, blend)
    }
}

impl BodyBuilder<'_> {
    fn add(&mut self, Part(carrier, colour, blend): Part, form: Form) {
        self.all.push(Shape {
            form,
            carrier,
            limb: self.limb,
            colour,
            blend: blend * self.scale,
        });
    }

    fn cone(&mut self, part: Part, ends: [Vec3; 2], radii: [f32; 2]) {
        self.flat_cone(part, ends, radii, 1.0);
    }

    fn flat_cone(&mut self, part: Part, ends: [Vec3; 2], radii: [f32; 2], depth: f32) {
        let radii = radii.map(|radius| radius * self.scale);
        self.add(part, Form::Cone { ends, radii, depth });
    }

    /// An ellipsoid beside a place.
    fn ball(&mut self, part: Part, place: Vec3, [x, y, z]: [f32; 3], radii: [f32; 3]) {
        let centre = place + self.by(x, y, z);
        self.turned_ball(part, centre, Vec3::Y, radii);
    }

    /// An ellipsoid whose own Y points along a direction.
    fn turned_ball(&mut self, part: Part, centre: Vec3, along: Vec3, radii: [f32; 3]) {
        let form = Form::Ellipsoid {
            centre,
            radii: Vec3::from(radii) * self.scale,
            rotation: Quat::from_rotation_arc(Vec3::Y, along),
        };
        self.add(part, form);
    }

    /// A vector of a body 1.75 m tall.
    fn by(&self, x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::new(x, y, z) * self.scale
    }

    fn trunk(&mut self) {
        let Anatomy { legs, arms, .. } = self.anatomy;
        let at = |id: JointId| self.anatomy.at(id);
        let hips = 0.5 * (at(legs[0].hip) + at(legs[1].hip));
        let shoulders = self.anatomy.shoulders();
        let half = |limbs: &[Leg; 2]| 0.5 * at(limbs[0].hip).distance(at(limbs[1].hip));
        let (hip, shoulder) = (half(legs) / self.scale, half(arms) / self.scale);
        let (nape, head) = (self.anatomy.nape(), at(self.anatomy.head));
        let rise = shoulders - hips;
        let long = rise.length() / self.scale;
        let cloth = Part(Carrier::Trunk, self.look.clothes, SOFT);
        let pelvis = [hip + 0.075, 0.125, 0.108];
        self.ball(cloth, hips, [0.0, 0.03, -0.005], pelvis);
        for side in [1.0, -1.0] {
            let seat = [side * (hip - 0.018), -0.015, -0.052];
            self.ball(cloth, hips, seat, [0.078, 0.085, 0.075]);
        }
        let waist = [hips + rise * 0.20, hips + rise * 0.62];
        self.flat_cone(cloth, waist, [0.130, 0.142], 0.74);
        let ribs = [(shoulder - 0.018).max(0.11), 0.40 * long, 0.112];
        self.ball(cloth, hips + rise * 0.70, [0.0, 0.0, -0.004], ribs);
        for side in [1.0, -1.0] {
            let breast = [side * 0.45 * shoulder, 0.0, 0.036];
            self.ball(cloth, hips + rise * 0.80, breast, [0.085, 0.075, 0.065]);
        }
        for arm in arms {
            let across = self.anatomy.at(arm.hip) - nape;
            let ends = [nape + self.by(0.0, -0.005, -0.012), nape + across * 0.62];
            self.cone(cloth, ends, [0.052, 0.044]);
        }
        let collar = [
            nape - rise.normalize_or(Vec3::Y) * (0.03 * self.scale),
            nape + (head - nape).normalize_or(Vec3::Y) * (0.015 * self.scale),
        ];
        self.cone(cloth, collar, [0.066, 0.060]);
        // A belt with a knot, and ends that hang down from it.
        let belt = Part(Carrier::Trunk, self.look.dark, HEM);
        let waist = hips + rise * 0.24;
        let (centre, radii) = (
            waist - self.by(0.0, 0.0, 0.002),
            self.by(0.148, 0.024, 0.112),
        );
        self.add(belt, Form::Ring { centre, radii });
        self.ball(belt, waist, [0.0, 0.0, 0.110], [0.026, 0.026, 0.018]);
        for side in [0.03, -0.03] {
            let ends = [self.by(0.0, 0.0, 0.110), self.by(side, -0.085, 0.112)];
            self.flat_cone(belt, ends.map(|end| waist + end), [0.014, 0.017], 0.6);
        }
    }

    fn leg(&mut self, side: usize) {
        let leg = self.anatomy.legs[side];
        let [hip, knee, ankle] = [leg.hip, leg.knee, leg.foot].map(|id| self.anatomy.at(id));
        let thigh = Part::of(leg.hip, self.look.clothes, SOFT);
        let shin = Part::of(leg.knee, self.look.clothes, SOFT);
        self.cone(thigh, [hip, knee], [0.092, 0.060]);
        let front = hip.lerp(knee, 0.42) + self.by(0.0, 0.0, 0.014);
        let along = (hip - knee).normalize_or(Vec3::Y);
        self.turned_ball(thigh, front, along, [0.074, 0.17, 0.076]);
        self.cone(shin, [knee, knee.lerp(ankle, 0.76)], [0.059, 0.058]);
        let back = knee.lerp(ankle, 0.30) + self.by(0.0, 0.0, -0.020);
        let along = (knee - ankle).normalize_or(Vec3::Y);
        self.turned_ball(shin, back, along, [0.056, 0.12, 0.056]);
        let skin = Part::of(leg.knee, self.look.skin, HEM);
        self.cone(skin, [knee.lerp(ankle, 0.6), ankle], [0.040, 0.034]);
    }

    fn foot(&mut self, side: usize) {
        let (leg, tip) = (self.anatomy.legs[side], self.anatomy.toes[side]);
        let toe = leg.toe.filter(|&toe| toe != tip);
        let (ankle, tip) = (self.anatomy.at(leg.foot), self.anatomy.at(tip));
        let (sole, scale) = (self.anatomy.sole, self.scale);
        let skin = Part::of(leg.foot, self.look.skin, 0.022);
        let tips = Part::of(toe.unwrap_or(leg.foot), self.look.skin, 0.022);
        let above = |place: Vec3, height: f32| place.with_y(sole + height * scale);
        let ahead = (tip - ankle).with_y(0.0).normalize_or(Vec3::Z);
        let heel = above(ankle - ahead * (0.026 * scale), 0.030);
        let ball = toe.map_or(ankle.lerp(tip, 0.62), |toe| self.anatomy.at(toe));
        let aside = ahead.cross(Vec3::Y) * (0.014 * scale);
        self.cone(skin, [ankle, heel], [0.035, 0.035]);
        self.cone(skin, [ankle, above(ball, 0.036)], [0.035, 0.026]);
        for shift in [aside, -aside] {
            let middle = above(ball, 0.024) + shift;
            self.cone(skin, [heel + 0.3 * shift, middle], [0.028, 0.029]);
            let tip = above(tip - ahead * (0.012 * scale), 0.017) + 0.8 * shift;
            self.cone(tips, [middle, tip], [0.029, 0.018]);
        }
    }

    fn arm(&mut self, side: usize) {
        let arm = self.anatomy.arms[side];
        let [shoulder, elbow, wrist] = [arm.hip, arm.knee, arm.foot].map(|id| self.anatomy.at(id));
        let girdle = Part::of(self.anatomy.girdles[side], self.look.clothes, SOFT);
        let inner = if side == LEFT { -0.075 } else { 0.075 };
        let inner = shoulder + self.by(inner, -0.004, 0.0);
        self.cone(girdle, [inner, shoulder], [0.066, 0.058]);
        let upper = Part::of(arm.hip, self.look.clothes, SOFT);
        let along = (elbow - shoulder).normalize_or(Vec3::NEG_Y);
        let from = shoulder + along * (0.01 * self.scale);
        self.cone(upper, [from, elbow], [0.060, 0.046]);
        let lower = Part::of(arm.knee, self.look.clothes, SOFT);
        self.cone(lower, [elbow, elbow.lerp(wrist, 0.60)], [0.046, 0.048]);
        let skin = Part::of(arm.knee, self.look.skin, HEM);
        self.cone(skin, [elbow.lerp(wrist, 0.4), wrist], [0.036, 0.027]);
    }

    fn fist(&mut self, side: usize) {
        let arm = self.anatomy.arms[side];
        let [elbow, wrist] = [arm.knee, arm.foot].map(|id| self.anatomy.at(id));
        let along = (wrist - elbow).normalize_or(Vec3::NEG_Y);
        let tip = arm.toe.map_or(wrist + along, |tip| self.anatomy.at(tip));
        let along = (tip - wrist).normalize_or(along);
        let skin = Part::of(arm.foot, self.look.skin, 0.018);
        let middle = wrist + along * (0.058 * self.scale);
        self.cone(skin, [wrist, middle], [0.028, 0.030]);
        self.turned_ball(skin, middle, along, [0.036, 0.048, 0.041]);
        let front = (Vec3::Z - along * along.z).normalize_or(Vec3::X);
        let thumb = [[0.030, 0.026], [0.074, 0.037]];
        let thumb = thumb.map(|[out, aside]| wrist + (along * out + front * aside) * self.scale);
        let part = Part::of(arm.foot, self.look.skin, 0.008);
        self.cone(part, thumb, [0.014, 0.013]);
    }

    fn head(&mut self) {
        let (nape, joint) = (self.anatomy.nape(), self.anatomy.head);
        let [neck, head] = [self.anatomy.neck, joint].map(|id| self.anatomy.at(id));
        let crown = self.anatomy.sole + self.anatomy.height;
        // From the head's joint, at the height of the jaw.
        let centre = head.with_y(crown - 0.105 * self.scale) + self.by(0.0, 0.0, 0.012);
        let back = self.by(0.0, 0.0, -0.006);
        if neck.y > nape.y + 1e-3 {
            // Below its joint the neck moves with the trunk.
            let low = Part(Carrier::Trunk, self.look.skin, 0.012);
            self.cone(low, [nape + back, neck + back], [0.052, 0.050]);
        }
        let throat = Part::of(self.anatomy.neck, self.look.skin, 0.012);
        let ends = [neck + back, head.lerp(centre, 0.4)];
        self.cone(throat, ends, [0.050, 0.050]);
        let skin = Part::of(joint, self.look.skin, 0.02);
        self.ball(skin, centre, [0.0, 0.008, -0.004], [0.073, 0.094, 0.092]);
        self.ball(skin, centre, [0.0, -0.050, 0.024], [0.053, 0.062, 0.060]);
        self.ball(skin, centre, [0.0, -0.096, 0.052], [0.020; 3]);
        let fine = Part::of(joint, self.look.skin, 0.010);
        let nose = [self.by(0.0, -0.004, 0.084), self.by(0.0, -0.034, 0.097)];
        self.cone(fine, nose.map(|end| centre + end), [0.007, 0.012]);
        for side in [0.074, -0.074] {
            self.ball(fine, centre, [side, -0.012, -0.004], [0.010, 0.027, 0.017]);
        }
        let hair = Part::of(joint, self.look.dark, HEM);
        self.ball(hair, centre, [0.0, 0.030, -0.017], [0.081, 0.086, 0.091]);
        self.ball(hair, centre, [0.0, -0.020, -0.040], [0.068, 0.060, 0.062]);
    }
}
