// Prefiltered texture sampling. The twin of src/render/sample.rs.

const ROUNDER: f32 = 12582912.0;
// -0.082 in units of the logarithm.
const ROUNDING: i32 = -687865;
const LEVELS: u32 = 45u;

// A level of a texture, with a border of one texel.
struct MipLevel {
    base: u32,
    size: u32,
}

struct Material {
    tiles_per_m: vec2<f32>,
    last_level: u32,
    padding: u32,
    levels: array<MipLevel, LEVELS>,
}

@group(0) @binding(6) var<storage, read> materials: array<Material>;
@group(0) @binding(7) var<storage, read> atlas: array<u32>;

fn round_small(x: f32) -> i32 {
    return bitcast<i32>(x + ROUNDER) - bitcast<i32>(ROUNDER);
}

fn footprint(tiles_per_m: vec2<f32>, covered_m: vec2<f32>) -> f32 {
    let tiles = covered_m * tiles_per_m;
    return max(0.5 * max(tiles.x, tiles.y), min(tiles.x, tiles.y));
}

fn strip_footprint(tiles_per_m: vec2<f32>, covered_m: vec2<f32>) -> f32 {
    let tiles = covered_m * tiles_per_m;
    return max(0.5 * tiles.x, tiles.y);
}

fn level(surface: u32, footprint: f32) -> MipLevel {
    let texels = footprint * f32(materials[surface].levels[0].size);
    // The clamp keeps the sum from overflowing.
    let logarithm = min(bitcast<i32>(texels) - bitcast<i32>(1.0), 0x3fffffff);
    let number = clamp((logarithm + ROUNDING) >> 21u, 0, i32(materials[surface].last_level));
    return materials[surface].levels[number];
}

fn within_tile(length_m: f32, tiles_per_m: f32) -> f32 {
    let tiles = length_m * tiles_per_m;
    return tiles - floor(tiles);
}

fn coordinate(within_tile: f32, level: MipLevel) -> i32 {
    return i32(within_tile * f32(level.size) * 256.0) - 128;
}

fn wrapped(texels: f32, level: MipLevel) -> i32 {
    let tiles = i32(floor(texels * (1.0 / f32(level.size))));
    return round_small(texels * 256.0) - tiles * (256 * i32(level.size)) - 128;
}

// Index of texel (u, v) of a level, from (-1, -1) on, and the first of the border beyond the last texel.
fn texel_index(level: MipLevel, u: i32, v: i32) -> u32 {
    return level.base + u32(u + 1) * (level.size + 2u) + u32(v + 1);
}

// The means of four bytes, rounded up.
fn mean(a: u32, b: u32) -> u32 {
    return (a | b) - (((a ^ b) >> 1u) & 0x7f7f7f7fu);
}

// The four channels of a texel.
fn unpack(texel: u32) -> vec4<u32> {
    return vec4<u32>(texel, texel >> 8u, texel >> 16u, texel >> 24u) & vec4<u32>(255u);
}

// The sum of two texels with weights that make up 256.
fn weigh(a: vec4<u32>, b: vec4<u32>, weight: u32) -> vec4<u32> {
    return a * (256u - weight) + b * weight;
}

// A texture with u and level of detail fixed: two lines of texels along v, the share in 1/16 of the second, and v of row 0 and
// its step in 1/65536 texel.
struct Strip {
    first: u32,
    pitch: u32,
    size: i32,
    weight: u32,
    v: i32,
    step: i32,
}

fn new_strip(tiles_per_m: vec2<f32>, u_m: f32, v_m: f32, step_m: f32, level: MipLevel) -> Strip {
    let size = f32(level.size);
    let u = coordinate(within_tile(u_m, tiles_per_m.x), level);
    let v = i32(within_tile(v_m, tiles_per_m.y) * size * 65536.0);
    let step = i32(step_m * tiles_per_m.y * size * -65536.0);
    return Strip(texel_index(level, u >> 8u, 0), level.size + 2u, i32(level.size), u32(u >> 4u) & 15u, v, step);
}

// A texel of the two lines, mixed by means alone.
fn strip_texel(strip: Strip, place: u32) -> u32 {
    let a = atlas[strip.first + place];
    let b = atlas[strip.first + strip.pitch + place];
    let w = mean(a, select(a, b, (strip.weight & 1u) != 0u));
    let x = mean(w, select(a, b, (strip.weight & 2u) != 0u));
    let y = mean(x, select(a, b, (strip.weight & 4u) != 0u));
    return mean(y, select(a, b, (strip.weight & 8u) != 0u));
}

// Colour in 1/256.
fn sample_strip(strip: Strip, row: u32) -> vec4<u32> {
    let at = ((strip.v + strip.step * i32(row)) >> 8u) - 128;
    let rest = (at >> 8u) % strip.size;
    let place = u32(select(rest, rest + strip.size, rest < 0));
    return weigh(unpack(strip_texel(strip, place)), unpack(strip_texel(strip, place + 1u)), u32(at & 255));
}

// A texture at a point, in 1/256.
fn sample_point(level: MipLevel, u: i32, v: i32) -> vec4<u32> {
    let first = texel_index(level, u >> 8u, v >> 8u);
    let second = first + level.size + 2u;
    let weight = u32(u & 255);
    let near = (weigh(unpack(atlas[first]), unpack(atlas[second]), weight) + vec4<u32>(128u)) >> vec4<u32>(8u);
    let far = (weigh(unpack(atlas[first + 1u]), unpack(atlas[second + 1u]), weight) + vec4<u32>(128u)) >> vec4<u32>(8u);
    return weigh(near, far, u32(v & 255));
}
