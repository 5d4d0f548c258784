//! The renderer on a graphics adapter: one compute shader through wgpu.

mod device;
mod picture;
mod tables;
mod tiles;

use std::collections::VecDeque;
use std::sync::{Arc, mpsc};
use std::time::Duration;

pub use device::SHADER;
use device::{ATLAS, MATERIALS, Shared, TABLES, Variant};
use picture::{PIXEL_BYTES, Unpacker, bytes_of};
use tables::{Table, Texels};
use tiles::{LAYER_TILES, TILE, tile};

use super::frame::Frame;
use super::records::Row;
use super::{Renderer, RendererInfo, Scene, View};
use crate::error::{Error, Result};
use crate::panorama::Panorama;

/// Invocations of a workgroup, as the shader has them.
const WORKGROUP: u32 = 64;
/// Most rows of a picture, as the shader has them: what fits into a uniform buffer of any device.
const MAX_ROWS: u32 = 4096;
/// Rows of an invocation on hardware, which wants thousands of invocations. A software adapter wants whole columns, to compute
/// a column's hits once.
const HARDWARE_ROWS: u32 = 16;
/// Texels in a row of the textures that hold tables, as the shader has them.
const TABLE_WIDTH: u32 = 1024;
/// Pictures under way at once: one is made, one is on its way back, one is prepared or read.
const IN_FLIGHT: usize = 3;
/// A picture that takes longer has failed.
const TIMEOUT: Duration = Duration::from_secs(60);

/// The GPU renderer.
///
/// All renderers of a process share one device. Each keeps its own buffers there, and the scene that it rendered last. When the
/// device is lost, which is an error of the picture under way and of all later ones, a new renderer makes a new device.
#[derive(Debug)]
pub struct GpuRenderer {
    shared: Arc<Shared>,
    frame: Frame,
    directions: Table,
    rows: Table,
    /// Parameters, edges, bodies and lamps.
    tables: Texels,
    words: Vec<u8>,
    materials: Texels,
    atlas: Texels,
    unpacker: Unpacker,
    /// Most rows of an invocation.
    invocation_rows: u32,
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
    fn new(reads_in_place: bool) -> Self {
        let picture = if reads_in_place { wgpu::BufferUsages::MAP_READ } else { wgpu::BufferUsages::COPY_SRC };
        Self {
            picture: Table::new("picture", wgpu::BufferUsages::STORAGE | picture),
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
    rows: Vec<Row>,
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

    fn slots(reads_in_place: bool) -> Vec<Slot> {
        (0..IN_FLIGHT).map(|_| Slot::new(reads_in_place)).collect()
    }

    fn on(shared: Arc<Shared>) -> Self {
        let reads_in_place = shared.reads_in_place;
        let invocation_rows = if shared.software { u32::MAX } else { HARDWARE_ROWS };
        Self {
            shared,
            invocation_rows,
            frame: Frame::new(),
            directions: Table::new("directions", wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST),
            rows: Table::new("rows", wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            tables: Texels::new("tables", TABLES, [TABLE_WIDTH, 1]),
            words: Vec::new(),
            materials: Texels::new("materials", MATERIALS, [TABLE_WIDTH, 1]),
            atlas: Texels::new("atlas", ATLAS, [TILE as u32, (TILE * LAYER_TILES) as u32]),
            unpacker: Unpacker::default(),
            scene: None,
            slots: Self::slots(reads_in_place),
        }
    }

    /// Refuses what the device cannot hold, before it is asked to.
    fn check_size(&self, view: &View<'_>) -> Result<()> {
        let limits = self.shared.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let p = &view.projection;
        let bytes = bytes_of(p);
        let (of_columns, pixels) = (bytes - p.pixels() as u64 * PIXEL_BYTES, most / PIXEL_BYTES);
        let pixels = pixels.saturating_sub(of_columns / PIXEL_BYTES);
        let columns = limits.max_compute_workgroups_per_dimension.saturating_mul(WORKGROUP);
        if bytes > most || p.width > columns {
            let adapter = &self.shared.info.adapter;
            let allowed = format!("up to {pixels} pixels in that many columns, and {columns} columns, on {adapter}");
            let found = format!("{} x {} = {} pixels", p.width, p.height, p.pixels());
            return Err(Error::Lacking { what: "panorama size".to_owned(), found, needed: allowed });
        }
        if p.height > MAX_ROWS {
            let (found, allowed) = (format!("{} rows", p.height), format!("up to {MAX_ROWS} on a graphics adapter"));
            return Err(Error::Invalid { what: "panorama size".to_owned(), found, allowed });
        }
        Ok(())
    }

    /// Puts scene and tables on the device. What is written here reaches it after the pictures that are under way.
    fn upload(&mut self, scene: &Scene) -> Result<()> {
        let (device, queue, frame) = (&self.shared.device, &self.shared.queue, &self.frame);
        let mut moved = false;
        moved |= self.directions.write(device, queue, bytemuck::cast_slice(&frame.directions));
        moved |= self.rows.reserve(device, u64::from(MAX_ROWS) * size_of::<Row>() as u64);
        moved |= self.rows.write(device, queue, bytemuck::cast_slice(&frame.rows));
        self.words.clear();
        self.words.extend_from_slice(bytemuck::bytes_of(&frame.params));
        self.words.extend_from_slice(bytemuck::cast_slice(&frame.edges));
        self.words.extend_from_slice(bytemuck::cast_slice(&frame.bodies));
        self.words.extend_from_slice(bytemuck::cast_slice(&frame.lamps));
        self.words.extend_from_slice(bytemuck::cast_slice(&frame.looks));
        moved |= self.tables.write(device, queue, &self.words);
        if self.scene != Some(scene.id) {
            let (materials, texels) = tile(scene);
            let most = device.limits().max_texture_array_layers as usize * LAYER_TILES;
            let tiles = texels.len() / (TILE * TILE);
            if tiles > most {
                let found = format!("{tiles} tiles of {TILE} x {TILE} texels");
                let allowed = format!("up to {most} on {}", self.shared.info.adapter);
                return Err(Error::Lacking { what: "textures of all surfaces".to_owned(), found, needed: allowed });
            }
            moved |= self.materials.write(device, queue, bytemuck::cast_slice(&materials));
            moved |= self.atlas.write(device, queue, bytemuck::cast_slice(&texels));
            self.scene = Some(scene.id);
        }
        if moved {
            self.slots.iter_mut().for_each(|slot| slot.bindings = None);
        }
        Ok(())
    }

    /// The bindings of a slot, in which room is made for `bytes`.
    fn bind(&mut self, slot: usize, bytes: u64) -> Result<&wgpu::BindGroup> {
        let Shared { device, reads_in_place, bindings: layout, .. } = &*self.shared;
        let place = &mut self.slots[slot];
        if !reads_in_place {
            place.readback.reserve(device, bytes);
        }
        if place.picture.reserve(device, bytes) {
            place.bindings = None;
        }
        if place.bindings.is_none() {
            let buffer = |table: &Table| table.buffer.clone().ok_or_else(missing);
            let buffers = [buffer(&self.directions)?, buffer(&self.rows)?, buffer(&place.picture)?];
            let view = |texels: &Texels| texels.view().ok_or_else(missing);
            let textures = [view(&self.tables)?, view(&self.materials)?, view(&self.atlas)?];
            let [directions, rows, picture] = buffers.each_ref().map(wgpu::Buffer::as_entire_binding);
            let [tables, materials, atlas] = textures.each_ref().map(wgpu::BindingResource::TextureView);
            let resources = [tables, directions, rows, materials, atlas, picture];
            let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
            let entries: Vec<_> = (0_u32..).zip(resources).map(entry).collect();
            let descriptor = wgpu::BindGroupDescriptor { label: Some("panorama"), layout, entries: &entries };
            place.bindings = Some(device.create_bind_group(&descriptor));
        }
        place.bindings.as_ref().ok_or_else(missing)
    }

    /// The buffer of a slot that is read.
    fn readable(&self, slot: usize) -> Result<&wgpu::Buffer> {
        let place = &self.slots[slot];
        let table = if self.shared.reads_in_place { &place.picture } else { &place.readback };
        table.buffer.as_ref().ok_or_else(missing)
    }

    /// Starts a picture and its way back.
    fn start(&mut self, scene: &Scene, view: &View<'_>, slot: usize) -> Result<Under> {
        self.shared.check()?;
        self.check_size(view)?;
        self.frame.prepare(scene, view)?;
        self.frame.params.rows_per_invocation = self.invocation_rows.min(view.projection.height);
        let bytes = bytes_of(&view.projection);
        self.upload(scene)?;
        let p = self.frame.params;
        let shared = Arc::clone(&self.shared);
        let pipeline = shared.pipeline(Variant::of(&p));
        let bindings = self.bind(slot, bytes)?;
        shared.check()?;
        let mut encoder = shared.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(p.width.div_ceil(WORKGROUP), p.height.div_ceil(p.rows_per_invocation), 1);
        }
        let readable = self.readable(slot)?;
        if let (false, Some(picture)) = (shared.reads_in_place, &self.slots[slot].picture.buffer) {
            encoder.copy_buffer_to_buffer(picture, 0, readable, 0, bytes);
        }
        let submission = shared.queue.submit([encoder.finish()]);
        let (send, arrived) = mpsc::channel();
        readable.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            // The receiver is gone only when waiting has failed already.
            let _ = send.send(result);
        });
        Ok(Under { submission, arrived, bytes, rows: self.frame.rows.clone() })
    }

    /// Waits for a picture and unpacks it.
    fn finish(&mut self, under: Under, slot: usize, view: &View<'_>, out: &mut Panorama) -> Result<()> {
        let wait = wgpu::PollType::Wait { submission_index: Some(under.submission), timeout: Some(TIMEOUT) };
        let polled = self.shared.device.poll(wait);
        self.shared.check()?;
        polled.map_err(|e| gpu_error(&e))?;
        // Another renderer's thread may be the one to tell, a moment later.
        under.arrived.recv_timeout(TIMEOUT).map_err(|e| gpu_error(&e))?.map_err(|e| gpu_error(&e))?;
        let readback = self.readable(slot)?.clone();
        {
            let mapped = readback.get_mapped_range(0..under.bytes).map_err(|e| gpu_error(&e))?;
            out.reshape(view.projection)?;
            self.unpacker.unpack(&mapped, &under.rows, out)?;
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
            self.slots = Self::slots(self.shared.reads_in_place);
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

#[cfg(test)]
mod tests {
    use std::sync::{Mutex, PoisonError};

    use super::*;
    use crate::world::World;

    /// One test at a time: they share a device, and one of them destroys it.
    static DEVICE: Mutex<()> = Mutex::new(());

    /// A renderer; where there is no adapter this says so loudly, and fails if it must not be so.
    fn renderer() -> Option<GpuRenderer> {
        match GpuRenderer::new() {
            Ok(renderer) => Some(renderer),
            Err(Error::NoAdapter(why)) => {
                eprintln!("\n*** NOT RUN: there is no graphics adapter ({why}) ***\n");
                assert!(std::env::var("WAYHOME_REQUIRE_GPU").as_deref() != Ok("1"), "WAYHOME_REQUIRE_GPU is 1");
                None
            }
            Err(error) => panic!("{error}"),
        }
    }

    /// What hardware renders: columns in pieces, which cut spans anywhere.
    #[test]
    fn pieces_of_columns_are_the_same_picture() {
        let _alone = DEVICE.lock().unwrap_or_else(PoisonError::into_inner);
        let (Some(mut whole), Some(mut pieces)) = (renderer(), renderer()) else { return };
        (whole.invocation_rows, pieces.invocation_rows) = (u32::MAX, 7);
        for name in ["crowd", "gallery", "proving-ground"] {
            let world = World::open(name).unwrap();
            let (scene, bodies) = (Scene::new(&world).unwrap(), world.body_poses());
            let view = View { projection: world.projection_of_size(500, 90), robot: world.home, bodies: &bodies };
            let (mut a, mut b) = (Panorama::empty(), Panorama::empty());
            whole.render(&scene, &view, &mut a).unwrap();
            pieces.render(&scene, &view, &mut b).unwrap();
            assert!(a == b, "{name}");
        }
    }

    #[test]
    fn a_device_lost_in_a_batch_is_an_error_and_the_next_renderer_works() {
        let _alone = DEVICE.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(mut renderer) = renderer() else { return };
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
