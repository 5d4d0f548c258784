// The panorama: which of a column's hits each row sees, in what colour and how far away. The twin of src/render/cpu.rs.
//
// One invocation renders some rows of one column: all of them where cores are few and wide, fewer where there are thousands. A
// software adapter computes some columns at once, and both branches of whatever is not a loop: what is only computed for sides
// or only for horizontal faces therefore stands in loops of their own, which end when no column is left in them.

// For all pixels in rows from the top: red, green, blue and a code for the instance, from the lowest byte up, and range (the bits
// of f32). After them for each column the instances of its hits, nearest first, which are the codes from FIRST_HIT_CODE on:
// two in each word.
@group(0) @binding(5) var<storage, read_write> picture: array<vec2<u32>>;

fn show(row: u32, column: u32, colour: u32, range: f32, code: u32) {
    picture[row * params.width + column] = vec2<u32>((colour & 0xffffffu) | (code << 24u), bitcast<u32>(range));
}

fn show_hits(column: u32) {
    let first = params.width * params.height + column * (MAX_HITS / 4u);
    for (var k = 0u; k < hit_count; k += 4u) {
        let low = (hit_surface[k] + 1u) | ((hit_surface[k + 1u] + 1u) << 16u);
        picture[first + k / 4u] = vec2<u32>(low, (hit_surface[k + 2u] + 1u) | ((hit_surface[k + 3u] + 1u) << 16u));
    }
}

@compute @workgroup_size(64)
fn render(@builtin(global_invocation_id) id: vec3<u32>) {
    load_params();
    let column = id.x;
    if column >= params.width {
        return;
    }
    let direction = directions[column];
    find_hits(direction);
    find_faces();
    if id.y == 0u {
        show_hits(column);
    }
    var r = id.y * params.rows_per_invocation;
    let last = min(r + params.rows_per_invocation, params.height);
    while r < last {
        let span = span_at(r);
        let end = min(span.end, last);
        let is_side = span.face == SIDE && span.surface != NOTHING;
        if is_side {
            let side = new_side(hit_again(span.surface, direction), direction);
            while r < end {
                let row = rows[r];
                show(r, column, shade_side(side, r, row), side.near * row.stretch, span.code);
                r++;
            }
        } else if span.surface != NOTHING {
            let plane = new_plane(span.surface, span.face == UNDERSIDE);
            while r < end {
                let row = rows[r];
                let t = span.height * row.inverse_tan + span.room * row.plane;
                show(r, column, shade_plane(plane, direction, t, row), t * row.stretch, span.code);
                r++;
            }
        } else {
            while r < end {
                show(r, column, 0u, 0.0, span.code);
                r++;
            }
        }
    }
}
