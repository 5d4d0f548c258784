//! Changes to a world before it is used.

use wayhome::error::{Error, Result};
use wayhome::geometry::Pose;
use wayhome::world::{Draft, World};

use super::values::pose;

/// What a person changes of a world without editing its file.
#[derive(Debug, clap::Args)]
pub struct ChangeArgs {
    /// Change a field of the world: its name as faults and studies give it, and a value as a world file has it, such as
    /// `floor.friction=0.2`, `camera.height_m=0.3` or `landmarks[desk].height_m=0.5`; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = change)]
    pub changes: Vec<Change>,
    /// Put home elsewhere: a pose in the room
    #[arg(long, value_name = "x,y,heading_deg", allow_hyphen_values = true, value_parser = pose)]
    pub home: Option<Pose>,
}

/// One field and its new value.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    place: String,
    value: toml::Value,
}

/// `KEY=VALUE`. A value that is none of a world file's is text.
fn change(text: &str) -> std::result::Result<Change, String> {
    let fault = || "a change is KEY=VALUE, such as floor.friction=0.2".to_owned();
    let (place, value) = text.split_once('=').filter(|(place, _)| !place.trim().is_empty()).ok_or_else(fault)?;
    // Studies name fields of the world so, beside settings of their own.
    let place = place.trim().strip_prefix("world.").unwrap_or(place.trim()).to_owned();
    let read = toml::from_str::<toml::Table>(&format!("value = {value}")).ok().and_then(|mut table| table.remove("value"));
    Ok(Change { place, value: read.unwrap_or_else(|| toml::Value::String(value.trim().to_owned())) })
}

impl ChangeArgs {
    /// The world that a person named, with the changes. Its hash tells of them.
    ///
    /// # Errors
    /// As [`World::open`], and when a change does not fit; the fault names its field.
    pub fn open(&self, world: &str) -> Result<World> {
        if self.changes.is_empty() && self.home.is_none() {
            return World::open(world);
        }
        let mut draft = Draft::open(world)?;
        for Change { place, value } in &self.changes {
            draft.set(place, value)?;
        }
        if let Some(home) = &self.home {
            let [x, y, heading] = [("x_m", home.x), ("y_m", home.y), ("heading_deg", home.heading.to_degrees())];
            for (field, value) in [x, y, heading] {
                draft.set(&format!("home.{field}"), &value)?;
            }
        }
        draft.world().map_err(|error| match error {
            // The fault is in what was asked for here, not in the file.
            Error::World { path, faults } => {
                Error::World { path: format!("{} with --set or --home", path.display()).into(), faults }
            }
            other => other,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_read_as_a_world_file_has_values() {
        let read = |text: &str| change(text).map(|c| (c.place, c.value));
        assert_eq!(read("floor.friction=0.2"), Ok(("floor.friction".to_owned(), toml::Value::Float(0.2))));
        assert_eq!(read("world.light.preset = night"), Ok(("light.preset".to_owned(), toml::Value::String("night".into()))));
        assert_eq!(read("home.x_m=1").map(|(_, value)| value), Ok(toml::Value::Integer(1)));
        assert!(read("floor.friction").is_err() && read("=3").is_err());
    }

    #[test]
    fn a_changed_world_has_its_home_and_its_hash() {
        let args = |changes: &[&str], home| ChangeArgs { changes: changes.iter().map(|c| change(c).unwrap()).collect(), home };
        let plain = args(&[], None).open("lab").unwrap();
        let moved = args(&["floor.friction=0.2"], Some(Pose::new(0.5, 0.25, 1.0))).open("lab").unwrap();
        assert!(moved.spec.floor.friction == 0.2 && moved.sha256 != plain.sha256);
        assert!(
            (moved.home.position() - Pose::new(0.5, 0.25, 0.0).position()).norm() == 0.0
                && (moved.home.heading - 1.0).abs() < 1e-12
        );
        let refused = args(&["floor.frction=0.2"], None).open("lab").unwrap_err().to_string();
        assert!(refused.contains("floor.frction") && refused.contains("--set"), "{refused}");
        assert!(args(&[], Some(Pose::new(50.0, 0.0, 0.0))).open("lab").unwrap_err().to_string().contains("home"));
    }
}
