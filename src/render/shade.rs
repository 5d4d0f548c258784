//! Colour of a surface where a ray meets it: prefiltered texture times light. The twin of `shaders/shade.wgsl`.
//!
//! Texture coordinates and weights are fixed-point numbers and texels are mixed as integers, so that CPU and GPU agree to the
//! bit once they agree on a coordinate. Red with blue, and green with the unused fourth channel, share a word, 16 bits each.

use super::Scene;
use super::columns::Hit;
use super::frame::{Frame, Lamp};
use super::scene::Material;

/// Least distance from a lamp that counts, squared, m^2: a lamp is no point.
const LAMP_SIZE_SQUARED: f32 = 0.01;
/// Least cosine of incidence that counts in the width of a pixel's footprint.
const LEAST_COSINE: f32 = 0.05;

/// Level of detail, in 1/256 of a level, for a pixel that covers `a_m` by `b_m` of the surface.
///
/// The texture is filtered the same along both axes. Taking the long side would blur surfaces that are seen at a flat angle,
/// the short side would let them flicker; half the long side is the compromise. The logarithm is read off the bits of the
/// number, linear between powers of two: the same on all machines.
pub(super) fn level(material: &Material, a_m: f32, b_m: f32) -> i32 {
    let footprint = (0.5 * a_m.max(b_m)).max(a_m.min(b_m)) * material.texels_per_m;
    let logarithm = (footprint.to_bits() as i32 - 1.0_f32.to_bits() as i32) >> 15;
    logarithm.clamp(0, 256 * material.log2_size as i32)
}

/// A coordinate of a texture, in 1/256 texel of the finest level.
fn fixed(coordinate_m: f32, material: &Material) -> i32 {
    (coordinate_m * material.texels_per_m * 256.0) as i32
}

/// Index in the atlas of the first texel of a level.
fn level_base(material: &Material, level: u32) -> u32 {
    let finest = 2 * material.log2_size;
    material.base + ((4 << finest) - (4 << (finest - 2 * level))) / 3
}

/// Red and blue, then green and alpha.
type Pair = [u32; 2];

fn unpack(texel: u32) -> Pair {
    [texel & 0x00ff_00ff, (texel >> 8) & 0x00ff_00ff]
}

/// `a` and `b` mixed, the share of `b` being `weight`/256.
fn mix(a: Pair, b: Pair, weight: u32) -> Pair {
    let one = |a: u32, b: u32| ((a * (256 - weight) + b * weight + 0x0080_0080) >> 8) & 0x00ff_00ff;
    [one(a[0], b[0]), one(a[1], b[1])]
}

/// One axis of a bilinear sample: two texel numbers and the weight of the second.
#[derive(Debug, Clone, Copy)]
struct Axis {
    first: u32,
    second: u32,
    weight: u32,
}

/// Neighbours along one axis on a level, for a coordinate of the finest level.
fn axis(coordinate: i32, level: u32, log2_size: u32) -> Axis {
    let at = (coordinate >> level) - 128; // texel centres lie at halves
    let mask = (1_u32 << (log2_size - level)) - 1;
    let texel = (at >> 8) as u32;
    Axis { first: texel & mask, second: texel.wrapping_add(1) & mask, weight: (at & 255) as u32 }
}

/// What is fixed on a level while u stays the same: two lines of texels along v.
#[derive(Debug, Clone, Copy)]
struct Lines {
    first: u32,
    second: u32,
    weight: u32,
    level: u32,
    log2_size: u32,
}

impl Lines {
    fn new(material: &Material, level: u32, u: i32) -> Self {
        let base = level_base(material, level);
        let a = axis(u, level, material.log2_size);
        let shift = material.log2_size - level;
        Self {
            first: base + (a.first << shift),
            second: base + (a.second << shift),
            weight: a.weight,
            level,
            log2_size: material.log2_size,
        }
    }

    fn sample(&self, atlas: &[u32], v: i32) -> Pair {
        let b = axis(v, self.level, self.log2_size);
        let texel = |line: u32, k: u32| unpack(atlas[(line + k) as usize]);
        let near = mix(texel(self.first, b.first), texel(self.second, b.first), self.weight);
        let far = mix(texel(self.first, b.second), texel(self.second, b.second), self.weight);
        mix(near, far, b.weight)
    }
}

/// A texture with u and level of detail fixed: what a column sees of an upright surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    material: Material,
    fine: Lines,
    coarse: Lines,
    weight: u32,
}

impl Strip {
    /// `u_m` in metres, `level` from [`level`].
    pub fn new(material: &Material, u_m: f32, level: i32) -> Self {
        let u = fixed(u_m, material);
        let fine = (level >> 8) as u32;
        let coarse = (fine + 1).min(material.log2_size);
        Self {
            material: *material,
            fine: Lines::new(material, fine, u),
            coarse: Lines::new(material, coarse, u),
            weight: (level & 255) as u32,
        }
    }

    /// Colour at `v_m`, in metres.
    pub fn sample(&self, atlas: &[u32], v_m: f32) -> Pair {
        let v = fixed(v_m, &self.material);
        let fine = self.fine.sample(atlas, v);
        if self.weight == 0 { fine } else { mix(fine, self.coarse.sample(atlas, v), self.weight) }
    }
}

/// Irradiance from `lamp` at a point at height `z`, `offset` away from under the lamp, on a surface that faces the lamp with
/// `facing`, the product of its normal with the vector to the lamp.
fn lit(lamp: &Lamp, offset_squared: f32, z: f32, facing: f32) -> f32 {
    let up = lamp.height - z;
    let square = (offset_squared + up * up).max(LAMP_SIZE_SQUARED);
    lamp.intensity * facing.max(0.0) / (square * square.sqrt())
}

/// What a column sees of the side of a hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    strip: Strip,
    /// Horizontal position from the camera, m.
    point: [f32; 2],
    normal: [f32; 2],
    /// Height at which v is 0, m.
    foot: f32,
}

impl Side {
    pub fn new(scene: &Scene, frame: &Frame, hit: &Hit, direction: [f32; 2]) -> Self {
        let material = &scene.materials[hit.surface as usize];
        let cosine = -(hit.normal[0] * direction[0] + hit.normal[1] * direction[1]);
        let across = hit.near * frame.params.pixel_rad;
        let level = level(material, across / cosine.max(LEAST_COSINE), across);
        Self {
            strip: Strip::new(material, hit.u, level),
            point: [hit.near * direction[0], hit.near * direction[1]],
            normal: hit.normal,
            foot: hit.bottom.max(0.0),
        }
    }

    /// Colour at height `z`, before light.
    pub fn colour(&self, scene: &Scene, z: f32) -> Pair {
        self.strip.sample(&scene.atlas, z - self.foot)
    }

    /// Light at the given heights.
    pub fn light(&self, frame: &Frame, z: &[f32], light: &mut [f32]) {
        light.fill(frame.params.ambient);
        for lamp in &frame.lamps {
            let to = [lamp.position[0] - self.point[0], lamp.position[1] - self.point[1]];
            let facing = self.normal[0] * to[0] + self.normal[1] * to[1];
            if facing > 0.0 {
                let offset_squared = to[0] * to[0] + to[1] * to[1];
                for (light, &z) in light.iter_mut().zip(z) {
                    *light += lit(lamp, offset_squared, z, facing);
                }
            }
        }
    }
}

/// A horizontal surface: floor, ceiling, or the top or underside of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    material: Material,
    /// Origin of its texture's axes from the camera, m.
    origin: [f32; 2],
    /// Cosine and sine of their direction.
    heading: [f32; 2],
    /// Height, m.
    z: f32,
    /// 1 where it faces up, -1 where it faces down.
    up: f32,
}

impl Plane {
    /// Floor or ceiling.
    pub fn of_room(scene: &Scene, frame: &Frame, ceiling: bool) -> Self {
        let p = &frame.params;
        let (surface, z, up) = if ceiling { (1, p.room_height, -1.0) } else { (0, 0.0, 1.0) };
        let origin = [-p.camera[0], -p.camera[1]];
        Self { material: scene.materials[surface], origin, heading: [1.0, 0.0], z, up }
    }

    /// Top or underside of the body behind `hit`.
    pub fn of_body(scene: &Scene, frame: &Frame, hit: &Hit, top: bool) -> Self {
        let body = &frame.bodies[(hit.surface - 2 - frame.params.wall_count) as usize];
        let (z, up) = if top { (hit.top, 1.0) } else { (hit.bottom, -1.0) };
        let material = scene.materials[hit.surface as usize];
        Self { material, origin: body.centre, heading: body.heading, z, up }
    }

    /// Colour and light at horizontal distance `t`, which a row of tangent 1/`inverse_tan` meets there.
    pub fn shade(&self, scene: &Scene, frame: &Frame, direction: [f32; 2], t: f32, inverse_tan: f32) -> (Pair, f32) {
        let point = [t * direction[0], t * direction[1]];
        let from = [point[0] - self.origin[0], point[1] - self.origin[1]];
        let [cos, sin] = self.heading;
        let across = t * frame.params.pixel_rad;
        let level = level(&self.material, across * inverse_tan.abs(), across);
        let strip = Strip::new(&self.material, cos * from[0] + sin * from[1], level);
        let colour = strip.sample(&scene.atlas, cos * from[1] - sin * from[0]);
        let mut light = frame.params.ambient;
        for lamp in &frame.lamps {
            let to = [lamp.position[0] - point[0], lamp.position[1] - point[1]];
            light += lit(lamp, to[0] * to[0] + to[1] * to[1], self.z, self.up * (lamp.height - self.z));
        }
        (colour, light)
    }
}

/// Colour times light, packed with red in the lowest byte; opaque.
pub(super) fn pack(colour: Pair, light: f32) -> u32 {
    let channel = |c: u32| (((c & 0xffff) as f32 * light + 0.5).min(255.0)) as u32;
    channel(colour[0]) | channel(colour[1]) << 8 | channel(colour[0] >> 16) << 16 | 0xff00_0000
}
