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
}

fn new_side(hit: Hit, direction: vec2<f32>) -> Side {
    let material = materials[hit.surface];
    let cosine = -dot(hit.normal, direction);
    let across = hit.near * params.pixel_rad;
    let detail = level(material, across / max(cosine, LEAST_COSINE), across);
    let v_m = params.camera_height + hit.near * rows[0].tan - max(hit.bottom, 0.0);
    let u = i32(within_tile(hit.u, material) * 65536.0);
    let v = i32(within_tile(v_m, material) * 65536.0);
    let step = i32(across * material.texels_per_m * -65536.0);
    return Side(new_strip(material, u, v, step, detail), hit.near, hit.near * direction, hit.normal);
}

fn shade_side(side: Side, row: u32) -> u32 {
    let z = params.camera_height + side.near * rows[row].tan;
    var light = params.ambient;
    for (var k = 0u; k < params.lamp_count; k++) {
        let to = lamps[k].position - side.point;
        light += lit(lamps[k], dot(to, to), z, dot(side.normal, to));
    }
    return light_up(sample_strip(side.strip, row), light);
}

struct Plane {
    material: Material,
    heading: vec2<f32>,
    camera: vec2<f32>,
    z: f32,
    up: f32,
}

fn new_plane(surface: u32, underside: bool) -> Plane {
    let material = materials[surface];
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
    camera = vec2<f32>(within_tile(camera.x, material), within_tile(camera.y, material));
    return Plane(material, heading, camera, z, select(1.0, -1.0, underside));
}

fn shade_plane(plane: Plane, direction: vec2<f32>, t: f32, inverse_tan: f32) -> u32 {
    let cos = plane.heading.x;
    let sin = plane.heading.y;
    let across = t * params.pixel_rad;
    let detail = level(plane.material, across * abs(inverse_tan), across);
    let texels = t * plane.material.texels_per_m;
    let u = round_small((texels * (cos * direction.x + sin * direction.y) + plane.camera.x) * 256.0) << 8u;
    let v = round_small((texels * (cos * direction.y - sin * direction.x) + plane.camera.y) * 256.0) << 8u;
    var light = params.ambient;
    for (var k = 0u; k < params.lamp_count; k++) {
        let to = lamps[k].position - t * direction;
        light += lit(lamps[k], dot(to, to), plane.z, plane.up * (lamps[k].height - plane.z));
    }
    return light_up(sample_point(plane.material, u, v, detail), light);
}
