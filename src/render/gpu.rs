//! The renderer on a graphics adapter: one compute shader through wgpu.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, mpsc};
use std::time::Duration;

use super::frame::Frame;
use super::{Renderer, RendererInfo, Scene, View};
use crate::error::{Error, Result};
use crate::panorama::Panorama;

/// The compute shader: `shaders/columns.wgsl`, `sample.wgsl`, `shade.wgsl` and `panorama.wgsl`, one after the other.
pub const SHADER: &str = concat!(
    include_str!("../../shaders/columns.wgsl"),
    "\n",
    include_str!("../../shaders/sample.wgsl"),
    "\n",
    include_str!("../../shaders/shade.wgsl"),
    "\n",
    include_str!("../../shaders/panorama.wgsl"),
);

/// Invocations of a workgroup, as the shader has them.
const WORKGROUP: u32 = 64;
/// Bytes that the shader writes for a pixel: colour, range and instance.
const PIXEL_BYTES: u64 = 12;
/// Rows of an invocation on hardware, which wants thousands of invocations. A software adapter wants whole columns, to compute
/// a column's hits once.
const HARDWARE_ROWS: u32 = 16;
/// Pictures under way at once: one is made, one is on its way back, one is prepared or read.
const IN_FLIGHT: usize = 3;
/// A picture that takes longer has failed.
const TIMEOUT: Duration = Duration::from_secs(60);

/// What the process has of graphics: making several devices at once has crashed drivers, so that all renderers share one.
static SHARED: Mutex<Option<Arc<Shared>>> = Mutex::new(None);

/// A device and what was made on it once.
#[derive(Debug)]
struct Shared {
    info: RendererInfo,
    software: bool,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
    /// What the device has complained of since it was last asked.
    complaints: Complaints,
    /// Why the device is gone, once it is.
    lost: Arc<OnceLock<String>>,
}

type Complaints = Arc<Mutex<Vec<String>>>;

impl Shared {
    /// The shared device, made on first use and again once it was lost.
    fn get(software_allowed: bool) -> Result<Arc<Self>> {
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        // It is on the best adapter there is: if that is software, there is no hardware.
        if let Some(shared) = shared.as_ref().filter(|s| s.lost.get().is_none()) {
            return if shared.software && !software_allowed {
                Err(Error::NoAdapter("none of hardware".to_owned()))
            } else {
                Ok(Arc::clone(shared))
            };
        }
        let made = Arc::new(Self::new(software_allowed)?);
        *shared = Some(Arc::clone(&made));
        Ok(made)
    }

    fn new(software_allowed: bool) -> Result<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let why = if adapters.is_empty() { "none found" } else { "none of hardware" };
        let adapter = adapters
            .into_iter()
            .filter(|a| software_allowed || is_hardware(a.get_info().device_type))
            .min_by_key(|a| rank(a.get_info().device_type))
            .ok_or_else(|| Error::NoAdapter(why.to_owned()))?;
        let about = adapter.get_info();
        let info = RendererInfo {
            kind: "gpu".to_owned(),
            adapter: format!("{} ({})", about.name, about.backend),
            driver: format!("{} {}", about.driver, about.driver_info).trim().to_owned(),
        };
        let most = adapter.limits();
        let required_limits = wgpu::Limits {
            max_storage_buffer_binding_size: most.max_storage_buffer_binding_size,
            max_buffer_size: most.max_buffer_size,
            ..wgpu::Limits::default()
        };
        let request = wgpu::DeviceDescriptor { label: Some("wayhome"), required_limits, ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&request)).map_err(|e| gpu_error(&e))?;
        let complaints = Complaints::default();
        let list = Arc::clone(&complaints);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            list.lock().unwrap_or_else(PoisonError::into_inner).push(e.to_string());
        }));
        let lost = Arc::new(OnceLock::new());
        let why = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, text| {
            // Only the first reason counts.
            let _ = why.set(format!("device lost ({reason:?}): {text}"));
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("panorama"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("panorama"),
            layout: None,
            module: &module,
            entry_point: Some("render"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let software = !is_hardware(about.device_type);
        let shared = Self { info, software, device, queue, pipeline, complaints, lost };
        shared.check()?;
        Ok(shared)
    }

    /// Turns what the device has complained of into an error.
    fn check(&self) -> Result<()> {
        if let Some(why) = self.lost.get() {
            return Err(Error::Gpu(why.clone()));
        }
        let complaints = std::mem::take(&mut *self.complaints.lock().unwrap_or_else(PoisonError::into_inner));
        if complaints.is_empty() { Ok(()) } else { Err(Error::Gpu(complaints.join("; "))) }
    }
}

/// The GPU renderer.
///
/// All renderers of a process share one device. Each keeps its own buffers there, and the scene that it rendered last. When the
/// device is lost, which is an error of the picture under way and of all later ones, a new renderer makes a new device.
#[derive(Debug)]
pub struct GpuRenderer {
    shared: Arc<Shared>,
    frame: Frame,
    params: Table,
    directions: Table,
    rows: Table,
    edges: Table,
    bodies: Table,
    lamps: Table,
    materials: Table,
    atlas: Table,
    /// Whose materials and atlas they are.
    scene: Option<u64>,
    /// Places for pictures under way, used in turn.
    slots: Vec<Slot>,
}

/// Where a picture is made and read back.
#[derive(Debug)]
struct Slot {
    picture: Table,
    readback: Table,
    bindings: Option<wgpu::BindGroup>,
}

impl Slot {
    fn new() -> Self {
        Self {
            picture: Table::new("picture", wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC),
            readback: Table::new("readback", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            bindings: None,
        }
    }
}

/// A picture under way: the submission that makes it, and who hears when it can be read.
struct Under {
    submission: wgpu::SubmissionIndex,
    arrived: mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>>,
    bytes: u64,
}

impl GpuRenderer {
    /// A renderer on the best adapter there is: discrete before integrated before virtual before software.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] where there is none, [`Error::Gpu`] where it does not take the shader.
    pub fn new() -> Result<Self> {
        Ok(Self::on(Shared::get(true)?))
    }

    /// A renderer on a hardware adapter.
    ///
    /// # Errors
    /// As [`GpuRenderer::new`]; [`Error::NoAdapter`] also where all adapters are software.
    pub fn on_hardware() -> Result<Self> {
        Ok(Self::on(Shared::get(false)?))
    }

    fn on(shared: Arc<Shared>) -> Self {
        let input = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        Self {
            shared,
            frame: Frame::new(),
            params: Table::new("params", wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            directions: Table::new("directions", input),
            rows: Table::new("rows", input),
            edges: Table::new("edges", input),
            bodies: Table::new("bodies", input),
            lamps: Table::new("lamps", input),
            materials: Table::new("materials", input),
            atlas: Table::new("atlas", input),
            scene: None,
            slots: (0..IN_FLIGHT).map(|_| Slot::new()).collect(),
        }
    }

    /// Refuses what the device cannot hold, before it is asked to.
    fn check_size(&self, scene: &Scene, view: &View<'_>) -> Result<()> {
        let limits = self.shared.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let p = &view.projection;
        let bytes = p.pixels() as u64 * PIXEL_BYTES;
        let columns = limits.max_compute_workgroups_per_dimension.saturating_mul(WORKGROUP);
        if bytes > most || p.width > columns {
            let allowed = format!("up to {} pixels and {columns} columns on {}", most / PIXEL_BYTES, self.shared.info.adapter);
            let found = format!("{} x {} = {} pixels", p.width, p.height, p.pixels());
            return Err(Error::Invalid { what: "panorama size".to_owned(), found, allowed });
        }
        let atlas = 4 * scene.atlas.len() as u64;
        if atlas > most {
            let (found, allowed) = (format!("{atlas} bytes"), format!("up to {most} bytes on {}", self.shared.info.adapter));
            return Err(Error::Invalid { what: "size of all textures".to_owned(), found, allowed });
        }
        Ok(())
    }

    /// Puts scene and tables on the device. What is written here reaches it after the pictures that are under way.
    fn upload(&mut self, scene: &Scene) {
        let (device, queue, frame) = (&self.shared.device, &self.shared.queue, &self.frame);
        let mut moved = false;
        moved |= self.params.write(device, queue, bytemuck::bytes_of(&frame.params));
        moved |= self.directions.write(device, queue, bytemuck::cast_slice(&frame.directions));
        moved |= self.rows.write(device, queue, bytemuck::cast_slice(&frame.rows));
        moved |= self.edges.write(device, queue, bytemuck::cast_slice(&frame.edges));
        moved |= self.bodies.write(device, queue, bytemuck::cast_slice(&frame.bodies));
        moved |= self.lamps.write(device, queue, bytemuck::cast_slice(&frame.lamps));
        if self.scene != Some(scene.id) {
            moved |= self.materials.write(device, queue, bytemuck::cast_slice(&scene.materials));
            moved |= self.atlas.write(device, queue, bytemuck::cast_slice(&scene.atlas));
            self.scene = Some(scene.id);
        }
        if moved {
            self.slots.iter_mut().for_each(|slot| slot.bindings = None);
        }
    }

    /// The bindings of a slot with room for `bytes`, and its two buffers.
    fn bind(&mut self, slot: usize, bytes: u64) -> Result<(&wgpu::BindGroup, &wgpu::Buffer, &wgpu::Buffer)> {
        let device = &self.shared.device;
        let place = &mut self.slots[slot];
        place.readback.reserve(device, bytes);
        if place.picture.reserve(device, bytes) {
            place.bindings = None;
        }
        let picture = place.picture.buffer.as_ref().ok_or_else(missing)?;
        let readback = place.readback.buffer.as_ref().ok_or_else(missing)?;
        if place.bindings.is_none() {
            let geometry = [&self.params, &self.directions, &self.rows, &self.edges, &self.bodies];
            let mut buffers = Vec::with_capacity(9);
            for table in geometry.into_iter().chain([&self.lamps, &self.materials, &self.atlas]) {
                buffers.push(table.buffer.as_ref().ok_or_else(missing)?);
            }
            buffers.push(picture);
            let entries: Vec<_> = (0_u32..)
                .zip(&buffers)
                .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
                .collect();
            place.bindings = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("panorama"),
                layout: &self.shared.pipeline.get_bind_group_layout(0),
                entries: &entries,
            }));
        }
        Ok((place.bindings.as_ref().ok_or_else(missing)?, picture, readback))
    }

    /// Starts a picture and its way back.
    fn start(&mut self, scene: &Scene, view: &View<'_>, slot: usize) -> Result<Under> {
        self.shared.check()?;
        self.check_size(scene, view)?;
        self.frame.prepare(scene, view)?;
        if !self.shared.software {
            self.frame.params.rows_per_invocation = HARDWARE_ROWS.min(view.projection.height);
        }
        let bytes = view.projection.pixels() as u64 * PIXEL_BYTES;
        self.upload(scene);
        let p = self.frame.params;
        let shared = Arc::clone(&self.shared);
        let (bindings, picture, readback) = self.bind(slot, bytes)?;
        shared.check()?;
        let mut encoder = shared.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&shared.pipeline);
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(p.width.div_ceil(WORKGROUP), p.height.div_ceil(p.rows_per_invocation), 1);
        }
        encoder.copy_buffer_to_buffer(picture, 0, readback, 0, bytes);
        let submission = shared.queue.submit([encoder.finish()]);
        let (send, arrived) = mpsc::channel();
        readback.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            // The receiver is gone only when waiting has failed already.
            let _ = send.send(result);
        });
        Ok(Under { submission, arrived, bytes })
    }

    /// Waits for a picture and copies it.
    fn finish(&self, under: Under, slot: usize, view: &View<'_>, out: &mut Panorama) -> Result<()> {
        let wait = wgpu::PollType::Wait { submission_index: Some(under.submission), timeout: Some(TIMEOUT) };
        let polled = self.shared.device.poll(wait);
        self.shared.check()?;
        polled.map_err(|e| gpu_error(&e))?;
        // Another renderer's thread may be the one to tell, a moment later.
        under.arrived.recv_timeout(TIMEOUT).map_err(|e| gpu_error(&e))?.map_err(|e| gpu_error(&e))?;
        let readback = self.slots[slot].readback.buffer.as_ref().ok_or_else(missing)?;
        {
            let mapped = readback.get_mapped_range(0..under.bytes).map_err(|e| gpu_error(&e))?;
            let words: &[u32] = bytemuck::try_cast_slice(&mapped).map_err(|e| gpu_error(&e))?;
            let pixels = view.projection.pixels();
            out.reshape(view.projection)?;
            out.rgba.copy_from_slice(bytemuck::cast_slice(&words[..pixels]));
            out.range_m.copy_from_slice(bytemuck::cast_slice(&words[pixels..2 * pixels]));
            for (instance, id) in out.instance.iter_mut().zip(&words[2 * pixels..3 * pixels]) {
                *instance = *id as u16;
            }
        }
        readback.unmap();
        Ok(())
    }

    /// Renders views with as many under way as there are slots.
    fn render_in_flight(&mut self, scene: &Scene, views: &[View<'_>], out: &mut [Panorama]) -> Result<()> {
        let mut under_way = VecDeque::with_capacity(IN_FLIGHT);
        let mut waiting = views.iter().zip(out).enumerate();
        for (k, view) in views.iter().enumerate() {
            if under_way.len() == IN_FLIGHT
                && let (Some(under), Some((first, (view, out)))) = (under_way.pop_front(), waiting.next())
            {
                self.finish(under, first % IN_FLIGHT, view, out)?;
            }
            under_way.push_back(self.start(scene, view, k % IN_FLIGHT)?);
        }
        for (under, (k, (view, out))) in under_way.into_iter().zip(waiting) {
            self.finish(under, k % IN_FLIGHT, view, out)?;
        }
        Ok(())
    }
}

fn gpu_error(e: &dyn std::fmt::Display) -> Error {
    Error::Gpu(e.to_string())
}

fn missing() -> Error {
    Error::Gpu("a buffer could not be made".to_owned())
}

impl Renderer for GpuRenderer {
    fn render(&mut self, scene: &Scene, view: &View<'_>, out: &mut Panorama) -> Result<()> {
        self.render_group(scene, std::slice::from_ref(view), std::slice::from_mut(out))
    }

    fn render_group(&mut self, scene: &Scene, views: &[View<'_>], out: &mut [Panorama]) -> Result<()> {
        assert_eq!(views.len(), out.len(), "a place for each view");
        self.render_in_flight(scene, views, out).inspect_err(|error| {
            // Who knows what state buffers and device are in.
            self.slots = (0..IN_FLIGHT).map(|_| Slot::new()).collect();
            if let Error::Gpu(why) = error {
                // A device that is gone may only say so later.
                let _ = self.shared.lost.set(why.clone());
            }
        })
    }

    fn info(&self) -> &RendererInfo {
        &self.shared.info
    }
}

fn is_hardware(kind: wgpu::DeviceType) -> bool {
    rank(kind) < 3
}

/// Lower is better; from 3 on it is not hardware, or nobody knows.
fn rank(kind: wgpu::DeviceType) -> u32 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// A buffer that grows with what is written to it.
#[derive(Debug)]
struct Table {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
}

impl Table {
    fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage, buffer: None }
    }

    /// Makes room for `size` bytes; whether that took a new buffer.
    fn reserve(&mut self, device: &wgpu::Device, size: u64) -> bool {
        let enough = self.buffer.as_ref().is_some_and(|b| b.size() >= size);
        if !enough {
            // Empty tables still need a buffer to bind, as long as their element.
            let descriptor = wgpu::BufferDescriptor {
                label: Some(self.label),
                size: size.max(64),
                usage: self.usage,
                mapped_at_creation: false,
            };
            self.buffer = Some(device.create_buffer(&descriptor));
        }
        !enough
    }

    fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) -> bool {
        let moved = self.reserve(device, bytes.len() as u64);
        if let (Some(buffer), false) = (&self.buffer, bytes.is_empty()) {
            queue.write_buffer(buffer, 0, bytes);
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn a_device_lost_in_a_batch_is_an_error_and_the_next_renderer_works() {
        let mut renderer = match GpuRenderer::new() {
            Ok(renderer) => renderer,
            Err(Error::NoAdapter(why)) => {
                eprintln!("\n*** NOT RUN: there is no graphics adapter ({why}) ***\n");
                assert!(std::env::var("WAYHOME_REQUIRE_GPU").as_deref() != Ok("1"), "WAYHOME_REQUIRE_GPU is 1");
                return;
            }
            Err(error) => panic!("{error}"),
        };
        let world = World::open("lab").unwrap();
        let scene = Scene::new(&world).unwrap();
        let (projection, bodies) = (world.projection_of_size(320, 40), world.body_poses());
        let views = vec![View { projection, robot: world.home, bodies: &bodies }; 400];
        let device = renderer.shared.device.clone();
        let mut shown = 0;
        let error = renderer.render_batch(&scene, &views, &mut |_, panoramas| {
            shown += panoramas.len();
            device.destroy();
            Ok(())
        });
        assert!(matches!(error, Err(Error::Gpu(_))), "{error:?}");
        assert!(shown < views.len());
        let mut out = Panorama::black(projection);
        assert!(renderer.render(&scene, &views[0], &mut out).is_err(), "lost is lost");
        GpuRenderer::new().unwrap().render(&scene, &views[0], &mut out).unwrap();
        assert!(out.range_m.iter().all(|r| *r > 0.0));
    }
}
