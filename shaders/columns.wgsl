// What the rays of a column meet: walls and bodies, nearest first. The twin of src/render/columns.rs and,
// for the list of hits, src/render/hits.rs.
//
// Tables are storage textures, or a uniform buffer: a software adapter reads these in vectors. Storage buffers it reads lane by
// lane, and sampled textures through a function that costs twice as much.

const FAR: f32 = 1.0e9;
const MAX_HITS: u32 = 16u;
const MAX_ROWS: u32 = 4096u;
const OVERLAP: f32 = 1.0e-4;
const PI: f32 = 3.14159265;

// What views have in common is compiled in.
override equal_angle: bool = false;
override lamps_shine: bool = true;
override corners_are_dark: bool = true;

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
    horizon_row: f32,
    ceiling_end: u32,
    floor_start: u32,
    first_edge: u32,
    first_body: u32,
    first_lamp: u32,
    all_bits: u32,
    first_look: u32,
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
}

// Parameters, edges, bodies, lamps and looks, one table after the other, 16 bytes a texel.
@group(0) @binding(0) var tables: texture_storage_2d<rgba32uint, read>;
@group(0) @binding(1) var<storage, read> directions: array<vec2<f32>>;
@group(0) @binding(2) var<uniform> rows: array<Row, MAX_ROWS>;

// What `tables` begins with. They are no uniform buffer, because Mesa's lavapipe would compile its values into the shader, anew
// for each picture.
var<private> params: Params;

fn table_words(k: u32) -> vec4<u32> {
    return textureLoad(tables, vec2<u32>(k & 1023u, k >> 10u));
}

fn table_numbers(k: u32) -> vec4<f32> {
    return bitcast<vec4<f32>>(table_words(k));
}

fn load_params() {
    let a = table_words(0u);
    let b = table_words(1u);
    let c = bitcast<vec4<f32>>(table_words(1u));
    let d = bitcast<vec4<f32>>(table_words(2u));
    let e = table_words(3u);
    let f = bitcast<vec4<f32>>(table_words(3u));
    let g = table_words(4u);
    let horizon_row = bitcast<f32>(g.x);
    let h = table_words(5u);
    params = Params(
        a.x, a.y, a.z, a.w,
        b.x, b.y, c.z, c.w,
        d.xy, d.z, d.w,
        e.x, e.y, f.z, f.w,
        horizon_row, g.y, g.z, g.w,
        h.x, h.y, h.z, h.w,
    );
}

// What a surface of this view is: number of its material in the lower half, instance id in the upper one.
fn look_of(surface: u32) -> u32 {
    return table_words(params.first_look + (surface >> 2u))[surface & 3u];
}

fn edge_at(k: u32) -> Edge {
    let first = table_numbers(params.first_edge + 2u * k);
    let second = table_numbers(params.first_edge + 2u * k + 1u);
    return Edge(first.xy, first.zw, second.x, second.y, second.z, second.w);
}

fn body_at(k: u32) -> Body {
    let first = table_numbers(params.first_body + 3u * k);
    let second = table_words(params.first_body + 3u * k + 1u);
    let third = table_words(params.first_body + 3u * k + 2u);
    let extent = bitcast<vec4<f32>>(second);
    return Body(first.xy, first.zw, extent.x, extent.y, extent.z, second.w, third.x, bitcast<f32>(third.y));
}

struct Hit {
    near: f32,
    far: f32,
    normal: vec2<f32>,
    u: f32,
    surface: u32,
}

// The hits of this invocation's column, nearest first, and how many there are: what decides which rows see them. The rest is
// computed again when a hit is shaded, which is cheaper than to keep it.
var<private> hit_near: array<f32, MAX_HITS>;
var<private> hit_far: array<f32, MAX_HITS>;
var<private> hit_surface: array<u32, MAX_HITS>;
var<private> hit_count: u32;

fn none() -> Hit {
    return Hit(FAR, FAR, vec2<f32>(0.0), 0.0, 0u);
}

// A hit whose near is FAR is no hit.
fn hit_wall(k: u32, direction: vec2<f32>) -> Hit {
    var hit = none();
    let edge = edge_at(k);
    let facing = dot(edge.normal, direction);
    let near = edge.distance / facing;
    let along = near * dot(edge.tangent, direction) - edge.along;
    if facing < 0.0 && edge.distance < 0.0 && along >= -OVERLAP && along <= edge.length + OVERLAP {
        hit.near = near;
        hit.far = near;
        hit.normal = edge.normal;
        hit.u = edge.u + along;
        hit.surface = 2u + k;
    }
    return hit;
}

fn hit_body(k: u32, direction: vec2<f32>) -> Hit {
    let body = body_at(k);
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
    hit.surface = 2u + params.wall_count + k;
    return hit;
}

fn hit_disc(body: Body, direction: vec2<f32>) -> Hit {
    var hit = none();
    let c = body.centre;
    let middle = dot(c, direction);
    let aside = direction.x * c.y - direction.y * c.x;
    let square = body.radius * body.radius - aside * aside;
    let half = sqrt(max(square, 0.0));
    if square > 0.0 && middle + half > 0.0 {
        hit.near = middle - half;
        hit.far = middle + half;
        hit.normal = (hit.near * direction - c) / body.radius;
        let cos = body.heading.x;
        let sin = body.heading.y;
        let own = vec2<f32>(cos * hit.normal.x + sin * hit.normal.y, cos * hit.normal.y - sin * hit.normal.x);
        hit.u = body.radius * angle(own.y, own.x);
    }
    return hit;
}

fn hit_polygon(body: Body, direction: vec2<f32>) -> Hit {
    var near = -FAR;
    var far = FAR;
    var entry = body.first_edge;
    for (var k = body.first_edge; k < body.first_edge + body.edge_count; k++) {
        let edge = edge_at(k);
        let facing = dot(edge.normal, direction);
        let t = edge.distance / facing;
        if facing == 0.0 {
            // Along the edge, outside of it or not.
            if edge.distance < 0.0 {
                far = -FAR;
            }
        } else if facing > 0.0 {
            far = min(far, t);
        } else if t > near {
            near = t;
            entry = k;
        }
    }
    var hit = none();
    if near < far && far > 0.0 {
        let edge = edge_at(entry);
        hit.near = near;
        hit.far = far;
        hit.normal = edge.normal;
        hit.u = edge.u + near * dot(edge.tangent, direction) - edge.along;
    }
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

// The hit on a surface that is known to be met.
fn hit_again(surface: u32, direction: vec2<f32>) -> Hit {
    if surface < 2u + params.wall_count {
        return hit_wall(surface - 2u, direction);
    }
    return hit_body(surface - 2u - params.wall_count, direction);
}

// Fills the list of hits: every wall and body is tried. The twin only tries those that span the column, which finds the same.
fn find_hits(direction: vec2<f32>) {
    var wall = none();
    for (var k = 0u; k < params.wall_count; k++) {
        let hit = hit_wall(k, direction);
        if hit.near < wall.near {
            wall = hit;
        }
    }
    hit_count = 0u;
    for (var k = 0u; k < params.body_count; k++) {
        let hit = hit_body(k, direction);
        if hit.near < wall.near {
            insert_hit(hit.near, min(hit.far, wall.near), hit.surface);
        }
    }
    sort_hits();
    // One place is kept for the wall.
    if wall.near < FAR {
        hit_near[hit_count] = wall.near;
        hit_far[hit_count] = wall.near;
        hit_surface[hit_count] = wall.surface;
        hit_count++;
    }
}

// Puts a hit at the end of the list, or in the place of the farthest where that is farther and the list full.
fn insert_hit(near: f32, far: f32, surface: u32) {
    var place = hit_count;
    if hit_count == MAX_HITS - 1u {
        var farthest = near;
        for (var k = 0u; k < hit_count; k++) {
            // Of equally far ones that with the greatest number.
            let as_far = place < hit_count && hit_near[k] == farthest && hit_surface[k] > hit_surface[place];
            if hit_near[k] > farthest || as_far {
                farthest = hit_near[k];
                place = k;
            }
        }
    }
    if place < MAX_HITS - 1u {
        hit_near[place] = near;
        hit_far[place] = far;
        hit_surface[place] = surface;
        hit_count = max(hit_count, place + 1u);
    }
}

// Sorts the list by distance; equally far ones by number.
fn sort_hits() {
    for (var k = 1u; k < hit_count; k++) {
        let near = hit_near[k];
        let far = hit_far[k];
        let surface = hit_surface[k];
        var place = k;
        while place > 0u && (hit_near[place - 1u] > near || hit_near[place - 1u] == near && hit_surface[place - 1u] > surface) {
            hit_near[place] = hit_near[place - 1u];
            hit_far[place] = hit_far[place - 1u];
            hit_surface[place] = hit_surface[place - 1u];
            place--;
        }
        hit_near[place] = near;
        hit_far[place] = far;
        hit_surface[place] = surface;
    }
}
