//! The extractor against rendered ground truth: range buffers say where a landmark must appear, and score what was found.
//! The truth never reaches the extractor: it reads colours only.

use wayhome::geometry::{Pose, Vector2, direction, wrap};
use wayhome::panorama::{Panorama, Projection};
use wayhome::vision::{Extractor, ExtractorSettings, Match};

/// What one panorama's matches are worth.
#[derive(Debug, Clone, Copy, Default)]
struct Score {
    matches: usize,
    right: usize,
    /// Normalised bearing errors, absolute bearing errors (px) of right matches.
    median_px: f64,
    p95_px: f64,
    median_z: f64,
    p95_z: f64,
}

/// Where the home pixel's surface point appears from `pose`, both poses given in the room; `None` if it is hidden there.
fn reproject(home: &Panorama, home_pose: Pose, now: &Panorama, pose: Pose, column: f64, row: f64) -> Option<(f64, f64)> {
    let p = home.projection;
    let at = |pano: &Panorama, x: f64, y: f64| {
        let (w, h) = (pano.projection.width as i64, pano.projection.height as i64);
        let (x, y) = ((x.round() as i64).rem_euclid(w), (y.round() as i64).clamp(0, h - 1));
        f64::from(pano.range_m[(y * w + x) as usize])
    };
    let tan = p.tan_elevation(row);
    let flat = at(home, column, row) / (1.0 + tan * tan).sqrt();
    let point = home_pose.transform(direction(p.azimuth(column)) * flat);
    let seen: Vector2<f64> = pose.inverse_transform(point);
    let distance = seen.norm();
    let (x, y) = (p.column(seen.y.atan2(seen.x)), p.row(flat * tan / distance));
    if y < -0.5 || y > f64::from(p.height) - 0.5 {
        return None;
    }
    let expected = (distance * distance + flat * flat * tan * tan).sqrt();
    let near = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy)));
    let visible = near
        .into_iter()
        .any(|(dx, dy)| (at(now, x + f64::from(dx), y + f64::from(dy)) - expected).abs() < 0.02 + 0.02 * expected);
    visible.then_some((x, y))
}

fn score(matches: &[Match], home: &Panorama, home_pose: Pose, now: &Panorama, pose: Pose) -> Score {
    let width = f64::from(home.projection.width);
    let mut errors = Vec::new();
    let mut normalised = Vec::new();
    for m in matches {
        let Some((x, y)) = reproject(home, home_pose, now, pose, m.home_px.0, m.home_px.1) else { continue };
        let dx = (m.now_px.0 - x + 1.5 * width).rem_euclid(width) - 0.5 * width;
        let dy = m.now_px.1 - y;
        if (dx * dx + dy * dy).sqrt() > 3.0 {
            continue;
        }
        errors.push(dx.abs());
        normalised.push(dx.abs() * home.projection.pixel_rad() / (m.home_sd_rad.powi(2) + m.now_sd_rad.powi(2)).sqrt());
    }
    errors.sort_by(f64::total_cmp);
    normalised.sort_by(f64::total_cmp);
    let quantile = |v: &[f64], q: f64| if v.is_empty() { f64::NAN } else { v[((v.len() - 1) as f64 * q) as usize] };
    Score {
        matches: matches.len(),
        right: errors.len(),
        median_px: quantile(&errors, 0.5),
        p95_px: quantile(&errors, 0.95),
        median_z: quantile(&normalised, 0.5),
        p95_z: quantile(&normalised, 0.95),
    }
}

/// Poses at `distance` from home in eight directions, each with a heading of its own.
fn around(home: Pose, distance: f64) -> Vec<Pose> {
    (0..8)
        .map(|k| {
            let p = home.position() + direction(0.3 + f64::from(k) * std::f64::consts::TAU / 8.0) * distance;
            Pose::new(p.x, p.y, home.heading + wrap(1.0 + 2.4 * f64::from(k)))
        })
        .collect()
}

fn table(
    render: impl Fn(Pose) -> Panorama,
    home_pose: Pose,
    settings: &ExtractorSettings,
    distances: &[f64],
    verbose: bool,
) -> Vec<(f64, Score)> {
    let home = render(home_pose);
    let mut extractor = Extractor::new(settings.clone(), &home);
    let landmarks = extractor.home_snapshot().bearings;
    let mut rows = Vec::new();
    for &distance in distances {
        let mut sum = Score::default();
        let (mut n, mut hits, mut low) = (0, 0, usize::MAX);
        let mut time = 0.0;
        let mut worst: f64 = 1.0;
        for pose in around(home_pose, distance) {
            if !(0.4..6.6).contains(&pose.x) || !(0.4..5.6).contains(&pose.y) {
                continue;
            }
            let now = render(pose);
            let start = std::time::Instant::now();
            extractor.observe(&now);
            time += start.elapsed().as_secs_f64();
            let s = score(extractor.matches(), &home, home_pose, &now, pose);
            if verbose {
                println!(
                    "   {:.2} {:.2} {:.2}: {} of {}, {:.2} px",
                    pose.x, pose.y, pose.heading, s.right, s.matches, s.median_px
                );
            }
            n += 1;
            sum.matches += s.matches;
            sum.right += s.right;
            low = low.min(s.right);
            worst = worst.min(s.right as f64 / s.matches.max(1) as f64);
            if s.right > 0 {
                hits += 1;
                sum.median_px += s.median_px;
                sum.p95_px += s.p95_px;
                sum.median_z += s.median_z;
                sum.p95_z += s.p95_z;
            }
        }
        let k = f64::from(hits.max(1));
        let mean = Score {
            matches: sum.matches / n,
            right: sum.right / n,
            median_px: sum.median_px / k,
            p95_px: sum.p95_px / k,
            median_z: sum.median_z / k,
            p95_z: sum.p95_z / k,
        };
        println!(
            "{distance:5.2} m: {:4} right of {:4} ({:3.0} %, worst {:3.0} %, least {low}) of {} | bearing error px median {:.2} 95 % {:.2} | z {:.2} {:.2} | {:.1} ms",
            mean.right,
            mean.matches,
            100.0 * sum.right as f64 / sum.matches.max(1) as f64,
            100.0 * worst,
            landmarks.len(),
            mean.median_px,
            mean.p95_px,
            mean.median_z,
            mean.p95_z,
            1000.0 * time / n as f64
        );
        rows.push((distance, mean));
    }
    rows
}

/// A bare stand-in for the renderer: an empty room, rectangles of random grey on every wall.
fn simple_room(pose: Pose) -> Panorama {
    let projection = Projection { horizon_row: 108.0, ..Projection::new(1440, 180) };
    let mut out = Panorama::black(projection);
    let hash = |a: i64, b: i64, c: i64| {
        let mut h = (a as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (b as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ (c as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
        h ^= h >> 29;
        h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h ^= h >> 32;
        (h % 1000) as f64 / 1000.0
    };
    let noise = |wall: i64, u: f64, v: f64, size: f64| {
        let (u, v) = (u / size, v / size);
        let (i, j) = (u.floor() as i64, v.floor() as i64);
        let s = |f: f64| f * f * (3.0 - 2.0 * f);
        let (fu, fv) = (s(u - u.floor()), s(v - v.floor()));
        let at = |di, dj| hash(i + di, j + dj, wall * 7 + (size * 1000.0) as i64);
        (at(0, 0) * (1.0 - fu) + at(1, 0) * fu) * (1.0 - fv) + (at(0, 1) * (1.0 - fu) + at(1, 1) * fu) * fv
    };
    for column in 0..1440_usize {
        let d = direction(pose.heading + projection.azimuth(column as f64));
        let tx = if d.x > 0.0 { (7.0 - pose.x) / d.x } else { -pose.x / d.x };
        let ty = if d.y > 0.0 { (6.0 - pose.y) / d.y } else { -pose.y / d.y };
        let flat = tx.min(ty);
        let (wall, u) =
            if tx < ty { (i64::from(d.x > 0.0), pose.y + d.y * flat) } else { (2 + i64::from(d.y > 0.0), pose.x + d.x * flat) };
        for row in 0..180_usize {
            let tan = projection.tan_elevation(row as f64);
            let z = 0.4 + flat * tan;
            let (grey, flat) = if z < 0.0 {
                let flat = 0.4 / -tan;
                (0.4, flat)
            } else {
                (0.5 * noise(wall, u, z, 0.4) + 0.3 * noise(wall, u, z, 0.13) + 0.2 * noise(wall, u, z, 0.05), flat)
            };
            let k = row * 1440 + column;
            let byte = (255.0 * grey) as u8;
            out.rgba[4 * k..4 * k + 4].copy_from_slice(&[byte, byte, byte, 255]);
            out.range_m[k] = (flat * (1.0 + tan * tan).sqrt()) as f32;
        }
    }
    out
}

#[test]
fn simple() {
    table(simple_room, Pose::new(3.4, 3.0, 0.0), &ExtractorSettings::default(), &[0.0, 0.25, 0.5, 1.0, 2.0, 3.0], true);
}
