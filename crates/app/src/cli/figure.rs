//! Reads the body and its props from files.

use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, JointTransform, Skeleton};
use sabaki::maps::{Body, Prop};
use sabaki_import::fit::{BindPose, FitError, FitSettings, JointFit, Mesh, fit_body};
use sabaki_import::{self, BodyFile, ClipSet, ReadError};
use serde::Serialize;

use super::numbers::number;
use super::output::usage;
use super::{Failure, output};

/// The body and its props.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Body and props")]
pub(crate) struct FigureArgs {
    /// Body: spheres (.json), or a mesh (.obj) to fit spheres to. Default: spheres derived from the
    /// lengths of the bones.
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// Metres per unit of the body mesh. Default: derived from the skeleton's size.
    #[arg(long, value_name = "METRES", requires = "body", value_parser = number(1e-9..=1e6))]
    body_scale: Option<f32>,
    /// Pose of the mesh: a frame of a clip, counted from 0. Default: the skeleton's rest pose, with
    /// no joint rotated.
    #[arg(long, value_name = "CLIP:FRAME", requires = "body")]
    body_pose: Option<String>,
    /// Moves the mesh to where the skeleton stands in that pose. Default: the mesh is in the clip's
    /// space.
    #[arg(long, requires = "body")]
    body_stand: bool,
    /// Held prop (.obj). Spheres are fitted to it; they attack together with the hand.
    #[arg(long, value_name = "FILE")]
    prop: Vec<PathBuf>,
    /// Joint that holds the prop; one for each prop.
    #[arg(long, value_name = "JOINT", requires = "prop")]
    prop_joint: Vec<String>,
    /// Position of the prop in the joint's frame, in metres, and its rotation (a quaternion):
    /// X,Y,Z or X,Y,Z,QX,QY,QZ,QW. None, or one for each prop.
    #[arg(long, value_name = "GRIP", requires = "prop", value_parser = grip, allow_hyphen_values = true)]
    prop_grip: Vec<JointTransform>,
    /// Metres per unit of the props. Default: the clips' unit, or one that gives the props a size
    /// that can be held.
    #[arg(long, value_name = "METRES", requires = "prop", value_parser = number(1e-9..=1e6))]
    prop_scale: Option<f32>,
    /// Makes the props part of the body: an attack that touches them hits.
    #[arg(long, requires = "prop")]
    prop_is_body: bool,
}

/// The body and props, with the quality of the fits.
#[derive(Default)]
pub(crate) struct Figure {
    pub(crate) body: Option<Body>,
    pub(crate) props: Vec<Prop>,
    /// The quality of the fits.
    pub(crate) fits: Vec<Fit>,
    /// Joints whose spheres are far from their mesh, one line each.
    pub(crate) warnings: Vec<String>,
}

/// A mesh and its spheres.
#[derive(Serialize)]
pub(crate) struct Fit {
    file: String,
    metres_per_unit: f64,
    size: Vec3,
    spacing: Option<f32>,
    joints: Vec<JointFit>,
    all: JointFit,
}

impl FigureArgs {
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.body.iter().chain(&self.prop).map(PathBuf::as_path)
    }

    /// What can be refused before the files are read.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        if self.prop.len() != self.prop_joint.len() {
            return Err(usage("each --prop needs its --prop-joint"));
        }
        if ![0, self.prop.len()].contains(&self.prop_grip.len()) {
            return Err(usage("none or each --prop has its --prop-grip"));
        }
        Ok(())
    }

    /// Reads the files and fits the meshes.
    pub(crate) fn read(&self, set: &ClipSet) -> Result<Figure, Failure> {
        let mut figure = Figure::default();
        if let Some(path) = &self.body {
            self.read_body(path, set, &mut figure)?;
        }
        for index in 0..self.prop.len() {
            self.read_prop(index, set, &mut figure)?;
        }
        Ok(figure)
    }

    fn read_body(&self, path: &Path, set: &ClipSet, figure: &mut Figure) -> Result<(), Failure> {
        if !is_mesh(path) {
            let file = BodyFile::read(path)?;
            let names = file.check_names(&set.repeated_names);
            let body = names.and_then(|()| file.resolve(&set.skeleton));
            figure.body = Some(body.map_err(ReadError::in_file(path))?);
            return Ok(());
        }
        let wrong = |error: FitError| usage(error).within(path);
        let mesh = sabaki_import::read_obj(path)?;
        let pose = self.pose(set)?;
        let found = sabaki_import::body_scale(&mesh, pose.joints()).metres_per_unit;
        let scale = self.body_scale.map_or(found, f64::from);
        let placed = |mesh: &Mesh, scale: f64, translation| {
            let place = JointTransform {
                translation,
                ..JointTransform::IDENTITY
            };
            mesh.placed(scale as f32, place)
                .map_err(|error| wrong(error.into()))
        };
        let mut mesh = placed(&mesh, scale, Vec3::ZERO)?;
        if self.body_stand {
            mesh = placed(&mesh, 1.0, mesh.to_stand_at(pose.joints()))?;
        }
        let settings = FitSettings::default();
        let (body, report) = fit_body(&pose, &mesh, &settings).map_err(wrong)?;
        figure.body = Some(body);
        let misfits = report.misfits(&settings).into_iter();
        let named = misfits.map(|misfit| format!("{}: {misfit}", path.display()));
        figure.warnings.extend(named);
        figure.fits.push(Fit {
            spacing: Some(report.spacing),
            all: report.worst(),
            joints: report.joints,
            ..Fit::of(path, scale, &mesh)
        });
        Ok(())
    }

    fn read_prop(&self, index: usize, set: &ClipSet, figure: &mut Figure) -> Result<(), Failure> {
        let (path, name) = (&self.prop[index], &self.prop_joint[index]);
        if set.repeated_names.contains(name) {
            return Err(usage(format!(
                "--prop-joint {name}: several joints have that name; name one of them, as {name}_2"
            )));
        }
        let joint = set
            .skeleton
            .find(name)
            .ok_or_else(|| unknown_joint(&set.skeleton, name))?;
        let wrong = |error: FitError| usage(error).within(path);
        let mesh = sabaki_import::read_obj(path)?;
        let clips = set
            .scales
            .first()
            .map_or(1.0, |scale| scale.metres_per_unit);
        let found = sabaki_import::held_scale(&mesh, clips).metres_per_unit;
        let scale = self.prop_scale.map_or(found, f64::from);
        let grip = self
            .prop_grip
            .get(index)
            .copied()
            .unwrap_or(JointTransform::IDENTITY);
        let mesh = mesh
            .placed(scale as f32, grip)
            .map_err(|error| wrong(error.into()))?;
        let settings = FitSettings::HELD;
        let fitted = sabaki_import::fit::fit_prop(joint, &mesh, &settings);
        let (prop, fit) = fitted.map_err(wrong)?;
        figure.props.push(Prop {
            is_body: self.prop_is_body,
            ..prop
        });
        let fit = JointFit {
            joint: name.clone(),
            ..fit
        };
        // The spacing of a prop's points is at most what is covered.
        let misfit = fit.misfit(&settings, settings.cover);
        let named = misfit.map(|misfit| format!("{}: {misfit}", path.display()));
        figure.warnings.extend(named);
        figure.fits.push(Fit {
            joints: vec![fit.clone()],
            all: fit,
            ..Fit::of(path, scale, &mesh)
        });
        Ok(())
    }

    fn pose<'a>(&self, set: &'a ClipSet) -> Result<BindPose<'a>, Failure> {
        let Some(named) = &self.body_pose else {
            return Ok(BindPose::rest(&set.skeleton));
        };
        let place = named
            .rsplit_once(':')
            .and_then(|(clip, frame)| Some((clip, frame.parse().ok()?)));
        let Some((name, frame)) = place else {
            return Err(usage(format!(
                "--body-pose {named}: not CLIP:FRAME, as boxing.bvh:0"
            )));
        };
        let Some(clip) = set.clips.iter().find(|clip: &&Clip| clip.name() == name) else {
            return Err(usage(format!("--body-pose {named}: no clip \"{name}\"")));
        };
        let pose = BindPose::of_frame(&set.skeleton, clip, frame);
        pose.map_err(usage)
    }
}

/// Whether a body is a mesh; the other files have spheres.
fn is_mesh(path: &Path) -> bool {
    let ending = path.extension();
    ending.is_some_and(|ending| ending.eq_ignore_ascii_case("obj"))
}

fn unknown_joint(skeleton: &Skeleton, name: &str) -> Failure {
    let names: Vec<&str> = skeleton
        .joints()
        .iter()
        .map(|joint| joint.name.as_str())
        .take(64)
        .collect();
    usage(format!(
        "the skeleton has no joint \"{name}\"; it has {}",
        names.join(", ")
    ))
}

/// `X,Y,Z` or `X,Y,Z,QX,QY,QZ,QW`.
fn grip(text: &str) -> Result<JointTransform, String> {
    let numbers: Result<Vec<f32>, _> = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect();
    let numbers = numbers.map_err(|error| format!("{error}"))?;
    let (place, turn) = match numbers[..] {
        [x, y, z] => (Vec3::new(x, y, z), Quat::IDENTITY),
        [x, y, z, qx, qy, qz, qw] => (Vec3::new(x, y, z), Quat::from_xyzw(qx, qy, qz, qw)),
        _ => return Err("three or seven numbers are wanted".to_owned()),
    };
    if !(place.is_finite() && turn.is_finite() && turn.length_squared() > 1e-6) {
        return Err("not a finite place and rotation".to_owned());
    }
    Ok(JointTransform {
        rotation: turn.normalize(),
        translation: place,
    })
}

impl Fit {
    fn of(path: &Path, metres_per_unit: f64, mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds();
        Self {
            file: path.display().to_string(),
            metres_per_unit,
            size: high - low,
            spacing: None,
            joints: Vec::new(),
            all: JointFit::default(),
        }
    }

    fn describe(&self) -> String {
        let Vec3 { x, y, z } = self.size;
        let mm = |metres: f32| format!("{:.1} mm", metres * 1e3);
        let table = output::table_of(
            1,
            &self.joints,
            &[
                ("joint", &|fit| fit.joint.clone()),
                ("vertices", &|fit| fit.vertices.to_string()),
                ("spheres", &|fit| fit.spheres.to_string()),
                ("mesh out", &|fit| mm(fit.mesh_out_max)),
                ("mean", &|fit| mm(fit.mesh_out_mean)),
                ("spheres out", &|fit| mm(fit.spheres_out_max)),
                ("mean", &|fit| mm(fit.spheres_out_mean)),
            ],
        );
        let limited = if self.all.limited {
            "; not as closely as wished: more spheres would be needed"
        } else {
            ""
        };
        format!(
            "{}: {x:.2} x {y:.2} x {z:.2} m at {} m a unit, {} spheres{limited}\n{table}\n",
            self.file, self.metres_per_unit, self.all.spheres
        )
    }
}

impl Figure {
    /// The quality of the fits as text.
    pub(crate) fn describe(&self) -> String {
        self.fits.iter().map(Fit::describe).collect()
    }
}
