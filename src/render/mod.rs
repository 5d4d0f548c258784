//! The renderer: what a panoramic camera on the robot sees, in colours, range and instance ids.
//!
//! Two renderers share one packed [`Scene`]: a wgpu compute raycaster (`shaders/*.wgsl`) and its CPU twin. Each shader file has
//! a Rust file of the same name and structure. They agree to within rounding, which `tests/render_agreement.rs` measures.
//!
//! The way of a picture: [`Scene::new`] packs a world once and bakes its textures (`scene`, `texture`). For each [`View`] the
//! geometry is moved to the camera and tables of directions and rows are filled (`frame`), with what is seen of a large building
//! (`visible`). Each column then finds the walls
//! and bodies in its upright plane (`columns`), its rows pick what they see of them, and each face gets its texture (`sample`)
//! and light (`shade`). What a real [`Camera`] makes of it comes last (`camera`).
//!
//! What is exact and what is not:
//! - Walls, upright prisms over discs and convex polygons, their tops and undersides, floor and ceiling are met exactly, also
//!   where bodies stand on one another, hang, or overlap. Behind fifteen bodies in a row a column sees no further body.
//! - A ray that meets nothing, which takes a camera outside the room, is black with range 0 and instance 0. A camera in the plane
//!   of a wall looks past it. A camera inside the solid of a body is an error.
//! - Textures are prefiltered, alike along both axes. Light is ambient and Lambert's, without shadows.
//! - A camera's blur, noise and dirt change colours alone: range and instance ids stay exact.
//! - The CPU renderer's pictures are the same bytes on every machine and any number of threads.
//!
//! Knows of: worlds and panoramas. Must not know of physics or vision; `gpu` alone knows wgpu.

mod batch;
mod camera;
mod columns;
mod cpu;
mod frame;
#[cfg(feature = "gpu")]
mod gpu;
mod hits;
mod huge_pages;
mod inner;
mod instructions;
mod now;
mod records;
mod sample;
mod scene;
mod shade;
mod spans;
mod stream;
mod texels;
mod texture;
mod visible;

use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::panorama::{Panorama, Projection};

pub use camera::Camera;
pub use cpu::CpuRenderer;
#[cfg(feature = "gpu")]
pub use gpu::{GpuRenderer, SHADER};
pub use instructions::InstructionSet;
pub use scene::Scene;

/// Which renderer a person asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::EnumMessage, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum RendererChoice {
    /// A hardware GPU where there is one, else the CPU.
    Auto,
    /// Any graphics adapter, a software one included; an error where there is none.
    Gpu,
    /// The CPU.
    Cpu,
}

/// What rendered, for the record.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct RendererInfo {
    /// "gpu" or "cpu".
    pub kind: String,
    /// Name of the adapter, or of the processor's instruction set.
    pub adapter: String,
    /// Driver and version; empty for the CPU.
    pub driver: String,
}

/// One picture to take.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Size and projection.
    pub projection: Projection,
    /// Pose of the robot in the room; the camera is where the world mounts it on the robot.
    pub robot: Pose,
    /// Current pose of every body, in the order of `World::bodies`.
    pub bodies: &'a [Pose],
}

/// A renderer of either kind.
pub trait Renderer: Send {
    /// Renders one view into `out`, whose buffers are resized as needed and otherwise reused.
    ///
    /// # Errors
    /// When a number of the view is not finite, the camera is inside a body ([`Error::CameraInside`]), the graphics device
    /// fails, or the size is more than it allows.
    fn render(&mut self, scene: &Scene, view: &View<'_>, out: &mut Panorama) -> Result<()>;

    /// Renders several views at once, each into the place of `out` with its number: on the CPU a thread takes a picture, or threads
    /// share it where there are fewer pictures than threads; on a GPU several pictures are under way. All of them are in memory
    /// together; [`Renderer::render_batch`] is for many.
    ///
    /// # Errors
    /// As [`Renderer::render`]; then nothing is known of what `out` holds.
    ///
    /// # Panics
    /// When `out` is not as long as `views`.
    fn render_group(&mut self, scene: &Scene, views: &[View<'_>], out: &mut [Panorama]) -> Result<()>;

    /// Renders many views and shows them to `sink` in their order, some at a time, with the number of the first of them. It may
    /// do with them as it likes, for instance develop them by a camera.
    ///
    /// While `sink` works on some pictures other threads render the next ones. [`most_in_memory`] pictures are in memory at most,
    /// whatever the length of the batch, and half of them are shown at once at most; on the CPU the more, the longer `sink` takes.
    /// A graphics adapter holds three more, twice each on hardware. Each view has its own poses of robot and bodies, so that a
    /// batch may be a film of moving bodies. `sink` may be called on any thread of the pool, never on two at a time.
    ///
    /// ```
    /// use wayhome::geometry::Pose;
    /// use wayhome::render::{CpuRenderer, Renderer, Scene, View};
    /// use wayhome::world::World;
    ///
    /// let world = World::open("lab")?;
    /// let (projection, bodies) = (world.projection_of_size(90, 12), world.body_poses());
    /// let turned = |k: u32| Pose { heading: 0.1 * f64::from(k), ..world.home };
    /// let views: Vec<_> = (0..100).map(|k| View { projection, robot: turned(k), bodies: &bodies }).collect();
    /// let mut seen = 0;
    /// CpuRenderer::new().render_batch(&Scene::new(&world)?, &views, &mut |first, panoramas| {
    ///     assert_eq!(first, seen, "in order");
    ///     seen += panoramas.len();
    ///     Ok(())
    /// })?;
    /// assert_eq!(seen, 100);
    /// # Ok::<(), wayhome::Error>(())
    /// ```
    ///
    /// # Errors
    /// The first of `sink` or of a picture. Those before it have been shown, but on a GPU for the group in which it happened.
    fn render_batch(
        &mut self,
        scene: &Scene,
        views: &[View<'_>],
        sink: &mut (dyn FnMut(usize, &mut [Panorama]) -> Result<()> + Send),
    ) -> Result<()> {
        batch::run(self, scene, views, sink)
    }

    /// What this renderer is.
    fn info(&self) -> &RendererInfo;
}

/// Most pictures of a size that a batch has in memory, in the thread pool at hand: two to 32 for each thread, the fewer the larger
/// they are; and of pictures so large that these would take more than 1 GiB, fewer, but at least
/// two.
#[must_use]
pub fn most_in_memory(projection: Projection) -> usize {
    2 * batch::group_length(projection.pixels(), rayon::current_num_threads())
}

/// The renderer of a person's choice.
///
/// # Errors
/// [`Error::NoAdapter`] where the GPU is asked for and there is none, [`Error::Gpu`] where it cannot be used, and
/// [`Error::FeatureOff`] where this build has no GPU renderer.
pub fn create(choice: RendererChoice) -> Result<Box<dyn Renderer>> {
    match choice {
        RendererChoice::Cpu => Ok(Box::new(CpuRenderer::new())),
        RendererChoice::Gpu => on_gpu(false),
        RendererChoice::Auto => on_gpu(true).or_else(|error| {
            match error {
                Error::NoAdapter(why) => log::debug!("rendering on the CPU: no hardware adapter ({why})"),
                Error::FeatureOff { .. } => {}
                error => log::warn!("rendering on the CPU: {error}"),
            }
            Ok(Box::new(CpuRenderer::new()))
        }),
    }
}

/// A renderer on a graphics adapter; with `hardware` on no software one.
#[cfg(feature = "gpu")]
fn on_gpu(hardware: bool) -> Result<Box<dyn Renderer>> {
    Ok(Box::new(if hardware { GpuRenderer::on_hardware()? } else { GpuRenderer::new()? }))
}

#[cfg(not(feature = "gpu"))]
fn on_gpu(_hardware: bool) -> Result<Box<dyn Renderer>> {
    Err(Error::FeatureOff { what: "the renderer on graphics adapters", feature: "gpu" })
}
