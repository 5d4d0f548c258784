// Prefiltered texture sampling. The twin of src/render/sample.rs.
//
// Coordinates are in 1/65536 texel of the finest level, and may wrap around.

const ROUNDER: f32 = 12582912.0;

struct Material {
    base: u32,
    log2_size: u32,
    texels_per_m: vec2<f32>,
}

@group(0) @binding(6) var<storage, read> materials: array<Material>;
@group(0) @binding(7) var<storage, read> atlas: array<u32>;

fn round_small(x: f32) -> i32 {
    return bitcast<i32>(x + ROUNDER) - bitcast<i32>(ROUNDER);
}

fn footprint(material: Material, covered_m: vec2<f32>) -> f32 {
    let texels = covered_m * material.texels_per_m;
    return max(0.5 * max(texels.x, texels.y), min(texels.x, texels.y));
}

fn strip_footprint(material: Material, covered_m: vec2<f32>) -> f32 {
    let texels = covered_m * material.texels_per_m;
    return max(0.5 * texels.x, texels.y);
}

fn level(material: Material, footprint: f32) -> i32 {
    let logarithm = (bitcast<i32>(footprint) - bitcast<i32>(1.0)) >> 15u;
    return clamp(logarithm, 0, 256 * i32(material.log2_size));
}

fn within_tile(length_m: f32, material: Material, scale: f32) -> f32 {
    let size = f32(1u << material.log2_size);
    let texels = length_m * scale;
    return texels - size * floor(texels / size);
}

fn coordinate(length_m: f32, material: Material, scale: f32) -> i32 {
    return i32(within_tile(length_m, material, scale) * 65536.0);
}

fn level_base(material: Material, level: u32) -> u32 {
    let finest = 2u * material.log2_size;
    return material.base + ((4u << finest) - (4u << (finest - 2u * level))) / 3u;
}

fn on_level(coordinate: i32, level: u32) -> i32 {
    return (coordinate >> (8u + level)) - 128;
}

// Red and blue, then green and alpha, 16 bits each.
fn unpack(texel: u32) -> vec2<u32> {
    return vec2<u32>(texel, texel >> 8u) & vec2<u32>(0x00ff00ffu);
}

fn mix_channels(a: vec2<u32>, b: vec2<u32>, weight: u32) -> vec2<u32> {
    return ((a * (256u - weight) + b * weight + vec2<u32>(0x00800080u)) >> vec2<u32>(8u)) & vec2<u32>(0x00ff00ffu);
}

// A level with u fixed: two lines of texels along v, and the weight of the second.
struct Lines {
    first: u32,
    second: u32,
    weight: u32,
    level: u32,
}

fn new_lines(material: Material, level: u32, u: i32) -> Lines {
    let base = level_base(material, level);
    let shift = material.log2_size - level;
    let mask = (1u << shift) - 1u;
    let at = on_level(u, level);
    let line = u32(at >> 8u);
    return Lines(base + ((line & mask) << shift), base + (((line + 1u) & mask) << shift), u32(at & 255), level);
}

fn sample_lines(lines: Lines, log2_size: u32, v: i32) -> vec2<u32> {
    let mask = (1u << (log2_size - lines.level)) - 1u;
    let at = on_level(v, lines.level);
    let low = u32(at >> 8u) & mask;
    let high = (low + 1u) & mask;
    let near = mix_channels(unpack(atlas[lines.first + low]), unpack(atlas[lines.second + low]), lines.weight);
    let far = mix_channels(unpack(atlas[lines.first + high]), unpack(atlas[lines.second + high]), lines.weight);
    return mix_channels(near, far, u32(at & 255));
}

struct Strip {
    log2_size: u32,
    fine: Lines,
    coarse: Lines,
    weight: u32,
    v: i32,
    step: i32,
}

// A texture with u and level of detail fixed.
fn new_strip(material: Material, u: i32, v: i32, step: i32, level: i32) -> Strip {
    let fine = u32(level >> 8u);
    let coarse = min(fine + 1u, material.log2_size);
    let weight = u32(level & 255);
    return Strip(material.log2_size, new_lines(material, fine, u), new_lines(material, coarse, u), weight, v, step);
}

fn sample_strip(strip: Strip, row: u32) -> vec2<u32> {
    let v = strip.v + strip.step * i32(row);
    let fine = sample_lines(strip.fine, strip.log2_size, v);
    if strip.weight == 0u {
        return fine;
    }
    return mix_channels(fine, sample_lines(strip.coarse, strip.log2_size, v), strip.weight);
}
