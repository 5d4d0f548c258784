//! All pairs of a set's panoramas: does the one show the way to where the other was taken?
//!
//! Each panorama is home in turn, and each other one is looked at from there. Panoramas of different rooms have nothing to say to
//! one another, and a method that gives an answer there makes it up.

use std::sync::OnceLock;

use serde::Serialize;
use strum::{IntoStaticStr, VariantArray};

use super::pool::Pool;
use crate::error::{Error, Result};
use crate::estimation::two_view::miss_rad;
use crate::geometry::{Pose, angle_of, wrap};
use crate::homing::{Answer, HomingKind};
use crate::panorama::Panorama;
use crate::panorama_set::PanoramaSet;

/// Most bytes of a set's panoramas, which are all in memory.
const MOST_BYTES: usize = 8 << 30;

/// How two panoramas of a set lie to one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, IntoStaticStr, VariantArray)]
pub enum Lie {
    /// In one room, up to 1 m apart.
    #[serde(rename = "room, to 1 m")]
    #[strum(serialize = "room, to 1 m")]
    To1M,
    /// In one room, 1 to 2.5 m apart.
    #[serde(rename = "room, to 2.5 m")]
    #[strum(serialize = "room, to 2.5 m")]
    To2500Mm,
    /// In one room, 2.5 to 5 m apart.
    #[serde(rename = "room, to 5 m")]
    #[strum(serialize = "room, to 5 m")]
    To5M,
    /// In one room, farther apart.
    #[serde(rename = "room, beyond 5 m")]
    #[strum(serialize = "room, beyond 5 m")]
    Beyond5M,
    /// In different rooms, up to 5 m apart: through an open door the one may see what the other does.
    #[serde(rename = "rooms, to 5 m")]
    #[strum(serialize = "rooms, to 5 m")]
    RoomsTo5M,
    /// In different rooms, farther apart.
    #[serde(rename = "rooms, beyond 5 m")]
    #[strum(serialize = "rooms, beyond 5 m")]
    RoomsBeyond5M,
}

impl Lie {
    fn of(distance_m: f64, same_room: bool) -> Self {
        match distance_m {
            d if d <= 5.0 && !same_room => Self::RoomsTo5M,
            _ if !same_room => Self::RoomsBeyond5M,
            d if d <= 1.0 => Self::To1M,
            d if d <= 2.5 => Self::To2500Mm,
            d if d <= 5.0 => Self::To5M,
            _ => Self::Beyond5M,
        }
    }

    /// What tables call it.
    #[must_use]
    pub fn words(self) -> &'static str {
        self.into()
    }
}

/// What came of a pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairRow {
    /// Method.
    pub method: HomingKind,
    /// Picture at home.
    pub home: String,
    /// Picture now.
    pub now: String,
    /// Room of home; empty where the set has one.
    pub home_room: String,
    /// Room of now.
    pub now_room: String,
    /// How they lie.
    pub lie: Lie,
    /// Distance between them, m.
    pub distance_m: f64,
    /// Landmarks that the answer rests on.
    pub landmarks: usize,
    /// Those of them that are seen within the tolerance of where the true poses put them, whatever their range.
    pub right: usize,
    /// Other readings of the panorama.
    pub alternatives: usize,
    /// Error of the turn since home, degrees.
    pub turn_error_deg: Option<f64>,
    /// Its stated standard deviation, degrees.
    pub turn_sd_deg: Option<f64>,
    /// Error of the direction of home, degrees.
    pub home_error_deg: Option<f64>,
    /// Its stated standard deviation, degrees.
    pub home_sd_deg: Option<f64>,
    /// Where now is from home, m, in the set's frame.
    pub from_home_m: [f64; 2],
    /// Direction in which home is held to be, degrees in the set's frame.
    pub toward_deg: Option<f64>,
}

impl PairRow {
    /// A row without an answer.
    #[must_use]
    pub fn empty(method: HomingKind, lie: Lie) -> Self {
        Self {
            method,
            home: String::new(),
            now: String::new(),
            home_room: String::new(),
            now_room: String::new(),
            lie,
            distance_m: 0.0,
            landmarks: 0,
            right: 0,
            alternatives: 0,
            turn_error_deg: None,
            turn_sd_deg: None,
            home_error_deg: None,
            home_sd_deg: None,
            from_home_m: [0.0; 2],
            toward_deg: None,
        }
    }

    /// Whether there is an answer.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.turn_error_deg.is_some() || self.home_error_deg.is_some()
    }

    /// Whether there is an answer that most of its landmarks do not bear out, or, from a method without landmarks, whose directions are
    /// off by more than a right angle.
    #[must_use]
    pub fn is_wrong(&self) -> bool {
        let off = |error: Option<f64>| error.is_some_and(|e| e.abs() > 90.0);
        self.is_answered()
            && if self.landmarks > 0 {
                2 * self.right < self.landmarks
            } else {
                off(self.turn_error_deg) || off(self.home_error_deg)
            }
    }
}

/// Panoramas nearer than this were taken at one place, m.
const SAME_M: f64 = 1e-6;

/// The panoramas of a set, each loaded once.
struct Views<'a> {
    set: &'a PanoramaSet,
    poses: Vec<Pose>,
    loaded: Vec<OnceLock<Panorama>>,
}

impl<'a> Views<'a> {
    fn of(set: &'a PanoramaSet) -> Result<Self> {
        let entries = set.entries();
        let unfit = |what: &str, found: String, needed: &str| Error::Unfit {
            what: format!("{what} of the set in {}", set.folder().display()),
            found,
            needed: needed.to_owned(),
        };
        let poses = entries.iter().map(|e| e.pose).collect::<Option<Vec<Pose>>>().ok_or_else(|| {
            let needed = "a set that says where its panoramas were taken, a table of poses, or --spacing-m with a grid";
            unfit("poses", "none".to_owned(), needed)
        })?;
        if entries.len() < 2 {
            return Err(unfit("panoramas", entries.len().to_string(), "two at least"));
        }
        let bytes = set.load(0)?.rgba.len();
        if bytes * entries.len() > MOST_BYTES {
            return Err(Error::Lacking {
                what: "memory for all panoramas of the set".to_owned(),
                found: format!("{} of {bytes} bytes", entries.len()),
                needed: format!("at most {MOST_BYTES} bytes in all; smaller ones by --width-px"),
            });
        }
        Ok(Self { set, poses, loaded: entries.iter().map(|_| OnceLock::new()).collect() })
    }

    fn panorama(&self, k: usize) -> Result<&Panorama> {
        if self.loaded[k].get().is_none() {
            let _ = self.loaded[k].set(self.set.load(k)?);
        }
        self.loaded[k].get().ok_or_else(|| Error::Threads("a panorama that was loaded is gone".to_owned()))
    }

    fn room(&self, k: usize) -> &str {
        self.set.entries()[k].world.as_ref().map_or("", |w| w.world.as_str())
    }

    fn name(&self, k: usize) -> [String; 2] {
        [self.set.entries()[k].key.clone(), self.room(k).to_owned()]
    }
}

/// What is asked of a set's pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairs {
    /// Methods.
    pub methods: Vec<HomingKind>,
    /// Pairs of one room that are farther apart are passed over, m.
    pub farthest_m: f64,
    /// How many panoramas are home in turn, evenly spread over the set; by default all.
    pub homes: Option<usize>,
    /// A landmark is right within this angle, rad.
    pub tolerance_rad: f64,
}

impl Pairs {
    /// Looks at all pairs of a panorama of `homes` and one of `set` taken elsewhere: of one set, or of two that show the same places under
    /// two conditions. Rows come method by method, home by home.
    ///
    /// # Errors
    /// When the set does not tell where its panoramas were taken, has fewer than two, does not fit into memory or cannot be read.
    pub fn run(
        &self,
        homes: &PanoramaSet,
        set: &PanoramaSet,
        pool: &Pool<'_>,
        watch: &(dyn Fn() + Sync),
    ) -> Result<Vec<PairRow>> {
        let (homes, nows) = (Views::of(homes)?, Views::of(set)?);
        let count = self.homes.unwrap_or(homes.poses.len()).clamp(1, homes.poses.len());
        let jobs: Vec<(HomingKind, usize)> =
            self.methods.iter().flat_map(|m| (0..count).map(|k| (*m, k * homes.poses.len() / count))).collect();
        let rows = pool.map(
            &jobs,
            || (),
            |(), &(method, home), halted| {
                let mut homing = method.at_home(homes.panorama(home)?);
                let mut rows = Vec::new();
                for (now, pose) in nows.poses.iter().enumerate() {
                    if halted() {
                        return Err(Error::Interrupted);
                    }
                    let distance_m = (pose.position() - homes.poses[home].position()).norm();
                    let same_room = homes.room(home) == nows.room(now);
                    if same_room && (distance_m > self.farthest_m || distance_m < SAME_M) {
                        continue;
                    }
                    let answer = homing.look(nows.panorama(now)?)?;
                    let names = [homes.name(home), nows.name(now)];
                    rows.push(self.row(method, names, Lie::of(distance_m, same_room), &homes.poses[home], pose, &answer));
                }
                watch();
                Ok(rows)
            },
        )?;
        Ok(rows.into_iter().flatten().collect())
    }

    fn row(&self, method: HomingKind, names: [[String; 2]; 2], lie: Lie, home: &Pose, now: &Pose, answer: &Answer) -> PairRow {
        let step = home.to_local(now);
        let way = angle_of(step.position());
        let right = answer.landmarks.iter().filter(|l| miss_rad(l, way, step.heading) <= self.tolerance_rad).count();
        let true_home = angle_of(now.inverse_transform(home.position()));
        let degrees = |rad: f64| Some(rad.to_degrees());
        let [[home_name, home_room], [now_name, now_room]] = names;
        let from_home = now.position() - home.position();
        PairRow {
            home: home_name,
            now: now_name,
            home_room,
            now_room,
            distance_m: from_home.norm(),
            landmarks: answer.landmarks.len(),
            right,
            alternatives: answer.alternatives,
            turn_error_deg: answer.turn.and_then(|a| degrees(wrap(a.rad - step.heading))),
            turn_sd_deg: answer.turn.and_then(|a| degrees(a.sd_rad?)),
            home_error_deg: answer.home.and_then(|a| degrees(wrap(a.rad - true_home))),
            home_sd_deg: answer.home.and_then(|a| degrees(a.sd_rad?)),
            from_home_m: from_home.into(),
            toward_deg: answer.home.and_then(|a| degrees(wrap(a.rad + now.heading))),
            ..PairRow::empty(method, lie)
        }
    }
}

/// Pairs of one kind under one method, together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairSummary {
    /// Method.
    pub method: HomingKind,
    /// How the pairs lie.
    pub lie: Lie,
    /// How many.
    pub pairs: usize,
    /// Those with an answer.
    pub answered: usize,
    /// Those of them that are wrong.
    pub wrong: usize,
    /// Landmarks of all answers.
    pub landmarks: usize,
    /// Right ones.
    pub right: usize,
    /// Median size of the error of the turn, degrees.
    pub turn_error_deg: Option<f64>,
    /// Median size of the error of the direction of home, degrees.
    pub home_error_deg: Option<f64>,
    /// Mean size of it: the average angular error, degrees.
    pub aae_deg: Option<f64>,
}

/// The rows by method and by how pairs lie.
#[must_use]
pub fn summaries(rows: &[PairRow]) -> Vec<PairSummary> {
    let mut all = Vec::new();
    for &method in HomingKind::VARIANTS {
        for &lie in Lie::VARIANTS {
            let of: Vec<&PairRow> = rows.iter().filter(|r| r.method == method && r.lie == lie).collect();
            if of.is_empty() {
                continue;
            }
            let sizes =
                |value: fn(&PairRow) -> Option<f64>| of.iter().filter_map(|r| value(r)).map(f64::abs).collect::<Vec<_>>();
            let home = sizes(|r| r.home_error_deg);
            all.push(PairSummary {
                method,
                lie,
                pairs: of.len(),
                answered: of.iter().filter(|r| r.is_answered()).count(),
                wrong: of.iter().filter(|r| r.is_wrong()).count(),
                landmarks: of.iter().map(|r| r.landmarks).sum(),
                right: of.iter().map(|r| r.right).sum(),
                turn_error_deg: crate::statistics::quantile(&sizes(|r| r.turn_error_deg), 0.5),
                aae_deg: crate::statistics::mean(home.iter().copied()),
                home_error_deg: crate::statistics::quantile(&home, 0.5),
            });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::homing::Angle;
    use crate::panorama_set::Lens;
    use crate::world::World;

    /// Four panoramas of a rendered room and one of another, written as pictures of a camera, with their table.
    fn pictures(folder: &std::path::Path) {
        use crate::render::{self, RendererChoice, Scene, View};
        let mut renderer = render::create(RendererChoice::Cpu).unwrap();
        let mut table = "file,x_m,y_m,heading_deg,room\n".to_owned();
        let poses = [("lab", 3.4, 3.0, 0.0), ("lab", 3.0, 2.6, 90.0), ("lab", 2.6, 3.1, -140.0), ("crowd", 4.0, 3.0, 10.0)];
        for (k, (name, x, y, heading_deg)) in poses.into_iter().enumerate() {
            let world = World::open(name).unwrap();
            // Somewhere free in the other room; the table may say what it likes of it.
            let pose = if name == "lab" { Pose::new(x, y, f64::to_radians(heading_deg)) } else { world.home };
            let projection = world.projection_of_size(720, 90);
            let mut seen = Panorama::black(projection);
            let view = View { projection, robot: pose, bodies: &world.body_poses() };
            renderer.render(&Scene::new(&world).unwrap(), &view, &mut seen).unwrap();
            crate::panorama_set::mirror(&mut seen);
            let camera = world.camera_pose(&Pose::new(x, y, f64::to_radians(heading_deg)));
            image::RgbaImage::from_raw(720, 90, seen.rgba).unwrap().save(folder.join(format!("{k}.png"))).unwrap();
            table += &format!("{k}.png,{},{},{heading_deg},{name}\n", camera.x, camera.y);
        }
        std::fs::write(folder.join("poses.csv"), table).unwrap();
    }

    #[test]
    fn pictures_of_one_room_show_the_way_and_those_of_another_none() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        // The room's camera looks up a little.
        let horizon_row = Some(World::open("lab").unwrap().projection_of_size(720, 90).horizon_row);
        let lens = Lens { kind: crate::panorama_set::LensKind::Cylindrical, horizon_row, ..Lens::default() };
        let set = PanoramaSet::of_pictures(folder.path(), None, lens).unwrap();
        let pairs = Pairs { methods: vec![HomingKind::Features], farthest_m: 5.0, homes: None, tolerance_rad: 0.035 };
        let rows = pairs.run(&set, &set, &Pool::new(2), &|| ()).unwrap();
        let (same, other): (Vec<_>, Vec<_>) = rows.iter().partition(|r| r.home_room == r.now_room);
        assert_eq!((same.len(), other.len()), (6, 6));
        for row in same {
            assert!(row.landmarks > 40 && 20 * row.right >= 19 * row.landmarks && !row.is_wrong(), "{row:?}");
            assert!(row.turn_error_deg.unwrap().abs() < 0.7 && row.home_error_deg.unwrap().abs() < 3.0, "{row:?}");
        }
        assert!(other.iter().all(|row| !row.is_answered() && row.landmarks == 0));
        let all = summaries(&rows);
        assert_eq!(
            all.iter().map(|s| (s.lie, s.pairs, s.answered, s.wrong)).collect::<Vec<_>>(),
            [(Lie::To1M, 6, 6, 0), (Lie::RoomsTo5M, 6, 0, 0)]
        );
    }

    #[test]
    fn an_answer_is_wrong_where_its_landmarks_or_its_directions_are() {
        let pairs = Pairs { methods: vec![HomingKind::Features], farthest_m: 5.0, homes: None, tolerance_rad: 0.035 };
        let names = || [(); 2].map(|()| [String::new(), String::new()]);
        let (home, now) = (Pose::IDENTITY, Pose::new(1.0, 0.0, 0.5));
        let angle = |rad: f64| Some(Angle { rad, sd_rad: None });
        let row = |turn: f64, way: f64| {
            let answer = Answer { turn: angle(turn), home: angle(way), ..Answer::default() };
            pairs.row(HomingKind::Features, names(), Lie::To1M, &home, &now, &answer)
        };
        let right = row(0.5, std::f64::consts::PI - 0.5);
        assert!(right.turn_error_deg.unwrap().abs() < 1e-9 && right.home_error_deg.unwrap().abs() < 1e-9 && !right.is_wrong());
        assert!(row(0.5 + 3.0, 0.0).is_wrong() && row(0.5, -0.5).is_wrong());
    }

    #[test]
    fn tables_with_gaps_are_named() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        let told = |table: &str| {
            let path = folder.path().join("t.csv");
            std::fs::write(&path, table).unwrap();
            PanoramaSet::of_pictures(folder.path(), Some(&path), Lens::default()).unwrap_err().to_string()
        };
        for (table, wanted) in [
            ("file,x_m,y_m\n0.png,1,2\n", "no heading_deg"),
            ("file,x_m,y_m,heading_deg\n0.png,1,,3\n", "line 2: y_m: found nothing, expected a number"),
            ("file,x_m,y_m,heading_deg\n0.png,1,2,3\n9.png,1,2,3\n", "line 3: found `9.png`, which is no file"),
            ("file,x_m,y_m,heading_deg\n0.png,1,2,3\n0.png,1,2,3\n", "line 3: found `0.png` again, which line 2 has"),
            ("file,x_m,y_m,heading_deg\n", "found no picture"),
        ] {
            assert!(told(table).contains(wanted), "{}", told(table));
        }
    }
}
