//! A world file that is changed before it is checked.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::World;
use super::load::read;
use super::spec::MotionSpec;
use crate::document::{Node, Value};
use crate::error::{Error, Result};

/// A world as its file has it, whose fields can be set one by one.
///
/// Fields are named as faults name them: `floor.friction`, `obstacles[2].height_m`; an entry of a list goes by its name too, as
/// `obstacles[stool].height_m`. Presets still work: a camera of another preset has that preset's optics where the file has none of
/// its own.
///
/// ```
/// use wayhome::world::Draft;
///
/// let mut draft = Draft::open("lab")?;
/// draft.set("floor.friction", &0.2)?;
/// draft.set("obstacles[stool].height_m", &1.8)?;
/// assert_eq!(draft.world()?.spec.floor.friction, 0.2);
/// assert!(draft.set("obstacles[throne].height_m", &1.8).is_err());
/// # Ok::<(), wayhome::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Draft {
    tree: Node,
    source: PathBuf,
    text: String,
    /// What was set, a line each; with the text it makes the hash of the changed world.
    changes: String,
}

impl Draft {
    /// Opens a world as [`World::open`] does.
    ///
    /// # Errors
    /// When there is none, it cannot be read, or is not of its format. Its faults come with [`Draft::world`].
    pub fn open(argument: &str) -> Result<Self> {
        let (text, source) = read(argument)?;
        let tree = if source.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            Node::from_json(&text, &source)?
        } else {
            Node::from_toml(&text, &source)?
        };
        Ok(Self { tree, source, text, changes: String::new() })
    }

    /// Sets the field at `place`. Whether there is such a field and takes such a value is checked with [`Draft::world`].
    ///
    /// # Errors
    /// When the place leads into a list entry that is not there.
    pub fn set(&mut self, place: &str, value: &impl Serialize) -> Result<()> {
        let node =
            Node::from_spec(value).map_err(|e| invalid(&self.source, place, &e.to_string(), "a value of a world file"))?;
        self.changes += &format!("\n{place} = {}", serde_json::to_string(value).unwrap_or_default());
        let steps: Vec<&str> = place.split(['.', '[']).map(|step| step.strip_suffix(']').unwrap_or(step)).collect();
        let source = &self.source;
        let mut at = &mut self.tree;
        for step in steps {
            if !matches!(at.value, Value::List(_) | Value::Table(_)) {
                at.value = Value::Table(Vec::new());
            }
            at = match &mut at.value {
                Value::List(items) => {
                    let count = items.len();
                    let found = step.parse::<usize>().ok().filter(|k| *k < count);
                    let found = found.or_else(|| items.iter().position(|i| i.get("name").and_then(Node::text) == Some(step)));
                    let allowed = || format!("an entry from 0 to {}, or one's name", count.saturating_sub(1));
                    &mut items[found.ok_or_else(|| invalid(source, place, step, &allowed()))?]
                }
                Value::Table(entries) => {
                    let k = entries.iter().position(|(key, _)| key == step).unwrap_or_else(|| {
                        entries.push((step.to_owned(), Node { line: None, value: Value::Null }));
                        entries.len() - 1
                    });
                    &mut entries[k].1
                }
                _ => return Ok(()), // it is one of the two by now
            };
        }
        *at = node;
        Ok(())
    }

    /// Gives the whole floor one friction: that of the floor, without zones.
    ///
    /// # Errors
    /// As [`Draft::set`].
    pub fn set_friction(&mut self, friction: f64) -> Result<()> {
        self.set("floor.zones", &Vec::<f64>::new())?;
        self.set("floor.friction", &friction)
    }

    /// Keeps the first `count` of the obstacles that move by themselves, and all that stand.
    ///
    /// # Errors
    /// When the world has fewer, or has faults.
    pub fn keep_walkers(&mut self, count: usize) -> Result<()> {
        let spec = self.world()?.spec;
        let walks = |motion: &Option<MotionSpec>| !matches!(motion, None | Some(MotionSpec::Pushed { .. }));
        let walkers: Vec<usize> = (0..spec.obstacles.len()).filter(|&k| walks(&spec.obstacles[k].motion)).collect();
        if count > walkers.len() {
            let allowed = format!("0 to {}, those of world `{}`", walkers.len(), spec.name);
            return Err(invalid(&self.source, "walkers", &count.to_string(), &allowed));
        }
        let Value::Table(entries) = &mut self.tree.value else { return Ok(()) };
        if let Some((_, Node { value: Value::List(bodies), .. })) = entries.iter_mut().find(|(key, _)| key == "obstacles") {
            let mut k = 0;
            bodies.retain(|_| {
                k += 1;
                !walkers[count..].contains(&(k - 1))
            });
        }
        self.changes += &format!("\nwalkers = {count}");
        Ok(())
    }

    /// The checked world. Its SHA-256 is that of the file and, where something was set, of all that was.
    ///
    /// # Errors
    /// When it has faults; all of them come at once.
    pub fn world(&self) -> Result<World> {
        let text = if self.changes.is_empty() { self.text.clone() } else { format!("{}{}", self.text, self.changes) };
        World::from_tree(self.tree.clone(), &self.source, &text)
    }
}

fn invalid(source: &Path, place: &str, found: &str, allowed: &str) -> Error {
    Error::Invalid { what: format!("{place} in {}", source.display()), found: found.to_owned(), allowed: allowed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_set_holds_and_the_rest_is_the_file() {
        let world = World::open("crowd").unwrap();
        let mut draft = Draft::open("crowd").unwrap();
        assert_eq!(draft.world().unwrap(), world, "nothing set, nothing changed");
        draft.set_friction(0.3).unwrap();
        draft.keep_walkers(4).unwrap();
        draft.set("camera.preset", &"cheap").unwrap();
        let changed = draft.world().unwrap();
        assert_eq!((changed.spec.floor.friction, changed.bodies.len()), (0.3, world.bodies.len() - 5));
        assert_eq!(changed.bodies[..], world.bodies[..changed.bodies.len()], "the first four walkers stay as they are");
        assert_eq!(changed.spec.camera.optics, super::super::CameraPreset::Cheap.optics());
        assert_ne!(changed.sha256, world.sha256);
        assert!(draft.keep_walkers(5).unwrap_err().to_string().contains("0 to 4"));
    }

    #[test]
    fn what_is_wrong_is_told_by_its_place() {
        let fault = |place: &str, value: f64| {
            let mut draft = Draft::open("lab").unwrap();
            draft.set(place, &value).and_then(|()| draft.world()).unwrap_err().to_string()
        };
        assert!(fault("floor.friction", -1.0).contains("floor.friction: found -1"), "{}", fault("floor.friction", -1.0));
        assert!(fault("floor.grip", 1.0).contains("an unknown field"));
        assert!(fault("landmarks[99].height_m", 1.0).contains("0 to 11"));
    }
}
