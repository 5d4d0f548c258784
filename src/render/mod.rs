//! The renderer: what a panoramic camera on the robot sees, in colours, range and instance ids.
//!
//! Two renderers share one packed [`Scene`]: a wgpu compute raycaster (`shaders/*.wgsl`) and its CPU twin. Each shader file has
//! a Rust file of the same name and structure. They agree to within rounding, which `tests/render_agreement.rs` measures.
//!
//! The way of a picture: [`Scene::new`] packs a world once and bakes its textures (`scene`, `texture`). For each [`View`] the
//! geometry is moved to the camera and tables of directions and rows are filled (`frame`). Each column then finds the walls
//! and bodies in its upright plane (`columns`), its rows pick what they see of them, and each face gets its texture (`sample`)
//! and light (`shade`). What a real [`Camera`] makes of it comes last (`camera`).
//!
//! What is exact and what is not:
//! - Walls, upright prisms over discs and convex polygons, their tops and undersides, floor and ceiling are met exactly, also
//!   where bodies stand on one another, hang, or overlap. Behind fifteen bodies in a row a column sees no further body.
//! - A ray that meets nothing, which takes a camera outside the room, is black with range 0 and instance 0. A camera inside the
//!   solid of a body is an error.
//! - Textures are prefiltered, alike along both axes. Light is ambient and Lambert's, without shadows.
//! - A camera's blur, noise and dirt change colours alone: range and instance ids stay exact.
//! - The CPU renderer's pictures are the same bytes on every machine and any number of threads.

mod camera;
mod columns;
mod cpu;
mod frame;
mod gpu;
mod hits;
mod sample;
mod scene;
mod shade;
mod texture;

use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::panorama::{Panorama, Projection};

pub use camera::Camera;
pub use cpu::CpuRenderer;
pub use gpu::{GpuRenderer, SHADER};
pub use scene::Scene;

/// Which renderer a person asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RendererChoice {
    /// A hardware GPU where there is one, else the CPU.
    Auto,
    /// Any graphics adapter, a software one included; an error where there is none.
    Gpu,
    /// The CPU twin.
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

    /// What this renderer is.
    fn info(&self) -> &RendererInfo;
}

/// The renderer of a person's choice.
///
/// # Errors
/// [`Error::NoAdapter`] where the GPU is asked for and there is none, [`Error::Gpu`] where it cannot be used.
pub fn create(choice: RendererChoice) -> Result<Box<dyn Renderer>> {
    match choice {
        RendererChoice::Cpu => Ok(Box::new(CpuRenderer::new())),
        RendererChoice::Gpu => Ok(Box::new(GpuRenderer::new()?)),
        RendererChoice::Auto => match GpuRenderer::on_hardware() {
            Ok(renderer) => Ok(Box::new(renderer)),
            Err(Error::NoAdapter(why)) => {
                log::debug!("rendering on the CPU: no hardware adapter ({why})");
                Ok(Box::new(CpuRenderer::new()))
            }
            Err(error) => {
                log::warn!("rendering on the CPU: {error}");
                Ok(Box::new(CpuRenderer::new()))
            }
        },
    }
}
