//! Everything that a study can set, by name.
//!
//! A setting is called as the command line calls it (`method`, `time_limit_s`), a field of the world as `world.` and its place
//! in the file (`world.floor.friction`, `world.obstacles[stool].height_m`), one of the anchored filter as `filter.` and one of
//! the extractor as `extractor.` and the field's name. Beside these there are settings that change several fields at once:
//! `floor_friction`, `walkers`, `start_distance_m`.

use serde::Serialize;
use serde::de::DeserializeOwned;
use strsim::levenshtein;
use strum::VariantArray;

use super::value::Value;
use crate::control::Law;
use crate::episode::{PlantKind, SensorKind, Setup, Start};
use crate::error::{Error, Result};
use crate::estimation::anchored::FilterSettings;
use crate::method::MethodKind;
use crate::render::RendererChoice;
use crate::study::compare::{CONTENDERS, pick};
use crate::vision::{ExtractorSettings, Landmarks};
use crate::world::{CameraPreset, Draft, Field, LightPreset, WorldSpec, fields};

/// Half the width of the ring that starts at a given distance are drawn from, m.
pub const START_RING_M: f64 = 0.05;

/// A world and a setup that settings are applied to.
#[derive(Debug, Clone)]
pub struct Case {
    /// The world.
    pub draft: Draft,
    /// All else.
    pub setup: Setup,
    /// Seed of the episode, by which a world may be drawn.
    pub seed: u64,
}

/// Ending of a generated world that each seed of a study has one of: `office:seed`.
const DRAWN: &str = ":seed";

/// Whether a world's name stands for one a seed.
pub(super) fn is_drawn(world: &str) -> bool {
    world.ends_with(DRAWN)
}

/// Opens a world by name, for the episode of a seed.
pub(super) fn open(world: &str, seed: u64) -> Result<Draft> {
    match world.strip_suffix(DRAWN) {
        Some(kind) => Draft::open(&format!("{kind}:{seed}")),
        None => Draft::open(world),
    }
}

/// What a value did not fit: what is allowed instead.
type Refusal = String;
type Apply = fn(&mut Case, &Value) -> std::result::Result<(), Refusal>;

/// Key, default, meaning and effect of each setting but those of `world.`, `filter.` and `extractor.`.
const SETTINGS: &[(&str, &str, &str, Apply)] = &[
    (
        "world",
        "the study's",
        "world file, built-in world, or a generated one: office:17, or office:seed for one a seed",
        |case, value| {
            case.draft = open(text(value)?, case.seed).map_err(|e| e.to_string())?;
            Ok(())
        },
    ),
    // Before those that a method's name implies, so that what is said of them beside it holds.
    ("method", "anchored-ekf", "homing method, by its name in `wayhome compare`", |case, value| {
        set_method(&mut case.setup, text(value)?)
    }),
    ("controller", "proportional", "steering law", |case, value| choose(&mut case.setup.law, Law::VARIANTS, value)),
    ("compass_deg", "none", "standard deviation of the compass", |case, value| {
        case.setup.compass_sd_rad = Some(at_least_0(value)?.to_radians());
        Ok(())
    }),
    ("plant", "rapier", "what moves", |case, value| choose(&mut case.setup.plant, PlantKind::VARIANTS, value)),
    ("bearings", "rendered", "where bearings come from", |case, value| {
        choose(&mut case.setup.sensor, &[SensorKind::Rendered, SensorKind::Ideal, SensorKind::Noisy], value)
    }),
    ("landmarks", "features", "what a landmark of rendered bearings is", |case, value| {
        choose(&mut case.setup.extractor.landmarks, Landmarks::VARIANTS, value)
    }),
    ("renderer", "cpu", "what renders", |case, value| {
        case.setup.renderer = match text(value)? {
            "cpu" => RendererChoice::Cpu,
            "gpu" => RendererChoice::Gpu,
            _ => return Err("\"cpu\" or \"gpu\"; what is there on a machine must not decide about the rows".into()),
        };
        Ok(())
    }),
    ("size", "the world's", "columns and rows of the panorama, \"720x90\"", |case, value| {
        let size = text(value)?.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        let fits = |&(w, h): &(u32, u32)| (16..=16384).contains(&w) && (8..=4096).contains(&h);
        case.setup.size_px = Some(size.filter(fits).ok_or("a size from 16x8 to 16384x4096 pixels in quotes, as \"720x90\"")?);
        Ok(())
    }),
    ("light", "the world's", "light", |case, value| choose_one(&mut case.setup.look.light, LightPreset::VARIANTS, value)),
    ("camera", "the world's", "camera", |case, value| choose_one(&mut case.setup.look.camera, CameraPreset::VARIANTS, value)),
    ("home_light", "as light", "light at home", |case, value| {
        choose_one(&mut case.setup.home_look.light, LightPreset::VARIANTS, value)
    }),
    ("home_camera", "as camera", "camera at home", |case, value| {
        choose_one(&mut case.setup.home_look.camera, CameraPreset::VARIANTS, value)
    }),
    ("start", "random", "random, or a start that the world names", |case, value| {
        let name = text(value)?;
        case.setup.start = if name == "random" { Start::Random } else { Start::Named(name.to_owned()) };
        Ok(())
    }),
    ("start_distance_m", "the world's", "distance of random starts from home, to 5 cm", |case, value| {
        let distance = at_least_0(value)?;
        put(case, "start.min_distance_m", &(distance - START_RING_M).max(0.0))?;
        put(case, "start.max_distance_m", &(distance + START_RING_M))
    }),
    ("time_limit_s", "the world's", "time limit", |case, value| {
        case.setup.time_limit_s = Some(at_least_0(value).ok().filter(|s| *s > 0.0).ok_or("a number greater than 0")?);
        Ok(())
    }),
    ("told_start", "false", "whether paper-ekf is told where it starts", |case, value| {
        let Value::Truth(told) = value else { return Err("true or false".into()) };
        // Only the paper's filter can be told; the other methods of a study start as they always do.
        case.setup.told_start = *told && case.setup.method == MethodKind::PaperEkf;
        Ok(())
    }),
    ("noise_deg", "0.3", "standard deviation of noisy bearings", |case, value| {
        case.setup.noise.get_or_insert_default().sd_rad = at_least_0(value)?.to_radians();
        Ok(())
    }),
    ("noise_dropout", "0.05", "share of noisy bearings that are missed", |case, value| {
        set_share(&mut case.setup.noise.get_or_insert_default().dropout, value)
    }),
    ("noise_false", "0.02", "share of noisy bearings that are false", |case, value| {
        set_share(&mut case.setup.noise.get_or_insert_default().false_match, value)
    }),
    ("hidden_share", "0", "share of the home landmarks never seen on the way", |case, value| {
        set_share(&mut case.setup.degradation.hidden, value)
    }),
    ("false_match_share", "0", "share of bearings made false matches", |case, value| {
        set_share(&mut case.setup.degradation.false_match, value)
    }),
    ("added_noise_deg", "0", "noise added to bearings of any sensor", |case, value| {
        case.setup.degradation.noise_sd_rad = at_least_0(value)?.to_radians();
        Ok(())
    }),
    ("floor_friction", "the world's", "friction of the whole floor, its zones taken away", |case, value| {
        let friction = value.number().ok_or("a number")?;
        case.draft.set_friction(friction).map_err(|e| e.to_string())
    }),
    ("walkers", "all", "how many of the world's walkers stay", |case, value| {
        let Value::Whole(count) = value else { return Err("a whole number".into()) };
        let count = usize::try_from(*count).map_err(|_| "a whole number from 0")?;
        case.draft.keep_walkers(count).map_err(|e| e.to_string())
    }),
    ("image_noise_electrons", "the camera's", "read noise of the camera on the way and at home", |case, value| {
        let read = at_least_0(value)?;
        let saturation = 10_000.0; // of the decent camera
        put(
            case,
            "camera.optics.noise",
            &std::collections::BTreeMap::from([("saturation_electrons", saturation), ("read_electrons", read)]),
        )
    }),
];

/// Sets one setting.
///
/// # Errors
/// When there is none of this name, or it does not take the value: what was found and what is allowed.
pub(super) fn apply(case: &mut Case, name: &str, value: &Value) -> Result<()> {
    let refused = |allowed: String| Error::Invalid { what: name.to_owned(), found: value.to_string(), allowed };
    if let Some((.., apply)) = SETTINGS.iter().find(|(known, ..)| *known == name) {
        return apply(case, value).map_err(refused);
    }
    match name.split_once('.') {
        Some(("world", place)) if !place.is_empty() => case.draft.set(place, value),
        Some(("filter", field)) if !OF_THE_ROBOT.contains(&name) => {
            change(&mut case.setup.filter, field, value).map_err(refused)
        }
        Some(("extractor", field)) => change(&mut case.setup.extractor, field, value).map_err(refused),
        _ => Err(Error::Invalid { what: "setting".into(), found: name.to_owned(), allowed: near(name) }),
    }
}

/// Place of a setting in the order in which settings are applied: the world first, then its fields, then all else in the order of
/// the list, so that no setting undoes another.
pub(super) fn rank(name: &str) -> usize {
    match SETTINGS.iter().position(|(known, ..)| *known == name) {
        Some(0) => 0,
        None if name.starts_with("world.") => 1,
        Some(k) => 1 + k,
        None => usize::MAX,
    }
}

/// Whether there is a setting of this name. Fields of the world are checked by the world itself.
pub(super) fn exists(name: &str) -> bool {
    catalogue().iter().any(|known| known.key == without_entries(name))
        || name.strip_prefix("world.").is_some_and(|place| place.contains('['))
}

/// Whether there are settings whose names go on from this one, as `world.floor.friction` does from `world.floor`.
pub(super) fn has_parts(name: &str) -> bool {
    let beginning = format!("{name}.");
    catalogue().iter().any(|known| known.key.starts_with(&beginning))
}

/// What a study can set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Its name in study files.
    pub key: String,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// What it is where nothing is set; empty where a world has to say.
    pub default: String,
    /// What it means, in a line.
    pub meaning: String,
}

impl Setting {
    fn new(key: String, default: String, meaning: String) -> Self {
        let unit = UNITS.iter().find(|(ending, _)| key.ends_with(ending)).map_or("", |(_, unit)| *unit);
        Self { key, unit, default, meaning }
    }
}

/// Endings of names, the longer ones first, and the units that they tell.
const UNITS: [(&str, &str); 14] = [
    ("_m_s2", "m/s^2"),
    ("_rad_s2", "rad/s^2"),
    ("_rad_s", "rad/s"),
    ("_rad_m", "rad/m"),
    ("_m_s", "m/s"),
    ("_deg", "deg"),
    ("_rad", "rad"),
    ("_electrons", "electrons"),
    ("_share", "share"),
    ("_kg", "kg"),
    ("_px", "px"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
];

/// All settings.
pub fn catalogue() -> Vec<Setting> {
    let own =
        SETTINGS.iter().map(|(key, default, meaning, _)| Setting::new((*key).into(), (*default).into(), (*meaning).into()));
    let of = |prefix: &'static str, schema: schemars::Schema| {
        let setting = move |field: Field| Setting::new(format!("{prefix}.{}", field.place), field.default, field.meaning);
        fields(schema.as_value()).into_iter().map(setting)
    };
    let filter = of("filter", schemars::schema_for!(FilterSettings));
    let extractor = of("extractor", schemars::schema_for!(ExtractorSettings));
    let world = of("world", schemars::schema_for!(WorldSpec));
    own.chain(filter.filter(|setting| !OF_THE_ROBOT.contains(&setting.key.as_str()))).chain(extractor).chain(world).collect()
}

/// Fields of the filter that the robot's data sheet says, whatever they were set to: the world has them.
const OF_THE_ROBOT: [&str; 2] = ["filter.track_m", "filter.camera_offset_m"];

/// `world.obstacles[2].height_m` as `world.obstacles[].height_m`.
fn without_entries(name: &str) -> String {
    let mut plain = String::new();
    for (k, part) in name.split('[').enumerate() {
        match part.split_once(']') {
            Some((_, rest)) if k > 0 => plain += &format!("[]{rest}"),
            _ => plain += part,
        }
    }
    plain
}

/// The settings whose names are most like `name`, for a message.
pub(super) fn near(name: &str) -> String {
    let last = |name: &str| name.rsplit('.').next().unwrap_or(name).to_owned();
    let distance = |known: &str| levenshtein(name, known).min(1 + levenshtein(&last(name), &last(known)));
    let mut names: Vec<(usize, String)> = catalogue().into_iter().map(|known| (distance(&known.key), known.key)).collect();
    names.sort();
    let nearest: Vec<String> = names.into_iter().take(5).map(|(_, name)| name).collect();
    format!("a setting; the nearest are {} (`wayhome sweep --settings` lists all)", nearest.join(", "))
}

/// A contender's method, and what else its name says; what it does not say stays. `exec:COMMAND` is a program of the user's own.
fn set_method(setup: &mut Setup, name: &str) -> std::result::Result<(), Refusal> {
    if name.starts_with("exec:") {
        setup.method = name.parse().map_err(|error: Error| error.to_string())?;
        return setup.method.check().map_err(|error| error.to_string());
    }
    let keys = || CONTENDERS.iter().map(|c| c.key.as_ref()).collect::<Vec<_>>().join(", ") + ", exec:COMMAND";
    let found = pick(&[name.to_owned()]).map_err(|_| keys())?;
    let contender = found.first().ok_or_else(keys)?;
    setup.method = contender.method.clone();
    if contender.law != Law::Proportional {
        setup.law = contender.law;
    }
    if contender.compass {
        setup.compass_sd_rad = Some(setup.compass_sd_rad.unwrap_or(0.0));
    }
    setup.told_start = contender.told_start;
    Ok(())
}

fn text(value: &Value) -> std::result::Result<&str, Refusal> {
    value.text().ok_or_else(|| "a text in quotes".into())
}

fn at_least_0(value: &Value) -> std::result::Result<f64, Refusal> {
    value.number().filter(|x| *x >= 0.0 && x.is_finite()).ok_or_else(|| "a number from 0".into())
}

fn set_share(field: &mut f64, value: &Value) -> std::result::Result<(), Refusal> {
    *field = value.number().filter(|x| (0.0..=1.0).contains(x)).ok_or("a number from 0 to 1")?;
    Ok(())
}

fn put(case: &mut Case, place: &str, value: &impl Serialize) -> std::result::Result<(), Refusal> {
    case.draft.set(place, value).map_err(|e| e.to_string())
}

/// Sets `field` to that of `all` whose name is the value.
fn choose<T: Copy + Into<&'static str>>(field: &mut T, all: &[T], value: &Value) -> std::result::Result<(), Refusal> {
    let found = all.iter().find(|one| value.text() == Some((**one).into()));
    *field = *found.ok_or_else(|| all.iter().map(|one| (*one).into()).collect::<Vec<&str>>().join(", "))?;
    Ok(())
}

fn choose_one<T: Copy + Into<&'static str>>(
    field: &mut Option<T>,
    all: &[T],
    value: &Value,
) -> std::result::Result<(), Refusal> {
    let mut chosen = *all.first().ok_or("nothing")?;
    choose(&mut chosen, all, value)?;
    *field = Some(chosen);
    Ok(())
}

/// Changes one field of a struct by its name.
fn change<T: Serialize + DeserializeOwned>(settings: &mut T, field: &str, value: &Value) -> std::result::Result<(), Refusal> {
    let mut tree = serde_json::to_value(&*settings).map_err(|e| e.to_string())?;
    let known = tree.as_object().map(|o| o.keys().cloned().collect::<Vec<_>>().join(", ")).unwrap_or_default();
    let slot = tree.get_mut(field).ok_or_else(|| format!("one of {known}"))?;
    *slot = serde_json::to_value(value).map_err(|e| e.to_string())?;
    *settings = serde_json::from_value(tree).map_err(|e| format!("a value that fits ({e})"))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::Noise;

    fn case() -> Case {
        Case { draft: Draft::open("crowd").unwrap(), setup: Setup::default(), seed: 1 }
    }

    #[test]
    fn settings_reach_what_they_name() {
        let mut case = case();
        for (name, value) in [
            ("method", Value::Text("alv-compass".into())),
            ("compass_deg", Value::Real(3.0)),
            ("hidden_share", Value::Real(0.5)),
            ("light", Value::Text("night".into())),
            ("filter.gate", Value::Whole(9)),
            ("extractor.features", Value::Whole(200)),
            ("walkers", Value::Whole(3)),
            ("world.task.arrival_radius_m", Value::Real(0.1)),
            ("world.obstacles[child].height_m", Value::Real(1.1)),
            ("start_distance_m", Value::Real(1.5)),
            ("floor_friction", Value::Real(0.2)),
        ] {
            assert!(exists(name), "{name}");
            if !name.contains("child") {
                apply(&mut case, name, &value).unwrap();
            }
        }
        let world = case.draft.world().unwrap();
        let setup = &case.setup;
        assert_eq!((setup.method.clone(), setup.filter.gate, setup.extractor.features), (MethodKind::Alv, 9.0, 200));
        assert!((setup.compass_sd_rad.unwrap() - 3.0_f64.to_radians()).abs() < 1e-12 && setup.degradation.hidden == 0.5);
        assert_eq!((world.spec.task.arrival_radius_m, world.spec.floor.friction), (0.1, 0.2));
        assert_eq!(world.bodies.len(), world.landmark_count + 3);
    }

    #[test]
    fn what_does_not_fit_is_told_with_what_would() {
        let told = |name: &str, value: Value| apply(&mut case(), name, &value).unwrap_err().to_string();
        assert!(told("hidden_shair", Value::Real(0.5)).contains("hidden_share"));
        assert!(told("friction", Value::Real(0.5)).contains("world.floor.friction"));
        assert!(told("hidden_share", Value::Real(1.5)).contains("0 to 1"));
        assert!(told("method", Value::Text("magic".into())).contains("tron-daniilidis-compass"));
        assert!(told("filter.gait", Value::Real(1.0)).contains("gate"));
        assert!(told("filter.gate", Value::Text("wide".into())).contains("wide"));
        assert!(told("filter.track_m", Value::Real(0.3)).contains("world.robot.track_m"));
        assert!(told("light", Value::Text("dusk".into())).contains("evening"));
        assert!(told("walkers", Value::Whole(12)).contains("0 to 9"));
        assert!(catalogue().iter().any(|setting| setting.key == "world.robot.mass_kg" && setting.unit == "kg"));
        assert!(!exists("world.floor.grip") && exists("world.landmarks[0].height_m"));
    }

    #[test]
    fn settings_say_what_they_are_and_their_defaults_change_nothing() {
        // What a world has to say has no default; the name of an alternative, as in `shape.disc`, says all that there is to say.
        for Setting { key, default, meaning, .. } in catalogue().iter().filter(|setting| !setting.key.starts_with("world.")) {
            assert!(!meaning.is_empty() && !default.is_empty(), "{key}: [{default}] {meaning}");
        }
        let base = Setup { renderer: RendererChoice::Cpu, noise: Some(Noise::default()), ..Setup::default() };
        for (key, default, ..) in SETTINGS {
            let value = match (default.parse::<f64>(), default.parse::<bool>()) {
                (Ok(number), _) => Value::Real(number),
                (_, Ok(truth)) => Value::Truth(truth),
                _ => Value::Text((*default).to_owned()),
            };
            let mut case = Case { draft: Draft::open("crowd").unwrap(), setup: base.clone(), seed: 1 };
            // Such as "the world's" are words for people, which no setting takes.
            if apply(&mut case, key, &value).is_ok() {
                assert_eq!(case.setup, base, "{key} = {default}");
            }
        }
    }
}
