//! The renderer on a graphics adapter: one compute shader through wgpu.

use std::sync::{Arc, Mutex, mpsc};
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

/// The GPU renderer.
///
/// It keeps its buffers, and the scene that it rendered last, on the device.
#[derive(Debug)]
pub struct GpuRenderer {
    info: RendererInfo,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
    software: bool,
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
    /// What the device has complained of since it was last asked.
    complaints: Complaints,
}

type Complaints = Arc<Mutex<Vec<String>>>;

impl GpuRenderer {
    /// A renderer on the best adapter there is: discrete before integrated before virtual before software.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] where there is none, [`Error::Gpu`] where it does not take the shader.
    pub fn new() -> Result<Self> {
        Self::on(|_| true)
    }

    /// A renderer on a hardware adapter.
    ///
    /// # Errors
    /// As [`GpuRenderer::new`]; [`Error::NoAdapter`] also where all adapters are software.
    pub fn on_hardware() -> Result<Self> {
        Self::on(|kind| kind < 3)
    }

    fn on(allowed: impl Fn(u32) -> bool) -> Result<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let count = adapters.len();
        let adapter = adapters
            .into_iter()
            .filter(|a| allowed(rank(a.get_info().device_type)))
            .min_by_key(|a| rank(a.get_info().device_type))
            .ok_or_else(|| {
                Error::NoAdapter(if count == 0 { "none found".to_owned() } else { format!("{count} found, none of hardware") })
            })?;
        let about = adapter.get_info();
        let software = about.device_type == wgpu::DeviceType::Cpu;
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
        let (device, queue) = pollster::block_on(adapter.request_device(&request)).map_err(|e| Error::Gpu(e.to_string()))?;
        let complaints = Complaints::default();
        let keep = |complaints: &Complaints| {
            let complaints = Arc::clone(complaints);
            move |text: String| {
                if let Ok(mut list) = complaints.lock() {
                    list.push(text);
                }
            }
        };
        let errors = keep(&complaints);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| errors(e.to_string())));
        let lost = keep(&complaints);
        device.set_device_lost_callback(move |reason, text| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                lost(format!("device lost: {text}"));
            }
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
        check(&complaints)?;
        let storage = wgpu::BufferUsages::STORAGE;
        let input = storage | wgpu::BufferUsages::COPY_DST;
        Ok(Self {
            info,
            pipeline,
            software,
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
            device,
            queue,
            complaints,
        })
    }

    /// Refuses what the device cannot hold, before it is asked to.
    fn check_size(&self, scene: &Scene, view: &View<'_>) -> Result<()> {
        let limits = self.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let p = &view.projection;
        let bytes = p.pixels() as u64 * PIXEL_BYTES;
        let columns = limits.max_compute_workgroups_per_dimension.saturating_mul(WORKGROUP);
        if bytes > most || p.width > columns {
            let allowed = format!("up to {} pixels and {columns} columns on {}", most / PIXEL_BYTES, self.info.adapter);
            let found = format!("{} x {} = {} pixels", p.width, p.height, p.pixels());
            return Err(Error::Invalid { what: "panorama size".to_owned(), found, allowed });
        }
        let atlas = 4 * scene.atlas.len() as u64;
        if atlas > most {
            let (found, allowed) = (format!("{atlas} bytes"), format!("up to {most} bytes on {}", self.info.adapter));
            return Err(Error::Invalid { what: "size of all textures".to_owned(), found, allowed });
        }
        Ok(())
    }

    /// Puts scene, tables and room for the picture on the device.
    fn upload(&mut self, scene: &Scene, bytes: u64) {
        let (device, queue, frame) = (&self.device, &self.queue, &self.frame);
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
        let missing = || Error::Gpu("a buffer could not be made".to_owned());
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
        self.bindings = Some(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("panorama"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        }));
        Ok(())
    }

    fn dispatch(&self, bytes: u64) -> Result<()> {
        let (Some(picture), Some(readback)) = (&self.picture.buffer, &self.readback.buffer) else {
            return Err(Error::Gpu("a buffer could not be made".to_owned()));
        };
        let p = &self.frame.params;
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.dispatch_workgroups(p.width.div_ceil(WORKGROUP), p.height.div_ceil(p.rows_per_invocation), 1);
        }
        encoder.copy_buffer_to_buffer(picture, 0, readback, 0, bytes);
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    fn read(&self, view: &View<'_>, bytes: u64, out: &mut Panorama) -> Result<()> {
        let failed = |e: &dyn std::fmt::Display| Error::Gpu(e.to_string());
        let Some(readback) = &self.readback.buffer else {
            return Err(Error::Gpu("a buffer could not be made".to_owned()));
        };
        let (send, receive) = mpsc::channel();
        readback.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            // The receiver is gone only when waiting has failed already.
            let _ = send.send(result);
        });
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: Some(TIMEOUT) };
        self.device.poll(wait).map_err(|e| failed(&e))?;
        check(&self.complaints)?;
        receive.try_recv().map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
        {
            let mapped = readback.get_mapped_range(0..bytes).map_err(|e| failed(&e))?;
            let words: &[u32] = bytemuck::try_cast_slice(&mapped).map_err(|e| failed(&e))?;
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

impl Renderer for GpuRenderer {
    fn render(&mut self, scene: &Scene, view: &View<'_>, out: &mut Panorama) -> Result<()> {
        self.check_size(scene, view)?;
        self.frame.prepare(scene, view)?;
        if !self.software {
            self.frame.params.rows_per_invocation = HARDWARE_ROWS.min(view.projection.height);
        }
        let bytes = view.projection.pixels() as u64 * PIXEL_BYTES;
        self.upload(scene, bytes);
        self.bind()?;
        check(&self.complaints)?;
        self.dispatch(bytes)?;
        self.read(view, bytes, out)
    }

    fn info(&self) -> &RendererInfo {
        &self.info
    }
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

/// Turns what the device has complained of into an error.
fn check(complaints: &Complaints) -> Result<()> {
    let mut list = complaints.lock().map_err(|_| Error::Gpu("an error handler failed".to_owned()))?;
    if list.is_empty() { Ok(()) } else { Err(Error::Gpu(std::mem::take(&mut *list).join("; "))) }
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
