// Colour of a surface where a ray meets it: texture times light. The twin of src/render/shade.rs.

const LAMP_SIZE_SQUARED: f32 = 0.01;
const LEAST_COSINE: f32 = 0.05;

struct Lamp {
    position: vec2<f32>,
    height: f32,
    intensity: f32,
}

@group(0) @binding(5) var<storage, read> lamps: array<Lamp>;

fn lit(lamp: Lamp, offset_squared: f32, z: f32, facing: f32) -> f32 {
    let up = lamp.height - z;
    let square = max(offset_squared + up * up, LAMP_SIZE_SQUARED);
    return lamp.intensity * max(facing, 0.0) / (square * sqrt(square));
}

struct Side {
    strip: Strip,
    point: vec2<f32>,
    normal: vec2<f32>,
    foot: f32,
}

fn new_side(hit: Hit, direction: vec2<f32>) -> Side {
    let material = materials[hit.surface];
    let cosine = -dot(hit.normal, direction);
    let across = hit.near * params.pixel_rad;
    let detail = level(material, across / max(cosine, LEAST_COSINE), across);
    return Side(new_strip(material, hit.u, detail), hit.near * direction, hit.normal, max(hit.bottom, 0.0));
}

fn side_light(side: Side, z: f32) -> f32 {
    var light = params.ambient;
    for (var k = 0u; k < params.lamp_count; k++) {
        let to = lamps[k].position - side.point;
        light += lit(lamps[k], dot(to, to), z, dot(side.normal, to));
    }
    return light;
}

struct Plane {
    material: Material,
    origin: vec2<f32>,
    heading: vec2<f32>,
    z: f32,
    up: f32,
}

fn plane_of_room(ceiling: bool) -> Plane {
    if ceiling {
        return Plane(materials[1], -params.camera, vec2<f32>(1.0, 0.0), params.room_height, -1.0);
    }
    return Plane(materials[0], -params.camera, vec2<f32>(1.0, 0.0), 0.0, 1.0);
}

fn plane_of_body(hit: Hit, top: bool) -> Plane {
    let body = bodies[hit.surface - 2u - params.wall_count];
    let z = select(hit.bottom, hit.top, top);
    return Plane(materials[hit.surface], body.centre, body.heading, z, select(-1.0, 1.0, top));
}

fn shade_plane(plane: Plane, direction: vec2<f32>, t: f32, inverse_tan: f32) -> u32 {
    let point = t * direction;
    let offset = point - plane.origin;
    let cos = plane.heading.x;
    let sin = plane.heading.y;
    let across = t * params.pixel_rad;
    let detail = level(plane.material, across * abs(inverse_tan), across);
    let strip = new_strip(plane.material, cos * offset.x + sin * offset.y, detail);
    let colour = sample_strip(strip, cos * offset.y - sin * offset.x);
    var light = params.ambient;
    for (var k = 0u; k < params.lamp_count; k++) {
        let to = lamps[k].position - point;
        light += lit(lamps[k], dot(to, to), plane.z, plane.up * (lamps[k].height - plane.z));
    }
    return pack(colour, light);
}

// Colour times light, packed with red in the lowest byte; opaque. Light is rounded to 1/4096, at most 16.
fn pack(colour: vec2<u32>, light: f32) -> u32 {
    let factor = u32(min(light * 4096.0, 65535.0));
    let channels = vec4<u32>(colour & vec2<u32>(0xffffu), colour >> vec2<u32>(16u));
    let lit = min(((channels * 16u + 8u) * factor) >> vec4<u32>(16u), vec4<u32>(255u));
    return lit.x | (lit.y << 8u) | (lit.z << 16u) | 0xff000000u;
}
