//! The robot as a person describes it, and ready-made robots with the sources of their numbers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A ready-made robot. For each, its numbers are told apart by where they come from:
/// - *published*: a data sheet or a file of the maker gives them,
/// - *derived* from published ones, as said,
/// - *assumed*: typical for a robot of the size; nobody publishes them.
///
/// Assumed for all of them: the inertia of a wheel with gear and rotor, rolling resistance 0.01 (hard rubber on a hard floor),
/// friction of the caster 0.05 of the floor's, creep 0.01 m/s, gains of the speed loop (chosen to settle in half a second), and
/// wheel radii that calibration left wrong by +0.15 and -0.05 %. Yaw inertia is derived: a uniform disc of mass and radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RobotPreset {
    /// iRobot Create 3 with a mast for the camera.
    /// - Published: 0.306 m/s with its safety features on, 0.9 m/s^2, 508.8 counts a turn (iRobot Education, Create 3
    ///   documentation: safety, odometry); mass 2.3 kg, radius 0.164 m, track 0.233 m, caster 0.125 m ahead of the axle, 1.9 rad/s
    ///   (its simulator `create3_sim`: robot description and `control.yaml`).
    /// - Derived: wheel radius 0.036 m, rounded from the simulator's 0.03575 m.
    /// - Assumed: centre of gravity 0.03 m ahead of the axle (the documentation says ahead, the simulator 0.023 m before bumper
    ///   and mast), height 0.35 m with the mast, motors of 0.6 N m stalled and 16 rad/s unloaded at the wheel, which leave torque
    ///   at its true top speed of 0.46 m/s (12.8 rad/s).
    #[default]
    Create3,
    /// TurtleBot3 Burger.
    /// - Published: height 0.192 m, 2.84 rad/s (ROBOTIS, TurtleBot3 e-manual: specifications); XL430-W250 motors of 1.5 N m
    ///   stalled and 61 turns a minute unloaded at 12 V, 12-bit encoder (e-manual: appendix DYNAMIXEL); wheel radius 0.033 m, track
    ///   0.16 m, caster 0.081 m behind the axle (`turtlebot3_description`, burger); radius 0.105 m (its navigation's cost map).
    /// - Derived: 1.2 kg, chassis and wheels of MVSim's vehicle file (the e-manual has 1 kg); 4096 counts a turn, the encoder's 12
    ///   bits; 0.19 m/s, nine tenths of what the motors turn unloaded (the sheet's 0.22 m/s is above that speed).
    /// - Assumed: centre of gravity 0.03 m behind the axle (that of the body's box in the description), 1 m/s^2.
    Turtlebot3,
    /// A laboratory robot on two Pololu 37D gear motors, 50:1, 12 V.
    /// - Published: 200 turns a minute unloaded, 21 kg cm stalled by extrapolation, which is 2.06 N m (Pololu, 37D Metal
    ///   Gearmotors data sheet).
    /// - Derived: 3200 counts a turn, 64 of the motor's encoder times 50.
    /// - Assumed: all else. It is no robot that one can buy.
    Generic,
}

/// A differential-drive robot with two drive wheels and a caster. Fields that are left out are those of the preset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RobotSpec {
    /// The robot that fields not given here are taken from.
    pub preset: RobotPreset,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Radius of the round body, m.
    pub radius_m: f64,
    /// Height of the body, m; what hangs higher is driven under.
    pub height_m: f64,
    /// Yaw inertia about the centre of gravity, kg m^2; by default that of a uniform disc.
    pub yaw_inertia_kg_m2: Option<f64>,
    /// Centre of gravity ahead of the axle, m.
    pub centre_of_gravity_m: f64,
    /// Centre of gravity above the floor, m: how much load speeding up, braking and cornering shift between wheels and caster.
    /// 0 leaves load transfer out.
    pub centre_of_gravity_height_m: f64,
    /// Distance between the wheels, m.
    pub track_m: f64,
    /// Wheel radius, m.
    pub wheel_radius_m: f64,
    /// Inertia of one wheel with its gear and rotor as felt at the wheel, kg m^2.
    pub wheel_inertia_kg_m2: f64,
    /// Rolling resistance of a drive wheel, as a share of its load.
    pub rolling_resistance: f64,
    /// Caster ahead of the axle (negative: behind), m.
    pub caster_m: f64,
    /// Friction of the caster, as a share of the floor's.
    pub caster_friction: f64,
    /// Slip speed at which friction saturates, m/s: the creep that makes odometry drift without a visible skid.
    pub creep_m_s: f64,
    /// Wheel torque of a stalled motor at full voltage, N m.
    pub stall_torque_n_m: f64,
    /// Wheel speed of an unloaded motor at full voltage, rad/s.
    pub no_load_speed_rad_s: f64,
    /// Proportional gain of the wheel-speed loop, share of full voltage per rad/s.
    pub speed_gain: f64,
    /// Integral gain of the wheel-speed loop, share of full voltage per rad.
    pub speed_integral_gain: f64,
    /// Encoder counts per turn of the wheel.
    pub encoder_counts_per_turn: f64,
    /// Relative error of the odometry's wheel radius, left and right: what calibration left over.
    pub wheel_radius_error: [f64; 2],
    /// Greatest commanded forward speed, m/s.
    pub max_speed_m_s: f64,
    /// Greatest commanded yaw rate, rad/s.
    pub max_turn_rate_rad_s: f64,
    /// Greatest commanded acceleration, m/s^2.
    pub max_acceleration_m_s2: f64,
    /// A gyro. Where there is one, the odometry's yaw rate is the gyro's and not the encoders'.
    pub gyro: Option<GyroSpec>,
    /// What is broken or breaks.
    pub faults: Vec<FaultSpec>,
}

impl RobotSpec {
    /// A ready-made robot.
    #[must_use]
    pub fn of(preset: RobotPreset) -> Self {
        let create3 = Self {
            preset,
            mass_kg: 2.3,
            radius_m: 0.164,
            height_m: 0.35,
            yaw_inertia_kg_m2: None,
            centre_of_gravity_m: 0.03,
            centre_of_gravity_height_m: 0.0,
            track_m: 0.233,
            wheel_radius_m: 0.036,
            wheel_inertia_kg_m2: 1.0e-4,
            rolling_resistance: 0.01,
            caster_m: 0.125,
            caster_friction: 0.05,
            creep_m_s: 0.01,
            stall_torque_n_m: 0.6,
            no_load_speed_rad_s: 16.0,
            speed_gain: 0.4,
            speed_integral_gain: 4.0,
            encoder_counts_per_turn: 508.8,
            wheel_radius_error: [0.0015, -0.0005],
            max_speed_m_s: 0.306,
            max_turn_rate_rad_s: 1.9,
            max_acceleration_m_s2: 0.9,
            gyro: None,
            faults: Vec::new(),
        };
        match preset {
            RobotPreset::Create3 => create3,
            RobotPreset::Turtlebot3 => Self {
                mass_kg: 1.2,
                radius_m: 0.105,
                height_m: 0.192,
                centre_of_gravity_m: -0.03,
                track_m: 0.16,
                wheel_radius_m: 0.033,
                caster_m: -0.081,
                stall_torque_n_m: 1.5,
                no_load_speed_rad_s: 6.39,
                speed_gain: 1.0,
                speed_integral_gain: 10.0,
                encoder_counts_per_turn: 4096.0,
                max_speed_m_s: 0.19,
                max_turn_rate_rad_s: 2.84,
                max_acceleration_m_s2: 1.0,
                ..create3
            },
            RobotPreset::Generic => Self {
                mass_kg: 5.0,
                radius_m: 0.2,
                height_m: 0.3,
                centre_of_gravity_m: 0.04,
                track_m: 0.3,
                wheel_radius_m: 0.045,
                wheel_inertia_kg_m2: 4.0e-4,
                caster_m: 0.15,
                stall_torque_n_m: 2.06,
                no_load_speed_rad_s: 20.9,
                encoder_counts_per_turn: 3200.0,
                max_speed_m_s: 0.7,
                max_turn_rate_rad_s: 3.0,
                max_acceleration_m_s2: 1.5,
                ..create3
            },
        }
    }
}

impl Default for RobotSpec {
    fn default() -> Self {
        Self::of(RobotPreset::default())
    }
}

/// A rate gyro about the vertical axis, read once a control step: the mean yaw rate over the step, plus bias, plus noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GyroSpec {
    /// Standard deviation of the bias, rad/s. Each run draws one and keeps it.
    pub bias_sd_rad_s: f64,
    /// Density of the white noise, rad/s per square root of Hz: the heading integrated over a time t wanders by this times
    /// sqrt(t).
    pub noise_rad_s_sqrt_hz: f64,
}

/// A fault of one wheel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultSpec {
    /// Which wheel.
    pub wheel: WheelSide,
    /// What is wrong with it.
    pub what: WheelFault,
    /// From when on, s from the start of the run.
    #[serde(default)]
    pub from_s: f64,
}

/// A wheel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WheelSide {
    /// The left one.
    Left,
    /// The right one.
    Right,
}

/// What can be wrong with a wheel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum WheelFault {
    /// The gear is stuck: the wheel no longer turns, whatever the motor and the floor do.
    SeizedMotor,
    /// The encoder counts nothing more. The speed loop has the motor's own tachometer and goes on.
    DeadEncoder,
    /// The tyre has lost grip or size.
    WornTyre {
        /// Friction of the wheel, as a share of the floor's.
        #[serde(default = "one")]
        friction_factor: f64,
        /// Radius, as a share of the true one.
        #[serde(default = "one")]
        radius_factor: f64,
    },
}

fn one() -> f64 {
    1.0
}
