//! The camera: its size, its place on the robot, its optics.

use std::f64::consts::{PI, TAU};

use super::Faults;
use crate::panorama::ProjectionKind;
use crate::world::WorldSpec;

pub(super) fn check(spec: &WorldSpec, faults: &mut Faults) {
    check_projection(spec, faults);
    check_mounting(spec, faults);
    check_optics(spec, faults);
}

fn check_projection(spec: &WorldSpec, faults: &mut Faults) {
    let c = &spec.camera;
    let pixels = |value: u32, low, high| ((low..=high).contains(&value), value.to_string(), format!("{low} to {high}"));
    for (place, (good, found, allowed)) in
        [("camera.width_px", pixels(c.width_px, 16, 16_384)), ("camera.height_px", pixels(c.height_px, 8, 4_096))]
    {
        faults.unless(good, place, found, allowed);
    }
    faults.between("camera.horizon", c.horizon, 0.0, 1.0);
    let sizes = ["camera.width_px", "camera.height_px", "camera.horizon"];
    if c.projection == ProjectionKind::EqualAngle && !sizes.iter().any(|place| faults.touch(place)) {
        let rows = f64::from(c.height_px) * c.horizon.max(1.0 - c.horizon);
        let steepest = rows * TAU / f64::from(c.width_px);
        faults.unless(
            steepest <= 0.5 * PI + 1e-9,
            "camera.height_px",
            format!("{}, with which rows reach {:.1} degrees from the horizon", c.height_px, steepest.to_degrees()),
            "rows up to 90 degrees from the horizon on either side",
        );
    }
}

fn check_mounting(spec: &WorldSpec, faults: &mut Faults) {
    let c = &spec.camera;
    faults.between("camera.mount_deg", c.mount_deg, -360.0, 360.0);
    if !faults.touch("room.height_m") {
        faults.unless(
            c.height_m > 0.0 && c.height_m < spec.room.height_m,
            "camera.height_m",
            c.height_m.to_string(),
            format!("more than 0, less than the room's height, {}", spec.room.height_m),
        );
    }
    let [x, y] = c.offset_m;
    if !faults.touch("camera.offset_m") && !faults.touch("robot.radius_m") {
        let most = spec.robot.radius_m;
        let allowed = format!("a place on the robot, up to {most} (robot.radius_m) from its middle");
        faults.unless((x * x + y * y).sqrt() <= most, "camera.offset_m", format!("[{x}, {y}]"), allowed);
    }
}

fn check_optics(spec: &WorldSpec, faults: &mut Faults) {
    let optics = &spec.camera.optics;
    faults.between("camera.optics.exposure", optics.exposure, 1e-3, 1e3);
    faults.between("camera.optics.gamma", optics.gamma, 0.1, 10.0);
    for (k, gain) in optics.white_balance.iter().enumerate() {
        faults.between(format!("camera.optics.white_balance[{k}]"), *gain, 0.0, 10.0);
    }
    faults.between("camera.optics.vignetting", optics.vignetting, 0.0, 1.0);
    faults.between("camera.optics.focus_blur_deg", optics.focus_blur_deg, 0.0, 10.0);
    faults.between("camera.optics.shutter_s", optics.shutter_s, 0.0, 1.0);
    if let Some(noise) = &optics.noise {
        faults.between("camera.optics.noise.saturation_electrons", noise.saturation_electrons, 10.0, 1e9);
        faults.between("camera.optics.noise.read_electrons", noise.read_electrons, 0.0, 1e6);
    }
    if let Some(dirt) = &optics.dirt {
        let most = 10_000;
        faults.unless(dirt.spots <= most, "camera.optics.dirt.spots", dirt.spots.to_string(), format!("0 to {most}"));
        faults.between("camera.optics.dirt.size_deg", dirt.size_deg, 0.01, 45.0);
        faults.between("camera.optics.dirt.opacity", dirt.opacity, 0.0, 1.0);
    }
}
