//! Bearings from a set of panoramas on disk.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use super::{Sensor, SensorTiming};
use crate::error::{Error, Result};
use crate::geometry::{Pose, wrap};
use crate::observation::{Bearing, HomeSnapshot, LandmarkId};
use crate::panorama::Panorama;
use crate::panorama_set::{Grid, PanoramaSet, Place};
use crate::random::Seed;
use crate::vision::{Extractor, ExtractorSettings};
use crate::world::World;

/// Standard deviation that is added to what the extractor states, because no panorama was taken just where the robot is, rad.
const BETWEEN_SD_RAD: f64 = 0.01;

/// Which set, and what it does not tell itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DatasetChoice {
    /// Its folder.
    pub folder: PathBuf,
    /// Condition; by default the first.
    pub condition: Option<String>,
    /// Condition of the home panorama where it is another.
    pub home_condition: Option<String>,
    /// Distance between places of its grid, m.
    pub spacing_m: Option<f64>,
    /// Place at home; by default the middle of the grid, and the first panorama of a set without one.
    pub home: Option<Place>,
}

/// A set laid into the room of a world.
#[derive(Debug)]
pub struct DatasetField {
    set: PanoramaSet,
    /// Where the camera was when each panorama was taken, in the room.
    poses: Vec<Pose>,
    /// The grid, its frame in the room, and which panorama is at each of its places.
    grid: Option<(Grid, Pose, BTreeMap<Place, usize>)>,
    home: Panorama,
    home_heading: f64,
}

impl DatasetField {
    /// Opens a set and lays it into the room: as it says itself if this program wrote it, else with its home on the world's home.
    ///
    /// # Errors
    /// When the set cannot be read, does not say where its panoramas were taken, or has none at home.
    pub fn new(world: &World, choice: &DatasetChoice) -> Result<Self> {
        let whole = PanoramaSet::open(&choice.folder)?;
        let first = whole.conditions().first().map(|c| (*c).to_owned()).unwrap_or_default();
        let wanted = choice.condition.clone().unwrap_or(first);
        let at_home = whole.clone().only(choice.home_condition.as_deref().unwrap_or(&wanted))?;
        let set = whole.only(&wanted)?;
        let grid = set.grid(choice.spacing_m, choice.home);
        let of_set = |what: &str| format!("{what} of the set in {}", choice.folder.display());
        let invalid =
            |what: &str, found: String, allowed: &str| Error::Invalid { what: of_set(what), found, allowed: allowed.into() };
        let unfit = |what: &str, found: String, needed: &str| Error::Unfit { what: of_set(what), found, needed: needed.into() };
        let untold = || {
            let allowed = "a set that says where its panoramas were taken, or --dataset-spacing-m with a grid";
            unfit("poses", "none".into(), allowed)
        };
        let in_room = set.document().is_some();
        // Poses in the set's own frame.
        let pose_of = |set: &PanoramaSet, k: usize| {
            let entry = &set.entries()[k];
            entry.pose.or_else(|| {
                let at = grid.as_ref()?.position(entry.place?);
                Some(Pose::new(at.x, at.y, 0.0))
            })
        };
        let all = |set: &PanoramaSet| (0..set.entries().len()).map(|k| pose_of(set, k)).collect::<Option<Vec<_>>>();
        let own = all(&set).ok_or_else(untold)?;
        let own_at_home = all(&at_home).ok_or_else(untold)?;
        let home_place = at_home.home_place(choice.home);
        let place_of = |k: usize| at_home.entries()[k].place;
        let named = |place: Option<Place>| place.map_or("none".to_owned(), |Place { i, j }| format!("({i}, {j})"));
        let home = if in_room {
            let off = |k: &usize| (own_at_home[*k].position() - world.home.position()).norm();
            let nearest = (0..own_at_home.len()).min_by(|a, b| off(a).total_cmp(&off(b))).ok_or_else(untold)?;
            let most = world.spec.task.arrival_radius_m;
            if off(&nearest) > most {
                let mut found = format!("{:.3} m from home at the nearest", off(&nearest));
                // The likeliest reason.
                if let Some(other) = set.document().map(|d| &d.world).filter(|name| **name != world.spec.name) {
                    found = format!("{found}, in a set of the world `{other}`");
                }
                let allowed = format!("a panorama within {most} m of the home of `{}`", world.spec.name);
                return Err(unfit("home panorama", found, &allowed));
            }
            if choice.home.is_some() && choice.home != place_of(nearest) {
                let allowed = format!("{}, where the set has its home", named(place_of(nearest)));
                return Err(invalid("--dataset-home", named(choice.home), &allowed));
            }
            nearest
        } else {
            if choice.home.is_some() && home_place.is_none() {
                return Err(invalid("--dataset-home", named(choice.home), "a set whose panoramas have places of a grid"));
            }
            let found = (0..own_at_home.len()).find(|k| home_place.is_none() || place_of(*k) == home_place);
            let found = found.ok_or_else(|| {
                let found = format!("none at place {}", named(home_place));
                unfit("home panorama", found, "a place with a panorama; see --dataset-home")
            })?;
            if choice.home.is_none() {
                let (folder, picture) = (choice.folder.display(), at_home.entries()[found].path().display());
                log::warn!(
                    "{folder}: the set does not say where home is; it is taken to be at `{picture}`, see --dataset-home"
                );
            }
            found
        };
        let origin = own_at_home[home];
        // Our own sets tell where the robot stood, others where the camera did.
        let camera_home = world.camera_pose(&world.home);
        let lay = |pose: Pose| if in_room { world.camera_pose(&pose) } else { camera_home.compose(&origin.to_local(&pose)) };
        let poses: Vec<Pose> = own.into_iter().map(lay).collect();
        let grid = grid.filter(|_| set.entries().iter().all(|e| e.place.is_some())).map(|grid| {
            let mut held = BTreeMap::new();
            for (k, entry) in set.entries().iter().enumerate() {
                if let Some(place) = entry.place {
                    held.entry(place).or_insert(k);
                }
            }
            // Our grids lie along the room's axes, those of others along the heading at home.
            let at = set
                .document()
                .and_then(|d| d.grid.as_ref())
                .map(|g| Pose { heading: 0.0, ..world.camera_pose(&g.pose(grid.home, origin.heading)) });
            (grid, at.unwrap_or(camera_home), held)
        });
        let home_heading = lay(origin).heading;
        let home = at_home.load(home)?;
        Ok(Self { set, poses, grid, home, home_heading })
    }
}

/// A sensor that sees, wherever the robot is, what the panoramas about it show.
///
/// On a grid the bearings at the four places around are interpolated, those of landmarks that are seen at all four; elsewhere, and
/// where a place of the grid has no panorama, the nearest panorama stands for all. More than half a spacing outside the grid
/// nothing is seen. The robot's heading comes in exactly: a panorama is a full turn.
pub struct DatasetSensor {
    field: Arc<DatasetField>,
    extractor: Extractor,
    home: HomeSnapshot,
    /// Bearings of panoramas that were looked at before: azimuths in the room.
    seen: BTreeMap<usize, Vec<Bearing>>,
    last: Option<Panorama>,
    /// The camera on the robot.
    mount: Pose,
    timing: SensorTiming,
    /// Whether it was told in this run that the robot is outside the set.
    told: bool,
}

impl DatasetSensor {
    /// Readies the extractor for the home panorama.
    pub fn new(world: &World, field: Arc<DatasetField>, settings: ExtractorSettings) -> Self {
        let extractor = Extractor::new(settings, &field.home);
        let mut home = extractor.home_snapshot();
        // The home frame is that of the world's home, whichever way the panorama there looked.
        let turn = field.home_heading - world.home.heading;
        for bearing in &mut home.bearings {
            bearing.azimuth_rad = wrap(bearing.azimuth_rad + turn);
        }
        let mount = world.camera_pose(&Pose::IDENTITY);
        Self { field, extractor, home, seen: BTreeMap::new(), last: None, mount, timing: SensorTiming::default(), told: false }
    }

    /// Bearings of panorama `k`, azimuths in the room.
    fn look(&mut self, k: usize) -> Result<&[Bearing]> {
        if !self.seen.contains_key(&k) {
            let reading = Instant::now();
            let panorama = self.field.set.load(k)?;
            let extracting = Instant::now();
            if panorama.projection != self.field.home.projection {
                let size = |p: &Panorama| format!("{} x {}", p.projection.width, p.projection.height);
                return Err(Error::Parse {
                    path: self.field.set.entries()[k].path().to_owned(),
                    message: format!("found {}, expected the size at home, {}", size(&panorama), size(&self.field.home)),
                });
            }
            let mut bearings = self.extractor.observe(&panorama);
            for bearing in &mut bearings {
                bearing.azimuth_rad = wrap(bearing.azimuth_rad + self.field.poses[k].heading);
            }
            self.timing.render_s += (extracting - reading).as_secs_f64();
            self.timing.vision_s += extracting.elapsed().as_secs_f64();
            self.last = Some(panorama);
            self.seen.insert(k, bearings);
        }
        Ok(self.seen.get(&k).map_or(&[], Vec::as_slice))
    }

    /// The panorama nearest to a pose of the camera, by place and then by heading.
    fn nearest(&self, camera: &Pose) -> Option<usize> {
        let key = |k: &usize| {
            let pose = self.field.poses[*k];
            ((pose.position() - camera.position()).norm(), wrap(pose.heading - camera.heading).abs())
        };
        (0..self.field.poses.len()).min_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
    }
}

impl DatasetSensor {
    /// Tells once a run why there are no bearings.
    fn tell_outside(&mut self, camera: Pose, grid: &Grid, frame: &Pose) {
        if std::mem::replace(&mut self.told, true) {
            return;
        }
        let corner = |i: usize, j: usize| {
            let at = frame.transform(grid.position(Place { i, j }));
            format!("({:.2}, {:.2})", at.x, at.y)
        };
        log::warn!(
            "no bearings where the camera is, at ({:.2}, {:.2}) m: it is outside the set in {}, whose grid reaches from {} to {} m",
            camera.x,
            camera.y,
            self.field.set.folder().display(),
            corner(grid.rows - 1, 0),
            corner(0, grid.columns - 1)
        );
    }
}

impl Sensor for DatasetSensor {
    fn reset(&mut self, _seed: Seed) -> Result<()> {
        (self.last, self.timing, self.told) = (None, SensorTiming::default(), false);
        Ok(())
    }

    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, _bodies: &[Pose]) -> Result<Vec<Bearing>> {
        let field = Arc::clone(&self.field);
        let camera = truth.compose(&self.mount);
        let mut corners: Vec<(usize, f64)> = Vec::new();
        if let Some((grid, frame, held)) = &field.grid
            && grid.rows > 1
            && grid.columns > 1
        {
            let Some(cell) = grid.cell(frame.inverse_transform(camera.position())) else {
                self.tell_outside(camera, grid, frame);
                return Ok(Vec::new());
            };
            let around = cell.corners.iter().zip(cell.weights).map(|(place, weight)| Some((*held.get(place)?, weight)));
            corners = around.collect::<Option<Vec<_>>>().unwrap_or_default();
        }
        if corners.is_empty() {
            corners.extend(self.nearest(&camera).map(|k| (k, 1.0)));
        }
        // Sums of turns from the first corner's azimuth, weighted, and of variances.
        let mut sums: BTreeMap<LandmarkId, (f64, f64, f64, usize)> = BTreeMap::new();
        let count = corners.len();
        for (nth, (k, weight)) in corners.into_iter().enumerate() {
            for bearing in self.look(k)? {
                let sum = sums.entry(bearing.id).or_insert((bearing.azimuth_rad, 0.0, 0.0, 0));
                if sum.3 == nth {
                    sum.1 += weight * wrap(bearing.azimuth_rad - sum.0);
                    sum.2 += weight * weight * bearing.sd_rad * bearing.sd_rad;
                    sum.3 += 1;
                }
            }
        }
        let everywhere = sums.into_iter().filter(|(_, sum)| sum.3 == count);
        let bearing = |(id, (first, turn, variance, _)): (LandmarkId, (f64, f64, f64, usize))| Bearing {
            id,
            azimuth_rad: wrap(first + turn - truth.heading),
            sd_rad: (variance + BETWEEN_SD_RAD * BETWEEN_SD_RAD).sqrt(),
        };
        Ok(everywhere.map(bearing).collect())
    }

    fn home_panorama(&self) -> Option<&Panorama> {
        Some(&self.field.home)
    }

    fn panorama(&self) -> Option<&Panorama> {
        self.last.as_ref()
    }

    fn timing(&self) -> SensorTiming {
        self.timing
    }
}
