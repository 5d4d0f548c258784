//! Conditions of a set: what is other than in the world's file.
//!
//! A condition is written as changes joined by `+`: `night+cheap`, `moved:2+exposure:1.5`. `original` changes nothing.

use rand::RngExt;
use serde::Deserialize;
use serde::de::value::{BorrowedStrDeserializer, Error as ValueError};

use crate::error::{Error, Result};
use crate::geometry::Vector2;
use crate::random::{Seed, Stream};
use crate::world::convex::{Convex, gap_to_walls_m};
use crate::world::spec::NoiseSpec;
use crate::world::{CameraPreset, LightPreset, OpticsSpec, TextureSpec, World, WorldSpec};

/// What the changes are called, for messages and `--help`.
pub const CHANGES: &str = "original; light: day, overcast, glare, evening, night, winlit[:WINDOW] (that window alone, from 0); camera: \
                           ideal, decent, cheap, dirty, night-camera, exposure:FACTOR (1 is as it is), blur:DEG (of the focus), \
                           noise:ELECTRONS (that fill a pixel; fewer are noisier); room: moved[:N] (furniture, each N in another \
                           order), textures[:N] (images swapped and patterns redrawn, each N in another way)";
/// Furniture is moved by at most this far along x and y, m, ...
const MOVED_M: f64 = 0.6;
/// ... turned by at most this much, degrees, ...
const TURNED_DEG: f64 = 40.0;
/// ... and keeps this far from everything else, m.
const APART_M: f64 = 0.03;
/// Places that are tried for a body before it stays where it is.
const TRIES: usize = 30;
/// Ambient light that is left where one window shines alone.
const DUSK: f64 = 0.25;

/// One change.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    Light(LightPreset),
    /// Lamps and all windows but this one are dark.
    WindowLit(usize),
    Camera(CameraPreset),
    Exposure(f64),
    BlurDeg(f64),
    /// Electrons that a pixel of the sensor holds: the fewer, the noisier.
    Noise(f64),
    /// Bodies on the floor are moved; the number tells such conditions apart.
    Moved(u64),
    /// Images change places, patterns are drawn anew.
    Textures(u64),
}

/// What is other than in the world's file.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    given: String,
    changes: Vec<Change>,
}

/// A world under a condition.
#[derive(Debug, Clone)]
pub struct Staged {
    /// The condition.
    pub condition: Condition,
    /// The world as it is then.
    pub world: World,
    /// Its light.
    pub light: LightPreset,
    /// The camera's optics.
    pub optics: OpticsSpec,
    /// What was changed, in words.
    pub description: String,
}

impl std::str::FromStr for Condition {
    type Err = String;

    fn from_str(given: &str) -> std::result::Result<Self, String> {
        let words = given.split('+').filter(|word| *word != "original");
        let changes = words.map(change).collect::<std::result::Result<Vec<_>, _>>()?;
        Ok(Self { given: given.to_owned(), changes })
    }
}

fn change(word: &str) -> std::result::Result<Change, String> {
    let (name, value) = word.split_once(':').map_or((word, None), |(name, value)| (name, Some(value)));
    let number = |least: f64, most: f64| {
        let found = value.unwrap_or_default();
        let read = found.parse().ok().filter(|x: &f64| (least..=most).contains(x));
        read.ok_or_else(|| format!("{name}: found `{found}`, allowed is a number from {least} to {most}"))
    };
    let count = |usual: u64| {
        let read = value.map_or(Ok(usual), str::parse);
        read.map_err(|_| format!("{name}: found `{}`, allowed is a whole number", value.unwrap_or_default()))
    };
    Ok(match name {
        "winlit" => Change::WindowLit(count(0)? as usize),
        "exposure" => Change::Exposure(number(0.01, 100.0)?),
        "blur" => Change::BlurDeg(number(0.0, 5.0)?),
        "noise" => Change::Noise(number(50.0, 1e6)?),
        "moved" => Change::Moved(count(1)?),
        "textures" => Change::Textures(count(1)?),
        _ => {
            // Night is a light and a camera.
            let camera = || preset(if name == "night-camera" { "night" } else { name });
            let found = preset(name).map(Change::Light).or_else(|| camera().map(Change::Camera));
            let found = found.ok_or_else(|| format!("found `{word}`, allowed is {CHANGES}"))?;
            value.map_or(Ok(found), |text| Err(format!("{name} takes no value, found `{text}`")))?
        }
    })
}

/// The preset that files call so.
fn preset<'de, T: Deserialize<'de>>(name: &'de str) -> Option<T> {
    T::deserialize(BorrowedStrDeserializer::<ValueError>::new(name)).ok()
}

impl Condition {
    /// The world as its file has it.
    pub fn original() -> Self {
        Self { given: "original".into(), changes: Vec::new() }
    }

    /// As the command line has it.
    pub fn given(&self) -> &str {
        &self.given
    }

    /// Name for folders and keys: letters, digits, `-` and `_`.
    pub fn name(&self) -> String {
        self.given.replace('+', "-").replace('.', "_").replace(':', "")
    }

    /// The world under this condition. `seed` is that of the set.
    ///
    /// # Errors
    /// When the world has no such window, or has faults once it is changed.
    pub fn stage(&self, world: &World, seed: Seed) -> Result<Staged> {
        let (mut spec, mut light, mut optics) = (world.spec.clone(), world.spec.light.preset, world.spec.camera.optics);
        let (mut words, mut moved) = (Vec::new(), None);
        for change in &self.changes {
            words.push(match *change {
                Change::Light(preset) => {
                    light = preset;
                    format!("light `{}`", serde_json::to_string(&preset).unwrap_or_default().trim_matches('"'))
                }
                Change::WindowLit(k) => window_lit(&mut spec, k)?,
                Change::Camera(preset) => {
                    optics = preset.optics();
                    format!("camera `{}`", serde_json::to_string(&preset).unwrap_or_default().trim_matches('"'))
                }
                Change::Exposure(factor) => {
                    optics.exposure *= factor;
                    format!("{factor} times the exposure")
                }
                Change::BlurDeg(deg) => {
                    optics.focus_blur_deg = deg;
                    format!("a focus blur of {deg} degrees")
                }
                Change::Noise(saturation_electrons) => {
                    let read_electrons = optics.noise.map_or(5.0, |n| n.read_electrons);
                    optics.noise = Some(NoiseSpec { saturation_electrons, read_electrons });
                    format!("a sensor that holds {saturation_electrons} electrons a pixel")
                }
                Change::Moved(n) => {
                    moved = Some(seed.derive(&format!("moved {n}")));
                    "furniture moved".to_owned()
                }
                Change::Textures(n) => {
                    swap_textures(&mut spec, &mut seed.derive(&format!("textures {n}")).stream("swap"));
                    "images in other places, patterns drawn anew".to_owned()
                }
            });
        }
        let mut staged = if spec == world.spec { world.clone() } else { World::from_spec(&spec, &world.source)? };
        if let Some(seed) = moved {
            staged = move_furniture(staged, &mut seed.stream("furniture"))?;
        }
        let description = if words.is_empty() { "as the world has it".to_owned() } else { words.join(", ") };
        Ok(Staged { condition: self.clone(), world: staged, light, optics, description })
    }
}

fn window_lit(spec: &mut WorldSpec, k: usize) -> Result<String> {
    let count = spec.light.windows.len();
    let Some(lit) = spec.light.windows.get(k) else {
        return Err(Error::Invalid {
            what: format!("window of condition winlit in world {}", spec.name),
            found: k.to_string(),
            allowed: if count == 0 { "a world with windows, such as gallery".into() } else { format!("0 to {}", count - 1) },
        });
    };
    let words = format!("window {k} (\"{}\") alone lit", lit.name);
    spec.light.ambient *= DUSK;
    spec.light.lamps.clear();
    for (other, window) in spec.light.windows.iter_mut().enumerate() {
        if other != k {
            window.brightness = 0.0;
        }
    }
    Ok(words)
}

fn swap_textures(spec: &mut WorldSpec, stream: &mut Stream) {
    spec.seed = stream.random::<u64>() >> 32;
    let room = &mut spec.room;
    let surfaces = room.walls.iter_mut().chain([&mut room.floor, &mut room.ceiling]);
    let bodies = spec.landmarks.iter_mut().chain(&mut spec.obstacles).map(|b| &mut b.texture);
    let windows = spec.light.windows.iter_mut().map(|w| &mut w.texture);
    let mut images: Vec<&mut TextureSpec> = Vec::new();
    for texture in surfaces.chain(bodies).chain(windows) {
        texture.seed = None; // the world's new seed holds for all
        if texture.image.is_some() {
            images.push(texture);
        }
    }
    // Sattolo's shuffle: no image stays where it is.
    for k in (1..images.len()).rev() {
        let other = (stream.random::<u64>() % k as u64) as usize;
        let (low, high) = images.split_at_mut(k);
        std::mem::swap(&mut low[other].image, &mut high[0].image);
    }
}

/// Moves each body that stands on the floor to a free place near by, if one is found.
fn move_furniture(mut world: World, stream: &mut Stream) -> Result<World> {
    let mut spec = world.spec.clone();
    // Starts and blows may lie where something stands now; pictures have no use for them.
    spec.start.named.clear();
    spec.disturbances.clear();
    let landmarks = spec.landmarks.len();
    for k in 0..world.bodies.len() {
        let body = &world.bodies[k];
        if body.bottom_m > 0.0 || body.motion.as_ref().is_some_and(|_| !body.can_be_pushed()) {
            continue;
        }
        let others: Vec<(usize, Convex)> =
            world.bodies.iter().enumerate().filter(|(l, _)| *l != k).map(|(l, b)| (l, Convex::of_body(b, &b.pose))).collect();
        // What carries another body stays beneath it.
        let carries = others
            .iter()
            .any(|(l, shape)| world.bodies[*l].bottom_m > 0.0 && shape.gap_m(&Convex::of_body(body, &body.pose)) < APART_M);
        if carries {
            continue;
        }
        let robot = Convex::disc(world.home.position(), world.spec.robot.radius_m + APART_M);
        for _ in 0..TRIES {
            let [dx, dy, turn] = std::array::from_fn(|_| 2.0 * stream.random::<f64>() - 1.0);
            let mut pose = body.pose;
            (pose.x, pose.y) = (pose.x + MOVED_M * dx, pose.y + MOVED_M * dy);
            pose.heading += (TURNED_DEG * turn).to_radians();
            let shape = Convex::of_body(body, &pose);
            let free = gap_to_walls_m(&world.outline, &shape) >= APART_M
                && shape.gap_m(&robot) >= 0.0
                && others.iter().all(|(_, other)| other.gap_m(&shape) >= APART_M);
            if !free {
                continue;
            }
            let written = if k < landmarks { &mut spec.landmarks[k] } else { &mut spec.obstacles[k - landmarks] };
            let before = written.clone();
            written.position_m = Vector2::new(pose.x, pose.y).into();
            written.heading_deg = pose.heading.to_degrees();
            // The world's own checks have the last word.
            match World::from_spec(&spec, &world.source) {
                Ok(moved) => world = moved,
                Err(_) if k < landmarks => spec.landmarks[k] = before,
                Err(_) => spec.obstacles[k - landmarks] = before,
            }
            break;
        }
    }
    Ok(world)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn staged(world: &str, given: &str) -> Result<Staged> {
        given.parse::<Condition>().unwrap().stage(&World::open(world)?, Seed(7))
    }

    #[test]
    fn conditions_are_read_and_named() {
        let name = |given: &str| given.parse::<Condition>().map(|c| c.name());
        assert_eq!(name("night+night-camera").unwrap(), "night-night-camera");
        assert_eq!(name("moved:2+exposure:1.5").unwrap(), "moved2-exposure1_5");
        for bad in ["", "dusk", "day:1", "exposure", "exposure:0", "moved:x", "day+", "noise:nan"] {
            assert!(name(bad).is_err(), "{bad}");
        }
        assert!(name("dusk").unwrap_err().contains("winlit"));
    }

    #[test]
    fn a_condition_changes_what_it_says() {
        let lab = World::open("lab").unwrap();
        assert_eq!(staged("lab", "original").unwrap().world, lab);
        let moved = staged("lab", "moved").unwrap().world;
        let count = lab.bodies.iter().zip(&moved.bodies).filter(|(a, b)| a.pose != b.pose).count();
        assert!(count >= 6, "{count} of {} bodies moved", lab.bodies.len());
        assert_eq!(moved.home, lab.home);
        assert_eq!(staged("lab", "moved").unwrap().world, moved, "by the seed alone");
        assert_ne!(staged("lab", "moved:2").unwrap().world.bodies, moved.bodies);
        let gallery = staged("gallery", "winlit:1+dirty").unwrap();
        assert!(gallery.world.spec.light.lamps.is_empty() && gallery.world.windows[0].brightness == 0.0);
        assert!(gallery.world.windows[1].brightness > 0.0 && gallery.optics.dirt.is_some());
        assert!(staged("lab", "winlit").unwrap_err().to_string().contains("windows"));
        let images = |world: &World| world.spec.landmarks.iter().filter_map(|b| b.texture.image.clone()).collect::<Vec<_>>();
        let (before, after) = (World::open("gallery").unwrap(), staged("gallery", "textures").unwrap().world);
        assert_ne!(images(&before), images(&after));
        assert_ne!(before.floor_texture.seed, after.floor_texture.seed);
    }
}
