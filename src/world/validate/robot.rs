//! The robot and its task.

use super::{Faults, GREATEST_M};
use crate::world::WorldSpec;
use crate::world::robot::WheelFault;

pub(super) fn check(spec: &WorldSpec, faults: &mut Faults) {
    check_body(spec, faults);
    check_drive(spec, faults);
    check_gyro_and_faults(spec, faults);
    check_task(spec, faults);
}

fn check_body(spec: &WorldSpec, faults: &mut Faults) {
    let r = &spec.robot;
    faults.positive("robot.mass_kg", r.mass_kg, 1e5);
    faults.between("robot.radius_m", r.radius_m, 0.01, 100.0);
    faults.between("robot.height_m", r.height_m, 0.01, 100.0);
    if let Some(inertia) = r.yaw_inertia_kg_m2 {
        faults.positive("robot.yaw_inertia_kg_m2", inertia, 1e7);
    }
    if !faults.touch("robot.height_m") {
        faults.unless(
            r.centre_of_gravity_height_m >= 0.0 && r.centre_of_gravity_height_m <= r.height_m,
            "robot.centre_of_gravity_height_m",
            r.centre_of_gravity_height_m.to_string(),
            format!("0 (no load transfer) to {} (height_m)", r.height_m),
        );
    }
    if !faults.touch("robot.height_m") && !faults.touch("room.height_m") && r.height_m >= spec.room.height_m {
        let allowed = format!("less than the room's height, {}", spec.room.height_m);
        faults.add("robot.height_m", r.height_m.to_string(), allowed);
    }
    if faults.touch("robot.radius_m") {
        return;
    }
    let radius = r.radius_m;
    faults.unless(
        r.track_m > 0.0 && r.track_m <= 2.0 * radius,
        "robot.track_m",
        r.track_m.to_string(),
        format!("more than 0, at most {} (twice radius_m: the wheels are within the body)", 2.0 * radius),
    );
    faults.unless(
        r.wheel_radius_m > 0.0 && r.wheel_radius_m <= radius,
        "robot.wheel_radius_m",
        r.wheel_radius_m.to_string(),
        format!("more than 0, at most {radius} (radius_m)"),
    );
    faults.unless(
        r.caster_m != 0.0 && r.caster_m.abs() <= radius,
        "robot.caster_m",
        r.caster_m.to_string(),
        format!("-{radius} to {radius} (radius_m), and not 0"),
    );
    if !faults.touch("robot.caster_m") {
        // Between axle and caster all three contacts carry load; outside, the robot would tip over.
        let (low, high) = (r.caster_m.min(0.0), r.caster_m.max(0.0));
        faults.unless(
            r.centre_of_gravity_m > low && r.centre_of_gravity_m < high,
            "robot.centre_of_gravity_m",
            r.centre_of_gravity_m.to_string(),
            format!("between {low} and {high}: between axle and caster, so that all wheels are loaded"),
        );
    }
}

fn check_drive(spec: &WorldSpec, faults: &mut Faults) {
    let r = &spec.robot;
    faults.positive("robot.wheel_inertia_kg_m2", r.wheel_inertia_kg_m2, 1e4);
    faults.between("robot.rolling_resistance", r.rolling_resistance, 0.0, 0.5);
    faults.between("robot.caster_friction", r.caster_friction, 0.0, 10.0);
    faults.positive("robot.creep_m_s", r.creep_m_s, 1.0);
    faults.positive("robot.stall_torque_n_m", r.stall_torque_n_m, 1e5);
    faults.positive("robot.no_load_speed_rad_s", r.no_load_speed_rad_s, 1e4);
    faults.positive("robot.speed_gain", r.speed_gain, 1e6);
    faults.between("robot.speed_integral_gain", r.speed_integral_gain, 0.0, 1e6);
    faults.positive("robot.encoder_counts_per_turn", r.encoder_counts_per_turn, 1e8);
    for (k, error) in r.wheel_radius_error.iter().enumerate() {
        faults.between(format!("robot.wheel_radius_error[{k}]"), *error, -0.5, 0.5);
    }
    faults.positive("robot.max_speed_m_s", r.max_speed_m_s, 100.0);
    faults.positive("robot.max_turn_rate_rad_s", r.max_turn_rate_rad_s, 100.0);
    faults.positive("robot.max_acceleration_m_s2", r.max_acceleration_m_s2, 1000.0);
    let [speed, no_load, wheel] = ["max_speed_m_s", "no_load_speed_rad_s", "wheel_radius_m"].map(|f| format!("robot.{f}"));
    let top = r.no_load_speed_rad_s * r.wheel_radius_m;
    if ![&speed, &no_load, &wheel].iter().any(|place| faults.touch(place)) && r.max_speed_m_s > top {
        let allowed = format!("at most {top:.4}, what the unloaded motor reaches (no_load_speed_rad_s times wheel_radius_m)");
        faults.add(speed, r.max_speed_m_s.to_string(), allowed);
    }
}

fn check_gyro_and_faults(spec: &WorldSpec, faults: &mut Faults) {
    if let Some(gyro) = &spec.robot.gyro {
        faults.between("robot.gyro.bias_sd_rad_s", gyro.bias_sd_rad_s, 0.0, 10.0);
        faults.between("robot.gyro.noise_rad_s_sqrt_hz", gyro.noise_rad_s_sqrt_hz, 0.0, 10.0);
    }
    for (k, fault) in spec.robot.faults.iter().enumerate() {
        let place = format!("robot.faults[{k}]");
        faults.between(format!("{place}.from_s"), fault.from_s, 0.0, 1e6);
        if let WheelFault::WornTyre { friction_factor, radius_factor } = fault.what {
            faults.between(format!("{place}.what.worn-tyre.friction_factor"), friction_factor, 0.0, 10.0);
            faults.between(format!("{place}.what.worn-tyre.radius_factor"), radius_factor, 0.5, 1.5);
        }
    }
}

fn check_task(spec: &WorldSpec, faults: &mut Faults) {
    let t = &spec.task;
    faults.positive("task.speed_m_s", t.speed_m_s, 100.0);
    faults.between("task.control_period_s", t.control_period_s, 0.001, 10.0);
    faults.positive("task.arrival_radius_m", t.arrival_radius_m, GREATEST_M);
    faults.positive("task.time_limit_s", t.time_limit_s, 1e6);
    let sound = |faults: &Faults, places: [&str; 2]| !places.iter().any(|place| faults.touch(place));
    if sound(faults, ["task.speed_m_s", "robot.max_speed_m_s"]) && t.speed_m_s > spec.robot.max_speed_m_s {
        let allowed = format!("at most {} (robot.max_speed_m_s)", spec.robot.max_speed_m_s);
        faults.add("task.speed_m_s", t.speed_m_s.to_string(), allowed);
    }
    if sound(faults, ["task.time_limit_s", "task.control_period_s"]) && t.time_limit_s < t.control_period_s {
        let allowed = format!("at least one control period, {} s", t.control_period_s);
        faults.add("task.time_limit_s", t.time_limit_s.to_string(), allowed);
    }
}
