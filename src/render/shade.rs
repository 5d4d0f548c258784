//! Colour of a surface where rays meet it: texture times light. The twin of `shaders/shade.wgsl`.
//!
//! Light is Lambert's: each lamp's inverse-square irradiance times the cosine of incidence; windows shine by the cosine law
//! themselves, piece by piece. Ambient light reaches corners less where a world asks for that. There are no shadows and no
//! reflections.

use super::Scene;
use super::columns::Hit;
use super::frame::Frame;
use super::records::{Edge, Lamp, Row};
use super::sample::{
    LANES, POINTS, PointRoom, Points, RUN, Strip, StripPlaces, StripRoom, Strips, footprint, is_wanted, level, shade_point,
    within_tile, wrapped,
};
use super::scene::MipLevel;
use super::texels::{LookUp, Texels};

/// Least distance from a lamp that counts, squared, m^2: a lamp is no point.
const LAMP_SIZE_SQUARED: f32 = 0.01;
/// Least cosine of incidence that counts in the width of a pixel's footprint.
const LEAST_COSINE: f32 = 0.05;
/// Least squared distance from a piece of a window that counts, m^2.
const LEAST_SQUARE: f32 = 1.0e-4;
/// What is less than this, m, behind a wall's line stands in the corner with it, and not beyond a corner that juts out.
const BEHIND: f32 = 1.0e-6;

/// Irradiance from `lamp` at height `z`, at a horizontal distance from the lamp of which the square is given, on a surface that
/// faces the lamp with `facing`, the product of its normal with the vector to the lamp.
#[inline(always)]
fn lit(lamp: &Lamp, offset_squared: f32, z: f32, facing: f32) -> f32 {
    let up = lamp.height - z;
    let square = offset_squared + up * up;
    let square = if square > LAMP_SIZE_SQUARED { square } else { LAMP_SIZE_SQUARED };
    lamp.intensity * facing / (square * square.sqrt())
}

/// Light from a piece of a window that faces the point with `facing` and that the point faces, both as products of a normal
/// with the vector between; the product of the two and the intensity is `weight`.
#[inline(always)]
fn lit_by_window(pane: &Lamp, weight: f32, offset_squared: f32, z: f32) -> f32 {
    let up = pane.height - z;
    let square = offset_squared + up * up;
    let square = if square > LEAST_SQUARE { square } else { LEAST_SQUARE };
    weight / (square * (square + pane.size_squared))
}

/// How deep in a corner something is that lies `distance` from a surface, 0 to 1.
#[inline(always)]
fn depth(frame: &Frame, distance: f32) -> f32 {
    let depth = 1.0 - distance * frame.params.inverse_reach;
    let depth = if depth > 0.0 { depth } else { 0.0 };
    depth * depth
}

/// How deep a point is in the corner between its surface, with this normal (zero for a horizontal one), and a wall.
#[inline(always)]
fn depth_at_wall(frame: &Frame, edge: &Edge, [x, y]: [f32; 2], normal: [f32; 2]) -> f32 {
    let before = edge.normal[0] * x + edge.normal[1] * y - edge.distance;
    let along = edge.tangent[0] * x + edge.tangent[1] * y - edge.along;
    let past = (-along).max(along - edge.length).max(0.0);
    // A wall makes no corner with itself or one in its line, and a full one with one at a right angle.
    let turned = 1.0 - (normal[0] * edge.normal[0] + normal[1] * edge.normal[1]);
    let turned = if turned < 1.0 { turned } else { 1.0 };
    let depth = turned * depth(frame, (before * before + past * past).sqrt());
    if before > -BEHIND { depth } else { 0.0 }
}

/// From this many walls on, those near some points are sought first.
const MANY_WALLS: u32 = 16;

/// The walls that may darken points at horizontal distance `t` in some directions; in a room of few walls all of them.
///
/// The points lie in a disc around the middle one. A wall farther from that than its radius and the reach of corners together adds
/// nothing to any of them.
#[inline(always)]
fn walls_near(frame: &Frame, x: &[f32; POINTS], y: &[f32; POINTS], t: f32, near: &mut Vec<u32>) {
    near.clear();
    if frame.params.corner_shade <= 0.0 {
        return;
    }
    if frame.params.wall_count < MANY_WALLS {
        near.extend(0..frame.params.wall_count);
        return;
    }
    let middle = [t * x[POINTS / 2], t * y[POINTS / 2]];
    let mut square = 0.0_f32;
    for k in 0..POINTS {
        let (dx, dy) = (t * x[k] - middle[0], t * y[k] - middle[1]);
        square = square.max(dx * dx + dy * dy);
    }
    let most = (square.sqrt() + 1.0 / frame.params.inverse_reach) * 1.0001 + 1.0e-4;
    for (edge, number) in frame.edges[..frame.params.wall_count as usize].iter().zip(0..) {
        let before = edge.normal[0] * middle[0] + edge.normal[1] * middle[1] - edge.distance;
        let along = edge.tangent[0] * middle[0] + edge.tangent[1] * middle[1] - edge.along;
        let past = (-along).max(along - edge.length).max(0.0);
        if before * before + past * past < most * most {
            near.push(number);
        }
    }
}

/// Rows of a column that see the side of a wall or body; or nothing, [`Hit::NONE`], and then they are not shaded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    pub hit: &'a Hit,
    /// Where the column looks.
    pub direction: [f32; 2],
    pub first_row: usize,
    /// At most [`RUN`].
    pub count: usize,
}

/// The sides that some runs see, a lane each: what the rows of each have in common is found for all of them at once.
#[derive(Debug)]
pub(super) struct Sides<'a> {
    runs: [&'a Run<'a>; LANES],
    strips: Strips<'a>,
    /// Length on them that a pixel covers sideways, m.
    slant: [f32; LANES],
}

impl<'a> Sides<'a> {
    #[inline(always)]
    pub fn new(scene: &'a Scene, frame: &Frame, runs: [&'a Run<'a>; LANES]) -> Self {
        let mut material = [&scene.materials[0]; LANES];
        let [mut cosine, mut near, mut u, mut foot, mut step, mut slant, mut v] = [[0.0_f32; LANES]; 7];
        let mut first_row = [0; LANES];
        for (k, run) in runs.into_iter().enumerate() {
            let Run { hit, direction, .. } = run;
            material[k] = &scene.materials[frame.material(hit.surface)];
            cosine[k] = -(hit.normal[0] * direction[0] + hit.normal[1] * direction[1]);
            (near[k], u[k], foot[k], first_row[k]) = (hit.near, hit.u, material[k].foot_m, run.first_row as i32);
        }
        let (eye, tan) = (frame.params.camera_height, frame.rows[0].tan);
        for k in 0..LANES {
            step[k] = near[k] * frame.params.pixel_rad;
            slant[k] = step[k] / cosine[k].max(LEAST_COSINE);
            v[k] = eye + near[k] * tan - foot[k];
        }
        let places = StripPlaces { material, u, v, step, slant, first_row };
        Self { runs, strips: Strips::new(&scene.atlas, &places), slant }
    }

    /// One of them.
    #[inline(always)]
    pub fn at(&self, k: usize) -> Side<'a> {
        Side { run: self.runs[k], strip: self.strips.at(k), slant: self.slant[k] }
    }
}

/// The side that a run sees.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side<'a> {
    run: &'a Run<'a>,
    /// Its texture where the rows are even in the tangent of elevation; then all have one level of detail.
    strip: Strip<'a>,
    slant: f32,
}

impl Side<'_> {
    /// Brings the texels that [`Side::shade`] needs.
    #[inline(always)]
    pub fn mix(&self, frame: &Frame, room: &mut StripRoom) {
        if frame.params.equal_angle == 0 {
            self.strip.mix(self.run.count.div_ceil(LANES), room);
        }
    }

    /// Colours of the rows. What follows in `out` up to a whole number of blocks is overwritten, too. `room` is as [`Side::mix`] left it.
    #[inline(always)]
    pub fn shade<L: LookUp>(
        &self,
        look_up: L,
        scene: &Scene,
        frame: &Frame,
        room: &mut StripRoom,
        light: &mut Light,
        out: &mut [u32],
    ) {
        let run = self.run;
        let blocks = run.count.div_ceil(LANES);
        let light = &mut light.0[..blocks];
        run.light(frame, light);
        if frame.params.equal_angle == 0 {
            self.strip.shade(look_up, light, room, &mut out.as_chunks_mut().0[..blocks]);
            return;
        }
        // Steps and level of detail change from row to row.
        let material = &scene.materials[frame.material(run.hit.surface)];
        let (near, foot) = (run.hit.near, material.foot_m);
        let u = within_tile(run.hit.u, material, 0);
        let rows = &frame.rows[run.first_row..run.first_row + run.count];
        for ((colour, row), light) in out.iter_mut().zip(rows).zip(light.as_flattened()) {
            let high = near * frame.params.pixel_rad * row.stretch * row.stretch;
            let level = level(material, footprint(material, [self.slant, high]));
            let v = within_tile(frame.params.camera_height + near * row.tan - foot, material, 1);
            *colour = shade_point(&scene.atlas, level, [u, v], *light);
        }
    }
}

/// Light on the rows of a run, block by block.
#[derive(Debug)]
#[repr(align(64))]
pub(super) struct Light([[f32; LANES]; RUN / LANES]);

impl Default for Light {
    fn default() -> Self {
        Self([[0.0; LANES]; RUN / LANES])
    }
}

impl Run<'_> {
    /// Light on the rows, of which the last block may be more.
    #[inline(always)]
    fn light(&self, frame: &Frame, light: &mut [[f32; LANES]]) {
        let Self { hit, direction, first_row, count } = *self;
        let eye = frame.params.camera_height;
        let rows = &frame.rows[first_row..first_row + count];
        light.fill([frame.params.ambient; LANES]);
        let light = &mut light.as_flattened_mut()[..count];
        let at = hit.near;
        let point = [at * direction[0], at * direction[1]];
        if frame.params.corner_shade > 0.0 {
            let walls = &frame.edges[..frame.params.wall_count as usize];
            // The same as of all: what is farther away adds nothing.
            let most = 1.001 / frame.params.inverse_reach;
            let is_close = |e: &&Edge| (e.normal[0] * point[0] + e.normal[1] * point[1] - e.distance).abs() < most;
            let depths = walls.iter().filter(is_close).map(|e| depth_at_wall(frame, e, point, hit.normal));
            let nook = depths.fold(0.0, f32::max);
            let reaches = |depth: f32| 1.0 - frame.params.corner_shade * depth;
            for (light, row) in light.iter_mut().zip(rows) {
                let z = eye + at * row.tan;
                let edge = depth(frame, z).max(depth(frame, frame.params.room_height - z));
                *light *= reaches(nook) * reaches(edge);
            }
        }
        let glow = glow(frame, hit.surface);
        if glow > 0.0 {
            for light in light.iter_mut() {
                *light += glow;
            }
        }
        let (lamps, panes) = frame.lamps.split_at(frame.params.lamp_count as usize);
        for lamp in lamps {
            let to = [lamp.position[0] - point[0], lamp.position[1] - point[1]];
            let facing = hit.normal[0] * to[0] + hit.normal[1] * to[1];
            if facing > 0.0 {
                let offset_squared = to[0] * to[0] + to[1] * to[1];
                for (light, row) in light.iter_mut().zip(rows) {
                    *light += lit(lamp, offset_squared, eye + at * row.tan, facing);
                }
            }
        }
        for pane in panes {
            let to = [pane.position[0] - point[0], pane.position[1] - point[1]];
            let facing = hit.normal[0] * to[0] + hit.normal[1] * to[1];
            let faced = -(pane.normal[0] * to[0] + pane.normal[1] * to[1]);
            if facing > 0.0 && faced > 0.0 {
                let (weight, offset_squared) = (pane.intensity * facing * faced, to[0] * to[0] + to[1] * to[1]);
                for (light, row) in light.iter_mut().zip(rows) {
                    *light += lit_by_window(pane, weight, offset_squared, eye + at * row.tan);
                }
            }
        }
    }
}

/// Light that a surface gives off.
#[inline(always)]
fn glow(frame: &Frame, surface: u32) -> f32 {
    surface.checked_sub(2 + frame.params.wall_count).map_or(0.0, |k| frame.bodies[k as usize].glow)
}

/// A horizontal surface: floor, ceiling, or the top or underside of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    surface: u32,
    /// Cosine and sine of the direction of its texture's axes.
    heading: [f32; 2],
    /// The camera in those axes, in tiles, less whole ones.
    camera: [f32; 2],
    /// Height, m.
    z: f32,
    /// 1 where it faces up, -1 where it faces down.
    up: f32,
    /// Light that it gives off.
    glow: f32,
}

impl Plane {
    /// Floor (surface 0), ceiling (surface 1), or the top or underside of a body.
    #[inline(always)]
    pub fn new(scene: &Scene, frame: &Frame, surface: u32, underside: bool) -> Self {
        let p = &frame.params;
        let material = &scene.materials[frame.material(surface)];
        let (mut camera, mut heading) = (p.camera, [1.0, 0.0]);
        let mut z = if underside { p.room_height } else { 0.0 };
        if surface >= 2 {
            let body = &frame.bodies[(surface - 2 - p.wall_count) as usize];
            let ([x, y], [cos, sin]) = (body.centre, body.heading);
            camera = [-(cos * x + sin * y), -(cos * y - sin * x)];
            heading = body.heading;
            z = if underside { body.bottom } else { body.top };
        }
        let camera = [within_tile(camera[0], material, 0), within_tile(camera[1], material, 1)];
        Self { surface, heading, camera, z, up: if underside { -1.0 } else { 1.0 }, glow: glow(frame, surface) }
    }

    /// Height of the surface, m.
    pub fn height(&self) -> f32 {
        self.z
    }

    /// What a row of the picture sees of it, that meets it at horizontal distance `t`, m.
    #[inline(always)]
    pub fn row<'a>(&self, scene: &'a Scene, frame: &Frame, row: &Row, t: f32) -> PlaneRow<'a> {
        let across = t * frame.params.pixel_rad;
        // Rows that are even in elevation are farther apart in its tangent.
        let spread = if frame.params.equal_angle == 0 { 1.0 } else { row.stretch * row.stretch };
        let deep = across * row.inverse_tan.abs() * spread;
        let material = &scene.materials[frame.material(self.surface)];
        let [u_per_m, v_per_m] = material.tiles_per_m;
        let level = level(material, (0.5 * deep.max(across)).max(deep.min(across)) * u_per_m.max(v_per_m));
        let size = level.size as f32;
        let scale = [t * u_per_m * size, t * v_per_m * size];
        PlaneRow {
            plane: *self,
            t,
            level,
            texels: Texels::new(&scene.atlas, level),
            scale,
            camera: self.camera.map(|tiles| tiles * size),
        }
    }

    /// Light on it in some directions at horizontal distance `t`.
    #[inline(always)]
    fn light(&self, frame: &Frame, x: &[f32; LANES], y: &[f32; LANES], t: f32, walls: &[u32]) -> [f32; LANES] {
        let mut light = [frame.params.ambient; LANES];
        if frame.params.corner_shade > 0.0 {
            let mut nook = [0.0_f32; LANES];
            for edge in walls.iter().map(|&wall| &frame.edges[wall as usize]) {
                for k in 0..LANES {
                    nook[k] = nook[k].max(depth_at_wall(frame, edge, [t * x[k], t * y[k]], [0.0; 2]));
                }
            }
            for (light, nook) in light.iter_mut().zip(nook) {
                *light *= 1.0 - frame.params.corner_shade * nook;
            }
        }
        if self.glow > 0.0 {
            for light in &mut light {
                *light += self.glow;
            }
        }
        let (lamps, panes) = frame.lamps.split_at(frame.params.lamp_count as usize);
        for lamp in lamps {
            let facing = self.up * (lamp.height - self.z);
            if facing > 0.0 {
                for k in 0..LANES {
                    let to = [lamp.position[0] - t * x[k], lamp.position[1] - t * y[k]];
                    light[k] += lit(lamp, to[0] * to[0] + to[1] * to[1], self.z, facing);
                }
            }
        }
        for pane in panes {
            let facing = self.up * (pane.height - self.z);
            if facing > 0.0 {
                for k in 0..LANES {
                    let to = [pane.position[0] - t * x[k], pane.position[1] - t * y[k]];
                    let faced = -(pane.normal[0] * to[0] + pane.normal[1] * to[1]);
                    let weight = pane.intensity * facing * if faced > 0.0 { faced } else { 0.0 };
                    light[k] += lit_by_window(pane, weight, to[0] * to[0] + to[1] * to[1], self.z);
                }
            }
        }
        light
    }
}

/// A row of the picture that sees a horizontal surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaneRow<'a> {
    plane: Plane,
    /// Horizontal distance at which it is met, m.
    t: f32,
    level: MipLevel,
    texels: Texels<'a>,
    /// Texels of the level from the camera to where it is met, along the axes of the texture.
    scale: [f32; 2],
    /// The camera in texels.
    camera: [f32; 2],
}

impl PlaneRow<'_> {
    /// Colours of some columns, those that have a bit in `wanted`; they look along `x` and `y`.
    #[inline(always)]
    pub fn shade<L: LookUp>(
        &self,
        look_up: L,
        frame: &Frame,
        [x, y]: [&[f32; POINTS]; 2],
        wanted: u64,
        room: &mut PointRoom,
        out: &mut [u32; POINTS],
    ) {
        let [cos, sin] = self.plane.heading;
        let (mut u, mut v) = ([0; POINTS], [0; POINTS]);
        for k in 0..POINTS {
            u[k] = wrapped(self.scale[0] * (cos * x[k] + sin * y[k]) + self.camera[0], self.level);
            v[k] = wrapped(self.scale[1] * (cos * y[k] - sin * x[k]) + self.camera[1], self.level);
        }
        let points = Points { texels: self.texels, u: &u, v: &v };
        points.look_up(look_up, wanted, room);
        walls_near(frame, x, y, self.t, &mut room.walls);
        let (x, y, out) = (x.as_chunks().0, y.as_chunks().0, out.as_chunks_mut::<LANES>().0);
        for (block, ((x, y), out)) in x.iter().zip(y).zip(out).enumerate() {
            if !is_wanted(wanted, block) {
                continue;
            }
            let mut lit = [0; LANES];
            let light = self.plane.light(frame, x, y, self.t, &room.walls);
            points.shade(block, &light, room, &mut lit);
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
}
