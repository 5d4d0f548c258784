// Colour of a surface where a ray meets it: texture times light. The twin of src/render/shade.rs.

const LAMP_SIZE_SQUARED: f32 = 0.01;
const LEAST_COSINE: f32 = 0.05;
const LEAST_SQUARE: f32 = 1.0e-4;
const BEHIND: f32 = 1.0e-6;

struct Lamp {
    position: vec2<f32>,
    height: f32,
    intensity: f32,
    normal: vec2<f32>,
    size_squared: f32,
    padding: u32,
}

@group(0) @binding(5) var<storage, read> lamps: array<Lamp>;

fn lit(lamp: Lamp, offset_squared: f32, z: f32, facing: f32) -> f32 {
    let up = lamp.height - z;
    let square = max(offset_squared + up * up, LAMP_SIZE_SQUARED);
    return lamp.intensity * max(facing, 0.0) / (square * sqrt(square));
}

fn lit_by_window(pane: Lamp, weight: f32, offset_squared: f32, z: f32) -> f32 {
    let up = pane.height - z;
    let square = max(offset_squared + up * up, LEAST_SQUARE);
    return weight / (square * (square + pane.size_squared));
}

fn corner_depth(distance: f32) -> f32 {
    let depth = max(1.0 - distance * params.inverse_reach, 0.0);
    return depth * depth;
}

fn depth_at_wall(edge: Edge, point: vec2<f32>, normal: vec2<f32>) -> f32 {
    let before = dot(edge.normal, point) - edge.distance;
    let along = dot(edge.tangent, point) - edge.along;
    let past = max(max(-along, along - edge.length), 0.0);
    let turned = min(1.0 - dot(normal, edge.normal), 1.0);
    let depth = turned * corner_depth(sqrt(before * before + past * past));
    return select(0.0, depth, before > -BEHIND);
}

// How deep a point is in the corners between its surface and the walls.
fn nook(point: vec2<f32>, normal: vec2<f32>) -> f32 {
    var deepest = 0.0;
    for (var k = 0u; k < params.wall_count; k++) {
        deepest = max(deepest, depth_at_wall(edges[k], point, normal));
    }
    return deepest;
}

fn glow_of(surface: u32) -> f32 {
    if surface < 2u + params.wall_count {
        return 0.0;
    }
    return bodies[surface - 2u - params.wall_count].glow;
}

// Colour in 1/256 times light, packed with red in the lowest byte; opaque. Light is rounded to 1/4096, at most 16.
fn light_up(colour: vec4<u32>, light: f32) -> u32 {
    let factor = u32(round_small(min(light * 4096.0, 65535.0)));
    let lit = min((((colour * factor) >> vec4<u32>(16u)) + vec4<u32>(8u)) >> vec4<u32>(4u), vec4<u32>(255u));
    return lit.x | (lit.y << 8u) | (lit.z << 16u) | 0xff000000u;
}

// What the rows of a side have in common.
struct Side {
    strip: Strip,
    near: f32,
    point: vec2<f32>,
    normal: vec2<f32>,
    surface: u32,
    u: f32,
    slant: f32,
    foot: f32,
    glow: f32,
    // Share of ambient light that comes past the walls.
    open: f32,
}

fn new_side(hit: Hit, direction: vec2<f32>) -> Side {
    let tiles_per_m = materials[hit.surface].tiles_per_m;
    let cosine = -dot(hit.normal, direction);
    let across = hit.near * params.pixel_rad;
    let slant = across / max(cosine, LEAST_COSINE);
    let foot = max(hit.bottom, 0.0);
    let detail = level(hit.surface, strip_footprint(tiles_per_m, vec2<f32>(slant, across)));
    let v = params.camera_height + hit.near * rows[0].tan - foot;
    let strip = new_strip(tiles_per_m, hit.u, v, across, detail);
    let u = within_tile(hit.u, tiles_per_m.x);
    let point = hit.near * direction;
    var open = 1.0;
    if params.corner_shade > 0.0 {
        open = 1.0 - params.corner_shade * nook(point, hit.normal);
    }
    return Side(strip, hit.near, point, hit.normal, hit.surface, u, slant, foot, glow_of(hit.surface), open);
}

fn shade_side(side: Side, row: u32) -> u32 {
    let z = params.camera_height + side.near * rows[row].tan;
    var light = params.ambient;
    if params.corner_shade > 0.0 {
        let edge = max(corner_depth(z), corner_depth(params.room_height - z));
        light *= side.open * (1.0 - params.corner_shade * edge);
    }
    light += side.glow;
    for (var k = 0u; k < params.lamp_count; k++) {
        let to = lamps[k].position - side.point;
        light += lit(lamps[k], dot(to, to), z, dot(side.normal, to));
    }
    for (var k = params.lamp_count; k < params.lamp_count + params.pane_count; k++) {
        let to = lamps[k].position - side.point;
        let facing = dot(side.normal, to);
        let faced = -dot(lamps[k].normal, to);
        if facing > 0.0 && faced > 0.0 {
            light += lit_by_window(lamps[k], lamps[k].intensity * facing * faced, dot(to, to), z);
        }
    }
    if params.equal_angle == 0u {
        return light_up(sample_strip(side.strip, row), light);
    }
    let high = side.near * params.pixel_rad * rows[row].stretch * rows[row].stretch;
    let tiles_per_m = materials[side.surface].tiles_per_m;
    let detail = level(side.surface, footprint(tiles_per_m, vec2<f32>(side.slant, high)));
    let v = within_tile(z - side.foot, tiles_per_m.y);
    return light_up(sample_point(detail, coordinate(side.u, detail), coordinate(v, detail)), light);
}

struct Plane {
    surface: u32,
    heading: vec2<f32>,
    camera: vec2<f32>,
    z: f32,
    up: f32,
    glow: f32,
}

fn new_plane(surface: u32, underside: bool) -> Plane {
    var camera = params.camera;
    var heading = vec2<f32>(1.0, 0.0);
    var z = select(0.0, params.room_height, underside);
    if surface >= 2u {
        let body = bodies[surface - 2u - params.wall_count];
        let cos = body.heading.x;
        let sin = body.heading.y;
        camera = -vec2<f32>(cos * body.centre.x + sin * body.centre.y, cos * body.centre.y - sin * body.centre.x);
        heading = body.heading;
        z = select(body.top, body.bottom, underside);
    }
    let scale = materials[surface].tiles_per_m;
    camera = vec2<f32>(within_tile(camera.x, scale.x), within_tile(camera.y, scale.y));
    return Plane(surface, heading, camera, z, select(1.0, -1.0, underside), glow_of(surface));
}

fn shade_plane(plane: Plane, direction: vec2<f32>, t: f32, row: Row) -> u32 {
    let cos = plane.heading.x;
    let sin = plane.heading.y;
    let across = t * params.pixel_rad;
    let spread = select(row.stretch * row.stretch, 1.0, params.equal_angle == 0u);
    let deep = across * abs(row.inverse_tan) * spread;
    let scale = materials[plane.surface].tiles_per_m;
    let detail = level(plane.surface, max(0.5 * max(deep, across), min(deep, across)) * max(scale.x, scale.y));
    let size = f32(detail.size);
    let texels = t * scale * size;
    let camera = plane.camera * size;
    let u = wrapped(texels.x * (cos * direction.x + sin * direction.y) + camera.x, detail);
    let v = wrapped(texels.y * (cos * direction.y - sin * direction.x) + camera.y, detail);
    let point = t * direction;
    var light = params.ambient;
    if params.corner_shade > 0.0 {
        light *= 1.0 - params.corner_shade * nook(point, vec2<f32>(0.0));
    }
    light += plane.glow;
    for (var k = 0u; k < params.lamp_count; k++) {
        let to = lamps[k].position - point;
        light += lit(lamps[k], dot(to, to), plane.z, plane.up * (lamps[k].height - plane.z));
    }
    for (var k = params.lamp_count; k < params.lamp_count + params.pane_count; k++) {
        let facing = plane.up * (lamps[k].height - plane.z);
        if facing > 0.0 {
            let to = lamps[k].position - point;
            let weight = lamps[k].intensity * facing * max(-dot(lamps[k].normal, to), 0.0);
            light += lit_by_window(lamps[k], weight, dot(to, to), plane.z);
        }
    }
    return light_up(sample_point(detail, u, v), light);
}
