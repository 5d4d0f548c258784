//! The renderer on a graphics adapter: one compute shader through wgpu.

use std::sync::{Arc, Mutex, OnceLock, PoisonError, mpsc};
use std::time::Duration;

use wgpu::util::DeviceExt;

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
/// All renderers of a process share one device. Each keeps its own buffers there, and the scene that it rendered last.
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
    /// Materials and atlas of the scene of this id.
    scene: Option<(u64, wgpu::Buffer, wgpu::Buffer)>,
    picture: Table,
    readback: Table,
    bindings: Option<wgpu::BindGroup>,
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
        let storage = wgpu::BufferUsages::STORAGE;
        let input = storage | wgpu::BufferUsages::COPY_DST;
        Self {
            shared,
            frame: Frame::new(),
            params: Table::new("params", wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            directions: Table::new("directions", input),
            rows: Table::new("rows", input),
            edges: Table::new("edges", input),
            bodies: Table::new("bodies", input),
            lamps: Table::new("lamps", input),
            scene: None,
            picture: Table::new("picture", storage | wgpu::BufferUsages::COPY_SRC),
            readback: Table::new("readback", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            bindings: None,
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

    /// Puts scene, tables and room for the picture on the device.
    fn upload(&mut self, scene: &Scene, bytes: u64) {
        let (device, queue, frame) = (&self.shared.device, &self.shared.queue, &self.frame);
        let mut moved = false;
        moved |= self.params.write(device, queue, bytemuck::bytes_of(&frame.params));
        moved |= self.directions.write(device, queue, bytemuck::cast_slice(&frame.directions));
        moved |= self.rows.write(device, queue, bytemuck::cast_slice(&frame.rows));
        moved |= self.edges.write(device, queue, bytemuck::cast_slice(&frame.edges));
        moved |= self.bodies.write(device, queue, bytemuck::cast_slice(&frame.bodies));
        moved |= self.lamps.write(device, queue, bytemuck::cast_slice(&frame.lamps));
        moved |= self.picture.reserve(device, bytes);
        self.readback.reserve(device, bytes);
        if self.scene.as_ref().is_none_or(|s| s.0 != scene.id) {
            let buffer = |label, contents| {
                let usage = wgpu::BufferUsages::STORAGE;
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
            };
            let materials = buffer("materials", bytemuck::cast_slice(&scene.materials));
            let atlas = buffer("atlas", bytemuck::cast_slice(&scene.atlas));
            self.scene = Some((scene.id, materials, atlas));
            moved = true;
        }
        if moved {
            self.bindings = None;
        }
    }

    fn bind(&mut self) -> Result<()> {
        if self.bindings.is_some() {
            return Ok(());
        }
        let (_, materials, atlas) = self.scene.as_ref().ok_or_else(missing)?;
        let tables = [&self.params, &self.directions, &self.rows, &self.edges, &self.bodies, &self.lamps];
        let mut buffers = Vec::with_capacity(9);
        for table in tables {
            buffers.push(table.buffer.as_ref().ok_or_else(missing)?);
        }
        buffers.extend([materials, atlas, self.picture.buffer.as_ref().ok_or_else(missing)?]);
        let entries: Vec<_> = (0_u32..)
            .zip(&buffers)
            .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
            .collect();
        self.bindings = Some(self.shared.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("panorama"),
            layout: &self.shared.pipeline.get_bind_group_layout(0),
            entries: &entries,
        }));
        Ok(())
    }

    /// Starts a picture and its way back; the receiver hears when it has arrived.
    fn dispatch(&self, bytes: u64) -> Result<(wgpu::SubmissionIndex, MapOutcome)> {
        let (Some(picture), Some(readback)) = (&self.picture.buffer, &self.readback.buffer) else {
            return Err(missing());
        };
        let p = &self.frame.params;
        let mut encoder = self.shared.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.shared.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.dispatch_workgroups(p.width.div_ceil(WORKGROUP), p.height.div_ceil(p.rows_per_invocation), 1);
        }
        encoder.copy_buffer_to_buffer(picture, 0, readback, 0, bytes);
        let submission = self.shared.queue.submit([encoder.finish()]);
        let (send, receive) = mpsc::channel();
        readback.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            // The receiver is gone only when waiting has failed already.
            let _ = send.send(result);
        });
        Ok((submission, receive))
    }

    fn read(&self, view: &View<'_>, bytes: u64, out: &mut Panorama) -> Result<()> {
        let (submission, arrived) = self.dispatch(bytes)?;
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(TIMEOUT) };
        let polled = self.shared.device.poll(wait);
        self.shared.check()?;
        polled.map_err(|e| gpu_error(&e))?;
        // Another renderer's thread may be the one to tell, a moment later.
        arrived.recv_timeout(TIMEOUT).map_err(|e| gpu_error(&e))?.map_err(|e| gpu_error(&e))?;
        let readback = self.readback.buffer.as_ref().ok_or_else(missing)?;
        {
            let mapped = readback.get_mapped_range(0..bytes).map_err(|e| gpu_error(&e))?;
            let words: &[u32] = bytemuck::try_cast_slice(&mapped).map_err(|e| gpu_error(&e))?;
            let pixels = view.projection.pixels();
            out.projection = view.projection;
            out.rgba.clear();
            out.rgba.extend_from_slice(bytemuck::cast_slice(&words[..pixels]));
            out.range_m.clear();
            out.range_m.extend_from_slice(bytemuck::cast_slice(&words[pixels..2 * pixels]));
            out.instance.clear();
            out.instance.extend(words[2 * pixels..3 * pixels].iter().map(|&id| id as u16));
        }
        readback.unmap();
        Ok(())
    }
}

/// What mapping a buffer came to.
type MapOutcome = mpsc::Receiver<std::result::Result<(), wgpu::BufferAsyncError>>;

fn gpu_error(e: &dyn std::fmt::Display) -> Error {
    Error::Gpu(e.to_string())
}

fn missing() -> Error {
    Error::Gpu("a buffer could not be made".to_owned())
}

impl Renderer for GpuRenderer {
    fn render(&mut self, scene: &Scene, view: &View<'_>, out: &mut Panorama) -> Result<()> {
        self.check_size(scene, view)?;
        self.frame.prepare(scene, view)?;
        if !self.shared.software {
            self.frame.params.rows_per_invocation = HARDWARE_ROWS.min(view.projection.height);
        }
        let bytes = view.projection.pixels() as u64 * PIXEL_BYTES;
        self.upload(scene, bytes);
        self.bind()?;
        self.shared.check()?;
        self.read(view, bytes, out).inspect_err(|_| {
            // Who knows what state it is in.
            self.readback.buffer = None;
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
