use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;

use sabaki::crowd::CrowdError;
use sabaki::math::F32x16;
use sabaki_draw::scene::{Camera, CrowdShot, Formation, FormationError, Mesh, Orbit, Outfit, Shot};

/// Path of the camera past a crowd.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CameraPath {
    /// Stands in front of the crowd, as in the paper.
    #[default]
    Head,
    /// Flies along the crowd and back.
    Along,
    /// Orbits the first rows, low and near.
    Around,
    /// Controlled by the mouse.
    Free,
}

impl CameraPath {
    /// All paths.
    pub const ALL: [Self; 4] = [Self::Head, Self::Along, Self::Around, Self::Free];

    /// Name of the path.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Along => "along",
            Self::Around => "around",
            Self::Free => "free",
        }
    }

    /// The camera after some seconds, for a column of some length in metres; `None` for [`CameraPath::Free`].
    #[must_use]
    pub fn camera(self, formation: &Formation, length: f32, seconds: f32) -> Option<Camera> {
        let head = formation.camera();
        match self {
            Self::Head => Some(head),
            Self::Along => {
                // Along and back in a minute, slow at both ends.
                let share = 0.5 - 0.5 * (seconds * std::f32::consts::TAU / 60.0).cos();
                let z = -share * (length - 30.0).max(0.0);
                Some(Camera {
                    eye: head.eye + Vec3::new(0.0, 1.5 * share.min(0.5), z),
                    target: head.target + Vec3::new(0.0, 0.0, z),
                    ..head
                })
            }
            Self::Around => {
                let around = 1.1 * (0.25 * seconds).sin();
                let orbit = Orbit {
                    target: Vec3::new(0.0, 1.0, -2.5),
                    around,
                    up: 0.22,
                    distance: 9.0,
                };
                Some(Camera {
                    field: head.field,
                    ..Camera::orbit(orbit)
                })
            }
            Self::Free => None,
        }
    }
}

/// An endless crowd, posed straight into the memory that it is drawn from.
pub struct LiveCrowd {
    /// The characters.
    pub formation: Formation,
    /// Chooses levels of detail by distance.
    pub levels: bool,
    /// Draws each character in the colour of its level.
    pub tinted: bool,
    /// Path of the camera.
    pub path: CameraPath,
    outfit: Option<Arc<Outfit>>,
    seconds: f32,
    pose_ms: VecDeque<f32>,
}

/// Number of pictures whose times are kept.
const TIMES: usize = 120;

impl LiveCrowd {
    /// Creates a crowd with levels by distance, in its own colours.
    #[must_use]
    pub fn new(formation: Formation) -> Self {
        Self {
            formation,
            levels: true,
            tinted: false,
            path: CameraPath::default(),
            outfit: None,
            seconds: 0.0,
            pose_ms: VecDeque::new(),
        }
    }

    /// Keeps the meshes that the crowd's members are drawn with: the skins of its [`Performer`](sabaki_draw::scene::Performer).
    pub fn wear(&mut self, outfit: Option<Arc<Outfit>>) {
        self.outfit = outfit;
    }

    /// Meshes of the crowd's members.
    #[must_use]
    pub fn meshes(&self) -> &[Mesh] {
        self.outfit.as_ref().map_or(&[], |outfit| &outfit.meshes)
    }

    /// Advances the simulation by some seconds.
    pub fn advance(&mut self, seconds: f32) {
        self.formation.advance(seconds);
        self.seconds += seconds;
    }

    /// The camera on its path; `None` if the mouse controls it.
    #[must_use]
    pub fn camera(&self) -> Option<Camera> {
        self.path
            .camera(&self.formation, self.formation.length(), self.seconds)
    }

    /// Milliseconds to pose the crowd in the last pictures, the latest one last.
    pub fn pose_times(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.pose_ms.iter().copied()
    }

    /// Poses the crowd into `poses` for a camera and a picture size in pixels, and returns what to draw.
    ///
    /// # Errors
    /// A camera without a field of view; less memory than [`Formation::max_output_len`].
    pub fn shot(
        &mut self,
        camera: Camera,
        size: [u32; 2],
        poses: &mut [F32x16],
    ) -> Result<(Shot, CrowdShot), LiveCrowdError> {
        self.formation.use_levels(self.levels);
        self.formation.show_levels(self.tinted);
        self.formation.look_from(&camera, size)?;
        let started = Instant::now();
        self.formation.pose(poses)?;
        self.pose_ms
            .push_back(1e3 * started.elapsed().as_secs_f32());
        if self.pose_ms.len() > TIMES {
            self.pose_ms.pop_front();
        }
        Ok(self.formation.shot(camera, size)?)
    }
}

/// Why a crowd cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum LiveCrowdError {
    /// An error of the formation.
    #[error(transparent)]
    Formation(#[from] FormationError),
    /// An error of the pose evaluation.
    #[error(transparent)]
    Pose(#[from] CrowdError),
}
