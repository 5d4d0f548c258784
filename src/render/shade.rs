//! Colour of a surface where rays meet it: texture times light. The twin of `shaders/shade.wgsl`.
//!
//! Light is Lambert's: each lamp's inverse-square irradiance times the cosine of incidence, and the ambient light. There are no
//! shadows and no reflections.

use std::ops::Range;

use super::Scene;
use super::columns::Hit;
use super::frame::{Frame, Lamp};
use super::sample::{RUN, Strip, level, round, sample_points, within_tile};
use super::scene::Material;

/// Least distance from a lamp that counts, squared, m^2: a lamp is no point.
const LAMP_SIZE_SQUARED: f32 = 0.01;
/// Least cosine of incidence that counts in the width of a pixel's footprint.
const LEAST_COSINE: f32 = 0.05;

/// Irradiance from `lamp` at height `z`, at a horizontal distance from the lamp of which the square is given, on a surface that
/// faces the lamp with `facing`, the product of its normal with the vector to the lamp.
#[inline(always)]
fn lit(lamp: &Lamp, offset_squared: f32, z: f32, facing: f32) -> f32 {
    let up = lamp.height - z;
    let square = offset_squared + up * up;
    let square = if square > LAMP_SIZE_SQUARED { square } else { LAMP_SIZE_SQUARED };
    lamp.intensity * facing / (square * square.sqrt())
}

/// Colour times light, opaque. Light is rounded to 1/4096, at most 16, and the product is one of integers.
#[inline(always)]
fn light_up(colour: u32, light: f32) -> u32 {
    let scaled = light * 4096.0;
    let factor = round(if scaled < 65535.0 { scaled } else { 65535.0 }) as u32;
    let channel = |c: u32| ((((c & 255) * 16 + 8) * factor) >> 16).min(255);
    channel(colour) | channel(colour >> 8) << 8 | channel(colour >> 16) << 16 | 0xff00_0000
}

/// Colours of the rows from `first_row` to `first_row + count` of a column that sees the side of `hit`; the colours up to the
/// next multiple of eight are void.
#[inline(always)]
pub(super) fn shade_side(
    scene: &Scene,
    frame: &Frame,
    hit: &Hit,
    direction: [f32; 2],
    first_row: usize,
    count: usize,
    out: &mut [u32; RUN],
) {
    let material = &scene.materials[hit.surface as usize];
    let eye = frame.params.camera_height;
    // What the rows have in common: u, the step of v, the level of detail, and where the lamps stand.
    let cosine = -(hit.normal[0] * direction[0] + hit.normal[1] * direction[1]);
    let across = hit.near * frame.params.pixel_rad;
    let level = level(material, across / cosine.max(LEAST_COSINE), across);
    let foot = hit.bottom.max(0.0);
    let v = eye + hit.near * frame.rows[0].tan - foot;
    let whole = count.next_multiple_of(8);
    let out = &mut out[..whole];
    Strip::new(material, hit.u, v, across, level).sample(&scene.atlas, first_row, out);
    let mut light = [frame.params.ambient; RUN];
    let light = &mut light[..whole];
    for lamp in &frame.lamps {
        let to = [lamp.position[0] - hit.near * direction[0], lamp.position[1] - hit.near * direction[1]];
        let facing = hit.normal[0] * to[0] + hit.normal[1] * to[1];
        if facing > 0.0 {
            let offset_squared = to[0] * to[0] + to[1] * to[1];
            for (light, row) in light.iter_mut().zip(&frame.rows[first_row..first_row + count]) {
                *light += lit(lamp, offset_squared, eye + hit.near * row.tan, facing);
            }
        }
    }
    for (colour, light) in out.iter_mut().zip(light) {
        *colour = light_up(*colour, *light);
    }
}

/// A horizontal surface: floor, ceiling, or the top or underside of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    material: Material,
    /// Cosine and sine of the direction of its texture's axes.
    heading: [f32; 2],
    /// The camera in those axes, texels, less whole periods.
    camera: [f32; 2],
    /// Height, m.
    z: f32,
    /// 1 where it faces up, -1 where it faces down.
    up: f32,
}

impl Plane {
    /// Floor (surface 0), ceiling (surface 1), or the top or underside of a body.
    #[inline(always)]
    pub fn new(scene: &Scene, frame: &Frame, surface: u32, underside: bool) -> Self {
        let p = &frame.params;
        let material = scene.materials[surface as usize];
        let (mut camera, mut heading) = (p.camera, [1.0, 0.0]);
        let mut z = if underside { p.room_height } else { 0.0 };
        if surface >= 2 {
            let body = &frame.bodies[(surface - 2 - p.wall_count) as usize];
            let ([x, y], [cos, sin]) = (body.centre, body.heading);
            camera = [-(cos * x + sin * y), -(cos * y - sin * x)];
            heading = body.heading;
            z = if underside { body.bottom } else { body.top };
        }
        let camera = camera.map(|x| within_tile(x, &material));
        Self { material, heading, camera, z, up: if underside { -1.0 } else { 1.0 } }
    }

    /// Colours of the columns `wanted` of a row that sees it, at horizontal distance `t`; the other colours mean nothing.
    #[inline(always)]
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
        let texels = t * self.material.texels_per_m;
        let fixed = |along: f32, camera: f32| round((texels * along + camera) * 256.0) << 8;
        let (mut u, mut v) = ([0; N], [0; N]);
        for k in 0..N {
            u[k] = fixed(cos * x[k] + sin * y[k], self.camera[0]);
            v[k] = fixed(cos * y[k] - sin * x[k], self.camera[1]);
        }
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
        for (colour, light) in colours.iter_mut().zip(light) {
            *colour = light_up(*colour, light);
        }
        colours
    }
}
