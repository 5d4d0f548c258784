//! `wayhome bearings`: what a user's own pictures say of the way home.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::homing::{Answer, Features, Homing};
use wayhome::storage::csv::{Columns, csv, number};
use wayhome::storage::write_atomically;
use wayhome::vision::ExtractorSettings;

use super::context::{Context, Verdict};
use super::lens::LensArgs;

/// Arguments of `bearings`.
#[derive(Debug, clap::Args)]
pub struct BearingsArgs {
    /// Picture taken at home
    pub home: PathBuf,
    /// Pictures taken elsewhere
    #[arg(required = true)]
    pub now: Vec<PathBuf>,
    #[command(flatten)]
    pub lens: LensArgs,
    /// Write every bearing, home's and the current one, to this table; one that is there already is not overwritten
    #[arg(long, value_name = "FILE.csv", value_parser = super::values::ending("csv"))]
    pub out: Option<PathBuf>,
}

/// What is printed of a picture.
#[derive(Serialize)]
struct Row {
    now: String,
    /// Bearings that one motion of the camera explains and chance would not bring.
    bearings: usize,
    /// Other motions that explain much of the view as well.
    alternatives: usize,
    /// Turn since home, degrees, anti-clockwise.
    turn_deg: Option<f64>,
    turn_sd_deg: Option<f64>,
    /// Direction of home from the heading now, degrees, anti-clockwise.
    home_deg: Option<f64>,
    home_sd_deg: Option<f64>,
    /// Median displacement of landmarks, degrees: 0 at home.
    parallax_deg: Option<f64>,
}

/// A bearing, for the table.
struct Bearing {
    now: String,
    home_azimuth_deg: f64,
    home_elevation_deg: f64,
    azimuth_deg: f64,
    elevation_deg: f64,
    sd_deg: f64,
}

const COLUMNS: &Columns<Bearing> = &[
    ("now", |b| b.now.clone()),
    ("home_azimuth_deg", |b| number(b.home_azimuth_deg)),
    ("home_elevation_deg", |b| number(b.home_elevation_deg)),
    ("azimuth_deg", |b| number(b.azimuth_deg)),
    ("elevation_deg", |b| number(b.elevation_deg)),
    ("sd_deg", |b| number(b.sd_deg)),
];

/// Displacement of landmarks below which a picture was taken at home as far as it can be told, degrees.
const AT_HOME_DEG: f64 = 0.3;

pub fn run(args: &BearingsArgs, context: &Context) -> Result<Verdict> {
    if let Some(out) = args.out.as_ref().filter(|out| out.exists()) {
        return Err(wayhome::Error::FileTaken { path: out.clone() }.into());
    }
    let lens = args.lens.lens_like(&args.home)?;
    let mut features = Features::new(ExtractorSettings::default(), &lens.read(&args.home)?);
    let landmarks = features.landmarks();
    let bar = context.progress(Some(args.now.len() as u64))?;
    let (mut rows, mut bearings) = (Vec::new(), Vec::new());
    for path in &args.now {
        bar.go_on()?;
        let answer = features.look(&lens.read(path)?)?;
        let now = path.display().to_string();
        let elevation = |tan: f64| wayhome::panorama_set::elevation_rad(tan).to_degrees();
        bearings.extend(answer.landmarks.iter().map(|l| Bearing {
            now: now.clone(),
            home_azimuth_deg: l.home.azimuth_rad.to_degrees(),
            home_elevation_deg: elevation(l.home.tan_elevation),
            azimuth_deg: l.now.azimuth_rad.to_degrees(),
            elevation_deg: elevation(l.now.tan_elevation),
            sd_deg: l.now.sd_rad.to_degrees(),
        }));
        rows.push(row(now, &answer));
        bar.done("");
    }
    drop(bar);
    if let Some(out) = &args.out {
        write_atomically(out, csv(COLUMNS, &bearings).as_bytes())?;
    }
    context.print(&rows, || text(&args.home.display().to_string(), landmarks, &rows))?;
    Ok(Verdict::Done)
}

fn row(now: String, answer: &Answer) -> Row {
    let degrees = |rad: f64| rad.to_degrees();
    Row {
        now,
        bearings: answer.landmarks.len(),
        alternatives: answer.alternatives,
        turn_deg: answer.turn.map(|a| degrees(a.rad)),
        turn_sd_deg: answer.turn.and_then(|a| a.sd_rad).map(degrees),
        home_deg: answer.home.map(|a| degrees(a.rad)),
        home_sd_deg: answer.home.and_then(|a| a.sd_rad).map(degrees),
        parallax_deg: answer.parallax_rad.map(degrees),
    }
}

fn text(home: &str, landmarks: usize, rows: &[Row]) -> String {
    let mut text = format!("home {home}: {landmarks} features\n");
    for row in rows {
        let _ = write!(text, "{}: ", row.now);
        match (row.turn_deg, row.home_deg) {
            (Some(turn), Some(home)) => {
                let sd = |sd: Option<f64>| sd.map_or_else(String::new, |sd| format!(" +- {sd:.1}"));
                let _ = write!(text, "{} bearings; turned by {turn:.1}{} deg", row.bearings, sd(row.turn_sd_deg));
                if row.parallax_deg.is_some_and(|p| p < AT_HOME_DEG) {
                    text += "; at home, as far as can be told";
                } else {
                    let _ = write!(text, "; home is at {home:.1}{} deg", sd(row.home_sd_deg));
                    let _ = write!(text, "; landmarks are displaced by {:.1} deg", row.parallax_deg.unwrap_or_default());
                }
                if row.alternatives > 0 {
                    let _ = write!(text, "; {} other readings", row.alternatives);
                }
            }
            _ => text += "nothing that chance would not bring: another place, or too far from home",
        }
        text += "\n";
    }
    text
}
