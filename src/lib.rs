//! Headless, physics-simulated robot testbed for bearing-only visual homing.
//!
//! # The story of a run
//!
//! A [`world`] is loaded and checked as a whole: a room, bodies in it, floor friction, a robot with a panoramic camera, and
//! the pose that is called home.
//!
//! ```
//! use wayhome::world::World;
//!
//! let world = World::open("lab")?; // a built-in world; a path opens a file
//! assert_eq!(world.spec.name, "lab");
//! assert!(world.bodies.len() > 5);
//! # Ok::<(), wayhome::Error>(())
//! ```
//!
//! [`physics`] moves the robot: wheels that slip, motors, encoders that count, walls that stop it. The [`render`]er draws what
//! the camera sees from where the robot really is, as a [`panorama`] with range and instance beside the colours.
//!
//! ```
//! use wayhome::panorama::Panorama;
//! use wayhome::render::{self, RendererChoice, Scene, View};
//! use wayhome::world::World;
//!
//! let world = World::open("lab")?;
//! let scene = Scene::new(&world)?;
//! let mut renderer = render::create(RendererChoice::Cpu)?;
//! let projection = world.projection_of_size(360, 45);
//! let mut seen = Panorama::black(projection);
//! renderer.render(&scene, &View { projection, robot: world.home, bodies: &world.body_poses() }, &mut seen)?;
//! assert!(seen.range_m.iter().all(|&r| r > 0.0), "a room is closed: every ray ends on a surface");
//! # Ok::<(), wayhome::Error>(())
//! ```
//!
//! [`vision`] finds features of the home panorama again and turns them into bearings, and to nothing else: from here on no code
//! sees an image. A method gets [`observation`]s only: the home snapshot once, then bearings and wheel odometry. Its
//! [`estimation`] says where home is, its [`control`] turns the wheels. The types of an observation hold no truth, so a method
//! cannot look at it.
//!
//! An [`episode`] joins a plant, a [`sensor`] and a [`method`] and keeps the record. Its
//! [`Simulation`](episode::Simulation) is stepped, command in and observation out; the closed loop is one of its callers.
//!
//! ```
//! use std::ops::ControlFlow;
//! use wayhome::episode::{Outcome, PlantKind, SensorKind, Setup, Simulation};
//! use wayhome::world::World;
//!
//! let world = World::open("lab")?;
//! let setup = Setup { plant: PlantKind::Unicycle, sensor: SensorKind::Noisy, ..Setup::default() };
//! let mut simulation = Simulation::new(&world, &setup)?;
//! let first = simulation.reset(7)?; // what a method sees at the start of the run of seed 7
//! assert!(!first.bearings.is_empty());
//! let record = simulation.run(7, &mut |_| ControlFlow::Continue(()))?; // the same run, driven by the setup's method
//! assert_eq!(record.outcome, Outcome::Home);
//! # Ok::<(), wayhome::Error>(())
//! ```
//!
//! A [`record`]er keeps a run as it happens, a [`study`] repeats episodes, a [`report`] writes what came of them, and
//! [`verify`] holds the project against closed forms and other programs.
//!
//! # Floors
//!
//! Each room imports only what lies below it; rooms of one floor do not import one another unless an arrow says so. The first
//! lines of each say what it knows of.
//!
//! ```text
//! 8  the command line (src/cli, main.rs)
//! 7  report -> study          pages of finished work         verify   the project held against others
//! 6  study -> record          many episodes                          route    chains of snapshots, taught and followed
//! 5  record -> episode        one recorder a format          episode  a simulation that is stepped
//! 4  sensor   method   dataset   homing
//! 3  physics   render   vision   estimation   control        draw     charts, maps, sheets
//! 2  world   panorama_set   observation
//! 1  panorama   document   fault   storage   table   command_line   error   geometry   ode   random   statistics
//! ```
//!
//! # Features
//!
//! What takes long to build or serves some callers only is a Cargo feature; all are on by default.
//!
//! | feature | what it adds |
//! |---|---|
//! | `cli` | the program `wayhome`; takes `rapier` and `video` along |
//! | `gpu` | [`render::RendererChoice::Gpu`], by wgpu |
//! | `parquet` | Parquet files: the rows of [`study::sweep`]s and the truth of [`dataset`]s |
//! | `rapier` | the plant with mass, slip and collisions ([`episode::PlantKind::Rapier`]), and what [`verify`] holds it against |
//! | `recording` | recordings of runs as MCAP files |
//! | `video` | rooms drawn in pixels: recordings of runs as animated GIFs, sheets of worlds |
//!
//! What is off does not exist, or is refused by [`Error::FeatureOff`], which names the feature. The unicycle, the CPU renderer,
//! the extractor, all methods and studies are always there.
//!
//! # Units and randomness
//!
//! SI units; x forward, y left, angles anti-clockwise. One seed gives a run: the same bytes on any number of threads, and with
//! the CPU renderer on any machine. That is why trigonometry goes through [`geometry`] and never through the platform.

pub mod command_line;
pub mod control;
pub mod dataset;
pub mod document;
pub mod draw;
pub mod episode;
pub mod error;
pub mod estimation;
pub mod fault;
pub mod geometry;
pub mod homing;
pub mod method;
pub mod observation;
pub mod ode;
pub mod panorama;
pub mod panorama_set;
#[cfg_attr(not(feature = "rapier"), allow(dead_code, reason = "what only the plant `rapier` uses of the shared parts"))]
pub mod physics;
pub mod random;
pub mod record;
pub mod render;
pub mod report;
pub mod route;
pub mod sensor;
pub mod statistics;
pub mod storage;
pub mod study;
pub mod table;
pub mod verify;
pub mod vision;
pub mod world;

pub use error::{Error, ErrorKind, Result};

/// Version of this program and the commit that it was built from, as in `0.1.0 (6278fe7)`; `+changes` follows the commit where
/// the sources differed from it. Where the commit is not known, as without git, the version stands alone.
pub const VERSION: &str = env!("WAYHOME_VERSION");
