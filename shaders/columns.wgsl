// What the rays of a column meet: walls and bodies, nearest first. The twin of src/render/columns.rs, function by function.

const FAR: f32 = 1.0e9;
const MAX_HITS: u32 = 16u;
const OVERLAP: f32 = 1.0e-4;
const PI: f32 = 3.14159265;

struct Params {
    width: u32,
    height: u32,
    wall_count: u32,
    body_count: u32,
    lamp_count: u32,
    rows_per_invocation: u32,
    pixel_rad: f32,
    camera_height: f32,
    camera: vec2<f32>,
    room_height: f32,
    ambient: f32,
    equal_angle: u32,
    pane_count: u32,
    corner_shade: f32,
    inverse_reach: f32,
}

struct Row {
    tan: f32,
    inverse_tan: f32,
    stretch: f32,
    plane: f32,
}

struct Edge {
    normal: vec2<f32>,
    tangent: vec2<f32>,
    distance: f32,
    along: f32,
    u: f32,
    length: f32,
}

struct Body {
    centre: vec2<f32>,
    heading: vec2<f32>,
    bottom: f32,
    top: f32,
    radius: f32,
    first_edge: u32,
    edge_count: u32,
    glow: f32,
    padding_0: u32,
    padding_1: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> directions: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> rows: array<Row>;
@group(0) @binding(3) var<storage, read> edges: array<Edge>;
@group(0) @binding(4) var<storage, read> bodies: array<Body>;

struct Hit {
    near: f32,
    far: f32,
    bottom: f32,
    top: f32,
    normal: vec2<f32>,
    u: f32,
    surface: u32,
}

// The hits of this invocation's column, nearest first, and how many there are.
var<private> hits: array<Hit, MAX_HITS>;
var<private> hit_count: u32;

fn none() -> Hit {
    return Hit(FAR, FAR, -FAR, FAR, vec2<f32>(0.0), 0.0, 0u);
}

// A hit whose near is FAR is no hit.
fn hit_wall(edge: Edge, k: u32, direction: vec2<f32>) -> Hit {
    var hit = none();
    let facing = dot(edge.normal, direction);
    if facing >= 0.0 || edge.distance >= 0.0 {
        return hit;
    }
    let near = edge.distance / facing;
    let along = near * dot(edge.tangent, direction) - edge.along;
    if along >= -OVERLAP && along <= edge.length + OVERLAP {
        hit.near = near;
        hit.far = near;
        hit.normal = edge.normal;
        hit.u = edge.u + along;
        hit.surface = 2u + k;
    }
    return hit;
}

fn hit_body(k: u32, direction: vec2<f32>) -> Hit {
    let body = bodies[k];
    var hit: Hit;
    if body.radius > 0.0 {
        hit = hit_disc(body, direction);
    } else {
        hit = hit_polygon(body, direction);
    }
    let inside = hit.near <= 0.0 && body.bottom <= params.camera_height && params.camera_height <= body.top;
    if hit.near >= FAR || inside {
        return none();
    }
    hit.near = max(hit.near, 0.0);
    hit.bottom = body.bottom;
    hit.top = body.top;
    hit.surface = 2u + params.wall_count + k;
    return hit;
}

fn hit_disc(body: Body, direction: vec2<f32>) -> Hit {
    var hit = none();
    let c = body.centre;
    let middle = dot(c, direction);
    let aside = direction.x * c.y - direction.y * c.x;
    let square = body.radius * body.radius - aside * aside;
    if square <= 0.0 {
        return hit;
    }
    let half = sqrt(square);
    if middle + half <= 0.0 {
        return hit;
    }
    hit.near = middle - half;
    hit.far = middle + half;
    hit.normal = (hit.near * direction - c) / body.radius;
    let cos = body.heading.x;
    let sin = body.heading.y;
    let own = vec2<f32>(cos * hit.normal.x + sin * hit.normal.y, cos * hit.normal.y - sin * hit.normal.x);
    hit.u = body.radius * angle(own.y, own.x);
    return hit;
}

fn hit_polygon(body: Body, direction: vec2<f32>) -> Hit {
    var near = -FAR;
    var far = FAR;
    var entry = body.first_edge;
    for (var k = body.first_edge; k < body.first_edge + body.edge_count; k++) {
        let facing = dot(edges[k].normal, direction);
        let distance = edges[k].distance;
        if facing == 0.0 {
            if distance < 0.0 {
                return none();
            }
            continue;
        }
        let t = distance / facing;
        if facing < 0.0 {
            if t > near {
                near = t;
                entry = k;
            }
        } else {
            far = min(far, t);
        }
    }
    if near >= far || far <= 0.0 {
        return none();
    }
    var hit = none();
    hit.near = near;
    hit.far = far;
    hit.normal = edges[entry].normal;
    hit.u = edges[entry].u + near * dot(edges[entry].tangent, direction) - edges[entry].along;
    return hit;
}

fn angle(y: f32, x: f32) -> f32 {
    let ax = abs(x);
    let ay = abs(y);
    let ratio = min(ax, ay) / max(max(ax, ay), 1.0e-30);
    let s = ratio * ratio;
    var a = ratio * (0.999866 + s * (-0.3302995 + s * (0.180141 + s * (-0.085133 + s * 0.0208351))));
    if ay > ax {
        a = 0.5 * PI - a;
    }
    if x < 0.0 {
        a = PI - a;
    }
    return select(a, -a, y < 0.0);
}

// Fills `hits`: every wall and body is tried. The twin only tries those that span the column, which finds the same.
fn find_hits(direction: vec2<f32>) {
    hit_count = 0u;
    var wall = none();
    for (var k = 0u; k < params.wall_count; k++) {
        let hit = hit_wall(edges[k], k, direction);
        if hit.near < wall.near {
            wall = hit;
        }
    }
    // One place is kept for the wall.
    for (var k = 0u; k < params.body_count; k++) {
        var hit = hit_body(k, direction);
        if hit.near >= wall.near {
            continue;
        }
        hit.far = min(hit.far, wall.near);
        var place = hit_count;
        while place > 0u && hits[place - 1u].near > hit.near {
            place--;
        }
        if place == MAX_HITS - 1u {
            continue;
        }
        hit_count = min(hit_count + 1u, MAX_HITS - 1u);
        for (var j = hit_count - 1u; j > place; j--) {
            hits[j] = hits[j - 1u];
        }
        hits[place] = hit;
    }
    if wall.near < FAR {
        hits[hit_count] = wall;
        hit_count++;
    }
}
