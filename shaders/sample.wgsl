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
    return (clamp(logarithm, 0, 256 * i32(material.log2_size)) + 32) & -64;
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

// A level with u fixed: two lines of texels along v, and the share in 1/16 of the second.
struct Lines {
    first: u32,
    second: u32,
    mask: u32,
    weight: u32,
}

fn new_lines(material: Material, level: u32, u: i32) -> Lines {
    let base = level_base(material, level);
    let shift = material.log2_size - level;
    let mask = (1u << shift) - 1u;
    let at = on_level(u, level);
    let line = u32(at >> 8u);
    return Lines(base + ((line & mask) << shift), base + (((line + 1u) & mask) << shift), mask, u32(at >> 4u) & 15u);
}

// A texel of the lines, mixed by means alone.
fn texel(lines: Lines, place: i32) -> u32 {
    let at = u32(place) & lines.mask;
    let a = atlas[lines.first + at];
    let b = atlas[lines.second + at];
    let w = mean(a, select(a, b, (lines.weight & 1u) != 0u));
    let x = mean(w, select(a, b, (lines.weight & 2u) != 0u));
    let y = mean(x, select(a, b, (lines.weight & 4u) != 0u));
    return mean(y, select(a, b, (lines.weight & 8u) != 0u));
}

// A texel mixed with the coarser level, which is three parts of its own texel there and one of the nearer neighbour.
fn towards(fine: u32, own: u32, neighbour: u32, quarters: u32) -> u32 {
    let coarse = mean(own, mean(own, neighbour));
    let half = mean(fine, coarse);
    return select(mean(half, select(coarse, fine, quarters == 1u)), half, quarters == 2u);
}

// A texture with u and level of detail fixed.
struct Strip {
    fine: Lines,
    coarse: Lines,
    level: u32,
    quarters: u32,
    v: i32,
    step: i32,
}

fn new_strip(material: Material, u: i32, v: i32, step: i32, level: i32) -> Strip {
    let fine = u32(level >> 8u);
    let coarse = min(fine + 1u, material.log2_size);
    return Strip(new_lines(material, fine, u), new_lines(material, coarse, u), fine, u32(level >> 6u) & 3u, v, step);
}

// Colour in 1/256.
fn sample_strip(strip: Strip, row: u32) -> vec4<u32> {
    let at = on_level(strip.v + strip.step * i32(row), strip.level);
    let place = at >> 8u;
    var near = texel(strip.fine, place);
    var far = texel(strip.fine, place + 1);
    if strip.quarters != 0u {
        let half = place >> 1u;
        let own = texel(strip.coarse, half);
        let next = texel(strip.coarse, half + 1);
        if (place & 1) == 0 {
            near = towards(near, own, texel(strip.coarse, half - 1), strip.quarters);
            far = towards(far, own, next, strip.quarters);
        } else {
            near = towards(near, own, next, strip.quarters);
            far = towards(far, next, own, strip.quarters);
        }
    }
    return weigh(unpack(near), unpack(far), u32(at & 255));
}

// One level of a texture at a point, in 1/256.
fn sample_level(material: Material, u: i32, v: i32, level: u32) -> vec4<u32> {
    let base = level_base(material, level);
    let shift = material.log2_size - level;
    let mask = (1u << shift) - 1u;
    let x = on_level(u, level);
    let y = on_level(v, level);
    let first = base + ((u32(x >> 8u) & mask) << shift);
    let second = base + ((u32((x >> 8u) + 1) & mask) << shift);
    let low = u32(y >> 8u) & mask;
    let high = (low + 1u) & mask;
    let weight = u32(x & 255);
    let near = (weigh(unpack(atlas[first + low]), unpack(atlas[second + low]), weight) + vec4<u32>(128u)) >> vec4<u32>(8u);
    let far = (weigh(unpack(atlas[first + high]), unpack(atlas[second + high]), weight) + vec4<u32>(128u)) >> vec4<u32>(8u);
    return weigh(near, far, u32(y & 255));
}

// A texture at a point, in 1/256.
fn sample_point(material: Material, u: i32, v: i32, level: i32) -> vec4<u32> {
    let fine = sample_level(material, u, v, u32(level >> 8u));
    let quarters = u32(level >> 6u) & 3u;
    if quarters == 0u {
        return fine;
    }
    let coarse = sample_level(material, u, v, u32(level >> 8u) + 1u);
    return fine - (fine >> vec4<u32>(2u)) * quarters + (coarse >> vec4<u32>(2u)) * quarters;
}
