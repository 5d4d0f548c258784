//! What one view needs beside its scene: tables of directions and rows, and the geometry as seen from the camera.
//!
//! Both renderers work from these tables. They are computed here once, in f64, with the camera as origin, and rounded to f32:
//! the two then start from the same bits, and a surface 3 m away is not blurred by a room that lies far from the origin.

use bytemuck::Zeroable;

use super::inner::{Block, Face, look};
use super::records::{Body, Edge, FAR, Lamp, Params, Row};
use super::scene::Prism;
use super::visible::Sight;
use super::{Scene, View};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, cross, sin_cos};
use crate::panorama::{Projection, ProjectionKind};
use crate::world::Footprint;

/// All tables of one view. Kept by a renderer and refilled view by view without allocating.
#[derive(Debug)]
pub(super) struct Frame {
    pub params: Params,
    /// Unit vectors of the columns in the room's axes.
    pub directions: Vec<[f32; 2]>,
    pub rows: Vec<Row>,
    /// First the walls of the room, then those inside, then the edges of polygonal bodies.
    pub edges: Vec<Edge>,
    pub bodies: Vec<Body>,
    /// For each surface of this view, [`look`]: floor, ceiling, walls and bodies in the order of `edges` and `bodies`; and what fills
    /// up to a multiple of four.
    pub looks: Vec<u32>,
    /// What is seen of a large room.
    sight: Sight,
    /// Lamps, then pieces of windows.
    pub lamps: Vec<Lamp>,
    /// How many are lamps.
    lamp_count: usize,
    /// Unit vectors of the columns for a camera that faces along x, and the width that they are for.
    circle: Vec<Vector2<f64>>,
}

impl Default for Frame {
    fn default() -> Self {
        Self::new()
    }
}

impl Frame {
    pub fn new() -> Self {
        Self {
            params: Params::zeroed(),
            directions: Vec::new(),
            rows: Vec::new(),
            edges: Vec::new(),
            bodies: Vec::new(),
            looks: Vec::new(),
            sight: Sight::default(),
            lamps: Vec::new(),
            lamp_count: 0,
            circle: Vec::new(),
        }
    }

    /// Fills the tables for `view`.
    ///
    /// # Errors
    /// When the picture has no pixels, its rows reach beyond the zenith, a number is not finite, the view does not pose each body
    /// of the scene, or the camera is inside one.
    pub fn prepare(&mut self, scene: &Scene, view: &View<'_>) -> Result<()> {
        check(scene, view)?;
        let projection = view.projection;
        let camera = view.robot.transform(scene.camera_offset_m);
        self.fill_directions(&projection, view.robot.heading);
        self.fill_rows(&projection, scene);
        self.edges.clear();
        self.looks.clear();
        self.looks.extend([0, 1].map(own_look));
        self.push_walls(scene, camera);
        let wall_count = self.edges.len() as u32;
        self.bodies.clear();
        let first_body = 2 + scene.outline.len();
        for (k, (prism, pose)) in scene.bodies.iter().zip(view.bodies).enumerate() {
            if scene.index.is_none() || self.sight.sees_disc(pose.position(), prism.footprint.bounding_radius()) {
                self.push_body(prism, scene.factors.lamps, pose, camera);
                self.looks.push(own_look(first_body + k));
                if self.bodies.last().is_some_and(|body| self.holds_camera(body, scene)) {
                    return Err(inside(&prism.name, scene, camera));
                }
            }
        }
        if let Some(name) = inner_wall_at(scene, camera) {
            return Err(inside(name, scene, camera));
        }
        for (k, pane) in scene.windows.iter().enumerate() {
            self.push_body(pane, scene.factors.windows, &Pose::IDENTITY, camera);
            self.looks.push(own_look(first_body + scene.bodies.len() + k));
        }
        self.push_blocks(scene, camera);
        self.looks.resize(self.looks.len().next_multiple_of(4), 0);
        self.fill_lamps(scene, camera);
        let texels = |bytes: usize| bytes.div_ceil(16) as u32;
        let first_edge = texels(size_of::<Params>());
        let first_body = first_edge + texels(size_of_val(self.edges.as_slice()));
        let first_lamp = first_body + texels(size_of_val(self.bodies.as_slice()));
        let first_look = first_lamp + texels(size_of_val(self.lamps.as_slice()));
        self.params = Params {
            width: projection.width,
            height: projection.height,
            wall_count,
            body_count: self.bodies.len() as u32,
            lamp_count: self.lamp_count as u32,
            rows_per_invocation: projection.height,
            pixel_rad: projection.pixel_rad() as f32,
            camera_height: scene.camera_height_m as f32,
            camera: [camera.x as f32, camera.y as f32],
            room_height: scene.room_height_m as f32,
            ambient: (scene.factors.ambient * scene.light.ambient) as f32,
            equal_angle: u32::from(projection.kind == ProjectionKind::EqualAngle),
            pane_count: (self.lamps.len() - self.lamp_count) as u32,
            corner_shade: scene.light.corner_shade as f32,
            inverse_reach: (1.0 / scene.light.corner_reach_m) as f32,
            horizon_row: projection.horizon_row as f32,
            ceiling_end: self.rows.partition_point(|r| r.tan >= 0.0 && r.plane < FAR) as u32,
            floor_start: self.rows.partition_point(|r| r.tan >= 0.0 || r.plane >= FAR) as u32,
            first_edge,
            first_body,
            first_lamp,
            all_bits: u32::MAX,
            first_look,
        };
        Ok(())
    }

    /// What shines: lamps first, then pieces of windows. What is switched off is left out.
    fn fill_lamps(&mut self, scene: &Scene, camera: Vector2<f64>) {
        let from_camera = |[x, y, _]: [f64; 3]| [(x - camera.x) as f32, (y - camera.y) as f32];
        let factors = &scene.factors;
        self.lamps.clear();
        if factors.lamps > 0.0 {
            self.lamps.extend(scene.light.lamps.iter().map(|l| Lamp {
                position: from_camera(l.position_m),
                height: l.position_m[2] as f32,
                intensity: (factors.lamps * l.intensity) as f32,
                normal: [0.0; 2],
                size_squared: 0.0,
                padding: 0,
            }));
        }
        self.lamp_count = self.lamps.len();
        if factors.windows > 0.0 {
            self.lamps.extend(scene.light.panes.iter().map(|p| Lamp {
                position: from_camera(p.position_m),
                height: p.position_m[2] as f32,
                intensity: (factors.windows * p.brightness * p.area_m2) as f32,
                normal: p.normal.map(|x| x as f32),
                // Exact on the axis of a disc of that area.
                size_squared: (p.area_m2 / std::f64::consts::PI) as f32,
                padding: 0,
            }));
        }
    }

    /// Appends the walls: those of the room, and the faces inside it that are as high.
    fn push_walls(&mut self, scene: &Scene, camera: Vector2<f64>) {
        let walls = scene.outline.len();
        let Some(index) = &scene.index else {
            push_edges(&mut self.edges, scene.outline.iter().map(|&p| p - camera), -1.0);
            self.looks.extend((2..2 + walls).map(own_look));
            self.edges.extend(scene.inner.faces.iter().map(|face| edge_of(face, camera)));
            self.looks.extend(scene.inner.faces.iter().map(|face| face.look));
            return;
        };
        let corner = |k: usize| scene.outline[k % walls] - camera;
        let edge_at = |number: u32| match (number as usize).checked_sub(walls) {
            None => edge(corner(number as usize), corner(number as usize + 1), -1.0).0,
            Some(face) => edge_of(&scene.inner.faces[face], camera),
        };
        let shade_m = if scene.light.corner_shade > 0.0 { scene.light.corner_reach_m } else { 0.0 };
        self.sight.find(index, camera, &self.directions, edge_at, shade_m);
        for &number in &self.sight.faces {
            self.edges.push(edge_at(number));
            let face = (number as usize).checked_sub(walls);
            self.looks.push(face.map_or_else(|| own_look(2 + number as usize), |face| scene.inner.faces[face].look));
        }
    }

    /// Appends the pieces of inner walls that are lower than the room or hang.
    fn push_blocks(&mut self, scene: &Scene, camera: Vector2<f64>) {
        let blocks = &scene.inner.blocks;
        if scene.index.is_none() {
            blocks.iter().for_each(|block| self.push_block(block, camera));
            return;
        }
        for k in 0..self.sight.blocks.len() {
            self.push_block(&blocks[self.sight.blocks[k] as usize], camera);
        }
    }

    /// Whether the camera is inside the solid of a body.
    fn holds_camera(&self, body: &Body, scene: &Scene) -> bool {
        let height = scene.camera_height_m as f32;
        let [x, y] = body.centre;
        let edges = &self.edges[body.first_edge as usize..][..body.edge_count as usize];
        let within =
            if body.radius > 0.0 { x * x + y * y < body.radius * body.radius } else { edges.iter().all(|e| e.distance > 0.0) };
        within && body.bottom < height && height < body.top
    }

    fn fill_directions(&mut self, projection: &Projection, heading: f64) {
        let width = projection.width as usize;
        if self.circle.len() != width {
            let step = projection.pixel_rad();
            self.circle.clear();
            self.circle.extend((0..width).map(|c| crate::geometry::direction(c as f64 * step)));
        }
        // Rotating a table of the circle costs four products a column; sine and cosine of each would cost ten times that.
        let (s, c) = sin_cos(heading + projection.mount_rad);
        self.directions.clear();
        self.directions.extend(self.circle.iter().map(|d| [(c * d.x - s * d.y) as f32, (s * d.x + c * d.y) as f32]));
    }

    fn fill_rows(&mut self, projection: &Projection, scene: &Scene) {
        let far = f64::from(FAR);
        let above = scene.room_height_m - scene.camera_height_m;
        let below = -scene.camera_height_m;
        self.rows.clear();
        self.rows.extend((0..projection.height).map(|row| {
            let tan = projection.tan_elevation(f64::from(row));
            let sign = if tan < 0.0 { -1.0 } else { 1.0 };
            let inverse = if tan.abs() * far > 1.0 { 1.0 / tan } else { sign * far };
            let plane = (if tan < 0.0 { below } else { above }) * inverse;
            Row {
                tan: tan as f32,
                inverse_tan: inverse as f32,
                stretch: (1.0 + tan * tan).sqrt() as f32,
                plane: plane.min(far) as f32,
            }
        }));
    }

    /// Appends a body; `light` is the factor on what it gives off.
    fn push_body(&mut self, prism: &Prism, light: f64, pose: &Pose, camera: Vector2<f64>) {
        let (s, c) = sin_cos(pose.heading);
        let centre = pose.position() - camera;
        let first_edge = self.edges.len() as u32;
        let radius = match &prism.footprint {
            Footprint::Disc(radius) => *radius,
            Footprint::Polygon(corners) => {
                let place = |p: &Vector2<f64>| centre + Vector2::new(c * p.x - s * p.y, s * p.x + c * p.y);
                push_edges(&mut self.edges, corners.iter().map(place), 1.0);
                0.0
            }
        };
        self.bodies.push(Body {
            centre: [centre.x as f32, centre.y as f32],
            heading: [c as f32, s as f32],
            bottom: prism.bottom_m as f32,
            top: prism.top_m as f32,
            radius: radius as f32,
            first_edge,
            edge_count: self.edges.len() as u32 - first_edge,
            glow: (light * prism.glow) as f32,
            padding: [0; 2],
        });
    }

    /// Appends a piece of a wall inside the room.
    fn push_block(&mut self, block: &Block, camera: Vector2<f64>) {
        let first_edge = self.edges.len() as u32;
        self.edges.extend(block.sides.iter().map(|side| edge_of(side, camera)));
        let origin = block.origin - camera;
        self.bodies.push(Body {
            centre: [origin.x as f32, origin.y as f32],
            heading: [block.along.x as f32, block.along.y as f32],
            bottom: block.bottom_m as f32,
            top: block.top_m as f32,
            radius: 0.0,
            first_edge,
            edge_count: block.sides.len() as u32,
            glow: 0.0,
            padding: [0; 2],
        });
        // A camera sees one of the long sides, and all of the block has one look.
        let left = cross(block.along, origin) < 0.0;
        self.looks.push(if left { block.left_look } else { block.sides[0].look });
    }

    /// Number of a surface's material.
    #[inline(always)]
    pub fn material(&self, surface: u32) -> usize {
        (self.looks[surface as usize] & 0xffff) as usize
    }

    /// Instance id of a surface; 0 of what is none.
    #[inline(always)]
    pub fn instance(&self, surface: u32) -> u16 {
        self.looks.get(surface as usize).map_or(0, |look| (look >> 16) as u16)
    }
}

/// Name of the inner wall that the camera is inside of.
fn inner_wall_at(scene: &Scene, camera: Vector2<f64>) -> Option<&str> {
    let solids = &scene.inner.solids;
    let holds = |k: &usize| {
        let (_, corners, [bottom_m, top_m]) = &solids[*k];
        let inside = (0..4).all(|k| cross(corners[(k + 1) % 4] - corners[k], camera - corners[k]) > 0.0);
        inside && *bottom_m < scene.camera_height_m && scene.camera_height_m < *top_m
    };
    let found = match &scene.index {
        Some(index) => index.solids_at(camera).into_iter().map(|k| k as usize).filter(holds).min(),
        None => (0..solids.len()).find(holds),
    };
    found.map(|k| solids[k].0.as_str())
}

/// The error of a camera that is inside something.
fn inside(name: &str, scene: &Scene, camera: Vector2<f64>) -> Error {
    Error::CameraInside { body: name.to_owned(), x_m: camera.x, y_m: camera.y, z_m: scene.camera_height_m }
}

/// The look of a surface that is numbered as its material and its instance are.
fn own_look(surface: usize) -> u32 {
    look(surface, surface as u16 + 1)
}

/// The edge of an upright face.
fn edge_of(face: &Face, camera: Vector2<f64>) -> Edge {
    Edge { u: face.u as f32, ..edge(face.a - camera, face.b - camera, 1.0).0 }
}

/// The edge from `a` to `b`, and its length, m. `side` is 1 where it is seen from the right, -1 from the left. u begins with 0.
fn edge(a: Vector2<f64>, b: Vector2<f64>, side: f64) -> (Edge, f64) {
    let length = ((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y)).sqrt();
    let tangent = (b - a) / length.max(1e-9);
    let normal = Vector2::new(tangent.y, -tangent.x) * side;
    let edge = Edge {
        normal: [normal.x as f32, normal.y as f32],
        tangent: [tangent.x as f32, tangent.y as f32],
        distance: (-side * cross(tangent, a)) as f32,
        along: (tangent.x * a.x + tangent.y * a.y) as f32,
        u: 0.0,
        length: length as f32,
    };
    (edge, length)
}

/// Appends the edges of an anti-clockwise polygon. `side` is 1 for normals that point out of it, -1 for normals into it.
fn push_edges(edges: &mut Vec<Edge>, corners: impl Iterator<Item = Vector2<f64>> + Clone, side: f64) {
    let mut u = 0.0;
    let next = corners.clone().cycle().skip(1);
    for (a, b) in corners.zip(next) {
        let (edge, length) = edge(a, b, side);
        edges.push(Edge { u: if side > 0.0 { u as f32 } else { 0.0 }, ..edge });
        u += length;
    }
}

fn check(scene: &Scene, view: &View<'_>) -> Result<()> {
    let invalid = |what: &str, found: String, allowed: String| Err(Error::Invalid { what: what.to_owned(), found, allowed });
    let p = &view.projection;
    if p.width == 0 || p.height == 0 || p.pixels() > (1 << 28) {
        return invalid("panorama size", format!("{} x {}", p.width, p.height), "1 to 2^28 pixels".to_owned());
    }
    if !(p.horizon_row.is_finite() && p.mount_rad.is_finite()) {
        return invalid("projection", format!("{p:?}"), "finite numbers".to_owned());
    }
    let steepest = p.horizon_row.max(f64::from(p.height) - p.horizon_row) * p.pixel_rad();
    if p.kind == ProjectionKind::EqualAngle && steepest > std::f64::consts::FRAC_PI_2 + 1e-9 {
        let found = format!("rows up to {:.1} degrees from the horizon", steepest.to_degrees());
        return invalid("equal-angle panorama", found, "up to 90 degrees".to_owned());
    }
    if !view.robot.is_finite() {
        return invalid("robot pose", format!("{:?}", view.robot), "finite numbers".to_owned());
    }
    if view.bodies.len() != scene.bodies.len() {
        let allowed = format!("{}, one for each body", scene.bodies.len());
        return invalid("number of body poses", view.bodies.len().to_string(), allowed);
    }
    if let Some((pose, prism)) = view.bodies.iter().zip(&scene.bodies).find(|(b, _)| !b.is_finite()) {
        return invalid(&format!("pose of body `{}`", prism.name), format!("{pose:?}"), "finite numbers".to_owned());
    }
    Ok(())
}
