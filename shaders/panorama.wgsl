// The panorama: which of a column's hits each row sees, in what colour and how far away. The twin of src/render/cpu.rs.
//
// One invocation renders some rows of one column: all of them where cores are few and wide, fewer where there are thousands. A
// software adapter computes some columns at once, and both branches of whatever is not a loop: what is only computed for sides
// or only for horizontal faces therefore stands in loops of their own, which end when no column is left in them.

// For all pixels in rows from the top: red, green and blue from the lowest byte up, and the code of what is seen there. After
// them for each column three words for each of its hits, nearest first, in which the codes are explained: instance, distance of
// the side and height of the top or underside over the camera. A pixel's range follows from these and its row.
@group(0) @binding(5) var<storage, read_write> picture: array<u32>;

fn show(row: u32, column: u32, colour: u32, code: u32) {
    let word = colour | (code << 24u);
    // The minimum changes nothing, but a software adapter would put the word together lane by lane.
    picture[row * params.width + column] = min(word, params.all_bits);
}

fn show_hits(column: u32) {
    var place = params.width * params.height + column * 3u * MAX_HITS;
    for (var k = 0u; k < hit_count; k++) {
        picture[place] = look_of(hit_surface[k]) >> 16u;
        picture[place + 1u] = bitcast<u32>(hit_near[k]);
        picture[place + 2u] = bitcast<u32>(cap_height[k]);
        place += 3u;
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
            var hit = hit_again(span.surface, direction);
            // Computed again it may be a little off, and at an outline miss.
            hit.near = span.near;
            hit.surface = span.surface;
            let side = new_side(hit, direction);
            while r < end {
                let row = rows[r];
                show(r, column, shade_side(side, r, row), span.code);
                r++;
            }
        } else if span.surface != NOTHING {
            let plane = new_plane(span.surface, span.face == UNDERSIDE);
            while r < end {
                let row = rows[r];
                let t = span.height * row.inverse_tan + span.room * row.plane;
                show(r, column, shade_plane(plane, direction, t, row), span.code);
                r++;
            }
        } else {
            while r < end {
                show(r, column, 0u, span.code);
                r++;
            }
        }
    }
}
