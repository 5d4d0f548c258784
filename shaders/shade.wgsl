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
}

fn lamp_at(k: u32) -> Lamp {
    let first = table_numbers(params.first_lamp + 2u * k);
    let second = table_numbers(params.first_lamp + 2u * k + 1u);
    return Lamp(first.xy, first.z, first.w, second.xy, second.z);
}

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
        deepest = max(deepest, depth_at_wall(edge_at(k), point, normal));
    }
    return deepest;
}

fn glow_of(surface: u32) -> f32 {
    if surface < 2u + params.wall_count {
        return 0.0;
    }
    return body_at(surface - 2u - params.wall_count).glow;
}

// Colour times light, packed with red in the lowest byte. Light is rounded to 1/4096, at most 16.
fn light_up(colour: Colour, light: f32) -> u32 {
    let factor = u32(round_small(min(light * 4096.0, 65535.0)));
    let red = channel_lit(colour.red_blue & 0xffffu, factor);
    let blue = channel_lit(colour.red_blue >> 16u, factor);
    return red | (channel_lit(colour.green, factor) << 8u) | (blue << 16u);
}

fn channel_lit(channel: u32, factor: u32) -> u32 {
    return min((((channel * factor) >> 16u) + 8u) >> 4u, 255u);
}

// What the rows of a side have in common.
struct Side {
    strip: Strip,
    material: Material,
    near: f32,
    point: vec2<f32>,
    normal: vec2<f32>,
    // In tiles, within one.
    u: f32,
    slant: f32,
    foot: f32,
    glow: f32,
    // Share of ambient light that comes past the walls.
    open: f32,
}

fn new_side(hit: Hit, direction: vec2<f32>) -> Side {
    let material = material_at(hit.surface);
    let cosine = -dot(hit.normal, direction);
    let across = hit.near * params.pixel_rad;
    let slant = across / max(cosine, LEAST_COSINE);
    let foot = material.foot;
    let detail = level(material, strip_footprint(material.tiles_per_m, vec2<f32>(slant, across)));
    let v = params.camera_height + hit.near * rows[0u].tan - foot;
    let strip = new_strip(material.tiles_per_m, hit.u, v, across, detail);
    let u = within_tile(hit.u, material.tiles_per_m.x);
    let point = hit.near * direction;
    var open = 1.0;
    if corners_are_dark {
        open = 1.0 - params.corner_shade * nook(point, hit.normal);
    }
    return Side(strip, material, hit.near, point, hit.normal, u, slant, foot, glow_of(hit.surface), open);
}

fn light_on_side(side: Side, z: f32) -> f32 {
    var light = params.ambient;
    if corners_are_dark {
        let edge = max(corner_depth(z), corner_depth(params.room_height - z));
        light *= side.open * (1.0 - params.corner_shade * edge);
    }
    light += side.glow;
    if lamps_shine {
        for (var k = 0u; k < params.lamp_count; k++) {
            let lamp = lamp_at(k);
            let to = lamp.position - side.point;
            light += lit(lamp, dot(to, to), z, dot(side.normal, to));
        }
        for (var k = params.lamp_count; k < params.lamp_count + params.pane_count; k++) {
            let pane = lamp_at(k);
            let to = pane.position - side.point;
            let facing = dot(side.normal, to);
            let faced = -dot(pane.normal, to);
            if facing > 0.0 && faced > 0.0 {
                light += lit_by_window(pane, pane.intensity * facing * faced, dot(to, to), z);
            }
        }
    }
    return light;
}

fn shade_side(side: Side, number: u32, row: Row) -> u32 {
    let z = params.camera_height + side.near * row.tan;
    let light = light_on_side(side, z);
    if !equal_angle {
        return light_up(sample_strip(side.strip, number), light);
    }
    let high = side.near * params.pixel_rad * row.stretch * row.stretch;
    let detail = level(side.material, footprint(side.material.tiles_per_m, vec2<f32>(side.slant, high)));
    let v = within_tile(z - side.foot, side.material.tiles_per_m.y);
    return light_up(sample_point(detail, coordinate(side.u, detail), coordinate(v, detail)), light);
}

// A horizontal surface.
struct Plane {
    material: Material,
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
        let body = body_at(surface - 2u - params.wall_count);
        let cos = body.heading.x;
        let sin = body.heading.y;
        camera = -vec2<f32>(cos * body.centre.x + sin * body.centre.y, cos * body.centre.y - sin * body.centre.x);
        heading = body.heading;
        z = select(body.top, body.bottom, underside);
    }
    let material = material_at(surface);
    camera = vec2<f32>(within_tile(camera.x, material.tiles_per_m.x), within_tile(camera.y, material.tiles_per_m.y));
    return Plane(material, heading, camera, z, select(1.0, -1.0, underside), glow_of(surface));
}

fn light_on_plane(plane: Plane, point: vec2<f32>) -> f32 {
    var light = params.ambient;
    if corners_are_dark {
        light *= 1.0 - params.corner_shade * nook(point, vec2<f32>(0.0));
    }
    light += plane.glow;
    if lamps_shine {
        for (var k = 0u; k < params.lamp_count; k++) {
            let lamp = lamp_at(k);
            let to = lamp.position - point;
            light += lit(lamp, dot(to, to), plane.z, plane.up * (lamp.height - plane.z));
        }
        for (var k = params.lamp_count; k < params.lamp_count + params.pane_count; k++) {
            let pane = lamp_at(k);
            let facing = plane.up * (pane.height - plane.z);
            if facing > 0.0 {
                let to = pane.position - point;
                let weight = pane.intensity * facing * max(-dot(pane.normal, to), 0.0);
                light += lit_by_window(pane, weight, dot(to, to), plane.z);
            }
        }
    }
    return light;
}

fn shade_plane(plane: Plane, direction: vec2<f32>, t: f32, row: Row) -> u32 {
    let cos = plane.heading.x;
    let sin = plane.heading.y;
    let across = t * params.pixel_rad;
    var spread = 1.0;
    if equal_angle {
        spread = row.stretch * row.stretch;
    }
    let deep = across * abs(row.inverse_tan) * spread;
    let scale = plane.material.tiles_per_m;
    let detail = level(plane.material, max(0.5 * max(deep, across), min(deep, across)) * max(scale.x, scale.y));
    let size = f32(detail.size);
    let texels = t * scale * size;
    let camera = plane.camera * size;
    let u = wrapped(texels.x * (cos * direction.x + sin * direction.y) + camera.x, detail);
    let v = wrapped(texels.y * (cos * direction.y - sin * direction.x) + camera.y, detail);
    return light_up(sample_point(detail, u, v), light_on_plane(plane, t * direction));
}
