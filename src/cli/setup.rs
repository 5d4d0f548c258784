//! The arguments that make up an episode: what commands that run episodes share.

use std::path::PathBuf;
use std::time::Duration;

use wayhome::control::Law;
use wayhome::episode::{Look, PlantKind, SensorKind, Setup};
use wayhome::method::MethodKind;
use wayhome::panorama_set::Place;
use wayhome::render::RendererChoice;
use wayhome::sensor::{DatasetChoice, Noise};
use wayhome::vision::Landmarks;
use wayhome::world::{CameraPreset, LightPreset};

use super::values::{MethodParser, choice, not_negative, pair, positive, seconds, share, size};

/// The homing method and how it steers.
#[derive(Debug, Clone, clap::Args)]
pub struct MethodArgs {
    /// Homing method
    #[arg(long, default_value = "anchored-ekf", value_parser = MethodParser)]
    pub method: MethodKind,
    /// Steering law of the methods that estimate where home is
    #[arg(long, default_value = "proportional", value_parser = choice::<Law>())]
    pub controller: Law,
    #[command(flatten)]
    pub patience: PatienceArgs,
}

/// How long a program may take.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct PatienceArgs {
    /// How long a method that is a program may take for an answer, s; six times as long for its first one
    #[arg(long, value_name = "S", default_value = "5", allow_negative_numbers = true, value_parser = seconds)]
    pub method_timeout_s: Duration,
}

impl MethodArgs {
    /// The method, with the time that it has.
    pub fn kind(&self) -> MethodKind {
        match &self.method {
            MethodKind::Exec(command) => MethodKind::Exec(command.clone().with_time_limit(self.patience.method_timeout_s)),
            own => own.clone(),
        }
    }
}

/// Light and camera of rendered panoramas.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct LookArgs {
    /// Light [default: the world's]
    #[arg(long, value_parser = choice::<LightPreset>())]
    pub light: Option<LightPreset>,
    /// What the camera does to a picture [default: as the world says]
    #[arg(long, value_parser = choice::<CameraPreset>())]
    pub camera: Option<CameraPreset>,
}

impl LookArgs {
    /// What they stand for.
    pub fn look(&self) -> Look {
        Look { light: self.light, camera: self.camera }
    }
}

/// What moves, what senses, and for how long.
#[derive(Debug, Clone, clap::Args)]
pub struct SetupArgs {
    /// What moves when the wheels are commanded
    #[arg(long, default_value = "rapier", value_parser = choice::<PlantKind>())]
    pub plant: PlantKind,
    /// Where bearings come from
    #[arg(long, default_value = "rendered", value_parser = choice::<SensorKind>())]
    pub bearings: SensorKind,
    /// What a landmark of rendered bearings is [default: features]
    #[arg(long, value_parser = choice::<Landmarks>())]
    pub landmarks: Option<Landmarks>,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice::<RendererChoice>())]
    pub renderer: RendererChoice,
    /// Columns and rows of the panorama, 16x8 to 16384x4096 [default: the world's]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    #[command(flatten)]
    pub look: LookArgs,
    /// Light at home, if another than on the way
    #[arg(long, value_parser = choice::<LightPreset>())]
    pub home_light: Option<LightPreset>,
    /// Camera at home, if another than on the way
    #[arg(long, value_parser = choice::<CameraPreset>())]
    pub home_camera: Option<CameraPreset>,
    /// Set of panoramas for `--bearings dataset`, in any layout that `dataset` writes, or a real one
    #[arg(long, value_name = "DIR", required_if_eq("bearings", "dataset"))]
    pub dataset: Option<PathBuf>,
    /// Condition of the set [default: its first]
    #[arg(long, value_name = "NAME", requires = "dataset")]
    pub dataset_condition: Option<String>,
    /// Condition of the home panorama, if another than on the way
    #[arg(long, value_name = "NAME", requires = "dataset")]
    pub dataset_home_condition: Option<String>,
    /// Distance between places of a set that does not tell it, m
    #[arg(long, value_name = "S", requires = "dataset", allow_negative_numbers = true, value_parser = positive)]
    pub dataset_spacing_m: Option<f64>,
    /// Row and column of home, from 0, of a set that does not tell it [default: the middle; without a grid, the first panorama]
    #[arg(long, value_name = "I,J", requires = "dataset", value_parser = place)]
    pub dataset_home: Option<Place>,
    /// Standard deviation of noisy bearings, degrees [default: 0.3]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = not_negative)]
    pub noise_deg: Option<f64>,
    /// Share of noisy bearings that are missed [default: 0.05]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = share)]
    pub noise_dropout: Option<f64>,
    /// Share of noisy bearings that are false [default: 0.02]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = share)]
    pub noise_false: Option<f64>,
    /// Give the robot a compass with readings of this standard deviation, degrees; programs and methods without an estimate use it
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = not_negative)]
    pub compass_deg: Option<f64>,
    /// Time limit, s [default: the world's]
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
    pub time_limit_s: Option<f64>,
}

impl SetupArgs {
    /// The setup that they ask for; its method and its start are the usual ones.
    pub fn setup(&self) -> Setup {
        let usual = Setup::default();
        let mut extractor = usual.extractor;
        extractor.landmarks = self.landmarks.unwrap_or(extractor.landmarks);
        let noise = Noise::default();
        let is_noise_given = [self.noise_deg, self.noise_dropout, self.noise_false].iter().any(Option::is_some);
        Setup {
            plant: self.plant,
            sensor: self.bearings,
            renderer: self.renderer,
            size_px: self.size,
            extractor,
            look: self.look.look(),
            home_look: Look { light: self.home_light, camera: self.home_camera },
            dataset: self.dataset.as_ref().map(|folder| DatasetChoice {
                folder: folder.clone(),
                condition: self.dataset_condition.clone(),
                home_condition: self.dataset_home_condition.clone(),
                spacing_m: self.dataset_spacing_m,
                home: self.dataset_home,
            }),
            noise: is_noise_given.then(|| Noise {
                sd_rad: self.noise_deg.map_or(noise.sd_rad, f64::to_radians),
                dropout: self.noise_dropout.unwrap_or(noise.dropout),
                false_match: self.noise_false.unwrap_or(noise.false_match),
            }),
            compass_sd_rad: self.compass_deg.map(f64::to_radians),
            time_limit_s: self.time_limit_s,
            ..usual
        }
    }
}

fn place(text: &str) -> Result<Place, String> {
    pair(text, ",").map(|(i, j)| Place { i, j }).ok_or_else(|| "a place is I,J: its row and column, from 0".into())
}
