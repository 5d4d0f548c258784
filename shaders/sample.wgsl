// Prefiltered texture sampling. The twin of src/render/sample.rs.

const ROUNDER: f32 = 12582912.0;
// -0.082 in units of the logarithm.
const ROUNDING: i32 = -687865;
// Words of a material in its table, two a texel.
const MATERIAL_TEXELS: u32 = 47u;

// A level of a texture, with a border of one texel, cut into tiles of 32 x 32 texels, u by v.
struct MipLevel {
    // Number of its first tile.
    base: u32,
    // Texels along an edge, the border not counted.
    size: u32,
}

struct Material {
    tiles_per_m: vec2<f32>,
    last_level: u32,
    // Texels along an edge of the finest level.
    finest: f32,
    // Where its levels are.
    levels: u32,
    // Height from which v is counted on an upright surface, m.
    foot: f32,
}

// Per material tiles per metre, number of the last level, the foot, and the levels.
@group(0) @binding(3) var materials: texture_storage_2d<rg32uint, read>;
// Columns of tiles, one beside the other: what is near one another in a texture lies on few pages of memory. Each texel comes
// with the next one along v, since no sample needs one alone.
@group(0) @binding(4) var atlas: texture_storage_2d_array<rg32uint, read>;

fn material_words(k: u32) -> vec2<u32> {
    return textureLoad(materials, vec2<u32>(k & 1023u, k >> 10u)).xy;
}

fn material_at(surface: u32) -> Material {
    let first = MATERIAL_TEXELS * (look_of(surface) & 0xffffu);
    let tiles_per_m = bitcast<vec2<f32>>(material_words(first));
    let words = material_words(first + 1u);
    return Material(tiles_per_m, words.x, f32(material_words(first + 2u).y), first + 2u, bitcast<f32>(words.y));
}

// A line of texels along v.
struct Line {
    tile: u32,
    u: u32,
}

// Line `u` of a level, from -1 on.
fn line_at(level: MipLevel, u: i32) -> Line {
    let place = u32(u + 1);
    return Line(level.base + (place >> 5u) * ((level.size + 33u) >> 5u), place & 31u);
}

// Texels `v` and `v + 1` of a line, from -1 on.
fn texels(line: Line, v: i32) -> vec2<u32> {
    let place = u32(v + 1);
    let tile = line.tile + (place >> 5u);
    return textureLoad(atlas, vec2<u32>(place & 31u, ((tile & 255u) << 5u) | line.u), tile >> 8u).xy;
}

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

fn level(material: Material, footprint: f32) -> MipLevel {
    let texels = footprint * material.finest;
    // The clamp keeps the sum from overflowing.
    let logarithm = min(bitcast<i32>(texels) - bitcast<i32>(1.0), 0x3fffffff);
    let number = clamp((logarithm + ROUNDING) >> 21u, 0, i32(material.last_level));
    let words = material_words(material.levels + u32(number));
    return MipLevel(words.x, words.y);
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

// The means of four bytes, rounded up.
fn mean(a: u32, b: u32) -> u32 {
    return (a | b) - (((a ^ b) >> 1u) & 0x7f7f7f7fu);
}

// Red and blue in 1/256, 16 bits each, and green.
struct Colour {
    red_blue: u32,
    green: u32,
}

// The sum of two texels with weights that make up 256.
fn weigh(a: u32, b: u32, weight: u32) -> Colour {
    let red_blue = (a & 0xff00ffu) * (256u - weight) + (b & 0xff00ffu) * weight;
    return Colour(red_blue, ((a >> 8u) & 255u) * (256u - weight) + ((b >> 8u) & 255u) * weight);
}

// Rounded to a texel.
fn rounded(colour: Colour) -> u32 {
    return (((colour.red_blue + 0x800080u) >> 8u) & 0xff00ffu) | ((colour.green + 128u) & 0xff00u);
}

// A texture with u and level of detail fixed: two lines of texels along v, the share in 1/16 of the second, and v of row 0 and
// its step in 1/65536 texel.
struct Strip {
    first: Line,
    second: Line,
    size: f32,
    weight: u32,
    v: i32,
    step: i32,
}

fn new_strip(tiles_per_m: vec2<f32>, u_m: f32, v_m: f32, step_m: f32, level: MipLevel) -> Strip {
    let size = f32(level.size);
    let u = coordinate(within_tile(u_m, tiles_per_m.x), level);
    let v = i32(within_tile(v_m, tiles_per_m.y) * size * 65536.0);
    let step = i32(step_m * tiles_per_m.y * size * -65536.0);
    return Strip(line_at(level, u >> 8u), line_at(level, (u >> 8u) + 1), size, u32(u >> 4u) & 15u, v, step);
}

// Texels of the two lines, mixed by means alone.
fn mix_lines(a: u32, b: u32, weight: u32) -> u32 {
    let w = mean(a, select(a, b, (weight & 1u) != 0u));
    let x = mean(w, select(a, b, (weight & 2u) != 0u));
    let y = mean(x, select(a, b, (weight & 4u) != 0u));
    return mean(y, select(a, b, (weight & 8u) != 0u));
}

fn sample_strip(strip: Strip, row: u32) -> Colour {
    let at = ((strip.v + strip.step * i32(row)) >> 8u) - 128;
    // Within the tile; numbers are small enough that f32 holds them, and the quotient is at most one off.
    let whole = f32(at >> 8u);
    var rest = whole - strip.size * floor(whole / strip.size);
    rest -= select(0.0, strip.size, rest >= strip.size);
    rest += select(0.0, strip.size, rest < 0.0);
    let place = i32(rest);
    let a = texels(strip.first, place);
    let b = texels(strip.second, place);
    return weigh(mix_lines(a.x, b.x, strip.weight), mix_lines(a.y, b.y, strip.weight), u32(at & 255));
}

// A texture at a point.
fn sample_point(level: MipLevel, u: i32, v: i32) -> Colour {
    let a = texels(line_at(level, u >> 8u), v >> 8u);
    let b = texels(line_at(level, (u >> 8u) + 1), v >> 8u);
    let weight = u32(u & 255);
    let near = rounded(weigh(a.x, b.x, weight));
    let far = rounded(weigh(a.y, b.y, weight));
    return weigh(near, far, u32(v & 255));
}
