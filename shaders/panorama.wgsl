// The panorama: which of a column's hits each row sees, in what colour and how far away. The twin of src/render/cpu.rs.
//
// One invocation renders some rows of one column: all of them where cores are few and wide, fewer where there are thousands.

const SIDE: u32 = 0u;
const TOP: u32 = 1u;
const UNDERSIDE: u32 = 2u;
// Owner of a row that no hit has claimed.
const FLOOR_OR_CEILING: u32 = 0xffffu;

// For all pixels in rows from the top: colours, then ranges (the bits of f32), then instances.
@group(0) @binding(8) var<storage, read_write> picture: array<u32>;

@compute @workgroup_size(64)
fn render(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = id.x;
    if column >= params.width {
        return;
    }
    let direction = directions[column];
    find_hits(direction);
    let pixels = params.width * params.height;
    let first = id.y * params.rows_per_invocation;
    let last = min(first + params.rows_per_invocation, params.height);
    var side: Side;
    var side_of = FLOOR_OR_CEILING;
    for (var r = first; r < last; r++) {
        let row = rows[r];
        var t = row.plane;
        var owner = FLOOR_OR_CEILING;
        var face = TOP;
        for (var k = 0u; k < hit_count; k++) {
            let near = hits[k].near;
            if near >= t {
                break;
            }
            let at_entry = params.camera_height + near * row.tan;
            let at_exit = params.camera_height + hits[k].far * row.tan;
            if at_entry > hits[k].top {
                let cap = (hits[k].top - params.camera_height) * row.inverse_tan;
                if hits[k].top < params.camera_height && at_exit < hits[k].top && cap < t {
                    t = cap;
                    owner = k;
                    face = TOP;
                }
            } else if at_entry < hits[k].bottom {
                let cap = (hits[k].bottom - params.camera_height) * row.inverse_tan;
                if hits[k].bottom > params.camera_height && at_exit > hits[k].bottom && cap < t {
                    t = cap;
                    owner = k;
                    face = UNDERSIDE;
                }
            } else {
                t = near;
                owner = k;
                face = SIDE;
            }
        }
        var colour = 0xff000000u;
        var range = 0.0;
        var instance = 0u;
        if owner != FLOOR_OR_CEILING && face == SIDE {
            // What the rows of a side have in common is computed once.
            if side_of != owner {
                side = new_side(hits[owner], direction);
                side_of = owner;
            }
            colour = shade_side(side, r);
            range = t * row.stretch;
            instance = hits[owner].surface + 1u;
        } else if t < FAR {
            var surface = select(0u, 1u, row.tan >= 0.0);
            var underside = row.tan >= 0.0;
            if owner != FLOOR_OR_CEILING {
                surface = hits[owner].surface;
                underside = face == UNDERSIDE;
            }
            colour = shade_plane(new_plane(surface, underside), direction, t, row);
            range = t * row.stretch;
            instance = surface + 1u;
        }
        let pixel = r * params.width + column;
        picture[pixel] = colour;
        picture[pixels + pixel] = bitcast<u32>(range);
        picture[2u * pixels + pixel] = instance;
    }
}
