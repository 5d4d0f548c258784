//! A world packed for rendering: the same for both renderers, and the same for every view.

use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::texture;
use crate::error::Result;
use crate::geometry::Vector2;
use crate::panorama::INSTANCE_FIRST_WALL;
use crate::world::spec::LampSpec;
use crate::world::{Footprint, TextureSpec, World};

/// Where a surface's texture lies in the atlas. The layout is that of `Material` in `shaders/shade.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct Material {
    /// Index in the atlas of the first texel of the finest level.
    pub base: u32,
    /// Binary logarithm of the finest level's edge length in texels. The coarser levels follow, down to one texel.
    pub log2_size: u32,
    /// Texels of the finest level per metre of surface.
    pub texels_per_m: f32,
    /// Fills up to 16 bytes.
    pub padding: u32,
}

/// A body as far as its pose does not matter.
#[derive(Debug, Clone)]
pub(super) struct Prism {
    /// Footprint in the body's own frame.
    pub footprint: Footprint,
    /// Height of the underside, m.
    pub bottom_m: f64,
    /// Height of the top, m.
    pub top_m: f64,
}

/// A world packed for rendering: geometry, materials and textures, the same for both renderers.
///
/// Surfaces are numbered like instances, from 0: the floor is surface 0 and instance 1, the ceiling surface 1 and instance 2,
/// then the walls and then the bodies.
///
/// Textures are laid out in metres. On a wall u runs from its first corner to its second and v up from the floor, so that a
/// wall longer than its texture's period shows the pattern again after each period. On a body u runs anti-clockwise around
/// the footprint, from the first corner or from the body's own x axis, and v up from the underside. Floor and ceiling take the
/// room's x and y, tops and undersides of bodies the body's own.
#[derive(Debug)]
pub struct Scene {
    /// Tells scenes apart, so that a renderer knows which one it holds on its device.
    pub(super) id: u64,
    pub(super) outline: Vec<Vector2<f64>>,
    pub(super) bodies: Vec<Prism>,
    pub(super) room_height_m: f64,
    pub(super) camera_height_m: f64,
    pub(super) ambient: f64,
    pub(super) lamps: Vec<LampSpec>,
    /// One material per surface.
    pub(super) materials: Vec<Material>,
    /// Texels, red in the lowest byte; see [`texture`] for the layout of a texture within.
    pub(super) atlas: Vec<u32>,
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
        let textures: Vec<&TextureSpec> = [&world.floor_texture, &world.ceiling_texture]
            .into_iter()
            .chain(&world.wall_textures)
            .chain(world.bodies.iter().map(|b| &b.texture))
            .collect();
        let (materials, atlas) = pack(&textures);
        Ok(Self {
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            outline: world.outline.clone(),
            bodies: world
                .bodies
                .iter()
                .map(|b| Prism { footprint: b.footprint.clone(), bottom_m: b.bottom_m, top_m: b.top_m })
                .collect(),
            room_height_m: world.spec.room.height_m,
            camera_height_m: world.spec.camera.height_m,
            ambient: world.spec.light.ambient,
            lamps: world.spec.light.lamps.clone(),
            materials,
            atlas,
        })
    }

    /// Number of bodies: how many poses a [`super::View`] has to give.
    #[must_use]
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }
}

/// Texels after the last texture, for vectors that read beyond a line that they need a part of.
const PADDING: usize = 16;

/// Bakes every texture once, also where several surfaces share it.
fn pack(textures: &[&TextureSpec]) -> (Vec<Material>, Vec<u32>) {
    let mut distinct: Vec<&TextureSpec> = Vec::new();
    let which: Vec<usize> = textures
        .iter()
        .map(|&t| {
            distinct.iter().position(|&d| d == t).unwrap_or_else(|| {
                distinct.push(t);
                distinct.len() - 1
            })
        })
        .collect();
    let sizes = texture::log2_sizes(&distinct);
    let baked: Vec<texture::Baked> = distinct.par_iter().zip(sizes).map(|(t, n)| texture::bake(t, n)).collect();
    let mut atlas = Vec::with_capacity(baked.iter().map(|b| b.texels.len()).sum::<usize>() + PADDING);
    let packed: Vec<Material> = baked
        .iter()
        .zip(&distinct)
        .map(|(b, t)| {
            let base = atlas.len() as u32;
            atlas.extend_from_slice(&b.texels);
            let texels_per_m = (f64::from(1_u32 << b.log2_size) / t.period_m) as f32;
            Material { base, log2_size: b.log2_size, texels_per_m, padding: 0 }
        })
        .collect();
    atlas.resize(atlas.len() + PADDING, 0);
    (which.into_iter().map(|k| packed[k]).collect(), atlas)
}
