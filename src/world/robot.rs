//! The robot as a person describes it, and ready-made robots with the sources of their numbers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A ready-made robot. Numbers that no source gives (inertia of a wheel, gains of the speed loop, creep, what calibration
/// leaves over) are typical ones for a robot of the size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RobotPreset {
    /// iRobot Create 3. Mass 2.3 kg, radius 0.164 m, track 0.233 m, wheel radius 0.036 m, caster 0.125 m ahead of the axle,
    /// 0.306 m/s, 1.9 rad/s, 0.9 m/s^2, 508.8 counts a turn: iRobot Education, Create 3 documentation and its simulator's robot
    /// description. The motors are those of a small gear motor.
    #[default]
    Create3,
    /// TurtleBot3 Burger. 178 mm wide and 192 mm high, wheels of 66 mm on a track of 160 mm, 2.84 rad/s, 4096 counts a turn:
    /// ROBOTIS, TurtleBot3 e-manual; 1.2 kg: MVSim's vehicle file. Its DYNAMIXEL XL430-W250 stall at 1.5 N m and turn 61 times a
    /// minute at 12 V (ROBOTIS, XL430-W250 e-manual), which is 0.21 m/s: a little less than the 0.22 m/s of the robot's sheet.
    Turtlebot3,
    /// A laboratory robot of 5 kg on two Pololu 37D gear motors, 50:1, 12 V: 200 turns a minute without load, 2.06 N m stalled,
    /// 3200 counts a turn of the wheel (Pololu, 37D Metal Gearmotors data sheet). All else is of our choice.
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
