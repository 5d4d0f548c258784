//! Bearings from geometry.

use super::Sensor;
use super::sight::hidden;
use crate::error::Result;
use crate::geometry::{Pose, angle_of};
use crate::observation::{Bearing, HomeSnapshot, LandmarkId};
use crate::world::World;

/// Standard deviation that the sensor states for its exact bearings, rad: small, and not zero, for the sake of filters.
const STATED_SD_RAD: f64 = 1e-4;

/// The true bearings of the landmark bodies' centres, each while nothing stands in the line of sight.
///
/// Landmark k of the world has id k. Bodies that reach through the camera's height hide what stands behind them, and so do
/// the walls of a room that is not convex; a lower body is looked over and a higher one looked under.
#[derive(Debug, Clone)]
pub struct IdealSensor<'a> {
    world: &'a World,
    home: HomeSnapshot,
}

impl<'a> IdealSensor<'a> {
    /// The sensor for a world.
    pub fn new(world: &'a World) -> Self {
        let home = HomeSnapshot { bearings: look(world, world.home, &world.body_poses()) };
        Self { world, home }
    }
}

impl Sensor for IdealSensor<'_> {
    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        Ok(look(self.world, truth, bodies))
    }
}

/// Bearings of all visible landmarks, in the order of their ids.
fn look(world: &World, robot: Pose, bodies: &[Pose]) -> Vec<Bearing> {
    let camera = world.camera_pose(&robot);
    (0..world.landmark_count)
        .filter(|&k| !hidden(world, bodies, camera.position(), k))
        .map(|k| Bearing {
            id: LandmarkId(k as u32),
            azimuth_rad: angle_of(camera.inverse_transform(bodies[k].position())),
            sd_rad: STATED_SD_RAD,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    /// A 10 x 10 m room with landmarks to the east and north-east of home and a screen that a test can move.
    fn world(screen_x: f64, screen_height: f64, screen_elevation: f64) -> World {
        let text = format!(
            r#"
            name = "test"
            [room]
            outline_m = [[-5, -5], [5, -5], [5, 5], [-5, 5]]
            [home]
            x_m = 0
            y_m = 0
            [[landmarks]]
            name = "east"
            shape = {{ disc = {{ radius_m = 0.1 }} }}
            position_m = [3, 0]
            height_m = 1
            texture = {{ family = "plain" }}
            [[landmarks]]
            name = "north-east"
            shape = {{ disc = {{ radius_m = 0.1 }} }}
            position_m = [3, 3]
            height_m = 1
            texture = {{ family = "plain" }}
            [[obstacles]]
            name = "screen"
            shape = {{ box = {{ size_m = [0.1, 1] }} }}
            position_m = [{screen_x}, 0]
            height_m = {screen_height}
            elevation_m = {screen_elevation}
            texture = {{ family = "plain" }}
            "#
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("test.toml");
        std::fs::write(&path, text).unwrap();
        World::load(&path).unwrap()
    }

    fn seen(world: &World, robot: Pose) -> Vec<(u32, f64)> {
        look(world, robot, &world.body_poses()).iter().map(|b| (b.id.0, b.azimuth_rad)).collect()
    }

    #[test]
    fn bearings_are_those_of_the_centres() {
        let open = world(-3.0, 1.0, 0.0);
        assert_eq!(seen(&open, Pose::IDENTITY), [(0, 0.0), (1, FRAC_PI_4)]);
        let turned = seen(&open, Pose::new(0.0, 0.0, 1.0));
        assert!((turned[0].1 + 1.0).abs() < 1e-15 && (turned[1].1 - (FRAC_PI_4 - 1.0)).abs() < 1e-15);
    }

    #[test]
    fn only_what_stands_between_at_camera_height_hides() {
        // The camera looks from 0.4 m.
        assert_eq!(seen(&world(1.5, 1.0, 0.0), Pose::IDENTITY), [(1, FRAC_PI_4)], "a screen in between");
        assert_eq!(seen(&world(1.5, 0.3, 0.0), Pose::IDENTITY).len(), 2, "a low screen is looked over");
        assert_eq!(seen(&world(1.5, 0.3, 0.6), Pose::IDENTITY).len(), 2, "a hung screen is looked under");
        assert_eq!(seen(&world(4.0, 1.0, 0.0), Pose::IDENTITY).len(), 2, "a screen behind");
        assert_eq!(seen(&world(-1.5, 1.0, 0.0), Pose::IDENTITY).len(), 2, "a screen at the back");
    }

    #[test]
    fn doors_and_windows_are_seen_through_and_walls_are_not() {
        // The wall at x = 1.5 is met at y = 0 on the way to "east" and at y = 1.5 on that to "north-east". The camera looks from 0.4 m.
        let seen_through = |openings: &str| {
            let mut world = world(-3.0, 1.0, 0.0);
            let wall = format!("from_m = [1.5, -5]\nto_m = [1.5, 5]\nopenings = [{openings}]");
            world.spec.walls = vec![toml::from_str(&wall).unwrap()];
            let world = World::from_spec(&world.spec, "walls").unwrap();
            seen(&world, Pose::IDENTITY).iter().map(|s| s.0).collect::<Vec<_>>()
        };
        let door = "{ kind = \"door\", from_start_m = 4.6, width_m = 0.8 }";
        assert_eq!(seen_through(""), [0; 0]);
        assert_eq!(seen_through(door), [0]);
        let window = |sill_m: f64, top_m: f64| {
            format!("{{ kind = \"window\", from_start_m = 6, width_m = 1, sill_m = {sill_m}, top_m = {top_m} }}")
        };
        assert_eq!(seen_through(&format!("{door}, {}", window(0.3, 1.0))), [0, 1]);
        assert_eq!(seen_through(&window(0.5, 1.0)), [0; 0], "a sill above the camera");
        assert_eq!(seen_through(&window(0.1, 0.35)), [0; 0], "a lintel below it");
    }

    #[test]
    fn landmarks_hide_each_other() {
        let open = world(-3.0, 1.0, 0.0);
        // From due south of "north-east", "east" stands in the way.
        assert_eq!(seen(&open, Pose::new(3.0, -2.0, 0.0)).iter().map(|s| s.0).collect::<Vec<_>>(), [0]);
    }
}
