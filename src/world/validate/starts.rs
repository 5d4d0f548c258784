//! Home, the start region and the named starts.

use super::room::polygon_inside;
use super::{Faults, GREATEST_M, TOLERANCE_M};
use crate::geometry::Pose;
use crate::world::polygon::anticlockwise;
use crate::world::spec::DisturbanceKind;
use crate::world::{World, WorldSpec};

pub(super) fn check_values(spec: &WorldSpec, faults: &mut Faults) {
    pose("home", spec.home.x_m, spec.home.y_m, spec.home.heading_deg, faults);
    let start = &spec.start;
    if let Some(region) = &start.region_m {
        faults.polygon("start.region_m", region, false);
    }
    faults.between("start.min_distance_m", start.min_distance_m, 0.0, GREATEST_M);
    faults.positive("start.max_distance_m", start.max_distance_m, GREATEST_M);
    if !faults.touch("start.min_distance_m") && !faults.touch("start.max_distance_m") {
        faults.unless(
            start.min_distance_m < start.max_distance_m,
            "start.min_distance_m",
            start.min_distance_m.to_string(),
            format!("less than max_distance_m, {}", start.max_distance_m),
        );
    }
    faults.between("start.clearance_m", start.clearance_m, 0.0, GREATEST_M);
    for (k, named) in start.named.iter().enumerate() {
        let place = format!("start.named[{k}]");
        // A name must not read as one of the other things that `--start` takes.
        let good = !named.name.trim().is_empty() && named.name != "random" && !named.name.contains(',');
        let allowed = "a name without commas, other than \"random\"";
        faults.unless(good, format!("{place}.name"), format!("\"{}\"", named.name), allowed);
        pose(&place, named.x_m, named.y_m, named.heading_deg, faults);
    }
    faults.distinct(start.named.iter().enumerate().map(|(k, n)| (format!("start.named[{k}]"), n.name.as_str())));
}

pub(super) fn check_disturbances(spec: &WorldSpec, faults: &mut Faults) {
    for (k, disturbance) in spec.disturbances.iter().enumerate() {
        let place = format!("disturbances[{k}]");
        faults.between(format!("{place}.at_s"), disturbance.at_s, 0.0, 1e6);
        match disturbance.what {
            DisturbanceKind::Kick { impulse_n_s, turn_n_m_s } => {
                for (axis, impulse) in impulse_n_s.into_iter().enumerate() {
                    faults.between(format!("{place}.what.kick.impulse_n_s[{axis}]"), impulse, -1e4, 1e4);
                }
                faults.between(format!("{place}.what.kick.turn_n_m_s"), turn_n_m_s, -1e4, 1e4);
            }
            DisturbanceKind::Kidnap(to) => pose(&format!("{place}.what.kidnap"), to.x_m, to.y_m, to.heading_deg, faults),
        }
    }
}

fn pose(place: &str, x: f64, y: f64, heading_deg: f64, faults: &mut Faults) {
    faults.between(format!("{place}.x_m"), x, -GREATEST_M, GREATEST_M);
    faults.between(format!("{place}.y_m"), y, -GREATEST_M, GREATEST_M);
    faults.between(format!("{place}.heading_deg"), heading_deg, -3600.0, 3600.0);
}

pub(super) fn check_places(world: &World, faults: &mut Faults) {
    if let Some(region) = &world.spec.start.region_m
        && !faults.touch("start.region_m")
    {
        polygon_inside(world, &anticlockwise(region), "start.region_m", faults);
    }
    if faults.touch("robot.radius_m") || faults.touch("robot.height_m") {
        return;
    }
    let named = world.spec.start.named.iter().enumerate();
    let named = named.map(|(k, n)| (format!("start.named[{k}]"), Pose::new(n.x_m, n.y_m, 0.0)));
    let disturbances = world.spec.disturbances.iter().enumerate();
    let kidnapped = disturbances.filter_map(|(k, d)| match d.what {
        DisturbanceKind::Kidnap(to) => Some((format!("disturbances[{k}].what.kidnap"), Pose::new(to.x_m, to.y_m, 0.0))),
        DisturbanceKind::Kick { .. } => None,
    });
    let bodies = world.body_poses();
    for (place, pose) in std::iter::once(("home".to_owned(), world.home)).chain(named).chain(kidnapped) {
        if ["x_m", "y_m"].iter().any(|field| faults.touch(&format!("{place}.{field}"))) {
            continue;
        }
        if let Err(what) = world.is_free(&pose, -TOLERANCE_M, &bodies) {
            let found = format!("[{}, {}], where the robot would stand in {what}", pose.x, pose.y);
            let allowed =
                format!("a place in the room with {} m (robot.radius_m) to walls and bodies", world.spec.robot.radius_m);
            faults.add(place, found, allowed);
        }
    }
}
