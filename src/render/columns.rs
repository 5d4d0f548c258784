//! What the rays of a column meet: walls and bodies, nearest first. The twin of `shaders/columns.wgsl`.
//!
//! All rays of a column lie in one upright plane, so what they meet is a matter of two dimensions: a wall is a line, a body an
//! interval of horizontal distance. The rows only decide which of these hits each ray sees.

use super::records::{Body, Edge, FAR, Params};

/// Greatest number of hits kept in a column, the wall included. Where a ray would meet more bodies before a wall, those
/// farthest away are left out; what stands behind fifteen others is as good as never seen.
pub(super) const MAX_HITS: usize = 16;
/// Length by which walls overlap at corners, m, so that no ray slips through between two.
const OVERLAP: f32 = 1.0e-4;

/// A wall or body met by the rays of a column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    /// Horizontal distance at which the rays enter, m; 0 where the camera stands under or above the body.
    pub near: f32,
    /// Horizontal distance at which they leave, m.
    pub far: f32,
    /// Height of the underside, m.
    pub bottom: f32,
    /// Height of the top, m.
    pub top: f32,
    /// Outward unit normal at the entry.
    pub normal: [f32; 2],
    /// Texture coordinate u at the entry, m.
    pub u: f32,
    /// Number of the surface.
    pub surface: u32,
}

impl Hit {
    /// Stands where there is none.
    pub const NONE: &'static Self = &Self { near: FAR, far: FAR, bottom: -FAR, top: FAR, normal: [0.0; 2], u: 0.0, surface: 0 };
}

/// What a ray sees of a hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Face {
    Side = 0,
    Top = 1,
    Underside = 2,
}

#[inline(always)]
fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// The rays' hit on wall `k`, if they meet it from inside the room.
///
/// Walls count as endlessly high: floor and ceiling are nearer wherever a ray would pass below or above one.
#[inline(always)]
pub(super) fn hit_wall(edge: &Edge, k: u32, direction: [f32; 2]) -> Option<Hit> {
    let facing = dot(edge.normal, direction);
    if facing >= 0.0 || edge.distance >= 0.0 {
        return None;
    }
    let near = edge.distance / facing;
    let along = near * dot(edge.tangent, direction) - edge.along;
    let met = along >= -OVERLAP && along <= edge.length + OVERLAP;
    met.then(|| Hit { near, far: near, normal: edge.normal, u: edge.u + along, surface: 2 + k, ..*Hit::NONE })
}

/// The rays' hit on body `k`, if they meet it; `None` also where the camera is inside its solid.
#[inline(always)]
pub(super) fn hit_body(body: &Body, k: u32, edges: &[Edge], params: &Params, direction: [f32; 2]) -> Option<Hit> {
    let hit = if body.radius > 0.0 { hit_disc(body, direction) } else { hit_polygon(edges, body, direction) }?;
    let inside = hit.near <= 0.0 && body.bottom <= params.camera_height && params.camera_height <= body.top;
    let surface = 2 + params.wall_count + k;
    (!inside).then_some(Hit { near: hit.near.max(0.0), bottom: body.bottom, top: body.top, surface, ..hit })
}

#[inline(always)]
fn hit_disc(body: &Body, direction: [f32; 2]) -> Option<Hit> {
    let c = body.centre;
    let middle = dot(c, direction);
    // Distance of the ray from the centre; |c|^2 - middle^2 would cancel.
    let aside = direction[0] * c[1] - direction[1] * c[0];
    let square = body.radius * body.radius - aside * aside;
    if square <= 0.0 {
        return None;
    }
    let half = square.sqrt();
    let (near, far) = (middle - half, middle + half);
    if far <= 0.0 {
        return None;
    }
    let normal = [(near * direction[0] - c[0]) / body.radius, (near * direction[1] - c[1]) / body.radius];
    let [cos, sin] = body.heading;
    let own = [cos * normal[0] + sin * normal[1], cos * normal[1] - sin * normal[0]];
    Some(Hit { near, far, normal, u: body.radius * angle(own[1], own[0]), ..*Hit::NONE })
}

#[inline(always)]
fn hit_polygon(edges: &[Edge], body: &Body, direction: [f32; 2]) -> Option<Hit> {
    let first = body.first_edge as usize;
    let (mut near, mut far, mut entry) = (-FAR, FAR, first);
    for (k, edge) in edges.iter().enumerate().skip(first).take(body.edge_count as usize) {
        let facing = dot(edge.normal, direction);
        if facing == 0.0 {
            if edge.distance < 0.0 {
                return None; // runs along the edge, outside
            }
            continue;
        }
        let t = edge.distance / facing;
        if facing < 0.0 {
            if t > near {
                (near, entry) = (t, k);
            }
        } else {
            far = far.min(t);
        }
    }
    if near >= far || far <= 0.0 {
        return None;
    }
    let edge = &edges[entry];
    let along = near * dot(edge.tangent, direction) - edge.along;
    Some(Hit { near, far, normal: edge.normal, u: edge.u + along, ..*Hit::NONE })
}

/// Angle of (x, y) in (-pi, pi], to 1e-5 rad: by a polynomial, so that CPU and GPU compute the same.
#[inline(always)]
pub(super) fn angle(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let ratio = ax.min(ay) / ax.max(ay).max(1.0e-30);
    let s = ratio * ratio;
    // Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49.
    let mut a = ratio * (0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1))));
    if ay > ax {
        a = std::f32::consts::FRAC_PI_2 - a;
    }
    if x < 0.0 {
        a = std::f32::consts::PI - a;
    }
    if y < 0.0 { -a } else { a }
}

#[cfg(test)]
mod tests {
    use super::angle;

    #[test]
    fn angle_is_that_of_the_library() {
        for k in -314..=314 {
            let a = 0.01 * k as f32;
            assert!((angle(libm::sinf(a), libm::cosf(a)) - a).abs() < 2e-5, "{a}");
        }
    }
}
