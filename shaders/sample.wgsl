// Prefiltered texture sampling. The twin of src/render/sample.rs.

struct Material {
    base: u32,
    log2_size: u32,
    texels_per_m: f32,
    padding: u32,
}

@group(0) @binding(6) var<storage, read> materials: array<Material>;
@group(0) @binding(7) var<storage, read> atlas: array<u32>;

fn level(material: Material, a_m: f32, b_m: f32) -> i32 {
    let footprint = max(0.5 * max(a_m, b_m), min(a_m, b_m)) * material.texels_per_m;
    let logarithm = (bitcast<i32>(footprint) - 0x3f800000) >> 15u;
    return clamp(logarithm, 0, 256 * i32(material.log2_size));
}

fn fixed(coordinate_m: f32, material: Material) -> i32 {
    return i32(coordinate_m * (material.texels_per_m * 256.0));
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
