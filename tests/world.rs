//! World files: the built-in worlds, what validation finds, where a robot may start, and the map.

use wayhome::draw::map::{MapDrawing, Stroke, world_svg};
use wayhome::fault::Fault;
use wayhome::geometry::{Pose, Vector2};
use wayhome::random::Seed;
use wayhome::world::{World, WorldSpec};
use wayhome::{Error, Result};

/// A small world without faults; each fault test spoils one thing in it.
const SOUND: &str = r#"
name = "sound"
[room]
outline_m = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]
height_m = 2.5
walls = [{ family = "brick", contrast = 0.5 }]
[floor]
friction = 0.7
zones = [{ name = "wet", friction = 0.3, polygon_m = [[0.5, 0.5], [1.5, 0.5], [1.5, 1.5]] }]
[light]
lamps = [{ position_m = [1.0, 1.0, 2.4], intensity = 1.0 }]
[[landmarks]]
name = "post"
shape = { disc = { radius_m = 0.2 } }
position_m = [3.5, 2.5]
height_m = 1.0
texture = { family = "plain" }
[[landmarks]]
name = "desk"
shape = { box = { size_m = [1.0, 0.5] } }
position_m = [0.5, 2.75]
height_m = 0.7
texture = { family = "planks", period_m = 2.0 }
[[obstacles]]
name = "wedge"
shape = { polygon = { corners_m = [[0.2, 0.0], [-0.1, 0.2], [-0.1, -0.2]] } }
position_m = [3.5, 0.5]
height_m = 0.3
texture = { family = "plain" }
[[obstacles]]
name = "cat"
shape = { disc = { radius_m = 0.1 } }
position_m = [1.0, 0.3]
height_m = 0.3
texture = { family = "plain" }
motion = { path = { corners_m = [[2.0, 0.3]], speed_m_s = 0.4 } }
[[obstacles]]
name = "dog"
shape = { disc = { radius_m = 0.1 } }
position_m = [0.4, 1.5]
height_m = 0.3
texture = { family = "plain" }
motion = { walk = { region_m = [[0.2, 1.2], [0.6, 1.2], [0.6, 1.8], [0.2, 1.8]], speed_m_s = 0.4 } }
[[walls]]
name = "stub"
from_m = [2.2, 2.5]
to_m = [2.2, 3.0]
[[walls]]
from_m = [2.9, 2.55]
to_m = [2.9, 3.0]
height_m = 1.2
openings = [{ kind = "window", from_start_m = 0.05, width_m = 0.15, sill_m = 0.5, top_m = 1.0 }, { from_start_m = 0.25, width_m = 0.1, top_m = 0.9 }]
[robot]
caster_m = 0.125
[camera]
width_px = 720
[home]
x_m = 2.0
y_m = 1.5
[start]
region_m = [[0.8, 0.8], [3.2, 0.8], [3.2, 2.2], [0.8, 2.2]]
min_distance_m = 0.5
max_distance_m = 1.5
named = [{ name = "A", x_m = 1.0, y_m = 1.0 }, { name = "B", x_m = 3.0, y_m = 2.0 }]
[task]
speed_m_s = 0.3
"#;

fn faults(result: Result<World>) -> Vec<Fault> {
    match result {
        Err(Error::World { faults, .. }) => faults,
        other => panic!("expected a faulty world, got {other:?}"),
    }
}

/// What to replace in the sound world, by what, and the one fault that this must give: its place, and a part of what is found.
const SPOILT: &[(&str, &str, &str, &str)] = &[
    // Form.
    ("width_px = 720", "width_px = 720.5", "camera.width_px", "720.5"),
    ("width_px = 720", "width = 720", "camera.width", "an unknown field"),
    ("height_m = 2.5", "height_m = nan", "room.height_m", "NaN"),
    ("height_m = 2.5", "height_m = \"2.5\"", "room.height_m", "\"2.5\""),
    ("family = \"brick\"", "family = \"bricks\"", "room.walls[0].family", "\"bricks\""),
    ("{ disc = { radius_m = 0.2 } }", "{ ball = { radius_m = 0.2 } }", "landmarks[0].shape", "a table of ball"),
    (
        "{ disc = { radius_m = 0.2 } }",
        "{ disc = { radius = 0.2, radius_m = 0.2 } }",
        "landmarks[0].shape.disc.radius",
        "unknown",
    ),
    ("position_m = [3.5, 2.5]", "position_m = [3.5]", "landmarks[0].position_m", "a list of 1"),
    ("[home]\nx_m = 2.0", "[home]", "home.x_m", "nothing"),
    // The room.
    ("name = \"sound\"", "name = \"../sound\"", "name", "\"../sound\""),
    ("[4.0, 3.0], [0.0, 3.0]]", "[0.0, 3.0], [4.0, 3.0]]", "room.outline_m", "edge 1 meets edge 3"),
    ("[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]", "[[0.0, 0.0], [4.0, 0.0]]", "room.outline_m", "2 corners"),
    ("height_m = 2.5", "height_m = -2.5", "room.height_m", "-2.5"),
    ("contrast = 0.5 }]", "contrast = 0.5 }, { family = \"plain\" }]", "room.walls", "2 textures"),
    ("contrast = 0.5", "contrast = 1.5", "room.walls[0].contrast", "1.5"),
    ("friction = 0.7", "friction = -0.7", "floor.friction", "-0.7"),
    ("[[0.5, 0.5], [1.5, 0.5]", "[[-0.5, 0.5], [1.5, 0.5]", "floor.zones[0].polygon_m", "leaves the room"),
    ("[1.0, 1.0, 2.4]", "[1.0, 1.0, 2.6]", "light.lamps[0].position_m", "2.6"),
    ("[light]", "[light]\npreset = \"dusk\"", "light.preset", "\"dusk\""),
    ("[light]", "[light]\ncorner_shade = 1.5", "light.corner_shade", "1.5"),
    (
        "[light]",
        "[light]\nwindows = [{ wall = 4, along_m = [1, 2], height_m = [1, 2], brightness = 1 }]",
        "light.windows[0].wall",
        "4",
    ),
    (
        "[light]",
        "[light]\nwindows = [{ wall = 1, along_m = [1, 3.5], height_m = [1, 2], brightness = 1 }]",
        "light.windows[0].along_m",
        "[1, 3.5]",
    ),
    (
        "[light]",
        "[light]\nwindows = [{ wall = 1, along_m = [1, 2], height_m = [2, 1], brightness = 1 }]",
        "light.windows[0].height_m",
        "[2, 1]",
    ),
    // Walls.
    ("to_m = [2.2, 3.0]", "to_m = [2.2, 2.5]", "walls[0].to_m", "0 m from the wall's beginning"),
    ("to_m = [2.2, 3.0]", "to_m = [2.2, 3.1]", "walls[0].to_m", "leaves the room"),
    ("to_m = [2.2, 3.0]", "to_m = [2.2, 3.0]\nthickness_m = 2.5", "walls[0].thickness_m", "2.5"),
    ("name = \"stub\"", "name = \"post\"", "walls[0].name", "the name of landmarks[0]"),
    ("height_m = 1.2", "height_m = 2.7", "walls[1].height_m", "2.7"),
    ("width_m = 0.15", "width_m = 0.5", "walls[1].openings[0].width_m", "0.5"),
    ("width_m = 0.1,", "width_m = 0.4,", "walls[1].openings[1].width_m", "ends 0.65 m along the wall"),
    ("from_start_m = 0.25", "from_start_m = 0.15", "walls[1].openings[1].from_start_m", "where opening 0 is"),
    ("sill_m = 0.5", "sill_m = 1.0", "walls[1].openings[0].sill_m", "1"),
    ("kind = \"window\"", "kind = \"door\"", "walls[1].openings[0].sill_m", "0.5"),
    ("kind = \"window\"", "kind = \"hatch\"", "walls[1].openings[0].kind", "\"hatch\""),
    ("top_m = 1.0", "top_m = 1.3", "walls[1].openings[0].top_m", "1.3"),
    ("top_m = 0.9", "top_m = 0.38", "walls[1].openings[1].top_m", "0.38"),
    ("from_m = [2.2, 2.5]", "from_m = [2.1, 1.5]", "home", "in stub"),
    ("position_m = [3.5, 2.5]", "position_m = [2.75, 2.7]", "landmarks[0].position_m", "deep in \"inner wall 1\""),
    (
        "from_m = [2.2, 2.5]\nto_m = [2.2, 3.0]",
        "from_m = [1.6, 0.2]\nto_m = [1.6, 0.6]",
        "obstacles[1].motion.path.corners_m[0]",
        "runs into \"stub\"",
    ),
    // Bodies.
    ("radius_m = 0.2", "radius_m = 0.0", "landmarks[0].shape.disc.radius_m", "0"),
    ("size_m = [1.0, 0.5]", "size_m = [1.0, -0.5]", "landmarks[1].shape.box.size_m[1]", "-0.5"),
    (
        "[-0.1, 0.2], [-0.1, -0.2]]",
        "[-0.1, 0.2], [0.0, 0.0], [-0.1, -0.2]]",
        "obstacles[0].shape.polygon.corners_m[2]",
        "does not turn",
    ),
    ("[[0.2, 0.0], [-0.1,", "[[0.2, 0.5], [-0.1,", "obstacles[0].shape.polygon.corners_m", "[0, 0] lies outside"),
    ("period_m = 2.0", "period_m = 0.0", "landmarks[1].texture.period_m", "0"),
    ("height_m = 1.0", "height_m = 3.0", "landmarks[0].height_m", "top at 3 m"),
    ("height_m = 1.0", "height_m = 1.0\nelevation_m = 0.38", "landmarks[0].elevation_m", "0.38"),
    ("name = \"desk\"", "name = \"post\"", "landmarks[1].name", "the name of landmarks[0]"),
    ("position_m = [0.5, 2.75]", "position_m = [0.498, 2.75]", "landmarks[1].position_m", "0.002 m deep in a wall"),
    ("position_m = [3.5, 2.5]", "position_m = [5.0, 2.5]", "landmarks[0].position_m", "outside the room"),
    ("position_m = [3.5, 2.5]", "position_m = [1.1, 2.7]", "landmarks[1].position_m", "0.100 m deep in \"post\""),
    (
        "height_m = 0.7",
        "height_m = 0.7\nmotion = { path = { corners_m = [[1.0, 2.75]], speed_m_s = 1.0 } }",
        "landmarks[1].motion",
        "a motion",
    ),
    ("corners_m = [[2.0, 0.3]]", "corners_m = [[3.9, 0.3]]", "obstacles[1].motion.path.corners_m[0]", "runs into \"wedge\""),
    ("corners_m = [[2.0, 0.3]]", "corners_m = [[2.0, 0.05]]", "obstacles[1].motion.path.corners_m[0]", "runs into a wall"),
    ("corners_m = [[2.0, 0.3]]", "corners_m = []", "obstacles[1].motion.path.corners_m", "no corner"),
    ("0.3]], speed_m_s = 0.4", "0.3]], speed_m_s = 0.0", "obstacles[1].motion.path.speed_m_s", "0"),
    ("[0.6, 1.8], [0.2, 1.8]]", "[0.6, 2.5], [0.2, 2.5]]", "obstacles[2].motion.walk.region_m", "too close to \"desk\""),
    (
        "[[0.2, 1.2], [0.6, 1.2]",
        "[[0.2, 1.6], [0.6, 1.6]",
        "obstacles[2].motion.walk.region_m",
        "without the body's own position",
    ),
    // Robot, camera, task.
    ("caster_m = 0.125", "caster_m = -0.125", "robot.centre_of_gravity_m", "0.03"),
    ("caster_m = 0.125", "track_m = 0.4", "robot.track_m", "0.4"),
    ("caster_m = 0.125", "encoder_counts_per_turn = 0.0", "robot.encoder_counts_per_turn", "0"),
    ("caster_m = 0.125", "max_speed_m_s = 1.0", "robot.max_speed_m_s", "1"),
    ("width_px = 720", "width_px = 8", "camera.width_px", "8"),
    ("width_px = 720", "width_px = 720\noffset_m = [0.3, 0.0]", "camera.offset_m", "[0.3, 0]"),
    ("width_px = 720", "width_px = 720\npreset = \"lens\"", "camera.preset", "\"lens\""),
    ("width_px = 720", "width_px = 720\noptics = { white_balance = [1, 1, 11] }", "camera.optics.white_balance[2]", "11"),
    ("width_px = 720", "width_px = 300\nprojection = \"equal-angle\"", "camera.height_px", "129.6 degrees"),
    ("width_px = 720", "height_m = 2.5", "camera.height_m", "2.5"),
    ("width_px = 720", "horizon = 1.2", "camera.horizon", "1.2"),
    ("speed_m_s = 0.3\n", "speed_m_s = 0.4\n", "task.speed_m_s", "0.4"),
    ("[task]", "[task]\ncontrol_period_s = 0.0", "task.control_period_s", "0"),
    // Home and starts.
    ("x_m = 2.0\n", "x_m = 3.9\n", "home", "in wall 1"),
    ("min_distance_m = 0.5", "min_distance_m = 1.5", "start.min_distance_m", "1.5"),
    ("[3.2, 2.2], [0.8, 2.2]]", "[3.2, 3.2], [0.8, 3.2]]", "start.region_m", "leaves the room"),
    ("x_m = 3.0, y_m = 2.0", "x_m = 3.3, y_m = 2.3", "start.named[1]", "in post"),
    ("name = \"B\"", "name = \"A\"", "start.named[1].name", "the name of start.named[0]"),
    ("name = \"B\"", "name = \"random\"", "start.named[1].name", "\"random\""),
];

#[test]
fn each_slip_gives_its_own_fault_and_no_other() {
    World::from_toml(SOUND, "sound.toml").expect("sound");
    for (sound, spoilt, place, found) in SPOILT {
        assert!(SOUND.contains(sound), "{sound}");
        let text = SOUND.replacen(sound, spoilt, 1);
        let faults = faults(World::from_toml(&text, "spoilt.toml"));
        let [fault] = faults.as_slice() else { panic!("{spoilt}: {faults:#?}") };
        assert_eq!(fault.place, *place, "{spoilt}: {fault}");
        assert!(fault.found.contains(found), "{spoilt}: {fault}");
        assert!(!fault.allowed.is_empty() && fault.line.is_some(), "{spoilt}: {fault}");
    }
}

#[test]
fn all_faults_come_at_once_with_line_and_owner() {
    // One slip of each kind, in different parts of the file; an unknown field does not hide the others.
    let text = SOUND
        .replacen("name = \"sound\"", "name = \"sound\"\ncolour = 1", 1)
        .replacen("friction = 0.7", "friction = -1.0", 1)
        .replacen("radius_m = 0.2", "radius_m = nan", 1)
        .replacen("height_m = 0.7", "height_m = 7.0", 1)
        .replacen("x_m = 2.0", "x_m = 20.0", 1);
    let faults = faults(World::from_toml(&text, "many.toml"));
    let places: Vec<_> = faults.iter().map(|f| f.place.as_str()).collect();
    assert_eq!(places, ["colour", "floor.friction", "landmarks[0].shape.disc.radius_m", "landmarks[1].height_m", "home"]);
    for fault in &faults {
        let line = text.lines().nth(fault.line.expect("line") - 1).expect("line exists");
        let field = fault.place.rsplit('.').next().expect("field");
        assert!(line.contains(field), "{fault}: {line}");
    }
    assert_eq!(faults[3].owner.as_deref(), Some("desk"));
    let message = World::from_toml(&text, "many.toml").expect_err("faulty").to_string();
    assert!(message.starts_with("many.toml: 5 faults\n  line 3: colour: found an unknown field"), "{message}");
}

#[test]
fn a_period_shorter_than_its_wall_is_warned_of() {
    let warned = |sound: &str, spoilt: &str| {
        let text = SOUND.replacen(sound, spoilt, 1);
        let world = World::from_toml(&text, "sound.toml").expect("sound");
        world.warnings.iter().map(|w| (w.place.clone(), w.line, w.message.clone())).collect::<Vec<_>>()
    };
    assert_eq!(warned("", ""), []);
    let line = |text: &str| SOUND.lines().position(|l| l.contains(text)).map(|k| k + 1);
    let [(place, at, message)] = &warned("contrast = 0.5", "contrast = 0.5, period_m = 1.5")[..] else {
        panic!("one for all walls")
    };
    assert_eq!((place.as_str(), *at), ("room.walls[0].period_m", line("walls =")));
    assert!(message.starts_with("wall 0, 4.00 m long, looks the same in 3 places"), "{message}");
    let [(place, ..)] = &warned("period_m = 2.0", "period_m = 0.6")[..] else { panic!("the desk's front") };
    assert_eq!(place, "landmarks[1].texture.period_m");
    let texture = "to_m = [2.2, 3.0]\ntexture = { family = \"tiles\", period_m = 0.3 }";
    let [(place, ..)] = &warned("to_m = [2.2, 3.0]", texture)[..] else { panic!("the stub") };
    assert_eq!(place, "walls[0].texture.period_m");
    let [(place, _, message)] = &warned("[room]", "[room]\nfloor = { family = \"tiles\", period_m = 3.0 }")[..] else {
        panic!("the floor")
    };
    assert!(place == "room.floor.period_m" && message.starts_with("the floor, 4.00 m long"), "{place}: {message}");
    assert_eq!(
        warned("family = \"brick\", contrast = 0.5", "family = \"bands\", period_m = 1.0"),
        [],
        "the same everywhere anyway"
    );
}

/// A floor or ceiling without a period looks the same in no two places, however long the room; those of built-in worlds give theirs.
#[test]
fn floors_do_not_repeat_unless_they_are_told_to() {
    let long = "name = \"long\"\nhome = { x_m = 1, y_m = 1 }\n[room]\noutline_m = [[0, 0], [14, 0], [14, 3], [0, 3]]\n\
                ceiling = { family = \"tiles\" }\n";
    let world = World::from_toml(long, "long.toml").expect("sound");
    assert_eq!([world.floor_texture.period_m[0], world.ceiling_texture.period_m[0]], [14.0, 14.0]);
    assert_eq!(world.warnings, []);
    for name in World::builtin_names() {
        let world = World::open(name).expect(name);
        for (texture, spec) in
            [(&world.floor_texture, &world.spec.room.floor), (&world.ceiling_texture, &world.spec.room.ceiling)]
        {
            assert!(!texture.fitted && texture.period_m[0] == spec.period_m.unwrap_or(4.0), "{name}: its pictures stay");
        }
    }
}

#[test]
fn a_world_that_is_none_is_told_with_what_there_is() {
    let told = |argument: &str| World::open(argument).expect_err(argument).to_string();
    for (argument, words) in [
        ("bathroom:3", &["found bathroom", "lab, office, flat"][..]),
        ("ofice:3", &["did you mean office?"]),
        ("office:x", &["found x", "office:17"]),
        ("slipery", &["did you mean slippery?", "kinds: lab, office", "crowd"]),
    ] {
        for word in words {
            assert!(told(argument).contains(word), "{argument}: {}", told(argument));
        }
    }
}

#[test]
fn a_syntax_error_names_line_and_column() {
    let message = World::from_toml("name = \"a\"\n[room\n", "broken.toml").expect_err("broken").to_string();
    assert!(message.contains("broken.toml") && message.contains("line 2, column 6"), "{message}");
    let message = World::from_json("{\n\"name\": }", "broken.json").expect_err("broken").to_string();
    assert!(message.contains("broken.json") && message.contains("line 2 column 9"), "{message}");
}

#[test]
fn spoilt_specs_are_refused_too() {
    let mut spec = World::from_toml(SOUND, "sound.toml").expect("sound").spec;
    World::from_spec(&spec, "made").expect("sound");
    spec.home.x_m = f64::INFINITY;
    spec.robot.mass_kg = -1.0;
    let places: Vec<_> = faults(World::from_spec(&spec, "made")).into_iter().map(|f| f.place).collect();
    assert_eq!(places.len(), 2, "{places:?}");
    assert!(places.contains(&"home.x_m".to_owned()) && places.contains(&"robot.mass_kg".to_owned()));
}

#[test]
fn built_in_worlds_survive_a_round_trip_through_json() {
    for name in World::builtin_names() {
        let world = World::open(name).expect(name);
        assert_eq!(world.spec.name, name);
        assert_eq!(world.source.to_str(), Some(format!("builtin:{name}").as_str()));
        let json = serde_json::to_string_pretty(&world.spec).expect("JSON");
        let mut back = World::from_json(&json, "worlds/copy.json").expect(name);
        assert_ne!(back.sha256, world.sha256, "another file");
        (back.source, back.sha256) = (world.source.clone(), world.sha256.clone());
        // JSON tells no lines.
        back.warnings.iter_mut().zip(&world.warnings).for_each(|(back, there)| back.line = there.line);
        assert_eq!(back, world);
        assert_eq!(serde_json::from_str::<WorldSpec>(&json).expect("spec"), world.spec, "our reader agrees with serde's own");
        // The embedded copy is the shipped file.
        let path = format!("worlds/{name}.toml");
        assert_eq!(World::open(&path).expect("file").sha256, world.sha256);
    }
}

#[test]
fn worlds_are_found_by_path_then_by_name() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("lab");
    std::fs::write(&path, SOUND).expect("write");
    assert_eq!(World::open(path.to_str().expect("UTF-8")).expect("file").spec.name, "sound");
    let elsewhere = folder.path().join("worlds/lab.toml");
    let message = World::open(elsewhere.to_str().expect("UTF-8")).expect_err("no such file").to_string();
    for name in World::builtin_names() {
        assert!(message.contains(name), "{message}");
    }
}

/// Every field that the shipped worlds write, and every choice they make, is one that the schema names.
#[test]
fn the_schema_knows_the_shipped_fields() {
    fn check(value: &toml::Value, schema: &serde_json::Value, root: &serde_json::Value) {
        let name = schema["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/"));
        let schema = name.map_or(schema, |name| &root["$defs"][name]);
        let alternatives = schema["oneOf"].as_array().or(schema["anyOf"].as_array());
        if let (Some(alternatives), Some(table)) = (alternatives, value.as_table()) {
            let fits = |s: &&serde_json::Value| {
                let inner = s["$ref"].as_str().map_or(*s, |r| &root["$defs"][r.rsplit('/').next().expect("name")]);
                inner["oneOf"].is_array() || table.keys().all(|key| inner["properties"].get(key).is_some())
            };
            return check(value, alternatives.iter().find(fits).expect("a fitting form"), root);
        }
        match value {
            toml::Value::Table(table) => {
                for (key, value) in table {
                    check(value, schema["properties"].get(key).unwrap_or_else(|| panic!("no {key} in {schema}")), root);
                }
            }
            toml::Value::Array(items) => items.iter().for_each(|item| check(item, &schema["items"], root)),
            toml::Value::String(text) if schema["oneOf"].is_array() => {
                assert!(schema["oneOf"].as_array().into_iter().flatten().any(|s| s["const"] == text.as_str()), "{text}");
            }
            _ => {}
        }
    }
    let schema = World::json_schema();
    for name in World::builtin_names() {
        let text = std::fs::read_to_string(format!("worlds/{name}.toml")).expect(name);
        check(&toml::from_str(&text).expect(name), &schema, &schema);
    }
}

#[test]
fn random_starts_keep_their_promises() {
    for name in World::builtin_names() {
        let world = World::open(name).expect(name);
        let start = &world.spec.start;
        let away = Pose::new(-1e3, 0.0, 0.0);
        let standing: Vec<Pose> = world.bodies.iter().map(|b| if b.motion.is_some() { away } else { b.pose }).collect();
        let mut quadrants = [false; 4];
        for seed in 0..200 {
            let pose = world.random_start(&mut Seed(seed).stream("start")).expect(name);
            let offset = world.home.inverse_transform(pose.position());
            assert!(offset.norm() >= start.min_distance_m && offset.norm() <= start.max_distance_m);
            world.is_free(&pose, start.clearance_m, &world.body_poses()).expect("clearance");
            // The straight way home, walked in small steps, for an independent look at the corridor.
            for k in 0..=100 {
                let at = pose.position() + (world.home.position() - pose.position()) * (f64::from(k) / 100.0);
                world.is_free(&Pose::new(at.x, at.y, 0.0), -1e-9, &standing).expect("corridor");
            }
            quadrants[usize::from(offset.x > 0.0) + 2 * usize::from(offset.y > 0.0)] = true;
            assert_eq!(pose, world.random_start(&mut Seed(seed).stream("start")).expect(name), "same seed, same start");
        }
        assert_eq!(quadrants, [true; 4], "{name}: starts lie all round home");
    }
}

#[test]
fn a_world_without_room_to_start_says_what_is_in_the_way() {
    let text = SOUND.replacen("min_distance_m = 0.5\nmax_distance_m = 1.5", "clearance_m = 1.4", 1);
    let world = World::from_toml(&text, "tight.toml").expect("sound");
    let message = world.random_start(&mut Seed(1).stream("start")).expect_err("tight").to_string();
    assert!(message.contains("wall") && message.contains("1.4 m of clearance"), "{message}");
    let message = world.named_start("C").expect_err("no C").to_string();
    assert!(message.contains("one of A, B"), "{message}");
    assert_eq!(world.named_start("B").expect("B"), Pose::new(3.0, 2.0, 0.0));
}

#[test]
fn what_hangs_above_the_robot_is_not_in_its_way() {
    let hung = |elevation: f64| {
        let text = SOUND.replacen("height_m = 1.0", &format!("height_m = 1.0\nelevation_m = {elevation:?}"), 1);
        let world = World::from_toml(&text, "hung.toml").expect("sound");
        world.is_free(&Pose::new(3.5, 2.5, 0.0), 0.0, &world.body_poses())
    };
    assert_eq!(hung(0.0), Err("post".to_owned()));
    assert_eq!(hung(0.3), Err("post".to_owned()));
    assert_eq!(hung(0.9), Ok(()));
}

#[test]
fn the_last_zone_gives_the_friction() {
    let zone = "zones = [{ name = \"wet\", friction = 0.3, polygon_m = [[0.5, 0.5], [1.5, 0.5], [1.5, 1.5]] }";
    let more = format!("{zone}, {{ friction = 0.1, polygon_m = [[1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0]] }}");
    let world = World::from_toml(&SOUND.replacen(zone, &more, 1), "zones.toml").expect("sound");
    let friction = |x, y| world.friction_at(Vector2::new(x, y));
    assert_eq!([friction(3.0, 1.0), friction(0.8, 0.6), friction(1.2, 0.6), friction(1.8, 0.6)], [0.7, 0.3, 0.1, 0.1]);
}

#[test]
fn walls_keep_their_textures_in_a_clockwise_room() {
    let textures = "walls = [{ family = \"brick\" }, { family = \"tiles\" }, { family = \"posters\" }, { family = \"bands\" }]";
    let text = SOUND.replacen("walls = [{ family = \"brick\", contrast = 0.5 }]", textures, 1);
    let there = World::from_toml(&text, "there.toml").expect("sound");
    // The same rectangle the other way round: south stays first in the list of corners, so the walls run backwards.
    let corners = "[[4.0, 0.0], [0.0, 0.0], [0.0, 3.0], [4.0, 3.0]]";
    let text = text.replacen("[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]", corners, 1);
    let back = World::from_toml(&text, "back.toml").expect("sound");
    // As written, wall 1 is the east wall there and the west wall here.
    let family_at = |world: &World, x: f64, y: f64| {
        let k = (0..4).find(|&k| (0.5 * (world.wall(k).0 + world.wall(k).1) - Vector2::new(x, y)).norm() < 1e-9).expect("wall");
        format!("{:?}", world.wall_textures[k].pattern)
    };
    assert_eq!([family_at(&there, 2.0, 0.0), family_at(&there, 4.0, 1.5)], ["Family(Brick)", "Family(Tiles)"]);
    assert_eq!([family_at(&back, 2.0, 0.0), family_at(&back, 0.0, 1.5)], ["Family(Brick)", "Family(Tiles)"]);
}

#[test]
fn maps_show_what_the_world_has() {
    for name in World::builtin_names() {
        let world = World::open(name).expect(name);
        let map = world_svg(&world);
        assert_eq!(map, world_svg(&world), "the same bytes");
        for body in &world.bodies {
            assert!(map.contains(&body.name), "{name}: {}", body.name);
        }
        let mut open: Vec<String> = Vec::new();
        for event in svg::read(&map).expect("SVG") {
            use svg::node::element::tag::Type;
            match event {
                svg::parser::Event::Tag(tag, Type::Start, _) => open.push(tag.to_owned()),
                svg::parser::Event::Tag(tag, Type::End, _) => assert_eq!(open.pop().as_deref(), Some(tag)),
                svg::parser::Event::Error(error) => panic!("{name}: {error}"),
                _ => {}
            }
        }
        assert!(open.is_empty(), "{name}: {open:?} not closed");
    }
}

#[test]
fn a_run_is_drawn_to_scale() {
    let world = World::from_toml(SOUND, "sound.toml").expect("sound");
    let corners = [Vector2::new(1.0, 1.0), Vector2::new(3.0, 1.0), Vector2::new(f64::NAN, 0.0), Vector2::new(3.0, 2.0)];
    let style = Stroke { colour: "#123456", width_px: 1.0, dashes: "" };
    let map = MapDrawing::new(&world)
        .path(corners, &style, "a < b")
        .ellipse(&Pose::new(2.0, 1.5, 0.0), [[0.04, 0.0], [0.0, 0.01]], 2.0)
        .ellipse(&Pose::new(2.0, 1.5, 0.0), [[f64::NAN, 0.0], [0.0, 0.01]], 2.0)
        .to_svg();
    let number = |element: &str, key: &str| -> f64 {
        let value = element.split(&format!(" {key}=\"")).nth(1).expect("attribute").split('"').next().expect("value");
        value.parse().expect("number")
    };
    let lines: Vec<&str> = map.split("<polyline").skip(1).filter(|e| e.contains("#123456")).collect();
    assert_eq!(lines.len(), 2, "one piece before the gap, one in the legend; a single point draws nothing");
    let points = lines[0].split(" points=\"").nth(1).expect("points").split('"').next().expect("value");
    let xy: Vec<f64> = points.split([' ', ',']).map(|n| n.parse().expect("number")).collect();
    let px_per_m = (xy[2] - xy[0]) / 2.0;
    assert_eq!(xy[1], xy[3]);
    let ellipses: Vec<&str> = map.split("<ellipse").skip(1).collect();
    assert_eq!(ellipses.len(), 2, "one on the map, one in the legend");
    assert!(
        (number(ellipses[0], "rx") - 0.4 * px_per_m).abs() < 0.02 && (number(ellipses[0], "ry") - 0.2 * px_per_m).abs() < 0.02
    );
    // y points up: home, half a metre higher than the path, stands higher on the page.
    assert!((xy[1] - number(ellipses[0], "cy") - 0.5 * px_per_m).abs() < 0.02);
    assert!(map.contains("a &lt; b"));
}
