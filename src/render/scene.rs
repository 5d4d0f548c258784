//! A world packed for rendering: the same for both renderers, and the same for every view.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::huge_pages;
use super::inner::InnerWalls;
use super::texture::{self, Surface};
use super::visible::Index;
use crate::error::Result;
use crate::geometry::Vector2;
use crate::panorama::INSTANCE_FIRST_WALL;
use crate::world::spec::{LampSpec, LightFactors};
use crate::world::{Body, Footprint, LightPreset, Window, World};

/// Most levels of a texture.
pub(super) const LEVELS: usize = texture::FINEST as usize + 1;

/// Where a surface's texture lies in the atlas. `material_at` of `shaders/sample.wgsl`
/// reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct Material {
    /// Tiles per metre of surface, along u and v. They differ for images that are not square.
    pub tiles_per_m: [f32; 2],
    /// Number of the coarsest level, of one texel.
    pub last_level: u32,
    /// Height from which v is counted on an upright surface, m.
    pub foot_m: f32,
    /// Each about a quarter of an octave coarser than the one before.
    pub levels: [MipLevel; LEVELS],
}

/// A level of a texture: a square of texels, v fastest, with a border in which the tile goes on.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct MipLevel {
    /// Index in the atlas of the first texel of the border; on a graphics device the number of its first tile.
    pub base: u32,
    /// Texels along an edge, the border not counted.
    pub size: u32,
}

impl MipLevel {
    /// Texels along an edge, the border counted.
    #[inline(always)]
    pub fn pitch(self) -> u32 {
        self.size + 2
    }

    /// Index in the atlas of texel (u, v), from -1 on.
    #[inline(always)]
    pub fn place(self, u: u32, v: u32) -> u32 {
        self.base + u.wrapping_add(1) * self.pitch() + v.wrapping_add(1)
    }
}

/// A body as far as its pose does not matter.
#[derive(Debug, Clone)]
pub(super) struct Prism {
    /// Name, for messages.
    pub name: String,
    /// Footprint in the body's own frame.
    pub footprint: Footprint,
    /// Height of the underside, m.
    pub bottom_m: f64,
    /// Height of the top, m.
    pub top_m: f64,
    /// Light that it gives off.
    pub glow: f64,
}

/// A piece of a window, small enough to shine from its middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pane {
    /// Middle: x, y, z, m.
    pub position_m: [f64; 3],
    /// Unit normal into the room.
    pub normal: [f64; 2],
    /// Area, m^2.
    pub area_m2: f64,
    /// Irradiance that a square metre makes on a facing surface 1 m away.
    pub brightness: f64,
}

/// What shines in a room.
#[derive(Debug, Clone)]
pub(super) struct SceneLight {
    pub ambient: f64,
    pub lamps: Vec<LampSpec>,
    pub panes: Vec<Pane>,
    /// Share of ambient light that does not reach corners.
    pub corner_shade: f64,
    /// How far from a corner that begins, m.
    pub corner_reach_m: f64,
}

/// Largest edge of a piece of a window, m.
const PIECE_M: f64 = 0.8;
/// Most pieces along an edge of a window.
const MOST_PIECES: f64 = 4.0;

/// A world packed for rendering: geometry, materials and textures, the same for both renderers.
///
/// Surfaces are numbered like instances, from 0: the floor is surface 0 and instance 1, the ceiling surface 1 and instance 2,
/// then the walls, the bodies, the windows, and two for each wall inside the room: its right side and its faces across, and its
/// left side.
///
/// Textures are laid out in metres. On a wall u runs from its first corner to its second and v up from the floor, so that a
/// wall longer than its texture's period shows the pattern again after each period. On a body u runs anti-clockwise around
/// the footprint, from the first corner or from the body's own x axis, and v up from the underside. Floor and ceiling take the
/// room's x and y, tops and undersides of bodies the body's own. Windows are thin prisms on their walls. On a wall inside the room
/// u runs along its right side from its beginning, along its left side from its end, and v up from the floor, whatever is open.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Tells textures of scenes apart, so that a renderer knows which ones it holds on its device.
    #[cfg_attr(not(feature = "gpu"), allow(dead_code, reason = "graphics adapters alone hold textures"))]
    pub(super) id: u64,
    pub(super) outline: Vec<Vector2<f64>>,
    pub(super) bodies: Vec<Prism>,
    /// Panes of windows, around the room's origin.
    pub(super) windows: Vec<Prism>,
    /// What walls inside the room consist of.
    pub(super) inner: Arc<InnerWalls>,
    /// Walls by place, where there are many.
    pub(super) index: Option<Arc<Index>>,
    pub(super) room_height_m: f64,
    pub(super) camera_height_m: f64,
    /// Position of the camera on the robot, m.
    pub(super) camera_offset_m: Vector2<f64>,
    /// What could shine, ...
    pub(super) light: Arc<SceneLight>,
    /// ... and how much of it does, exposure included.
    pub(super) factors: LightFactors,
    /// One material per surface.
    pub(super) materials: Arc<Vec<Material>>,
    /// Texels, red in the lowest byte; see [`texture`] for the layout of a texture within.
    pub(super) atlas: Arc<Vec<u32>>,
}

impl Scene {
    /// Packs a world: bakes the textures of all its surfaces.
    ///
    /// # Errors
    /// None at present; a world that loaded can be packed.
    pub fn new(world: &World) -> Result<Self> {
        static NEXT_ID: AtomicU64 = AtomicU64::new(1);
        debug_assert!(
            world
                .bodies
                .iter()
                .enumerate()
                .all(|(k, b)| { usize::from(b.instance) == usize::from(INSTANCE_FIRST_WALL) + world.outline.len() + k }),
            "instance ids follow the order of surfaces"
        );
        // Seen from the room, u runs from right to left along a wall, and along x over a ceiling.
        let mirrored = [(&world.floor_texture, false), (&world.ceiling_texture, true)];
        let surfaces: Vec<Surface<'_>> = mirrored
            .into_iter()
            .chain(world.wall_textures.iter().map(|t| (t, true)))
            .chain(world.bodies.iter().map(|b| (&b.texture, false)))
            .chain(world.windows.iter().map(|w| (&w.texture, false)))
            .chain(world.partitions.iter().flat_map(|p| [(&p.texture, false); 2]))
            .map(|(texture, mirrored)| Surface::new(texture, mirrored))
            .collect();
        let (mut materials, atlas) = pack(&surfaces);
        let first_body = 2 + world.outline.len();
        let feet = world.bodies.iter().map(|b| b.bottom_m).chain(world.windows.iter().map(|w| w.bottom_m));
        let feet = feet.chain(world.partitions.iter().flat_map(|p| [0.0, -p.left_rise_m]));
        for (material, foot_m) in materials[first_body..].iter_mut().zip(feet) {
            material.foot_m = foot_m as f32;
        }
        let body = |b: &Body| Prism {
            name: b.name.clone(),
            footprint: b.footprint.clone(),
            bottom_m: b.bottom_m,
            top_m: b.top_m,
            glow: b.glow,
        };
        let window = |w: &Window| Prism {
            name: w.name.clone(),
            footprint: Footprint::Polygon(w.footprint.clone()),
            bottom_m: w.bottom_m,
            top_m: w.top_m,
            glow: std::f64::consts::PI * w.brightness,
        };
        let inner = InnerWalls::new(world, materials.len() - 2 * world.partitions.len());
        let walls = (0..world.outline.len()).map(|k| world.wall(k).into()).chain(inner.faces.iter().map(|f| [f.a, f.b]));
        let blocks = inner.blocks.iter().map(|block| block.sides.map(|side| side.a));
        let index = Index::new(walls, blocks, inner.solids.iter().map(|(_, corners, _)| corners)).map(Arc::new);
        let [forward, left] = world.spec.camera.offset_m;
        let light = &world.spec.light;
        let scene = Self {
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            outline: world.outline.clone(),
            bodies: world.bodies.iter().map(body).collect(),
            windows: world.windows.iter().map(window).collect(),
            index,
            inner: Arc::new(inner),
            room_height_m: world.spec.room.height_m,
            camera_height_m: world.spec.camera.height_m,
            camera_offset_m: Vector2::new(forward, left),
            light: Arc::new(SceneLight {
                ambient: light.ambient,
                lamps: light.lamps.clone(),
                panes: world.windows.iter().flat_map(panes).collect(),
                corner_shade: light.corner_shade,
                corner_reach_m: light.corner_reach_m,
            }),
            factors: LightPreset::Day.factors(),
            materials: Arc::new(materials),
            atlas: Arc::new(atlas),
        };
        Ok(scene.under(light.preset, world.spec.camera.optics.exposure))
    }

    /// The same scene under other light and exposure. Textures are shared, with a graphics device's copy too.
    #[must_use]
    pub fn under(&self, light: LightPreset, exposure: f64) -> Self {
        let f = light.factors();
        let factors = LightFactors { ambient: exposure * f.ambient, lamps: exposure * f.lamps, windows: exposure * f.windows };
        Self { factors, ..self.clone() }
    }

    /// Number of bodies: how many poses a [`super::View`] has to give.
    #[must_use]
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }
}

/// Cuts a window into pieces that are small beside the distances in a room.
fn panes(window: &Window) -> impl Iterator<Item = Pane> {
    let corner = |k: usize| window.footprint.get(k).copied().unwrap_or_default();
    let (first, along, high) = (corner(0), corner(1) - corner(0), window.top_m - window.bottom_m);
    let width = (along.x * along.x + along.y * along.y).sqrt().max(1e-9);
    let normal = [-along.y / width, along.x / width].map(|x| -x);
    let pieces = |length: f64| libm::ceil(length / PIECE_M).clamp(1.0, MOST_PIECES);
    let (columns, rows) = (pieces(width), pieces(high));
    let (bottom, brightness) = (window.bottom_m, window.brightness);
    (0..(columns * rows) as usize).map(move |k| {
        let (column, row) = (k / rows as usize, k % rows as usize);
        let at = first + along * ((column as f64 + 0.5) / columns);
        Pane {
            position_m: [at.x, at.y, bottom + high * (row as f64 + 0.5) / rows],
            normal,
            area_m2: width * high / (columns * rows),
            brightness,
        }
    })
}

/// Texels after the last texture, for vectors that read beyond a line that they need a part of.
const PADDING: usize = 32;

/// Bakes every texture once, also where several surfaces share it.
fn pack(surfaces: &[Surface<'_>]) -> (Vec<Material>, Vec<u32>) {
    let mut distinct: Vec<Surface<'_>> = Vec::new();
    let mut known: HashMap<_, Vec<usize>> = HashMap::new();
    let which: Vec<usize> = surfaces
        .iter()
        .map(|&s| {
            // Few surfaces share colour, seed and period without being the same.
            let alike = known.entry((s.texture.colour, s.texture.seed, s.texture.period_m.map(f64::to_bits))).or_default();
            alike.iter().copied().find(|&k| distinct[k] == s).unwrap_or_else(|| {
                distinct.push(s);
                alike.push(distinct.len() - 1);
                distinct.len() - 1
            })
        })
        .collect();
    let fineness = texture::fineness(distinct.iter().map(|s| s.texture));
    let lengths: Vec<usize> = fineness.iter().map(|&f| texture::texels(f)).collect();
    let mut atlas = huge_pages::zeroed(lengths.iter().sum::<usize>() + PADDING);
    let (mut places, mut rest) = (Vec::with_capacity(distinct.len()), atlas.as_mut_slice());
    for &length in &lengths {
        let (place, after) = rest.split_at_mut(length);
        places.push(place);
        rest = after;
    }
    let bake = |((surface, fineness), place): ((&Surface<'_>, u32), &mut [u32])| texture::bake(surface, fineness, place);
    let baked: Vec<texture::Baked> = distinct.par_iter().zip(fineness).zip(places).map(bake).collect();
    let mut base = 0;
    let mut packed: Vec<Material> = Vec::with_capacity(distinct.len());
    for (b, s) in baked.iter().zip(&distinct) {
        let tiles_per_m = [0, 1].map(|axis| (1.0 / (s.texture.period_m[axis] * f64::from(b.periods[axis]))) as f32);
        let mut levels = [MipLevel { base, size: 1 }; LEVELS];
        for (level, &size) in levels.iter_mut().zip(&b.sizes) {
            *level = MipLevel { base, size };
            base += level.pitch() * level.pitch();
        }
        packed.push(Material { tiles_per_m, last_level: b.sizes.len() as u32 - 1, foot_m: 0.0, levels });
    }
    (which.into_iter().map(|k| packed[k]).collect(), atlas)
}
