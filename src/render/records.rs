//! The records that the tables of a view are made of, as both renderers and the shaders read them.

use bytemuck::{Pod, Zeroable};

/// Distance that stands for "never", m. Finite, because shaders may assume that no infinities occur.
pub(super) const FAR: f32 = 1.0e9;

/// One edge of the outline or of a polygonal footprint. `edge_at` of `shaders/columns.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct Edge {
    /// Unit normal: into the room for a wall, out of the body for a footprint.
    pub normal: [f32; 2],
    /// Unit vector from the first to the second corner.
    pub tangent: [f32; 2],
    /// Normal times first corner, m.
    pub distance: f32,
    /// Tangent times first corner, m.
    pub along: f32,
    /// Texture coordinate u of the first corner, m.
    pub u: f32,
    /// Length, m.
    pub length: f32,
}

/// A body where it stands now. `body_at` of `shaders/columns.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct Body {
    /// Origin of the body's frame, m.
    pub centre: [f32; 2],
    /// Cosine and sine of its heading.
    pub heading: [f32; 2],
    /// Height of the underside, m.
    pub bottom: f32,
    /// Height of the top, m.
    pub top: f32,
    /// Radius of a disc, m; 0 for a polygon.
    pub radius: f32,
    /// First edge of a polygon.
    pub first_edge: u32,
    /// Number of edges of a polygon.
    pub edge_count: u32,
    /// Light that it gives off.
    pub glow: f32,
    /// Fills up to 48 bytes.
    pub padding: [u32; 2],
}

/// A lamp, or a piece of a window. `lamp_at` of `shaders/shade.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct Lamp {
    /// Horizontal position from the camera, m.
    pub position: [f32; 2],
    /// Height above the floor, m.
    pub height: f32,
    /// Irradiance that a facing surface gets at 1 m, straight in front of it.
    pub intensity: f32,
    /// Unit normal of a window into the room; zero for a lamp, which shines to all sides.
    pub normal: [f32; 2],
    /// What a window's size adds to the square of the distance, m^2.
    pub size_squared: f32,
    /// Fills up to 32 bytes.
    pub padding: u32,
}

/// One row of the picture. The layout is that of `Row` in `shaders/columns.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct Row {
    /// Tangent of the elevation.
    pub tan: f32,
    /// Its inverse, at most [`FAR`] in magnitude.
    pub inverse_tan: f32,
    /// Straight-line distance per horizontal distance.
    pub stretch: f32,
    /// Horizontal distance at which floor or ceiling is met, m.
    pub plane: f32,
}

/// Numbers of the whole view. The layout is that of `Params` in `shaders/columns.wgsl`,
/// where `load_params` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(super) struct Params {
    pub width: u32,
    pub height: u32,
    pub wall_count: u32,
    pub body_count: u32,
    pub lamp_count: u32,
    /// Rows that one invocation of the shader renders; the CPU has no use for it.
    pub rows_per_invocation: u32,
    /// Angle between columns, rad.
    pub pixel_rad: f32,
    /// Height of the camera above the floor, m.
    pub camera_height: f32,
    /// Position of the camera in the room, m.
    pub camera: [f32; 2],
    /// Height of the room, m.
    pub room_height: f32,
    /// Ambient light.
    pub ambient: f32,
    /// 1 where rows are even in elevation, 0 where they are even in its tangent.
    pub equal_angle: u32,
    /// Pieces of windows; they follow the lamps.
    pub pane_count: u32,
    /// Share of ambient light that does not reach corners.
    pub corner_shade: f32,
    /// Inverse of how far that reaches, 1/m.
    pub inverse_reach: f32,
    /// Row of the horizon.
    pub horizon_row: f32,
    /// The rows that can meet the ceiling are those before this one, ...
    pub ceiling_end: u32,
    /// ... and those that can meet the floor begin with this one.
    pub floor_start: u32,
    /// Where the shader finds the first edge, body, lamp and look in its table, which begins with this; in units of 16 bytes.
    pub first_edge: u32,
    pub first_body: u32,
    pub first_lamp: u32,
    /// No word is greater than this; the shader's compiler must not know.
    pub all_bits: u32,
    pub first_look: u32,
}
