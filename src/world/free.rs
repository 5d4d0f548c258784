//! Where a robot may stand: free space, starts, floor friction.

use std::f64::consts::{PI, TAU};

use rand_pcg::rand_core::Rng;

use super::convex::Convex;
use super::polygon::{anticlockwise, bounds, contains};
use super::{Body, Footprint, Partition, World};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2};
use crate::random::Stream;

/// How many random starts are tried before the world is called too crowded.
const START_TRIES: u32 = 10_000;

/// A camera nearer to a wall than this, m, may be in the wall's plane, and such a camera looks past it.
const IN_WALL_M: f64 = 1e-9;

impl World {
    /// Whether the robot's body at `pose` keeps `margin_m` from the walls and from all bodies that reach down to its height.
    ///
    /// `body_poses` are in the order of [`World::bodies`]; [`World::body_poses`] gives those at time 0.
    ///
    /// # Errors
    /// What is in the way, in words: `wall 2`, `desk`.
    pub fn is_free(&self, pose: &Pose, margin_m: f64, body_poses: &[Pose]) -> std::result::Result<(), String> {
        let disc = Convex::disc(pose.position(), self.spec.robot.radius_m + margin_m);
        self.first_in_the_way(&disc, self.bodies.iter().zip(body_poses))
    }

    /// Whether the camera of a robot at `pose` is in the room and neither in a wall nor in a body, each where it is at time 0. The
    /// robot's own size does not matter.
    ///
    /// # Errors
    /// Where the camera is, in words: `outside the room`, "inside `desk`".
    pub fn camera_is_free(&self, pose: &Pose) -> std::result::Result<(), String> {
        let (camera, height_m) = (self.camera_pose(pose).position(), self.spec.camera.height_m);
        if !self.boundary.contains(camera) {
            return Err("outside the room".into());
        }
        if self.boundary.distance(camera) < IN_WALL_M {
            return Err("in a wall of the room".into());
        }
        let at_its_height = self.bodies.iter().filter(|b| b.bottom_m <= height_m && height_m <= b.top_m);
        let body = at_its_height.into_iter().find(|b| b.footprint.distance_to(b.pose.inverse_transform(camera)) <= 0.0);
        let is_in = |stretch: &[f64; 2], wall: &Partition| {
            Footprint::Polygon(wall.footprint(*stretch).into()).distance_to(camera) < IN_WALL_M
        };
        let mut walls = self.partitions_near(camera, camera).into_iter().map(|k| &self.partitions[k]);
        let wall = walls.find(|wall| wall.stretches(height_m, height_m).iter().any(|s| is_in(s, wall)));
        match body.map(|b| &b.name).or(wall.map(|w| &w.name)) {
            Some(name) => Err(format!("inside `{name}`")),
            None => Ok(()),
        }
    }

    /// Whether the robot can drive straight from `from` to `to`, past walls and standing bodies, those that could be pushed away
    /// included. Bodies that move by themselves don't count.
    ///
    /// # Errors
    /// What is in the way, in words.
    pub fn is_corridor_free(&self, from: Vector2<f64>, to: Vector2<f64>) -> std::result::Result<(), String> {
        let corridor = Convex::corridor(from, to, self.spec.robot.radius_m);
        let standing = self.bodies.iter().filter(|b| b.stands());
        self.first_in_the_way(&corridor, standing.map(|b| (b, &b.pose)))
    }

    fn first_in_the_way<'a>(
        &self,
        shape: &Convex,
        bodies: impl Iterator<Item = (&'a Body, &'a Pose)>,
    ) -> std::result::Result<(), String> {
        if !self.boundary.contains(shape.middle()) {
            return Err("the outside of the room".to_owned());
        }
        let (low, high) = shape.bounds(0.0);
        for k in self.boundary.walls_near(low, high) {
            let (a, b) = self.wall(k);
            if shape.gap_m(&Convex::corridor(a, b, 0.0)) < 0.0 {
                return Err(format!("wall {k}"));
            }
        }
        for k in self.partitions_near(low, high) {
            let partition = &self.partitions[k];
            let mut stretches = partition.stretches(0.0, self.spec.robot.height_m).into_iter();
            if stretches.any(|s| shape.gap_m(&Convex::polygon(&partition.footprint(s), 0.0)) < 0.0) {
                return Err(partition.name.clone());
            }
        }
        for (body, pose) in bodies {
            let close = shape.may_reach(pose.position(), body.footprint.bounding_radius());
            if close && body.bottom_m < self.spec.robot.height_m && shape.gap_m(&Convex::of_body(body, pose)) < 0.0 {
                return Err(body.name.clone());
            }
        }
        Ok(())
    }

    /// Ends of wall `k`, from corner k to corner k + 1, m.
    #[must_use]
    pub fn wall(&self, k: usize) -> (Vector2<f64>, Vector2<f64>) {
        (self.outline[k], self.outline[(k + 1) % self.outline.len()])
    }

    /// Distance from `point` to the nearest wall, m; minus infinity outside the room.
    #[must_use]
    pub fn distance_to_walls_m(&self, point: Vector2<f64>) -> f64 {
        if self.boundary.contains(point) { self.boundary.distance(point) } else { f64::NEG_INFINITY }
    }

    /// Coulomb friction of the floor at a point: that of the last zone around it, else the floor's own.
    #[must_use]
    pub fn friction_at(&self, point: Vector2<f64>) -> f64 {
        self.zones.iter().rev().find(|z| contains(&z.polygon, point)).map_or(self.spec.floor.friction, |z| z.friction)
    }

    /// Draws a start: uniform over the start region (or the room) between the least and greatest distance from home, any
    /// heading. The robot stands free there with the start's clearance, and nothing that stands still is in its straight way
    /// home.
    ///
    /// # Errors
    /// When 10,000 draws find no such place; the message names what was most often in the way.
    pub fn random_start(&self, stream: &mut Stream) -> Result<Pose> {
        let start = &self.spec.start;
        let region = start.region_m.as_deref().map_or_else(|| self.outline.clone(), anticlockwise);
        let (low, high) = bounds(&region);
        let poses = self.body_poses();
        let mut refusals: std::collections::BTreeMap<String, u32> = std::collections::BTreeMap::new();
        for _ in 0..START_TRIES {
            // Three numbers a try, whatever becomes of it: the stream's position tells the number of tries.
            let [u, v, turn] = [uniform(stream), uniform(stream), uniform(stream)];
            let point = Vector2::new(low.x + u * (high.x - low.x), low.y + v * (high.y - low.y));
            let pose = Pose::new(point.x, point.y, TAU * turn - PI);
            let distance_m = (point - self.home.position()).norm();
            let refusal = if !contains(&region, point) {
                continue;
            } else if distance_m < start.min_distance_m || distance_m > start.max_distance_m {
                Err("the distance from home".to_owned())
            } else {
                self.is_free(&pose, start.clearance_m, &poses).and_then(|()| self.is_corridor_free(point, self.home.position()))
            };
            match refusal {
                Ok(()) => return Ok(pose),
                Err(reason) => *refusals.entry(reason).or_default() += 1,
            }
        }
        let worst = refusals.iter().max_by_key(|(_, count)| **count);
        Err(Error::Unfit {
            what: format!("random start in world {}", self.spec.name),
            found: format!(
                "no free place in {START_TRIES} tries{}",
                worst.map_or_else(String::new, |(reason, count)| format!("; {count} times {reason} was in the way"))
            ),
            needed: format!(
                "a start region with free places {} to {} m from home, {} m of clearance and a straight free way home",
                start.min_distance_m, start.max_distance_m, start.clearance_m
            ),
        })
    }

    /// The start called `name` in the world file.
    ///
    /// # Errors
    /// When there is none; the message lists the names that exist.
    pub fn named_start(&self, name: &str) -> Result<Pose> {
        let named = &self.spec.start.named;
        named.iter().find(|n| n.name == name).map(|n| Pose::new(n.x_m, n.y_m, n.heading_deg.to_radians())).ok_or_else(|| {
            let names: Vec<_> = named.iter().map(|n| n.name.as_str()).collect();
            Error::Invalid {
                what: format!("start in world {}", self.spec.name),
                found: name.to_owned(),
                allowed: if names.is_empty() {
                    "random, or x,y,heading_deg; this world has no named starts".to_owned()
                } else {
                    format!("random, x,y,heading_deg, or one of {}", names.join(", "))
                },
            }
        })
    }
}

/// A number in [0, 1) with 53 random bits.
fn uniform(stream: &mut Stream) -> f64 {
    const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
    (stream.next_u64() >> 11) as f64 * STEP
}
