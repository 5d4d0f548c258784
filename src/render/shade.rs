//! Colour of a surface where rays meet it: texture times light. The twin of `shaders/shade.wgsl`.
//!
//! Light is Lambert's: each lamp's inverse-square irradiance times the cosine of incidence, and the ambient light. There are no
//! shadows and no reflections.

use std::ops::Range;

use super::Scene;
use super::columns::Hit;
use super::frame::{Frame, Lamp, Row};
use super::sample::{RUN, Strip, fixed, level, sample_points};
use super::scene::Material;

/// Least distance from a lamp that counts, squared, m^2: a lamp is no point.
const LAMP_SIZE_SQUARED: f32 = 0.01;
/// Least cosine of incidence that counts in the width of a pixel's footprint.
const LEAST_COSINE: f32 = 0.05;

/// Irradiance from `lamp` at height `z`, at a horizontal distance from the lamp of which the square is given, on a surface that
/// faces the lamp with `facing`, the product of its normal with the vector to the lamp.
fn lit(lamp: &Lamp, offset_squared: f32, z: f32, facing: f32) -> f32 {
    let up = lamp.height - z;
    let square = offset_squared + up * up;
    let square = if square > LAMP_SIZE_SQUARED { square } else { LAMP_SIZE_SQUARED };
    lamp.intensity * facing / (square * square.sqrt())
}

/// Multiplies colours with light. Light is rounded to 1/4096, at most 16, and the product is one of integers. The lengths are
/// equal, and multiples of four.
fn light_up(colours: &mut [u32], light: &[f32]) {
    for (colours, light) in colours.as_chunks_mut::<4>().0.iter_mut().zip(light.as_chunks::<4>().0) {
        let factors = light.map(|l| {
            let scaled = l * 4096.0;
            let factor = (if scaled < 65535.0 { scaled } else { 65535.0 }) as i32 as u32;
            factor | factor << 16
        });
        let factors: [u16; 8] = bytemuck::cast(factors);
        let lit = |two_channels: [u32; 4]| -> [u32; 4] {
            let channels: [u16; 8] = bytemuck::cast(two_channels);
            let product = |k: usize| ((u32::from(channels[k] * 16 + 8) * u32::from(factors[k])) >> 16) as u16;
            bytemuck::cast(std::array::from_fn::<u16, 8, _>(|k| product(k).min(255)))
        };
        let red_blue = lit(colours.map(|c| c & 0x00ff_00ff));
        let green = lit(colours.map(|c| (c >> 8) & 0x00ff_00ff));
        *colours = std::array::from_fn(|k| red_blue[k] | green[k] << 8 | 0xff00_0000);
    }
}

/// Colours of a run of rows that see the side of a hit.
pub(super) fn shade_side(scene: &Scene, frame: &Frame, hit: &Hit, direction: [f32; 2], rows: &[Row], out: &mut [u32; RUN]) {
    let material = &scene.materials[hit.surface as usize];
    // Whole quads; what lies past the end is computed for nothing.
    let count = rows.len().next_multiple_of(4);
    let mut z = [0.0; RUN];
    for (z, row) in z.iter_mut().zip(rows) {
        *z = frame.params.camera_height + hit.near * row.tan;
    }
    let lowest = z[rows.len() - 1];
    z[rows.len()..count].fill(lowest);
    let z = &z[..count];
    // What the rows have in common: u and level of detail, and where the lamps stand.
    let cosine = -(hit.normal[0] * direction[0] + hit.normal[1] * direction[1]);
    let across = hit.near * frame.params.pixel_rad;
    let level = level(material, across / cosine.max(LEAST_COSINE), across);
    let foot = hit.bottom.max(0.0);
    let mut v = [0; RUN];
    for (v, z) in v.iter_mut().zip(z) {
        *v = fixed(z - foot, material);
    }
    Strip::new(material, hit.u, level).sample(&scene.atlas, &v[..count], &mut out[..count]);
    let mut light = [0.0; RUN];
    let light = &mut light[..count];
    light.fill(frame.params.ambient);
    for lamp in &frame.lamps {
        let to = [lamp.position[0] - hit.near * direction[0], lamp.position[1] - hit.near * direction[1]];
        let facing = hit.normal[0] * to[0] + hit.normal[1] * to[1];
        if facing > 0.0 {
            let offset_squared = to[0] * to[0] + to[1] * to[1];
            for (light, &z) in light.iter_mut().zip(z) {
                *light += lit(lamp, offset_squared, z, facing);
            }
        }
    }
    light_up(&mut out[..count], light);
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
    /// Floor (surface 0), ceiling (surface 1), or the top or underside of a body.
    pub fn new(scene: &Scene, frame: &Frame, surface: u32, underside: bool) -> Self {
        let p = &frame.params;
        let material = scene.materials[surface as usize];
        let up = if underside { -1.0 } else { 1.0 };
        if surface < 2 {
            let z = if underside { p.room_height } else { 0.0 };
            return Self { material, origin: [-p.camera[0], -p.camera[1]], heading: [1.0, 0.0], z, up };
        }
        let body = &frame.bodies[(surface - 2 - p.wall_count) as usize];
        let z = if underside { body.bottom } else { body.top };
        Self { material, origin: body.centre, heading: body.heading, z, up }
    }

    /// Colours of the columns `wanted` of a row that sees it, at horizontal distance `t`; those of the others are void.
    pub fn shade<const N: usize>(
        &self,
        scene: &Scene,
        frame: &Frame,
        [x, y]: &[[f32; N]; 2],
        t: f32,
        inverse_tan: f32,
        wanted: Range<usize>,
    ) -> [u32; N] {
        let [cos, sin] = self.heading;
        let across = t * frame.params.pixel_rad;
        let level = level(&self.material, across * inverse_tan.abs(), across);
        let from = |k: usize| [t * x[k] - self.origin[0], t * y[k] - self.origin[1]];
        let u = std::array::from_fn(|k| fixed(cos * from(k)[0] + sin * from(k)[1], &self.material));
        let v = std::array::from_fn(|k| fixed(cos * from(k)[1] - sin * from(k)[0], &self.material));
        let mut colours = sample_points(&scene.atlas, &self.material, [&u, &v], level, wanted);
        let mut light = [frame.params.ambient; N];
        for lamp in &frame.lamps {
            let facing = self.up * (lamp.height - self.z);
            if facing > 0.0 {
                for (k, light) in light.iter_mut().enumerate() {
                    let to = [lamp.position[0] - t * x[k], lamp.position[1] - t * y[k]];
                    *light += lit(lamp, to[0] * to[0] + to[1] * to[1], self.z, facing);
                }
            }
        }
        light_up(&mut colours, &light);
        colours
    }
}
