// Colour of a surface where a ray meets it: prefiltered texture times light. The twin of src/render/shade.rs.

const LAMP_SIZE_SQUARED: f32 = 0.01;
const LEAST_COSINE: f32 = 0.05;

struct Material {
    base: u32,
    log2_size: u32,
    texels_per_m: f32,
    padding: u32,
}

struct Lamp {
    position: vec2<f32>,
    height: f32,
    intensity: f32,
}

@group(0) @binding(5) var<storage, read> lamps: array<Lamp>;
@group(0) @binding(6) var<storage, read> materials: array<Material>;
@group(0) @binding(7) var<storage, read> atlas: array<u32>;

fn level(material: Material, a_m: f32, b_m: f32) -> i32 {
    let footprint = max(0.5 * max(a_m, b_m), min(a_m, b_m)) * material.texels_per_m;
    let logarithm = (bitcast<i32>(footprint) - 0x3f800000) >> 15u;
    return clamp(logarithm, 0, 256 * i32(material.log2_size));
}

fn fixed(coordinate_m: f32, material: Material) -> i32 {
    return i32(coordinate_m * material.texels_per_m * 256.0);
}

fn level_base(material: Material, level: u32) -> u32 {
    let finest = 2u * material.log2_size;
    return material.base + ((4u << finest) - (4u << (finest - 2u * level))) / 3u;
}

// Red and blue, then green and alpha, 16 bits each.
fn unpack(texel: u32) -> vec2<u32> {
    return vec2<u32>(texel, texel >> 8u) & vec2<u32>(0x00ff00ffu);
}

fn mix_pairs(a: vec2<u32>, b: vec2<u32>, weight: u32) -> vec2<u32> {
    return ((a * (256u - weight) + b * weight + vec2<u32>(0x00800080u)) >> vec2<u32>(8u)) & vec2<u32>(0x00ff00ffu);
}

struct Axis {
    first: u32,
    second: u32,
    weight: u32,
}

fn axis(coordinate: i32, level: u32, log2_size: u32) -> Axis {
    let at = (coordinate >> level) - 128;
    let mask = (1u << (log2_size - level)) - 1u;
    let texel = u32(at >> 8u);
    return Axis(texel & mask, (texel + 1u) & mask, u32(at & 255));
}

struct Lines {
    first: u32,
    second: u32,
    weight: u32,
    level: u32,
}

fn new_lines(material: Material, level: u32, u: i32) -> Lines {
    let base = level_base(material, level);
    let a = axis(u, level, material.log2_size);
    let shift = material.log2_size - level;
    return Lines(base + (a.first << shift), base + (a.second << shift), a.weight, level);
}

fn sample_lines(lines: Lines, log2_size: u32, v: i32) -> vec2<u32> {
    let b = axis(v, lines.level, log2_size);
    let near = mix_pairs(unpack(atlas[lines.first + b.first]), unpack(atlas[lines.second + b.first]), lines.weight);
    let far = mix_pairs(unpack(atlas[lines.first + b.second]), unpack(atlas[lines.second + b.second]), lines.weight);
    return mix_pairs(near, far, b.weight);
}

struct Strip {
    material: Material,
    fine: Lines,
    coarse: Lines,
    weight: u32,
}

fn new_strip(material: Material, u_m: f32, level: i32) -> Strip {
    let u = fixed(u_m, material);
    let fine = u32(level >> 8u);
    let coarse = min(fine + 1u, material.log2_size);
    return Strip(material, new_lines(material, fine, u), new_lines(material, coarse, u), u32(level & 255));
}

fn sample_strip(strip: Strip, v_m: f32) -> vec2<u32> {
    let v = fixed(v_m, strip.material);
    let fine = sample_lines(strip.fine, strip.material.log2_size, v);
    if strip.weight == 0u {
        return fine;
    }
    return mix_pairs(fine, sample_lines(strip.coarse, strip.material.log2_size, v), strip.weight);
}

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

fn pack(colour: vec2<u32>, light: f32) -> u32 {
    let channels = vec4<f32>(vec4<u32>(colour & vec2<u32>(0xffffu), colour >> vec2<u32>(16u)));
    let lit = vec4<u32>(min(channels * light + 0.5, vec4<f32>(255.0)));
    return lit.x | (lit.y << 8u) | (lit.z << 16u) | 0xff000000u;
}
