//! The graphics device that all renderers of a process share, and the shader on it.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::gpu_error;
use crate::error::{Error, Result};
use crate::render::RendererInfo;
use crate::render::records::Params;

/// The compute shader: `shaders/columns.wgsl`, `spans.wgsl`, `sample.wgsl`, `shade.wgsl` and `panorama.wgsl`, one after the other.
pub const SHADER: &str = concat!(
    include_str!("../../../shaders/columns.wgsl"),
    "\n",
    include_str!("../../../shaders/spans.wgsl"),
    "\n",
    include_str!("../../../shaders/sample.wgsl"),
    "\n",
    include_str!("../../../shaders/shade.wgsl"),
    "\n",
    include_str!("../../../shaders/panorama.wgsl"),
);

/// Formats of the tables that the shader reads as textures.
pub(super) const TABLES: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;
pub(super) const MATERIALS: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
pub(super) const ATLAS: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;

/// What the process has of graphics: making several devices at once has crashed drivers, so that all renderers share one.
static SHARED: Mutex<Option<Arc<Shared>>> = Mutex::new(None);

/// A device and what was made on it once.
#[derive(Debug)]
pub(super) struct Shared {
    pub info: RendererInfo,
    pub software: bool,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// Whether the memory that the shader writes can be read in place, which saves a copy where both are the processor's.
    pub reads_in_place: bool,
    module: wgpu::ShaderModule,
    pub bindings: wgpu::BindGroupLayout,
    layout: wgpu::PipelineLayout,
    pipelines: Mutex<HashMap<Variant, wgpu::ComputePipeline>>,
    /// What the device has complained of since it was last asked.
    complaints: Complaints,
    /// Why the device is gone, once it is.
    pub lost: Arc<OnceLock<String>>,
}

type Complaints = Arc<Mutex<Vec<String>>>;

/// What is compiled into the shader: it then has nothing in its loops that the view does not need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    equal_angle: bool,
    lamps_shine: bool,
    corners_are_dark: bool,
}

impl Variant {
    pub fn of(params: &Params) -> Self {
        Self {
            equal_angle: params.equal_angle != 0,
            lamps_shine: params.lamp_count + params.pane_count > 0,
            corners_are_dark: params.corner_shade > 0.0,
        }
    }

    /// The shader's constants.
    fn constants(self) -> [(&'static str, f64); 3] {
        let Self { equal_angle, lamps_shine, corners_are_dark } = self;
        [("equal_angle", equal_angle), ("lamps_shine", lamps_shine), ("corners_are_dark", corners_are_dark)]
            .map(|(name, value)| (name, f64::from(u8::from(value))))
    }
}

impl Shared {
    /// The shared device, made on first use and again once it was lost.
    pub fn get(software_allowed: bool) -> Result<Arc<Self>> {
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
        let software = !is_hardware(about.device_type);
        let in_place = wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;
        let reads_in_place = software && adapter.features().contains(in_place);
        let required_features = if reads_in_place { in_place } else { wgpu::Features::empty() };
        let required_limits = wgpu::Limits {
            max_storage_buffer_binding_size: most.max_storage_buffer_binding_size,
            max_buffer_size: most.max_buffer_size,
            max_texture_array_layers: most.max_texture_array_layers,
            ..wgpu::Limits::default()
        };
        let request =
            wgpu::DeviceDescriptor { label: Some("wayhome"), required_features, required_limits, ..Default::default() };
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
        let entry =
            |binding: u32, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None };
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let table = |view_dimension, format| wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::ReadOnly,
            format,
            view_dimension,
        };
        let bindings = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("panorama"),
            entries: &[
                entry(0, table(wgpu::TextureViewDimension::D2, TABLES)),
                entry(1, buffer(wgpu::BufferBindingType::Storage { read_only: true })),
                entry(2, buffer(wgpu::BufferBindingType::Uniform)),
                entry(3, table(wgpu::TextureViewDimension::D2, MATERIALS)),
                entry(4, table(wgpu::TextureViewDimension::D2Array, ATLAS)),
                entry(5, buffer(wgpu::BufferBindingType::Storage { read_only: false })),
            ],
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("panorama"),
            bind_group_layouts: &[Some(&bindings)],
            ..Default::default()
        });
        let pipelines = Mutex::default();
        let shared =
            Self { info, software, device, queue, reads_in_place, module, bindings, layout, pipelines, complaints, lost };
        // So that a driver that does not take the shader says so now.
        shared.pipeline(Variant { equal_angle: false, lamps_shine: true, corners_are_dark: false });
        shared.check()?;
        Ok(shared)
    }

    /// The shader for a view; compiled when it is first asked for.
    pub fn pipeline(&self, variant: Variant) -> wgpu::ComputePipeline {
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let make = || {
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("panorama"),
                layout: Some(&self.layout),
                module: &self.module,
                entry_point: Some("render"),
                compilation_options: wgpu::PipelineCompilationOptions { constants: &variant.constants(), ..Default::default() },
                cache: None,
            })
        };
        pipelines.entry(variant).or_insert_with(make).clone()
    }

    /// Turns what the device has complained of into an error.
    pub fn check(&self) -> Result<()> {
        if let Some(why) = self.lost.get() {
            return Err(Error::Gpu(why.clone()));
        }
        let complaints = std::mem::take(&mut *self.complaints.lock().unwrap_or_else(PoisonError::into_inner));
        if complaints.is_empty() { Ok(()) } else { Err(Error::Gpu(complaints.join("; "))) }
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
