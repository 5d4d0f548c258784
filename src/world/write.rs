//! Writing a world as TOML that a person reads: sections in the order of `worlds/lab.toml`, one body after the other, and nothing
//! that is at its default.

use std::fmt::Write;

use serde::Serialize;

use super::robot::{RobotPreset, RobotSpec};
use super::spec::{
    BodySpec, CameraSpec, FloorSpec, LightSpec, MotionSpec, OpeningSpec, PoseSpec, RoomSpec, ShapeSpec, StartSpec, TextureSpec,
    WallSpec, WindowSpec, WorldSpec, ZoneSpec,
};

impl WorldSpec {
    /// The world as TOML. Loading it gives this spec again.
    ///
    /// ```
    /// use wayhome::world::World;
    ///
    /// let lab = World::open("lab")?;
    /// assert_eq!(World::from_toml(&lab.spec.to_toml(), "again.toml")?.spec, lab.spec);
    /// # Ok::<(), wayhome::Error>(())
    /// ```
    #[must_use]
    pub fn to_toml(&self) -> String {
        // No field is forgotten: a new one does not compile until it is here.
        let Self {
            name,
            description,
            seed,
            room,
            walls,
            floor,
            light,
            landmarks,
            obstacles,
            robot,
            camera,
            home,
            start,
            task,
            disturbances,
        } = self;
        let mut out = Writer { text: String::with_capacity(1 << 14) };
        out.field("name", &text(name));
        out.unless("description", description.is_empty(), || text(description));
        out.unless("seed", *seed == 0, || seed.to_string());
        out.room(room);
        walls.iter().for_each(|w| out.wall(w));
        out.floor(floor);
        out.light(light);
        landmarks.iter().for_each(|b| out.body("landmarks", b));
        obstacles.iter().for_each(|b| out.body("obstacles", b));
        out.section("robot", robot, &RobotSpec { preset: RobotPreset::default(), ..RobotSpec::of(robot.preset) });
        let of_preset = CameraSpec { optics: camera.preset.optics(), ..CameraSpec::default() };
        out.section("camera", camera, &of_preset);
        out.section("task", task, &super::TaskSpec::default());
        out.head("home");
        out.pose(home);
        out.start(start);
        for disturbance in disturbances {
            out.head("[disturbances]");
            out.changed(disturbance, None);
        }
        out.text
    }
}

/// Text that grows.
struct Writer {
    text: String,
}

impl Writer {
    fn head(&mut self, name: &str) {
        let _ = write!(self.text, "\n[{name}]\n"); // writing to a string cannot fail, here and below
    }

    fn field(&mut self, name: &str, value: &str) {
        let _ = writeln!(self.text, "{name} = {value}");
    }

    fn unless(&mut self, name: &str, is_default: bool, value: impl FnOnce() -> String) {
        if !is_default {
            self.field(name, &value());
        }
    }

    fn room(&mut self, room: &RoomSpec) {
        let RoomSpec { outline_m, height_m, walls, floor, ceiling } = room;
        self.head("room");
        self.field("outline_m", &points(outline_m));
        self.field("height_m", &number(*height_m));
        let lines: String = walls.iter().map(|w| format!("  {},\n", texture(w))).collect();
        self.field("walls", &format!("[\n{lines}]"));
        self.field("floor", &texture(floor));
        self.field("ceiling", &texture(ceiling));
    }

    fn wall(&mut self, wall: &WallSpec) {
        let WallSpec { name, from_m, to_m, thickness_m, height_m, texture: looks, openings } = wall;
        self.head("[walls]");
        self.unless("name", name.is_empty(), || text(name));
        self.field("from_m", &list(from_m));
        self.field("to_m", &list(to_m));
        self.unless("thickness_m", *thickness_m == WallSpec::new(*from_m, *to_m).thickness_m, || number(*thickness_m));
        if let Some(height) = height_m {
            self.field("height_m", &number(*height));
        }
        if let Some(looks) = looks {
            self.field("texture", &texture(looks));
        }
        let line = |opening: &OpeningSpec| {
            let OpeningSpec { kind, from_start_m, width_m, sill_m, top_m } = opening;
            let mut fields: Vec<String> = kind.iter().map(|k| format!("kind = {}", generic(k))).collect();
            fields.push(format!("from_start_m = {}, width_m = {}", number(*from_start_m), number(*width_m)));
            fields.extend(sill_m.map(|s| format!("sill_m = {}", number(s))));
            fields.extend(top_m.map(|t| format!("top_m = {}", number(t))));
            format!("  {{ {} }},\n", fields.join(", "))
        };
        self.unless("openings", openings.is_empty(), || format!("[\n{}]", openings.iter().map(line).collect::<String>()));
    }

    fn floor(&mut self, floor: &FloorSpec) {
        let FloorSpec { friction, zones } = floor;
        self.head("floor");
        self.field("friction", &number(*friction));
        for zone in zones {
            let ZoneSpec { name, polygon_m, friction } = zone;
            self.head("[floor.zones]");
            self.unless("name", name.is_empty(), || text(name));
            self.field("polygon_m", &points(polygon_m));
            self.field("friction", &number(*friction));
        }
    }

    fn light(&mut self, light: &LightSpec) {
        let LightSpec { preset, ambient, corner_shade, corner_reach_m, lamps, windows } = light;
        let usual = LightSpec::default();
        self.head("light");
        self.unless("preset", *preset == usual.preset, || generic(preset));
        self.field("ambient", &number(*ambient));
        self.unless("corner_shade", *corner_shade == usual.corner_shade, || number(*corner_shade));
        self.unless("corner_reach_m", *corner_reach_m == usual.corner_reach_m, || number(*corner_reach_m));
        let lines = lamps
            .iter()
            .map(|lamp| format!("  {{ position_m = {}, intensity = {} }},\n", list(&lamp.position_m), number(lamp.intensity)));
        self.unless("lamps", lamps.is_empty(), || format!("[\n{}]", lines.collect::<String>()));
        for window in windows {
            let WindowSpec { name, wall, along_m, height_m, brightness, texture: seen } = window;
            self.head("[light.windows]");
            self.unless("name", name.is_empty(), || text(name));
            self.field("wall", &wall.to_string());
            self.field("along_m", &list(along_m));
            self.field("height_m", &list(height_m));
            self.field("brightness", &number(*brightness));
            self.field("texture", &texture(seen));
        }
    }

    fn body(&mut self, kind: &str, body: &BodySpec) {
        let BodySpec { name, shape, position_m, heading_deg, height_m, elevation_m, texture: looks, glow, motion } = body;
        self.head(&format!("[{kind}]"));
        self.field("name", &text(name));
        self.field(
            "shape",
            &match shape {
                ShapeSpec::Disc { radius_m } => format!("{{ disc = {{ radius_m = {} }} }}", number(*radius_m)),
                ShapeSpec::Box { size_m } => format!("{{ box = {{ size_m = {} }} }}", list(size_m)),
                ShapeSpec::Polygon { corners_m } => format!("{{ polygon = {{ corners_m = {} }} }}", points(corners_m)),
            },
        );
        self.field("position_m", &list(position_m));
        self.unless("heading_deg", *heading_deg == 0.0, || number(*heading_deg));
        self.field("height_m", &number(*height_m));
        self.unless("elevation_m", *elevation_m == 0.0, || number(*elevation_m));
        self.field("texture", &texture(looks));
        self.unless("glow", *glow == 0.0, || number(*glow));
        if let Some(motion) = motion {
            self.field(
                "motion",
                &match motion {
                    MotionSpec::Path { corners_m, speed_m_s, closed } => {
                        let closed = if *closed { ", closed = true" } else { "" };
                        format!(
                            "{{ path = {{ corners_m = {}, speed_m_s = {}{closed} }} }}",
                            points(corners_m),
                            number(*speed_m_s)
                        )
                    }
                    MotionSpec::Walk { .. } | MotionSpec::Pushed { .. } => generic(motion),
                },
            );
        }
    }

    fn pose(&mut self, pose: &PoseSpec) {
        let PoseSpec { x_m, y_m, heading_deg } = pose;
        self.field("x_m", &number(*x_m));
        self.field("y_m", &number(*y_m));
        self.unless("heading_deg", *heading_deg == 0.0, || number(*heading_deg));
    }

    fn start(&mut self, start: &StartSpec) {
        let StartSpec { region_m, min_distance_m, max_distance_m, clearance_m, named } = start;
        let usual = StartSpec::default();
        self.head("start");
        if let Some(region) = region_m {
            self.field("region_m", &points(region));
        }
        self.field("min_distance_m", &number(*min_distance_m));
        self.field("max_distance_m", &number(*max_distance_m));
        self.unless("clearance_m", *clearance_m == usual.clearance_m, || number(*clearance_m));
        let line = |n: &super::spec::NamedStartSpec| {
            let (x, y, heading) = (number(n.x_m), number(n.y_m), number(n.heading_deg));
            format!("  {{ name = {}, x_m = {x}, y_m = {y}, heading_deg = {heading} }},\n", text(&n.name))
        };
        self.unless("named", named.is_empty(), || format!("[\n{}]", named.iter().map(line).collect::<String>()));
    }

    /// A section of the fields that differ from `usual`; none where all are the same.
    fn section<T: Serialize + PartialEq>(&mut self, name: &str, value: &T, usual: &T) {
        if value != usual {
            self.head(name);
            self.changed(value, Some(usual));
        }
    }

    /// The fields of a value that differ from `usual`.
    fn changed<T: Serialize>(&mut self, value: &T, usual: Option<&T>) {
        let table = |value: &T| toml::Table::try_from(value).unwrap_or_default(); // specs are tables
        let usual = usual.map(table).unwrap_or_default();
        for (name, value) in table(value) {
            match (value, usual.get(&name)) {
                (value, Some(same)) if value == *same => {}
                // The preset's own fields come back with it: only what differs is written.
                (toml::Value::Table(inner), Some(toml::Value::Table(usual))) => {
                    let changed: toml::Table = inner.into_iter().filter(|(key, value)| usual.get(key) != Some(value)).collect();
                    self.field(&name, &inline(&toml::Value::Table(changed)));
                }
                (value, _) => self.field(&name, &inline(&value)),
            }
        }
    }
}

/// A string in quotes.
fn text(value: &str) -> String {
    toml::Value::String(value.to_owned()).to_string()
}

/// A number that TOML reads as a float again: the shortest one that does.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn list(values: &[f64]) -> String {
    let numbers: Vec<String> = values.iter().map(|v| number(*v)).collect();
    format!("[{}]", numbers.join(", "))
}

/// Points on as many lines as they need.
fn points(points: &[[f64; 2]]) -> String {
    const IN_A_LINE: usize = 6;
    let of = |points: &[[f64; 2]]| points.iter().map(|p| list(p)).collect::<Vec<_>>().join(", ");
    if points.len() <= IN_A_LINE {
        return format!("[{}]", of(points));
    }
    let lines: String = points.chunks(IN_A_LINE).map(|line| format!("  {},\n", of(line))).collect();
    format!("[\n{lines}]")
}

fn texture(texture: &TextureSpec) -> String {
    let TextureSpec { family, image, colour, period_m, contrast, seed } = texture;
    let mut fields = Vec::with_capacity(5);
    fields.extend(family.map(|f| format!("family = {}", generic(&f))));
    fields.extend(image.as_ref().map(|i| format!("image = {}", text(i))));
    let [red, green, blue] = colour;
    fields.push(format!("colour = [{red}, {green}, {blue}]"));
    fields.extend(period_m.map(|p| format!("period_m = {}", number(p))));
    fields.extend(contrast.map(|c| format!("contrast = {}", number(c))));
    fields.extend(seed.map(|s| format!("seed = {s}")));
    format!("{{ {} }}", fields.join(", "))
}

/// Anything that serialises, on one line.
fn generic(value: &impl Serialize) -> String {
    toml::Value::try_from(value).map(|v| inline(&v)).unwrap_or_default() // specs always serialise
}

fn inline(value: &toml::Value) -> String {
    match value {
        toml::Value::Float(x) => number(*x),
        toml::Value::Array(items) => format!("[{}]", items.iter().map(inline).collect::<Vec<_>>().join(", ")),
        toml::Value::Table(fields) if fields.is_empty() => "{}".to_owned(),
        toml::Value::Table(fields) => {
            format!("{{ {} }}", fields.iter().map(|(k, v)| format!("{k} = {}", inline(v))).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Draft, World};

    #[test]
    fn all_worlds_come_back_from_their_text() {
        for name in World::builtin_names() {
            let mut draft = Draft::open(name).unwrap();
            if name == "lab" {
                draft.set("camera.preset", &"cheap").unwrap();
                draft.set("camera.optics.gamma", &1.5).unwrap();
                draft.set("robot.preset", &"generic").unwrap();
                draft.set("robot.mass_kg", &6.5).unwrap();
                draft.set("task.speed_m_s", &0.25).unwrap();
                draft.set("light.preset", &"evening").unwrap();
            }
            let spec = draft.world().unwrap().spec;
            // Images are looked for beside the file.
            let source = format!("{}/worlds/again.toml", env!("CARGO_MANIFEST_DIR"));
            assert_eq!(World::from_toml(&spec.to_toml(), source).unwrap().spec, spec, "{name}");
        }
    }
}
