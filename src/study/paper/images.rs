//! Section IV-B: bearings from panoramas on a grid. Table II and Fig. 5 on the paper's own set, Fig. 7 on Vardy's.
//!
//! Neither set comes with the paper. The worlds `paper-grid` and `vardy-hall` have the same grids, sizes of picture and starts, and
//! their panoramas are rendered; a set on disk takes their place where a person has one.

use std::path::Path;
use std::sync::Mutex;

use super::course::{Course, Starts, starts};
use super::objects::ObjectField;
use super::trial::{Eyes, unlimited};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::panorama::Panorama;
use crate::panorama_set::{Grid, LayoutKind, PanoramaSet, Place};
use crate::render::{CpuRenderer, Renderer, Scene, View};
use crate::vision::ExtractorSettings;
use crate::world::World;

/// What is stated of bearings that are interpolated between places, rad: about half a degree.
const SD_RAD: f64 = 0.01;

/// One of the two sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageSet {
    /// 9 x 19 places, 29.25 cm apart, home (5, 10), 4680 x 480 pixels: reference 27 of the paper.
    Paper,
    /// 10 x 17 places, 30 cm apart, home (4, 8), 561 x 81 pixels: reference 28 of the paper.
    Vardy,
}

impl ImageSet {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Paper, Self::Vardy];

    /// The world that is rendered for it.
    pub fn world_name(self) -> &'static str {
        match self {
            Self::Paper => "paper-grid",
            Self::Vardy => "vardy-hall",
        }
    }

    /// Its grid. Rows and columns count from 0 here; the paper's own set counts from 1.
    pub fn grid(self) -> Grid {
        match self {
            Self::Paper => Grid { rows: 9, columns: 19, spacing_m: 0.2925, home: Place { i: 4, j: 9 } },
            Self::Vardy => Grid { rows: 10, columns: 17, spacing_m: 0.30, home: Place { i: 4, j: 8 } },
        }
    }

    /// Such a set on disk.
    ///
    /// # Errors
    /// When it is not whole or has another grid.
    pub fn open(self, folder: &Path) -> Result<PanoramaSet> {
        let layout = match self {
            Self::Paper => LayoutKind::Paper,
            Self::Vardy => LayoutKind::Vardy,
        };
        let (files, grid) = (PanoramaSet::open_as(folder, layout)?.whole()?, self.grid());
        if files.shape() != (grid.rows, grid.columns) {
            return Err(Error::Unfit {
                what: format!("grid of the set in {}", folder.display()),
                found: format!("{} x {} places", files.shape().0, files.shape().1),
                needed: format!("{} x {}", grid.rows, grid.columns),
            });
        }
        Ok(files)
    }

    /// Settings that suit the size of its pictures.
    fn extractor(self) -> ExtractorSettings {
        match self {
            Self::Paper => {
                ExtractorSettings { octaves: 5, features: 1000, home_features: 1000, ..ExtractorSettings::default() }
            }
            Self::Vardy => ExtractorSettings::default(),
        }
    }
}

/// Bearings of a set's objects, and the starts and the task of runs on it.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageCase {
    /// Which set.
    pub set: ImageSet,
    /// Whether the panoramas are rendered; else they come from disk.
    pub rendered: bool,
    /// The panorama at home.
    pub home: Panorama,
    /// Its objects.
    pub field: ObjectField,
    /// The paper's starts.
    pub starts: Starts,
    /// Home, Ts = 0.1 s, v, Rc and the time limit.
    pub world: World,
}

impl ImageCase {
    /// Extracts the objects of a set: of the one in `folder` where there is one, else of rendered panoramas.
    ///
    /// # Errors
    /// When the set on disk is not whole, has another grid, or no objects can be found in it.
    pub fn new(set: ImageSet, folder: Option<&Path>) -> Result<Self> {
        let world = World::open(set.world_name())?;
        let grid = set.grid();
        let (home, field) = match folder {
            Some(folder) => {
                let files = set.open(folder)?;
                ObjectField::extract(grid, &set.extractor(), &|place| files.at(place))?
            }
            None => {
                let scene = Scene::new(&world)?;
                // A renderer is taken from the shelf and put back: at most one a thread is made.
                let shelf: Mutex<Vec<CpuRenderer>> = Mutex::default();
                let render = |place: Place| -> Result<Panorama> {
                    let taken = shelf.lock().ok().and_then(|mut shelf| shelf.pop());
                    let mut renderer = taken.unwrap_or_default();
                    let at = grid.position(place);
                    let robot = world.home.compose(&Pose::new(at.x, at.y, 0.0));
                    let mut panorama = Panorama::black(world.projection());
                    let view = View { projection: world.projection(), robot, bodies: &world.body_poses() };
                    renderer.render(&scene, &view, &mut panorama)?;
                    if let Ok(mut shelf) = shelf.lock() {
                        shelf.push(renderer);
                    }
                    Ok(panorama)
                };
                ObjectField::extract(grid, &set.extractor(), &render)?
            }
        };
        let (rendered, starts) = (folder.is_none(), starts(&world)?);
        Ok(Self { set, rendered, home, field, starts, world: unlimited(&world) })
    }
}

impl Course for ImageCase {
    fn world(&self) -> &World {
        &self.world
    }

    fn starts(&self) -> &Starts {
        &self.starts
    }

    fn eyes(&self, landmarks: usize) -> Eyes<'_> {
        let look = Box::new(move |pose: &Pose| self.field.bearings(pose, landmarks, SD_RAD));
        Eyes { home_pose: self.world.home, home: self.field.home(landmarks, SD_RAD), look, compass: false }
    }
}
