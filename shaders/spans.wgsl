// What the rows of a column see: runs of rows, from the top, each with the face that it shows. The twin of
// src/render/spans.rs; where that lays out a column as a whole, here a span is found when its first row is reached.

const SIDE: u32 = 0u;
const TOP: u32 = 1u;
const UNDERSIDE: u32 = 2u;
const NOTHING: u32 = 0xffffu;
const NOTHING_CODE: u32 = 0u;
const FLOOR_CODE: u32 = 1u;
const CEILING_CODE: u32 = 2u;
// Of the side of the first hit; that of its top or underside follows, then those of the next hit.
const FIRST_HIT_CODE: u32 = 3u;

// For each hit the rows, from the first to before the last, that would see its side if nothing else were there, and those that
// would see its top or underside; the height of these over the camera, m.
var<private> side_rows: array<vec2<u32>, MAX_HITS>;
var<private> cap_rows: array<vec2<u32>, MAX_HITS>;
var<private> cap_height: array<f32, MAX_HITS>;
// Whether footprints overlap, so that the nearer hit does not hide the farther one as a whole.
var<private> hits_overlap: bool;

// Rows up to `end` that show the same face of a surface. Its horizontal distance is `near`, and `height` times the inverse
// tangent of the row, and `room` times the distance of floor or ceiling. `code` stands for it in the picture.
struct Span {
    end: u32,
    surface: u32,
    face: u32,
    near: f32,
    height: f32,
    room: f32,
    code: u32,
}

// About the row that looks along this tangent of elevation.
fn row_near(tan: f32) -> u32 {
    var elevation = tan;
    if equal_angle {
        elevation = atan(tan);
    }
    return u32(clamp(params.horizon_row - elevation / params.pixel_rad, 0.0, f32(params.height)));
}

fn is_below(row: u32, distance: f32, z: f32, touching: bool) -> bool {
    let at = params.camera_height + distance * rows[row].tan;
    return at < z || (touching && at == z);
}

// The first row whose ray is below height `z` at a distance, or at it where `touching`.
fn first_below(distance: f32, z: f32, touching: bool) -> u32 {
    var row = row_near((z - params.camera_height) / max(distance, 1.0e-6));
    while row > 0u && is_below(row - 1u, distance, z, touching) {
        row--;
    }
    while row < params.height && !is_below(row, distance, z, touching) {
        row++;
    }
    return row;
}

// The rows whose rays come farther than `near` before they meet floor or ceiling.
fn rows_before_planes(near: f32) -> vec2<u32> {
    let divisor = max(near, 1.0e-6);
    var start = min(row_near((params.room_height - params.camera_height) / divisor), params.floor_start);
    while start > 0u && rows[start - 1u].plane > near {
        start--;
    }
    while start < params.floor_start && rows[start].plane <= near {
        start++;
    }
    var end = max(row_near(-params.camera_height / divisor), params.floor_start);
    while end > params.floor_start && rows[end - 1u].plane <= near {
        end--;
    }
    while end < params.height && rows[end].plane > near {
        end++;
    }
    return vec2<u32>(start, end);
}

// Finds the rows of all hits' faces.
fn find_faces() {
    hits_overlap = false;
    var past = 0.0;
    for (var k = 0u; k < hit_count; k++) {
        let near = hit_near[k];
        let far = hit_far[k];
        hits_overlap = hits_overlap || near < past;
        past = far;
        side_rows[k] = rows_before_planes(near);
        cap_rows[k] = vec2<u32>(0u);
        cap_height[k] = 0.0;
        if hit_surface[k] < 2u + params.wall_count {
            continue;
        }
        let body = body_at(hit_surface[k] - 2u - params.wall_count);
        let below_top = first_below(near, body.top, true);
        let below_bottom = first_below(near, body.bottom, false);
        side_rows[k] = vec2<u32>(max(side_rows[k].x, below_top), min(side_rows[k].y, below_bottom));
        // What is seen of the top ends where the side begins, what is seen of the underside begins where the side ends.
        let from_above = body.top < params.camera_height;
        let turn = first_below(far, select(body.bottom, body.top, from_above), !from_above);
        if from_above {
            cap_rows[k] = vec2<u32>(turn, below_top);
            cap_height[k] = body.top - params.camera_height;
        } else if body.bottom > params.camera_height {
            cap_rows[k] = vec2<u32>(below_bottom, turn);
            cap_height[k] = body.bottom - params.camera_height;
        }
    }
}

// Where the next of two rows lies after `row`, `end` if neither does.
fn next_of(rows: vec2<u32>, row: u32, end: u32) -> u32 {
    return min(select(end, rows.x, rows.x > row), select(end, rows.y, rows.y > row));
}

fn is_in(rows: vec2<u32>, row: u32) -> bool {
    return rows.x <= row && row < rows.y;
}

// The span that `row` begins, or goes on with.
fn span_at(row: u32) -> Span {
    let here = rows[row];
    var span = Span(params.height, 0u, TOP, 0.0, 0.0, 1.0, FLOOR_CODE);
    if row < params.floor_start {
        span = Span(params.floor_start, NOTHING, SIDE, 0.0, 0.0, 1.0, NOTHING_CODE);
    }
    if row < params.ceiling_end {
        span = Span(params.ceiling_end, 1u, UNDERSIDE, 0.0, 0.0, 1.0, CEILING_CODE);
    }
    var distance = here.plane;
    var faces = 0u;
    for (var k = 0u; k < hit_count; k++) {
        let side = side_rows[k];
        let cap = cap_rows[k];
        span.end = min(span.end, min(next_of(side, row, span.end), next_of(cap, row, span.end)));
        let sees_side = is_in(side, row);
        if !sees_side && !is_in(cap, row) {
            continue;
        }
        faces++;
        var near = hit_near[k];
        var height = 0.0;
        var face = SIDE;
        if !sees_side {
            near = 0.0;
            height = cap_height[k];
            face = select(UNDERSIDE, TOP, height < 0.0);
        }
        let at = near + height * here.inverse_tan;
        // Where none overlap the first hides the others as a whole, whatever rounding makes of the row at its edge.
        if select(faces == 1u, at < distance, hits_overlap) {
            distance = at;
            span = Span(span.end, hit_surface[k], face, near, height, 0.0, FIRST_HIT_CODE + 2u * k + select(1u, 0u, sees_side));
        }
    }
    if hits_overlap && faces > 1u {
        // Which is the nearest is to be asked row by row.
        span.end = row + 1u;
    }
    return span;
}
