//! Wheels: a DC motor under a speed loop, with the floor pulling at the rim.
//!
//! The motor follows the linear torque-speed line, torque = stall (u - speed / no_load), with u the share of full voltage,
//! -1 to 1. The speed loop sets u = k_p (reference - speed) + k_i integral of it. Both are taken at the end of the substep:
//! a light wheel that loses the floor would oscillate under the same gains taken at its start.
//!
//! Rolling resistance is dry friction on the wheel's turning: a torque of c N R against it, and as much as it takes, up to
//! that, to keep a standing wheel standing.

use crate::world::RobotSpec;

/// What drives a wheel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WheelDrive {
    /// The speed loop holds this wheel speed, rad/s.
    Speed(f64),
    /// A torque from outside the motor, N m; zero lets the wheel roll freely.
    Torque(f64),
    /// A brake that holds the wheel still whatever the floor does.
    Locked,
}

/// Data of a wheel with its motor and loop.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WheelSpec {
    /// True rolling radius, m.
    pub(super) radius_m: f64,
    inertia_kg_m2: f64,
    stall_torque_n_m: f64,
    no_load_speed_rad_s: f64,
    proportional: f64,
    integral: f64,
}

/// State of a wheel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct WheelState {
    /// rad/s.
    pub(super) speed: f64,
    /// Angle turned since the start, rad.
    pub(super) angle: f64,
    /// Integral of the speed error, rad.
    speed_error: f64,
}

/// A wheel's answer to the floor: its speed at the end of the substep, and how much a further angular impulse (N m s) from
/// the floor slows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    pub(super) speed: f64,
    pub(super) inverse_inertia: f64,
}

impl WheelSpec {
    pub(super) fn new(robot: &RobotSpec, radius_m: f64) -> Self {
        Self {
            radius_m,
            inertia_kg_m2: robot.wheel_inertia_kg_m2,
            stall_torque_n_m: robot.stall_torque_n_m,
            no_load_speed_rad_s: robot.no_load_speed_rad_s,
            proportional: robot.speed_gain,
            integral: robot.speed_integral_gain,
        }
    }

    /// The wheel after `dt` seconds in which the floor turned it back by `floor` and rolling resistance took up to
    /// `resistance` (angular impulses, N m s).
    pub(super) fn respond(&self, state: &WheelState, drive: WheelDrive, floor: f64, resistance: f64, dt: f64) -> Response {
        if resistance == 0.0 {
            return self.turn(state, drive, floor, dt);
        }
        // Speed falls as the angular impulse grows, so at most one of these holds.
        let forwards = self.turn(state, drive, floor + resistance, dt);
        if forwards.speed > 0.0 {
            return forwards;
        }
        let backwards = self.turn(state, drive, floor - resistance, dt);
        if backwards.speed < 0.0 {
            return backwards;
        }
        Response { speed: 0.0, inverse_inertia: 0.0 }
    }

    /// The wheel after `dt` seconds in which everything but the motor turned it back by `floor` (angular impulse, N m s).
    fn turn(&self, state: &WheelState, drive: WheelDrive, floor: f64, dt: f64) -> Response {
        let momentum = self.inertia_kg_m2 * state.speed - floor;
        match drive {
            WheelDrive::Locked => Response { speed: 0.0, inverse_inertia: 0.0 },
            WheelDrive::Torque(torque) => {
                let inverse_inertia = 1.0 / self.inertia_kg_m2;
                Response { speed: (momentum + torque * dt) * inverse_inertia, inverse_inertia }
            }
            WheelDrive::Speed(reference) => {
                let full = self.stall_torque_n_m * dt; // what full voltage gives a standing wheel, N m s
                let braked = self.inertia_kg_m2 + full / self.no_load_speed_rad_s;
                let wish = self.proportional * reference + self.integral * state.speed_error;
                let inverse_inertia = 1.0 / (braked + full * self.proportional);
                let speed = (momentum + full * wish) * inverse_inertia;
                let voltage = wish - self.proportional * speed;
                if voltage.abs() <= 1.0 {
                    return Response { speed, inverse_inertia };
                }
                // The supply limits the voltage: constant, so only the motor's own back-EMF still brakes. The torque-speed
                // relation is monotone, so this branch is consistent whenever the other is not.
                let inverse_inertia = 1.0 / braked;
                Response { speed: (momentum + full * voltage.signum()) * inverse_inertia, inverse_inertia }
            }
        }
    }

    /// Takes over the solved speed: turns the wheel and winds the integral, but never further into saturation.
    pub(super) fn finish(&self, state: &mut WheelState, drive: WheelDrive, speed: f64, dt: f64) {
        let speed = flushed(speed);
        state.angle += 0.5 * (state.speed + speed) * dt;
        state.speed = speed;
        if let WheelDrive::Speed(reference) = drive {
            let error = reference - speed;
            let voltage = self.proportional * error + self.integral * state.speed_error;
            if voltage.abs() < 1.0 || voltage * error < 0.0 {
                state.speed_error = flushed(state.speed_error + error * dt);
            }
        } else {
            state.speed_error = 0.0;
        }
    }

    /// Energy of rotation, J.
    pub(super) fn energy(&self, state: &WheelState) -> f64 {
        0.5 * self.inertia_kg_m2 * state.speed * state.speed
    }
}

/// Zero for what no longer matters (1e-13 of whatever unit, far below what the friction solver resolves): decaying velocities
/// come to true rest instead of lingering among denormal numbers, which are slow to compute with.
pub(super) fn flushed(value: f64) -> f64 {
    if value.abs() < 1e-13 { 0.0 } else { value }
}
