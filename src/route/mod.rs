//! Routes: chains of snapshots, taught once and followed by visual homing from each to the next.
//!
//! A person drives the robot along ([`teach`]); it keeps snapshots by a [`rule`](rule::SnapshotRule): bearings and descriptors of features,
//! and the path by its odometry ([`chart::Route`], in a file by [`store`]). Later it follows the route by itself ([`follow::Follower`]):
//! around each snapshot it has a map of that snapshot's features, whose ranges the odometry between snapshots tells (`ranges`),
//! finds its pose in there from bearings ([`locate::Locator`]), and hands the pose over to the next. How odometry drifts on the way
//! through a building does not matter, only how it drifts from one snapshot to the next; so errors do not grow with the length of the
//! route. [`repeat()`](repeat::repeat) holds a follower against the truth, [`measure`] puts that in numbers.
//!
//! Nothing that the robot keeps or does knows of the truth: [`learn::Learner`] and [`follow::Follower`] get
//! [`Observation`](crate::observation::Observation)s only.
//!
//! ```
//! use std::ops::ControlFlow;
//! use wayhome::geometry::Vector2;
//! use wayhome::render::RendererChoice;
//! use wayhome::route::repeat::{Repeating, repeat};
//! use wayhome::route::scene::{EVERY, SIZE_PX, Stage};
//! use wayhome::route::teach::{Teaching, teach};
//! use wayhome::world::World;
//!
//! # #[cfg(feature = "rapier")] {
//! let world = World::open("lab")?;
//! let stage = Stage::new(&world, SIZE_PX, EVERY, RendererChoice::Cpu)?;
//! let way = [Vector2::new(1.5, 1.2), Vector2::new(3.0, 1.4), Vector2::new(3.4, 2.4)];
//! let lesson = teach(&stage, &way, &Teaching::default(), &mut |_| ControlFlow::Continue(()))?;
//! let again = repeat(&stage, &lesson.route, &lesson.truth, &Repeating::default(), 7, &mut |_| ControlFlow::Continue(()))?;
//! assert!(again.is_completed() && again.cross_track_m().all(|error_m| error_m < 0.1));
//! # }
//! # Ok::<(), wayhome::Error>(())
//! ```
//!
//! Knows of: episodes and what lies below. Must not know of studies and reports.

pub mod chart;
pub mod follow;
pub mod learn;
mod legs;
pub mod locate;
pub mod measure;
mod ranges;
pub mod repeat;
pub mod rule;
pub mod scene;
mod steer;
pub mod store;
pub mod teach;
pub mod tour;
