//! The shapes of a clothed person. Lengths are of a body 1.75 m tall.

use std::f32::consts::TAU;

use glam::{Quat, Vec2, Vec3};

use super::anatomy::{Anatomy, LEFT};
use super::shapes::{Carrier, Form, Shape, Shapes, joined};
use crate::scene::Look;
use sabaki::anim::{JointId, JointTransform};

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
        all: Vec::new(),
    };
    builder.trunk();
    for side in 0..2 {
        builder.leg(side);
        builder.foot(side);
        builder.arm(side);
    }
    builder.head();
    Shapes {
        all: builder.all,
        sole: anatomy.sole,
    }
}

/// Builds the shapes of a body, part by part.
struct BodyBuilder<'a> {
    anatomy: &'a Anatomy,
    look: &'a Look,
    scale: f32,
    all: Vec<Shape>,
}

/// The part whose shapes are added: the joint that moves them, their colour, and the width over which they blend.
#[derive(Clone, Copy)]
struct Part {
    carrier: Carrier,
    colour: Vec3,
    blend: f32,
}

impl Part {
    fn of(joint: JointId, colour: Vec3) -> Self {
        Self {
            carrier: Carrier::Joint(joint),
            colour,
            blend: SOFT,
        }
    }

    fn blend(self, blend: f32) -> Self {
        Self { blend, ..self }
    }
}

impl BodyBuilder<'_> {
    fn add(&mut self, part: Part, form: Form) -> &mut Shape {
        let index = self.all.len();
        self.all.push(Shape {
            form,
            carrier: part.carrier,
            colour: part.colour,
            blend: part.blend * self.scale,
            depth: 1.0,
        });
        &mut self.all[index]
    }

    fn cone(&mut self, part: Part, ends: [Vec3; 2], radii: [f32; 2]) -> &mut Shape {
        let radii = radii.map(|radius| radius * self.scale);
        self.add(part, Form::Cone { ends, radii })
    }

    fn ball(&mut self, part: Part, centre: Vec3, radii: Vec3) -> &mut Shape {
        let place = JointTransform {
            rotation: Quat::IDENTITY,
            translation: centre,
        };
        self.turned_ball(part, place, radii)
    }

    fn turned_ball(&mut self, part: Part, place: JointTransform, radii: Vec3) -> &mut Shape {
        let radii = radii * self.scale;
        let form = Form::Ellipsoid {
            centre: place.translation,
            radii,
            rotation: place.rotation,
        };
        self.add(part, form)
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
        let half = |limbs: &[sabaki::anim::Leg; 2]| {
            0.5 * at(limbs[0].hip).distance(at(limbs[1].hip)) / self.scale
        };
        let (hip, shoulder) = (half(legs), half(arms));
        let nape = self.anatomy.nape();
        let rise = shoulders - hips;
        let long = rise.length() / self.scale;
        let cloth = Part {
            carrier: Carrier::Trunk,
            colour: self.look.clothes,
            blend: SOFT,
        };
        let pelvis = hips + self.by(0.0, 0.03, -0.005);
        self.ball(cloth, pelvis, Vec3::new(hip + 0.075, 0.125, 0.108));
        for side in [1.0, -1.0] {
            let seat = hips + self.by(side * (hip - 0.018), -0.015, -0.052);
            self.ball(cloth, seat, Vec3::new(0.078, 0.085, 0.075));
        }
        let (low, high) = (hips + rise * 0.20, hips + rise * 0.62);
        self.cone(cloth, [low, high], [0.130, 0.142]).depth = 0.74;
        let ribs = hips + rise * 0.70 + self.by(0.0, 0.0, -0.004);
        let broad = (shoulder - 0.018).max(0.11);
        self.ball(cloth, ribs, Vec3::new(broad, 0.40 * long, 0.112));
        let breast = hips + rise * 0.80 + self.by(0.0, 0.0, 0.036);
        for side in [1.0, -1.0] {
            let breast = breast + self.by(side * 0.45 * shoulder, 0.0, 0.0);
            self.ball(cloth, breast, Vec3::new(0.085, 0.075, 0.065));
        }
        for arm in arms {
            let across = at(arm.hip) - nape;
            let ends = [nape + self.by(0.0, -0.005, -0.012), nape + across * 0.62];
            self.cone(cloth, ends, [0.052, 0.044]);
        }
        let throat = (at(self.anatomy.head) - nape).normalize_or(Vec3::Y);
        let collar = [
            nape - rise.normalize_or(Vec3::Y) * (0.03 * self.scale),
            nape + throat * (0.015 * self.scale),
        ];
        self.cone(cloth, collar, [0.066, 0.060]);
        self.belt(hips + rise * 0.24);
    }

    /// A belt around the shapes so far, with a knot on it and ends that hang down before them.
    fn belt(&mut self, waist: Vec3) {
        let belt = Part {
            carrier: Carrier::Trunk,
            colour: self.look.dark,
            blend: HEM,
        };
        let edge = |builder: &Self, from: Vec3, way: Vec3| {
            surface(&builder.all, from, way * 0.002 * builder.scale)
        };
        let [front, back] = [Vec3::Z, Vec3::NEG_Z].map(|way| edge(self, waist, way));
        let centre = 0.5 * (front + back);
        let [left, right] = [Vec3::X, Vec3::NEG_X].map(|way| edge(self, centre, way));
        let radii = 0.5 * Vec3::new(left.x - right.x, 0.0, front.z - back.z);
        // The ellipse is outside of the shapes all around.
        let outside = (0..24).map(|step| {
            let way = Quat::from_rotation_y(step as f32 * TAU / 24.0) * Vec3::Z;
            let away = edge(self, centre, way) - centre;
            Vec2::new(away.x / radii.x, away.z / radii.z).length()
        });
        let factor = outside.fold(1.0, f32::max);
        let thick = 0.005 * self.scale;
        let radii = (radii * factor + thick).with_y(0.024 * self.scale);
        self.add(belt, Form::Belt { centre, radii });
        let knot = centre + Vec3::Z * radii.z;
        let tails = [1.0, -1.0].map(|side| {
            let end = knot + self.by(side * 0.03, -0.085, 0.0);
            edge(self, end.with_z(centre.z), Vec3::Z) + self.by(0.0, 0.0, 0.004)
        });
        self.ball(belt, knot, Vec3::new(0.026, 0.026, 0.018));
        for end in tails {
            self.cone(belt, [knot, end], [0.014, 0.017]).depth = 0.6;
        }
    }

    fn leg(&mut self, side: usize) {
        let leg = self.anatomy.legs[side];
        let [hip, knee, ankle] = [leg.hip, leg.knee, leg.foot].map(|id| self.anatomy.at(id));
        let thigh = Part::of(leg.hip, self.look.clothes);
        let shin = Part::of(leg.knee, self.look.clothes);
        self.cone(thigh, [hip, knee], [0.092, 0.060]);
        let front = hip.lerp(knee, 0.42) + self.by(0.0, 0.0, 0.014);
        let along = Quat::from_rotation_arc(Vec3::NEG_Y, (knee - hip).normalize_or(Vec3::NEG_Y));
        self.turned_ball(thigh, turned(along, front), Vec3::new(0.074, 0.17, 0.076));
        self.cone(shin, [knee, knee.lerp(ankle, 0.76)], [0.059, 0.058]);
        let back = knee.lerp(ankle, 0.30) + self.by(0.0, 0.0, -0.020);
        let along = Quat::from_rotation_arc(Vec3::NEG_Y, (ankle - knee).normalize_or(Vec3::NEG_Y));
        self.turned_ball(shin, turned(along, back), Vec3::new(0.056, 0.12, 0.056));
        let skin = Part::of(leg.knee, self.look.skin);
        self.cone(
            skin.blend(HEM),
            [knee.lerp(ankle, 0.6), ankle],
            [0.040, 0.034],
        );
    }

    fn foot(&mut self, side: usize) {
        let leg = self.anatomy.legs[side];
        let (ankle, tip) = (
            self.anatomy.at(leg.foot),
            self.anatomy.at(self.anatomy.toes[side]),
        );
        let (sole, scale) = (self.anatomy.sole, self.scale);
        let skin = Part::of(leg.foot, self.look.skin).blend(0.022);
        let toe = leg.toe.filter(|&toe| toe != self.anatomy.toes[side]);
        let tips = Part::of(toe.unwrap_or(leg.foot), self.look.skin).blend(0.022);
        let above = |place: Vec3, height: f32| Vec3::new(place.x, sole + height * scale, place.z);
        let ahead = Vec3::new(tip.x - ankle.x, 0.0, tip.z - ankle.z).normalize_or(Vec3::Z);
        let heel = above(ankle - ahead * (0.026 * self.scale), 0.030);
        let ball = match toe {
            Some(toe) => self.anatomy.at(toe),
            None => ankle.lerp(tip, 0.62),
        };
        let aside = ahead.cross(Vec3::Y) * (0.014 * self.scale);
        self.cone(skin, [ankle, heel], [0.035, 0.035]);
        self.cone(skin, [ankle, above(ball, 0.036)], [0.035, 0.026]);
        for shift in [aside, -aside] {
            let back = heel + 0.3 * shift;
            self.cone(skin, [back, above(ball, 0.024) + shift], [0.028, 0.029]);
            let tip = above(tip - ahead * (0.012 * self.scale), 0.017) + 0.8 * shift;
            self.cone(tips, [above(ball, 0.024) + shift, tip], [0.029, 0.018]);
        }
    }

    fn arm(&mut self, side: usize) {
        let arm = self.anatomy.arms[side];
        let [shoulder, elbow, wrist] = [arm.hip, arm.knee, arm.foot].map(|id| self.anatomy.at(id));
        let girdle = Part::of(self.anatomy.girdles[side], self.look.clothes);
        let sign = if side == LEFT { 1.0 } else { -1.0 };
        let inner = shoulder - self.by(sign * 0.075, 0.004, 0.0);
        self.cone(girdle, [inner, shoulder], [0.066, 0.058]);
        let upper = Part::of(arm.hip, self.look.clothes);
        let along = (elbow - shoulder).normalize_or(Vec3::NEG_Y);
        self.cone(
            upper,
            [shoulder + along * (0.01 * self.scale), elbow],
            [0.060, 0.046],
        );
        let lower = Part::of(arm.knee, self.look.clothes);
        self.cone(lower, [elbow, elbow.lerp(wrist, 0.60)], [0.046, 0.048]);
        let skin = Part::of(arm.knee, self.look.skin).blend(HEM);
        self.cone(skin, [elbow.lerp(wrist, 0.4), wrist], [0.036, 0.027])
            .blend = HEM * self.scale;
        self.fist(side);
    }

    fn fist(&mut self, side: usize) {
        let arm = self.anatomy.arms[side];
        let [elbow, wrist] = [arm.knee, arm.foot].map(|id| self.anatomy.at(id));
        let along = (wrist - elbow).normalize_or(Vec3::NEG_Y);
        let tip = arm.toe.map_or(wrist + along, |tip| self.anatomy.at(tip));
        let along = (tip - wrist).normalize_or(along);
        let skin = Part::of(arm.foot, self.look.skin).blend(0.018);
        let turn = Quat::from_rotation_arc(Vec3::Y, along);
        let middle = wrist + along * (0.058 * self.scale);
        self.cone(skin, [wrist, middle], [0.028, 0.030]);
        self.turned_ball(skin, turned(turn, middle), Vec3::new(0.036, 0.048, 0.041));
        let front = (Vec3::Z - along * along.z).normalize_or(Vec3::X) * self.scale;
        let thumb = [
            wrist + along * (0.030 * self.scale) + front * 0.026,
            wrist + along * (0.074 * self.scale) + front * 0.037,
        ];
        self.cone(skin.blend(0.008), thumb, [0.014, 0.013]);
    }

    fn head(&mut self) {
        let (nape, neck, head) = (
            self.anatomy.nape(),
            self.anatomy.at(self.anatomy.neck),
            self.anatomy.at(self.anatomy.head),
        );
        let joint = self.anatomy.head;
        let throat = Part::of(self.anatomy.neck, self.look.skin).blend(0.012);
        // Below its joint the neck moves with the trunk.
        let low = Part {
            carrier: Carrier::Trunk,
            ..throat
        };
        let skin = Part::of(joint, self.look.skin).blend(0.02);
        let dark = Part::of(joint, self.look.dark).blend(HEM);
        // From the head's joint, at the height of the jaw.
        let crown = self.anatomy.sole + self.anatomy.height;
        let centre = Vec3::new(
            head.x,
            crown - 0.105 * self.scale,
            head.z + 0.012 * self.scale,
        );
        let top = head.lerp(centre, 0.4);
        let back = self.by(0.0, 0.0, -0.006);
        if neck.y > nape.y + 1e-3 {
            self.cone(low, [nape + back, neck + back], [0.052, 0.050]);
        }
        self.cone(throat, [neck + back, top], [0.050, 0.050]);
        self.ball(
            skin,
            centre + self.by(0.0, 0.008, -0.004),
            Vec3::new(0.073, 0.094, 0.092),
        );
        self.ball(
            skin,
            centre + self.by(0.0, -0.050, 0.024),
            Vec3::new(0.053, 0.062, 0.060),
        );
        self.ball(
            skin,
            centre + self.by(0.0, -0.096, 0.052),
            Vec3::splat(0.020),
        );
        let fine = skin.blend(0.010);
        let nose = [
            centre + self.by(0.0, -0.004, 0.084),
            centre + self.by(0.0, -0.034, 0.097),
        ];
        self.cone(fine, nose, [0.007, 0.012]);
        for side in [1.0, -1.0] {
            let ear = centre + self.by(side * 0.074, -0.012, -0.004);
            self.ball(fine, ear, Vec3::new(0.010, 0.027, 0.017));
        }
        self.ball(
            dark,
            centre + self.by(0.0, 0.030, -0.017),
            Vec3::new(0.081, 0.086, 0.091),
        );
        self.ball(
            dark,
            centre + self.by(0.0, -0.020, -0.040),
            Vec3::new(0.068, 0.060, 0.062),
        );
    }
}

/// The point at which a ray from a place inside of shapes leaves them, at most half a metre away.
fn surface(shapes: &[Shape], from: Vec3, step: Vec3) -> Vec3 {
    let most = (0.5 / step.length()) as u32;
    let places = (0..most).map(|count| from + step * count as f32);
    let mut outside = places.skip_while(|&place| joined(shapes, place) < 0.0);
    outside.next().unwrap_or(from)
}

fn turned(rotation: Quat, translation: Vec3) -> JointTransform {
    JointTransform {
        rotation,
        translation,
    }
}
