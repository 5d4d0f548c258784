//! Reading a world file and resolving it into a [`World`].

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use serde::Deserialize;
use sha2::{Digest, Sha256};

use super::generate::{Kind, Knobs, did_you_mean, generate};
use super::grid::Grid;
use super::picture::{Gallery, Pictures};
use super::polygon::{anticlockwise, bounds, signed_area};
use super::repeats;
use super::robot::{RobotPreset, RobotSpec};
use super::spec::{BodySpec, CameraPreset, RoomSpec, ShapeSpec, WallSpec, WindowSpec, WorldSpec};
use super::structure::{self, Findings};
use super::texture::Texture;
use super::validate;
use super::wall::{Partition, pieces};
use super::{Body, Boundary, Footprint, Window, World, Zone};
use crate::document::Node;
use crate::error::{Error, Result};
use crate::fault::Fault;
use crate::geometry::{Pose, Vector2};
use crate::panorama::INSTANCE_FIRST_WALL;

/// Marks the source of a world that the program carries with it.
const BUILTIN_SOURCE: &str = "builtin:";
/// Marks the source of a world that was generated when it was opened.
const GENERATED_SOURCE: &str = "generated:";
/// The worlds that the program carries with it, as (name, TOML text).
const BUILTIN: [(&str, &str); 10] = [
    ("lab", include_str!("../../worlds/lab.toml")),
    ("slippery", include_str!("../../worlds/slippery.toml")),
    ("crowd", include_str!("../../worlds/crowd.toml")),
    ("paper-ideal", include_str!("../../worlds/paper-ideal.toml")),
    ("paper-grid", include_str!("../../worlds/paper-grid.toml")),
    ("proving-ground", include_str!("../../worlds/proving-ground.toml")),
    ("vardy-hall", include_str!("../../worlds/vardy-hall.toml")),
    ("gallery", include_str!("../../worlds/gallery.toml")),
    ("office-floor", include_str!("../../worlds/office-floor.toml")),
    ("loop-hall", include_str!("../../worlds/loop-hall.toml")),
];
/// The images of those worlds, by their path.
const BUILTIN_IMAGES: [(&str, &[u8]); 2] = [
    ("gallery/lab.png", include_bytes!("../../worlds/gallery/lab.png")),
    ("gallery/poster.png", include_bytes!("../../worlds/gallery/poster.png")),
];

/// The schema of world files, which takes as long to make as a small file takes to be checked.
static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(|| schemars::schema_for!(WorldSpec).to_value());

/// Thickness of a window's pane, m.
const PANE_M: f64 = 0.01;

impl World {
    /// Opens a world by what a person typed: the path of a file if there is one, else a generated world as `KIND:SEED`
    /// (`office:17`), or the name of a built-in world, as `NAME` or `worlds/NAME.toml`.
    ///
    /// # Errors
    /// When there is neither, and as [`World::load`].
    pub fn open(argument: &str) -> Result<Self> {
        let (text, source) = read(argument)?;
        Self::parse(&text, &source)
    }

    /// Names of the built-in worlds.
    #[must_use]
    pub fn builtin_names() -> Vec<&'static str> {
        BUILTIN.iter().map(|(name, _)| *name).collect()
    }

    /// Loads and checks a world file: TOML, or JSON where the name ends in `.json`.
    ///
    /// # Errors
    /// When the file cannot be read, is not of its format, or has faults; all faults come at once.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(&read_file(path)?, path)
    }

    /// Checks a text of the format that the source's name tells.
    fn parse(text: &str, source: &Path) -> Result<Self> {
        if source.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            Self::from_json(text, source)
        } else {
            Self::from_toml(text, source)
        }
    }

    /// JSON Schema of the world file (draft 2020-12).
    #[must_use]
    pub fn json_schema() -> serde_json::Value {
        SCHEMA.clone()
    }

    /// Checks a world given as TOML text. `source` names it in messages; images are looked for in its folder.
    ///
    /// # Errors
    /// As [`World::load`].
    pub fn from_toml(text: &str, source: impl AsRef<Path>) -> Result<Self> {
        Self::from_tree(Node::from_toml(text, source.as_ref())?, source.as_ref(), text)
    }

    /// Checks a world given as JSON text. `source` names it in messages; images are looked for in its folder.
    ///
    /// # Errors
    /// As [`World::load`].
    pub fn from_json(text: &str, source: impl AsRef<Path>) -> Result<Self> {
        Self::from_tree(Node::from_json(text, source.as_ref())?, source.as_ref(), text)
    }

    /// Checks a world that a program made or changed. `source` names it in messages, and images are looked for in its folder; the
    /// SHA-256 is that of its JSON form.
    ///
    /// # Errors
    /// When it has faults; all of them come at once.
    pub fn from_spec(spec: &WorldSpec, source: impl AsRef<Path>) -> Result<Self> {
        let parse_error = |message: String| Error::Parse { path: source.as_ref().to_owned(), message };
        let tree = Node::from_spec(spec).map_err(|e| parse_error(e.to_string()))?;
        let json = serde_json::to_string(spec).map_err(|e| parse_error(e.to_string()))?;
        Self::from_tree(tree, source.as_ref(), &json)
    }

    pub(super) fn from_tree(mut tree: Node, path: &Path, text: &str) -> Result<Self> {
        let as_read = tree.clone(); // the check below removes unknown fields, whose lines are still wanted
        let Findings { unknown, not_finite, unreadable } = structure::check(&mut tree, &SCHEMA);
        let mut faults = unknown;
        if unreadable.is_empty() {
            if let Some(preset) = tree.get("robot").and_then(|robot| robot.get("preset")).cloned() {
                let parse_error = |message: String| Error::Parse { path: path.to_owned(), message };
                let preset = RobotPreset::deserialize(preset).map_err(|e| parse_error(e.to_string()))?;
                let robot = Node::from_spec(&RobotSpec::of(preset)).map_err(|e| parse_error(e.to_string()))?;
                tree.fill(&["robot"], robot);
            }
            if let Some(preset) = tree.get("camera").and_then(|camera| camera.get("preset")).cloned() {
                let parse_error = |message: String| Error::Parse { path: path.to_owned(), message };
                let preset = CameraPreset::deserialize(preset).map_err(|e| parse_error(e.to_string()))?;
                let optics = Node::from_spec(&preset.optics()).map_err(|e| parse_error(e.to_string()))?;
                tree.fill(&["camera", "optics"], optics);
            }
            let spec =
                WorldSpec::deserialize(tree).map_err(|e| Error::Parse { path: path.to_owned(), message: e.to_string() })?;
            faults.extend(validate::check(&spec, &not_finite));
            let (pictures, missing) = load_pictures(&spec, path);
            faults.extend(missing);
            if faults.is_empty() && not_finite.is_empty() {
                let mut world = Self::resolve(spec, path, sha256(text, &pictures), &pictures);
                world.warnings = repeats::warnings(&world);
                for warning in &mut world.warnings {
                    (warning.line, warning.owner) = as_read.locate(&warning.place);
                }
                return Ok(world);
            }
        }
        faults.extend(not_finite);
        faults.extend(unreadable);
        for fault in &mut faults {
            (fault.line, fault.owner) = as_read.locate(&fault.place);
        }
        faults.sort_by_key(|f| f.line); // in reading order where lines are known, else as found
        Err(Error::World { path: path.to_owned(), faults })
    }

    /// The checked form of a spec that has no faults. Never panics where the room has none.
    pub(super) fn resolve(spec: WorldSpec, source: &Path, sha256: String, pictures: &Pictures) -> Self {
        let outline = anticlockwise(&spec.room.outline_m);
        let clockwise = outline.get(1).is_some_and(|c| [c.x, c.y] != spec.room.outline_m[1]);
        let seed = |n: u64| spec.seed.wrapping_mul(1000).wrapping_add(n);
        let walls = &spec.room.walls;
        let wall_textures: Vec<_> = (0..outline.len())
            .map(|k| {
                // A clockwise outline is turned round; its walls keep the textures that they have in the file.
                let as_written = if clockwise { outline.len() - 1 - k } else { k };
                let length_m = (outline[(k + 1) % outline.len()] - outline[k]).norm();
                Texture::new(&walls[as_written % walls.len()], length_m, seed(10 + as_written as u64), pictures)
            })
            .collect();
        let first_body = INSTANCE_FIRST_WALL + outline.len() as u16;
        let bodies: Vec<_> = spec
            .landmarks
            .iter()
            .chain(&spec.obstacles)
            .enumerate()
            .map(|(k, b)| (k, b, footprint(b)))
            .map(|(k, b, footprint)| Body {
                name: b.name.clone(),
                pose: Pose::new(b.position_m[0], b.position_m[1], b.heading_deg.to_radians()),
                bottom_m: b.elevation_m,
                top_m: b.elevation_m + b.height_m,
                texture: Texture::new(&b.texture, footprint.girth_m(), seed(100 + k as u64), pictures),
                footprint,
                glow: b.glow,
                motion: b.motion.clone(),
                instance: first_body + k as u16,
            })
            .collect();
        let first_window = first_body + bodies.len() as u16;
        let windows: Vec<_> = spec
            .light
            .windows
            .iter()
            .enumerate()
            .map(|(k, w)| Window {
                name: if w.name.is_empty() { format!("window in wall {}", w.wall) } else { w.name.clone() },
                footprint: pane(w, &spec.room.outline_m),
                bottom_m: w.height_m[0],
                top_m: w.height_m[1],
                // Far from the bodies' seeds, so that a further body changes no window.
                texture: Texture::new(&w.texture, w.along_m[1] - w.along_m[0], seed(u64::MAX / 2 + k as u64), pictures),
                brightness: w.brightness,
                instance: first_window + k as u16,
            })
            .collect();
        let first_partition = first_window + windows.len() as u16;
        let partitions = spec.walls.iter().enumerate();
        let partitions = partitions.map(|(k, w)| {
            // Far from all others' seeds, for the same reason.
            let seed = seed(u64::MAX / 4 + k as u64);
            let texture = w.texture.as_ref().unwrap_or(&walls[0]);
            let texture = |length_m: f64| Texture::new(texture, length_m, seed, pictures);
            partition(w, k, &spec.room, texture, first_partition.wrapping_add(k as u16))
        });
        let partitions = partitions.collect();
        let zones =
            spec.floor.zones.iter().map(|z| Zone { polygon: anticlockwise(&z.polygon_m), friction: z.friction }).collect();
        let (low, high) = bounds(&outline);
        let longest_m = (high.x - low.x).max(high.y - low.y);
        let home = Pose::new(spec.home.x_m, spec.home.y_m, spec.home.heading_deg.to_radians());
        let mut world = Self {
            wall_textures,
            floor_texture: Texture::new(&spec.room.floor, longest_m, seed(1), pictures),
            ceiling_texture: Texture::new(&spec.room.ceiling, longest_m, seed(2), pictures),
            landmark_count: spec.landmarks.len(),
            outline,
            bodies,
            windows,
            partitions,
            zones,
            home,
            source: source.to_owned(),
            sha256,
            warnings: Vec::new(),
            boundary: Boundary::default(),
            partition_grid: Grid::default(),
            spec,
        };
        world.index();
        world
    }
}

fn read_file(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|source| Error::Io { action: "read", path: path.to_owned(), source })
}

/// Text and source of the world that a person named: the path of a file if there is one, else a generated world as `KIND:SEED`, or
/// the name of a built-in world, as `NAME` or `worlds/NAME.toml`.
pub(super) fn read(argument: &str) -> Result<(String, PathBuf)> {
    let path = Path::new(argument);
    if path.is_file() {
        return Ok((read_file(path)?, path.to_owned()));
    }
    if let Some((kind, seed)) = argument.split_once(':').filter(|_| !argument.contains(['/', '\\'])) {
        let kind: Kind = kind.parse()?;
        let seed = seed.trim().parse().map_err(|_| Error::Invalid {
            what: format!("seed of a world of kind {kind}"),
            found: if seed.is_empty() { "none".to_owned() } else { seed.to_owned() },
            allowed: format!("one of 0 to {}, as in {kind}:17", u64::MAX),
        })?;
        let world = generate(kind, seed, &Knobs::default())?;
        return Ok((world.toml, PathBuf::from(format!("{GENERATED_SOURCE}{kind}:{seed}"))));
    }
    let bare = argument.strip_prefix("worlds/").unwrap_or(argument);
    let bare = bare.strip_suffix(".toml").unwrap_or(bare);
    match BUILTIN.iter().find(|(name, _)| *name == bare) {
        Some((name, text)) => Ok(((*text).to_owned(), PathBuf::from(format!("{BUILTIN_SOURCE}{name}")))),
        None => Err(Error::Invalid {
            what: "world".to_owned(),
            found: format!("{argument}{}, which is no file", did_you_mean(bare, World::builtin_names().into_iter())),
            allowed: format!(
                "a world file (TOML or JSON), a generated world as KIND:SEED (office:17; kinds: {}), or a built-in world: {}",
                Kind::ALL.iter().map(|k| k.name()).collect::<Vec<_>>().join(", "),
                World::builtin_names().join(", ")
            ),
        }),
    }
}

fn footprint(body: &BodySpec) -> Footprint {
    match &body.shape {
        ShapeSpec::Disc { radius_m } => Footprint::Disc(*radius_m),
        ShapeSpec::Box { size_m: [x, y] } => {
            let (x, y) = (0.5 * x, 0.5 * y);
            Footprint::Polygon(vec![Vector2::new(-x, -y), Vector2::new(x, -y), Vector2::new(x, y), Vector2::new(-x, y)])
        }
        ShapeSpec::Polygon { corners_m } => Footprint::Polygon(anticlockwise(corners_m)),
    }
}

/// The checked form of wall `k` inside a room. `texture` makes one that covers so much along u, m.
fn partition(wall: &WallSpec, k: usize, room: &RoomSpec, texture: impl Fn(f64) -> Texture, instance: u16) -> Partition {
    let [from, to] = [wall.from_m, wall.to_m].map(|[x, y]| Vector2::new(x, y));
    let (length_m, thickness_m) = (wall.length_m(), wall.thickness_m);
    let height_m = wall.height_m.unwrap_or(room.height_m);
    let spec = wall.texture.as_ref().unwrap_or(&room.walls[0]);
    let asks_for_less = spec.period_m.is_some() || spec.image.is_some();
    // The sides of a wall as high as the room share the width of its texture, since no end of a piece above or below an opening is
    // seen with either of them. Around a lower wall the texture goes on.
    let (texture, left_start_m, rises) = if height_m < room.height_m {
        (texture(2.0 * (length_m + thickness_m)), length_m + thickness_m, false)
    } else {
        (texture(length_m + 2.0 * thickness_m), 0.0, true)
    };
    Partition {
        name: if wall.name.is_empty() { format!("inner wall {k}") } else { wall.name.clone() },
        from,
        along: (to - from) / length_m.max(1e-9),
        length_m,
        thickness_m,
        pieces: pieces(wall, height_m),
        left_start_m: if asks_for_less { 0.0 } else { left_start_m },
        left_rise_m: if rises && !asks_for_less { 0.5 * texture.period_m[1] } else { 0.0 },
        texture,
        instance,
    }
}

/// Footprint of a window's pane, which lies on its wall. Empty where there is no such wall.
fn pane(window: &WindowSpec, outline: &[[f64; 2]]) -> Vec<Vector2<f64>> {
    let Some(&[x, y]) = outline.get(window.wall) else { return Vec::new() };
    let first = Vector2::new(x, y);
    let [x, y] = outline[(window.wall + 1) % outline.len()];
    let along = Vector2::new(x, y) - first;
    let along = along / along.norm().max(1e-9);
    let corners: Vec<_> = outline.iter().map(|&[x, y]| Vector2::new(x, y)).collect();
    let inward = Vector2::new(-along.y, along.x) * signed_area(&corners).signum();
    let [a, b] = window.along_m.map(|s| first + along * s);
    // Seen from the room, the pane's own left comes first.
    let (left, right) = if signed_area(&corners) > 0.0 { (b, a) } else { (a, b) };
    vec![left + inward * PANE_M, right + inward * PANE_M, right, left]
}

/// Reads all images of a world; those that cannot be had are faults.
fn load_pictures(spec: &WorldSpec, source: &Path) -> (Pictures, Vec<Fault>) {
    let builtin = source.to_str().is_some_and(|s| s.starts_with(BUILTIN_SOURCE));
    let gallery = if builtin {
        Gallery::Builtin(&BUILTIN_IMAGES)
    } else {
        Gallery::Folder(source.parent().map(Path::to_owned).unwrap_or_default())
    };
    let mut pictures = Pictures::default();
    let mut faults = Vec::new();
    for (place, texture) in spec.textures() {
        if let Some(Err((found, allowed))) = texture.image.as_ref().map(|path| pictures.load(path, &gallery)) {
            faults.push(Fault { place: format!("{place}.image"), found, allowed, owner: None, line: None });
        }
    }
    (pictures, faults)
}

/// SHA-256 of a text's bytes and those of the images, lower-case hexadecimal.
fn sha256(text: &str, pictures: &Pictures) -> String {
    let mut hash = Sha256::new();
    hash.update(text.as_bytes());
    for file in &pictures.files {
        hash.update(file);
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}
