//! What is true of a frame: landmarks, how much of each is hidden, and where home's features are.

use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, angle_of, cross, direction};
use crate::panorama::{Panorama, Projection, Shot};
use crate::panorama_set::{Frame, FrameTruth, LandmarkTruth, WorldRef};
use crate::table::Table;
use crate::vision::{Extractor, ExtractorSettings};
use crate::world::polygon::edges;
use crate::world::{Body, Footprint, World};

/// Features of the home panorama whose places are told.
const FEATURES: usize = 200;

/// A place in the home panorama and where the same surface point is in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueMatch {
    /// Number of the feature of the home panorama.
    pub feature: usize,
    /// Column and row at home, px.
    pub home_px: (f64, f64),
    /// Column and row in the frame, px.
    pub px: (f64, f64),
}

/// What is known of a condition before its frames are taken.
#[derive(Debug, Clone)]
pub struct Witness<'a> {
    world: &'a World,
    home: Shot,
    features: Vec<(f64, f64)>,
}

impl<'a> Witness<'a> {
    /// From the home panorama as the camera took it, range and instances included.
    pub fn new(world: &'a World, home: Panorama) -> Self {
        let settings = ExtractorSettings { home_features: FEATURES, ..ExtractorSettings::default() };
        let features = Extractor::new(settings, &home).home_keypoints().map(|k| k.px).collect();
        Self { world, home: Shot { panorama: home, pose: world.camera_pose(&world.home) }, features }
    }

    /// The home panorama.
    pub fn home(&self) -> &Panorama {
        &self.home.panorama
    }

    /// What is true of a frame.
    pub fn frame(&self, frame: &Frame, panorama: &Panorama) -> FrameTruth {
        let world = self.world;
        let camera = world.camera_pose(&frame.robot);
        FrameTruth {
            frame: frame.number,
            condition: frame.condition.clone(),
            spot: frame.spot,
            place: frame.place.map(|p| [p.i, p.j]),
            t_s: frame.time_s,
            pose: frame.robot.into(),
            camera_m: [camera.x, camera.y, world.spec.camera.height_m],
            landmarks: landmarks(world, &camera, panorama),
            world: frame.world.clone(),
        }
    }

    /// Where home's features are in a frame: those that are seen there. The panorama is given back.
    pub fn matches(&self, frame: &Frame, panorama: &mut Panorama) -> Vec<TrueMatch> {
        let now = Shot { panorama: std::mem::replace(panorama, Panorama::empty()), pose: self.world.camera_pose(&frame.robot) };
        let seen = self.features.iter().enumerate().filter_map(|(feature, &home_px)| {
            let there = self.home.appearance(&now, home_px);
            there.visible.then_some(TrueMatch { feature, home_px, px: there.px })
        });
        let seen = seen.collect();
        *panorama = now.panorama;
        seen
    }
}

/// The landmarks as seen from `camera`.
fn landmarks(world: &World, camera: &Pose, panorama: &Panorama) -> Vec<LandmarkTruth> {
    let mut seen = vec![0_u32; usize::from(u16::MAX) + 1];
    // Run by run: one count after the other on the same place would wait for each other.
    for run in panorama.instance.chunk_by(|a, b| a == b) {
        seen[usize::from(run[0])] += run.len() as u32;
    }
    let truth = |body: &Body| {
        let centre = camera.inverse_transform(body.pose.position());
        let seen_px = seen[usize::from(body.instance)];
        let alone_px = pixels_alone(body, world.spec.camera.height_m, camera, &panorama.projection);
        let hidden = |alone: u32| 1.0 - (f64::from(seen_px) / f64::from(alone)).min(1.0);
        LandmarkTruth {
            instance: body.instance,
            name: body.name.clone(),
            bearing_rad: angle_of(centre),
            range_m: centre.norm(),
            visible: seen_px > 0,
            seen_px,
            alone_px,
            occluded: (alone_px > 0).then(|| hidden(alone_px)),
        }
    };
    world.landmarks().iter().map(truth).collect()
}

/// Pixels that show a body if nothing else is in the room, from a camera outside it.
///
/// In the upright plane of a column the body is a rectangle between the distances at which the column's ray enters and leaves the
/// footprint, and between underside and top; the rows that meet it are those between its lowest and highest corner.
fn pixels_alone(body: &Body, camera_height_m: f64, camera: &Pose, projection: &Projection) -> u32 {
    let origin = body.pose.inverse_transform(camera.position());
    let turn = camera.heading - body.pose.heading;
    let (bottom, top) = (body.bottom_m - camera_height_m, body.top_m - camera_height_m);
    let last_row = f64::from(projection.height) - 1.0;
    // Columns that can meet it: those within its bounding circle.
    let reach = match &body.footprint {
        Footprint::Disc(radius_m) => *radius_m,
        Footprint::Polygon(corners) => corners.iter().map(|c| c.norm()).fold(0.0, f64::max),
    };
    let (distance, width) = (origin.norm(), i64::from(projection.width));
    let (middle, half) = if distance > reach {
        let to_body = angle_of(camera.inverse_transform(body.pose.position()));
        let half = libm::asin(reach / distance) / projection.pixel_rad();
        (projection.column(to_body), libm::ceil(half) as i64 + 1)
    } else {
        (0.0, width / 2)
    };
    let middle = middle as i64;
    let columns = if 2 * half + 1 >= width { 0..width } else { middle - half..middle + half + 1 };
    let mut count = 0;
    for column in columns {
        let azimuth = projection.azimuth(column.rem_euclid(width) as f64);
        let Some((near, far)) = span(&body.footprint, origin, direction(azimuth + turn)) else { continue };
        let low = (bottom / near).min(bottom / far);
        let high = (top / near).max(top / far);
        let first = libm::ceil(projection.row(high)).max(0.0);
        let last = libm::floor(projection.row(low)).min(last_row);
        if last >= first {
            count += (last - first) as u32 + 1;
        }
    }
    count
}

/// Distances at which a ray from `origin` along the unit vector `along` enters and leaves a footprint, all in its frame; `None`
/// where it misses it or starts inside.
fn span(footprint: &Footprint, origin: Vector2<f64>, along: Vector2<f64>) -> Option<(f64, f64)> {
    let (near, far) = match footprint {
        Footprint::Disc(radius_m) => {
            let (middle, aside) = (-origin.dot(&along), cross(along, origin));
            let half = radius_m * radius_m - aside * aside;
            let half = (half >= 0.0).then(|| half.sqrt())?;
            (middle - half, middle + half)
        }
        Footprint::Polygon(corners) => {
            // The corners run anti-clockwise, so that the inside is to the left of each edge.
            let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
            for (a, b) in edges(corners) {
                let edge = b - a;
                let (inside, towards) = (cross(edge, origin - a), cross(edge, along));
                if towards == 0.0 {
                    if inside < 0.0 {
                        return None;
                    }
                    continue;
                }
                let at = -inside / towards;
                if towards > 0.0 { near = near.max(at) } else { far = far.min(at) }
            }
            (near, far)
        }
    };
    (near > 0.0 && far >= near).then_some((near, far))
}

/// Tables of some frames: the frames, their landmarks, their matches with home, each as Parquet, and the first two as JSON lines.
///
/// # Errors
/// When a table cannot be written, which is a fault in this program.
pub fn tables(frames: &[(FrameTruth, Vec<TrueMatch>)], notes: &[(&str, String)]) -> Result<[(&'static str, Vec<u8>); 4]> {
    let fault = |message: String| Error::Parse { path: "truth".into(), message };
    let int = |n: usize| n as i64;
    let of = |value: fn(&FrameTruth) -> Option<f64>| frames.iter().map(|(f, _)| value(f)).collect::<Vec<_>>();
    let about = Table::default()
        .ints("frame", frames.iter().map(|(f, _)| int(f.frame)))
        .texts("condition", frames.iter().map(|(f, _)| f.condition.clone()))
        .ints("spot", frames.iter().map(|(f, _)| int(f.spot)))
        .ints("row", frames.iter().map(|(f, _)| f.place.map(|p| int(p[0]))))
        .ints("column", frames.iter().map(|(f, _)| f.place.map(|p| int(p[1]))))
        .reals("t_s", of(|f| f.t_s))
        .reals("x_m", of(|f| Some(f.pose.x_m)))
        .reals("y_m", of(|f| Some(f.pose.y_m)))
        .reals("heading_rad", of(|f| Some(f.pose.heading_rad)))
        .reals("camera_x_m", of(|f| Some(f.camera_m[0])))
        .reals("camera_y_m", of(|f| Some(f.camera_m[1])))
        .reals("camera_z_m", of(|f| Some(f.camera_m[2])))
        .ints("landmarks_visible", frames.iter().map(|(f, _)| int(f.landmarks.iter().filter(|l| l.visible).count())))
        .ints("matches", frames.iter().map(|(_, m)| int(m.len())));
    // A part holds frames of one world.
    let about = if frames.iter().any(|(f, _)| f.world.is_some()) {
        let of = |name: fn(&WorldRef) -> &String| {
            frames.iter().map(move |(f, _)| f.world.as_ref().map(name).cloned().unwrap_or_default())
        };
        about.texts("world", of(|w| &w.world)).texts("kind", of(|w| &w.kind))
    } else {
        about
    };
    let each = || frames.iter().flat_map(|(f, _)| f.landmarks.iter().map(move |l| (f, l)));
    let landmarks = Table::default()
        .ints("frame", each().map(|(f, _)| int(f.frame)))
        .ints("instance", each().map(|(_, l)| i64::from(l.instance)))
        .texts("name", each().map(|(_, l)| l.name.clone()))
        .reals("bearing_rad", each().map(|(_, l)| l.bearing_rad))
        .reals("range_m", each().map(|(_, l)| l.range_m))
        .bools("visible", each().map(|(_, l)| l.visible))
        .ints("seen_px", each().map(|(_, l)| i64::from(l.seen_px)))
        .ints("alone_px", each().map(|(_, l)| i64::from(l.alone_px)))
        .reals("occluded", each().map(|(_, l)| l.occluded));
    let each = || frames.iter().flat_map(|(f, m)| m.iter().map(move |m| (f, m)));
    let matches = Table::default()
        .ints("frame", each().map(|(f, _)| int(f.frame)))
        .ints("feature", each().map(|(_, m)| int(m.feature)))
        .reals("home_column_px", each().map(|(_, m)| m.home_px.0))
        .reals("home_row_px", each().map(|(_, m)| m.home_px.1))
        .reals("column_px", each().map(|(_, m)| m.px.0))
        .reals("row_px", each().map(|(_, m)| m.px.1));
    let mut lines = Vec::new();
    for (frame, _) in frames {
        lines.extend(json(frame)?);
    }
    Ok([
        ("frames.parquet", about.to_parquet(notes).map_err(fault)?),
        ("landmarks.parquet", landmarks.to_parquet(notes).map_err(fault)?),
        ("matches.parquet", matches.to_parquet(notes).map_err(fault)?),
        ("frames.jsonl", lines),
    ])
}

/// A frame's truth as a line of JSON.
///
/// # Errors
/// As [`tables`].
pub fn json(frame: &FrameTruth) -> Result<Vec<u8>> {
    let mut line = serde_json::to_vec(frame).map_err(|e| Error::Parse { path: "truth".into(), message: e.to_string() })?;
    line.push(b'\n');
    Ok(line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::ProjectionKind;
    use crate::render::{CpuRenderer, Renderer, Scene, View};
    use crate::world::WorldSpec;

    /// Each landmark of the lab alone in the room: the renderer must count the pixels that the closed form gives, but for rounding at
    /// its rim.
    #[test]
    fn pixels_of_a_body_alone_are_what_is_rendered() {
        let lab = World::open("lab").unwrap();
        for k in 0..lab.landmark_count {
            let spec = WorldSpec { landmarks: vec![lab.spec.landmarks[k].clone()], obstacles: Vec::new(), ..lab.spec.clone() };
            let world = World::from_spec(&spec, "alone").unwrap();
            let scene = Scene::new(&world).unwrap();
            for kind in [ProjectionKind::Cylindrical, ProjectionKind::EqualAngle] {
                for robot in [world.home, Pose::new(2.1, 3.9, 2.0), Pose::new(5.2, 2.6, -1.0)] {
                    let projection = Projection { kind, ..world.projection_of_size(720, 90) };
                    let mut seen = Panorama::black(projection);
                    let bodies = world.body_poses();
                    CpuRenderer::new().render(&scene, &View { projection, robot, bodies: &bodies }, &mut seen).unwrap();
                    let truth = landmarks(&world, &world.camera_pose(&robot), &seen);
                    let [one] = &truth[..] else { panic!() };
                    // Rays along an edge may fall on either side of it.
                    let slack = 2 + one.alone_px / 50;
                    assert!(one.seen_px.abs_diff(one.alone_px) <= slack, "{one:?} {kind:?} {robot:?}");
                    assert!(one.occluded.unwrap() < 0.03 && one.visible, "{one:?}");
                }
            }
        }
    }

    #[test]
    fn what_hides_is_counted() {
        // The camera looks from 0.4 m at a pillar; a screen as high hides all of it but what stands out above.
        let text = |screen_y: f64| {
            format!(
                r#"name = "screen"
                room = {{ outline_m = [[-4, -4], [4, -4], [4, 4], [-4, 4]] }}
                home = {{ x_m = 0, y_m = 0 }}
                [[landmarks]]
                name = "pillar"
                shape = {{ disc = {{ radius_m = 0.2 }} }}
                position_m = [3, 0]
                height_m = 0.8
                texture = {{ family = "plain" }}
                [[obstacles]]
                name = "screen"
                shape = {{ box = {{ size_m = [0.1, 1] }} }}
                position_m = [1.5, {screen_y}]
                height_m = 1.0
                texture = {{ family = "plain" }}"#
            )
        };
        let occluded = |screen_y: f64| {
            let world = World::from_toml(&text(screen_y), "screen").unwrap();
            let projection = world.projection_of_size(1440, 180);
            let mut seen = Panorama::black(projection);
            let view = View { projection, robot: world.home, bodies: &world.body_poses() };
            CpuRenderer::new().render(&Scene::new(&world).unwrap(), &view, &mut seen).unwrap();
            let truth = landmarks(&world, &world.camera_pose(&world.home), &seen);
            (truth[0].occluded.unwrap(), truth[0].range_m, truth[0].bearing_rad)
        };
        let (hidden, range_m, bearing_rad) = occluded(0.0);
        assert_eq!((hidden, range_m, bearing_rad), (1.0, 3.0, 0.0));
        assert!(occluded(2.0).0 < 0.02);
        // The screen's edge at y = 0 runs through the middle of the pillar.
        let half = occluded(0.5).0;
        assert!((half - 0.5).abs() < 0.03, "{half}");
    }
}
