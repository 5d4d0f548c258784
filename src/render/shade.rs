//! Colour of a surface where rays meet it: texture times light. The twin of `shaders/shade.wgsl`.
//!
//! Light is Lambert's: each lamp's inverse-square irradiance times the cosine of incidence, and the ambient light. There are no
//! shadows and no reflections.

use super::Scene;
use super::columns::Hit;
use super::frame::{Frame, Lamp};
use super::sample::{LANES, POINTS, PointRoom, Points, RUN, Strip, StripRoom, is_wanted, level, round, within_tile};
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

/// Where the sides of a column are shaded.
#[derive(Debug)]
pub(super) struct SideRoom {
    strip: StripRoom,
    light: [f32; RUN],
}

impl Default for SideRoom {
    fn default() -> Self {
        Self { strip: StripRoom::default(), light: [0.0; RUN] }
    }
}

/// Colours of the rows from `first_row` to `first_row + count` of a column that sees the side of `hit`; at most [`RUN`]. What
/// follows in `out` up to a whole number of blocks is overwritten, too.
#[inline(always)]
pub(super) fn shade_side(
    scene: &Scene,
    frame: &Frame,
    hit: &Hit,
    direction: [f32; 2],
    first_row: usize,
    count: usize,
    room: &mut SideRoom,
    out: &mut [u32],
) {
    let material = &scene.materials[hit.surface as usize];
    let eye = frame.params.camera_height;
    // What the rows have in common: u, the step of v, the level of detail, and where the lamps stand.
    let cosine = -(hit.normal[0] * direction[0] + hit.normal[1] * direction[1]);
    let across = hit.near * frame.params.pixel_rad;
    let level = level(material, across / cosine.max(LEAST_COSINE), across);
    let foot = hit.bottom.max(0.0);
    let v = eye + hit.near * frame.rows[0].tan - foot;
    let light = &mut room.light[..count];
    light.fill(frame.params.ambient);
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
    let strip = Strip::new(&scene.atlas, material, [hit.u, v, across], level, first_row);
    let blocks = count.div_ceil(LANES);
    strip.shade(&room.light.as_chunks().0[..blocks], &mut room.strip, &mut out.as_chunks_mut().0[..blocks]);
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

    /// Height of the surface, m.
    pub fn height(&self) -> f32 {
        self.z
    }

    /// Colours of some columns of a row that sees it, at horizontal distance `t`: those that have a bit in `wanted`.
    #[inline(always)]
    pub fn shade(
        &self,
        scene: &Scene,
        frame: &Frame,
        [x, y]: [&[f32; POINTS]; 2],
        [t, inverse_tan]: [f32; 2],
        wanted: u64,
        room: &mut PointRoom,
        out: &mut [u32; POINTS],
    ) {
        let [cos, sin] = self.heading;
        let across = t * frame.params.pixel_rad;
        let level = level(&self.material, across * inverse_tan.abs(), across);
        let texels = t * self.material.texels_per_m;
        let (mut u, mut v) = ([0; POINTS], [0; POINTS]);
        for k in 0..POINTS {
            u[k] = round((texels * (cos * x[k] + sin * y[k]) + self.camera[0]) * 256.0) << 8;
            v[k] = round((texels * (cos * y[k] - sin * x[k]) + self.camera[1]) * 256.0) << 8;
        }
        let points = Points { atlas: &scene.atlas, material: &self.material, u: &u, v: &v, level };
        points.look_up(wanted, room);
        let (x, y, out) = (x.as_chunks().0, y.as_chunks().0, out.as_chunks_mut::<LANES>().0);
        for (block, ((x, y), out)) in x.iter().zip(y).zip(out).enumerate() {
            if !is_wanted(wanted, block) {
                continue;
            }
            let mut lit = [0; LANES];
            points.shade(block, &self.light(frame, x, y, t), room, &mut lit);
            let wanted = (wanted >> (LANES * block)) as u16;
            if wanted == u16::MAX {
                *out = lit;
            } else {
                for k in 0..LANES {
                    out[k] = if wanted >> k & 1 != 0 { lit[k] } else { out[k] };
                }
            }
        }
    }

    /// Light on it in some directions at horizontal distance `t`.
    #[inline(always)]
    fn light(&self, frame: &Frame, x: &[f32; LANES], y: &[f32; LANES], t: f32) -> [f32; LANES] {
        let mut light = [frame.params.ambient; LANES];
        for lamp in &frame.lamps {
            let facing = self.up * (lamp.height - self.z);
            if facing > 0.0 {
                for k in 0..LANES {
                    let to = [lamp.position[0] - t * x[k], lamp.position[1] - t * y[k]];
                    light[k] += lit(lamp, to[0] * to[0] + to[1] * to[1], self.z, facing);
                }
            }
        }
        light
    }
}
