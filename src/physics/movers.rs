//! Bodies that move by themselves: along a path, or from one random point of a region to the next.
//!
//! Moving bodies are driven, not pushed, so one that walked on regardless would crush the robot against a wall. Like a
//! person, a mover therefore stops short of the robot: it waits while its next move would bring it closer than
//! [`CLEARANCE_M`]. A walker that has waited for [`PATIENCE_S`] tries other points until one is free; a path mover waits until the way is
//! free. The robot may still drive into a mover, which then stands like a wall. Bodies high enough for the robot to pass
//! below take no notice of it. Movers keep the heading that the file gives them, and pass through other bodies.

use rand::RngExt;

use crate::geometry::{Pose, Vector2};
use crate::random::{Seed, Stream};
use crate::world::polygon::{contains, edges, segments_cross};
use crate::world::{Body, Footprint, MotionSpec, World};

/// Free space that a mover keeps to the robot's body, m.
const CLEARANCE_M: f64 = 0.05;
/// How long a walker waits for the robot before it goes elsewhere, s.
const PATIENCE_S: f64 = 1.0;
/// Draws at most for a walker's next point.
const MAX_DRAWS: usize = 1000;

/// The robot as movers see it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Walkway {
    pub(super) robot: Vector2<f64>,
    pub(super) radius: f64,
}

/// All bodies of a world with their current poses.
#[derive(Debug, Clone)]
pub(super) struct Movers {
    poses: Vec<Pose>,
    movers: Vec<Mover>,
}

#[derive(Debug, Clone)]
struct Mover {
    /// Index of the body.
    body: usize,
    footprint: Footprint,
    /// Whether the robot is too tall to pass below.
    solid: bool,
    speed: f64,
    route: Route,
    waited_s: f64,
}

#[derive(Debug, Clone)]
enum Route {
    /// Corners in order, the one ahead, and whether it goes through them forwards.
    Path { corners: Vec<Vector2<f64>>, next: usize, forwards: bool, closed: bool },
    /// Region, the point ahead, and where the next ones come from.
    Walk { region: Vec<Vector2<f64>>, target: Vector2<f64>, stream: Box<Stream> },
}

/// Whether a robot of this height runs into the body.
pub(super) fn is_solid(body: &Body, robot_height_m: f64) -> bool {
    body.bottom_m < robot_height_m
}

impl Movers {
    pub(super) fn new(world: &World, seed: Seed) -> Self {
        let mut names: Vec<&str> = Vec::new();
        let mut movers = Vec::new();
        for (index, body) in world.bodies.iter().enumerate() {
            let Some(motion) = &body.motion else { continue };
            // Each mover's stream hangs on its name, so that a further body in the file changes no other's walk.
            let namesakes = names.iter().filter(|n| **n == body.name).count();
            names.push(&body.name);
            let vector = |c: &[f64; 2]| Vector2::new(c[0], c[1]);
            let (speed, route) = match motion {
                MotionSpec::Path { corners_m, speed_m_s, closed } => {
                    let mut corners = vec![body.pose.position()];
                    corners.extend(corners_m.iter().map(vector));
                    (*speed_m_s, Route::Path { corners, next: 0, forwards: true, closed: *closed })
                }
                MotionSpec::Walk { region_m, speed_m_s } => {
                    let route = Route::Walk {
                        region: region_m.iter().map(vector).collect(),
                        target: body.pose.position(),
                        stream: Box::new(seed.stream(&format!("walk/{}/{namesakes}", body.name))),
                    };
                    (*speed_m_s, route)
                }
                MotionSpec::Pushed { .. } => continue, // rapier's business
            };
            movers.push(Mover {
                body: index,
                footprint: body.footprint.clone(),
                solid: is_solid(body, world.spec.robot.height_m),
                speed,
                route,
                waited_s: 0.0,
            });
        }
        Self { poses: world.body_poses(), movers }
    }

    /// Current pose of every body, in the order of `World::bodies`.
    pub(super) fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Takes over where something pushed a body.
    pub(super) fn place(&mut self, body: usize, pose: Pose) {
        self.poses[body] = pose;
    }

    /// Moves all movers on by `dt` seconds.
    pub(super) fn advance(&mut self, walkway: Walkway, dt: f64) {
        for mover in &mut self.movers {
            mover.advance(&mut self.poses[mover.body], walkway, dt);
        }
    }
}

impl Mover {
    fn advance(&mut self, pose: &mut Pose, walkway: Walkway, dt: f64) {
        let mut here = pose.position();
        let mut left = self.speed * dt;
        // A step may pass corners; there are no more of them in one step than this, unless corners coincide.
        for _ in 0..8 {
            let way = self.route.target() - here;
            let distance = way.norm();
            if distance > left {
                here += way * (left / distance);
                break;
            }
            here += way;
            left -= distance;
            self.route.choose_next(here);
        }
        let next = Pose { x: here.x, y: here.y, ..*pose };
        if self.solid && self.would_crowd(pose, &next, walkway) {
            self.waited_s += dt;
            if self.waited_s > PATIENCE_S && matches!(self.route, Route::Walk { .. }) {
                self.route.choose_next(pose.position());
            }
        } else {
            self.waited_s = 0.0;
            *pose = next;
        }
    }

    fn would_crowd(&self, now: &Pose, next: &Pose, walkway: Walkway) -> bool {
        let gap = |pose: &Pose| self.footprint.distance_to(pose.inverse_transform(walkway.robot)) - walkway.radius;
        let after = gap(next);
        after < CLEARANCE_M && after < gap(now)
    }
}

impl Route {
    fn target(&self) -> Vector2<f64> {
        match self {
            Self::Path { corners, next, .. } => corners[*next],
            Self::Walk { target, .. } => *target,
        }
    }

    /// Chooses where to go from `here`.
    fn choose_next(&mut self, here: Vector2<f64>) {
        match self {
            Self::Path { corners, next, forwards, closed } => {
                let last = corners.len() - 1;
                if *closed {
                    *next = if *next == last { 0 } else { *next + 1 };
                } else {
                    if *next == last {
                        *forwards = false;
                    } else if *next == 0 {
                        *forwards = true;
                    }
                    *next = if *forwards { (*next + 1).min(last) } else { next.saturating_sub(1) };
                }
            }
            Self::Walk { region, target, stream } => *target = draw_target(region, here, stream),
        }
    }
}

/// A point drawn uniformly from those of the region to which the straight way from `here` stays inside it; `here` itself
/// where none turns up. From outside the region any point will do.
fn draw_target(region: &[Vector2<f64>], here: Vector2<f64>, stream: &mut Stream) -> Vector2<f64> {
    let low = region.iter().fold(Vector2::repeat(f64::INFINITY), |m, c| m.inf(c));
    let high = region.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |m, c| m.sup(c));
    let inside = contains(region, here);
    for _ in 0..MAX_DRAWS {
        let draw = Vector2::new(stream.random::<f64>(), stream.random::<f64>());
        let point = low + (high - low).component_mul(&draw);
        let leaves = || edges(region).any(|(a, b)| segments_cross(here, point, a, b));
        if contains(region, point) && !(inside && leaves()) {
            return point;
        }
    }
    here
}
