//! `wayhome world generate`: rooms drawn from a seed, and sheets of them.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Result;
use rayon::prelude::*;
use serde::Serialize;
use wayhome::Error;
use wayhome::draw::worlds::{CELL_PX, WorldSheet};
use wayhome::panorama::Panorama;
use wayhome::render::{self, Renderer, RendererChoice, Scene, View};
use wayhome::storage::{OutputFolder, write_atomically};
use wayhome::world::World;
use wayhome::world::generate::{Generated, HEAD, Kind, Knob, Knobs, OUTLINE, Outline, generate, usual_outlines};

use super::context::{Context, Verdict, folder_or, print, write_own};
use super::values::choice;

/// Worlds that are made before they are written and the user is asked whether to go on.
const BATCH: u64 = 256;

/// Arguments of `world generate`.
#[derive(Debug, clap::Args)]
pub struct GenerateArgs {
    /// What sort of room
    #[arg(value_parser = choice::<Kind>())]
    pub kind: Kind,
    /// Seed of the first world; the next ones have the seeds after it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// How many worlds
    #[arg(long, value_name = "M", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub count: u64,
    /// Draw a knob from this range, or give it this value; may be repeated. See --knobs
    #[arg(long, value_name = "KNOB=VALUE|KNOB=LOW..HIGH")]
    pub set: Vec<String>,
    /// File for one world (NAME.toml), folder for several [default: stdout, several: results/runs/generate-KIND-N]
    #[arg(long, value_name = "DIR|FILE")]
    pub out: Option<PathBuf>,
    /// Picture of the worlds: what the camera sees at home, and the room from above. Worlds are written with --out only
    #[arg(long, value_name = "FILE.png")]
    pub sheet: Option<PathBuf>,
    /// What renders the sheet
    #[arg(long, default_value = "auto", value_parser = choice::<RendererChoice>())]
    pub renderer: RendererChoice,
    /// List the knobs of this kind, with unit, usual and allowed range and meaning
    #[arg(long)]
    pub knobs: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output {
    kind: &'static str,
    seed: u64,
    count: u64,
    worlds: Vec<String>,
    out: Option<String>,
    sheet: Option<String>,
}

pub fn run(args: &GenerateArgs, context: &Context) -> Result<Verdict> {
    if args.knobs {
        return list_knobs(args.kind, context);
    }
    let mut knobs = Knobs::default();
    args.set.iter().try_for_each(|setting| knobs.set(setting))?;
    let last = args.seed.checked_add(args.count - 1).ok_or_else(|| Error::Invalid {
        what: "--count".to_owned(),
        found: args.count.to_string(),
        allowed: format!("seeds up to {}", u64::MAX),
    })?;
    // A name that ends in .toml is a file, and no file is given for several worlds.
    let file = args.out.as_ref().filter(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")));
    if let Some(path) = file.filter(|_| args.count > 1) {
        let found = format!("{} for {} worlds", path.display(), args.count);
        return Err(Error::Invalid { what: "--out".to_owned(), found, allowed: "a folder".to_owned() }.into());
    }
    if args.count == 1 && args.out.is_none() && args.sheet.is_none() {
        print(&generate(args.kind, args.seed, &knobs)?.toml)?;
        return Ok(Verdict::Done);
    }
    let (kind, first) = (args.kind.name(), args.seed.to_string());
    let folder = match (&args.out, &args.sheet) {
        (Some(out), _) if file.is_none() => Some(out.clone()),
        (None, None) => Some(folder_or(None, &["generate", kind, &first])),
        _ => None,
    };
    let mut open = folder.as_ref().map(|path| OutputFolder::open(path, "world generate")).transpose()?;
    let mut sheet = args.sheet.as_ref().map(|_| SheetMaker::new(args.renderer)).transpose()?;
    let bar = context.work(args.count)?;
    let mut worlds = Vec::new();
    let mut from = args.seed;
    loop {
        let to = from.saturating_add(BATCH - 1).min(last);
        let batch: Vec<_> =
            (from..=to).into_par_iter().map(|seed| generate(args.kind, seed, &knobs)).collect::<wayhome::Result<_>>()?;
        for world in batch {
            bar.go_on()?;
            if let Some(folder) = &mut open {
                folder.write(&format!("{}.toml", world.spec.name), world.toml.as_bytes())?;
            }
            if let Some(path) = file {
                write_own(path, &world.toml, HEAD)?;
            }
            if let Some(sheet) = &mut sheet {
                sheet.add(&world)?;
            }
            worlds.push(world.spec.name);
            bar.inc(1);
        }
        if to == last {
            break;
        }
        from = to + 1;
    }
    drop(bar);
    if let Some(folder) = open {
        folder.finish()?;
    }
    if let (Some(path), Some(sheet)) = (&args.sheet, sheet) {
        write_atomically(path, &sheet.sheet.png(path)?)?;
    }
    let shown = |path: Option<&PathBuf>| path.map(|p| p.display().to_string());
    let output = Output {
        kind,
        seed: args.seed,
        count: args.count,
        worlds,
        out: shown(file.or(folder.as_ref())),
        sheet: shown(args.sheet.as_ref()),
    };
    context.print(&output, || {
        let places = [&output.out, &output.sheet].into_iter().flatten().cloned().collect::<Vec<_>>().join(", ");
        let of = if args.count == 1 { "world" } else { "worlds" };
        format!("{} {of} of kind {kind}, seeds {}..{last}: {places}\n", args.count, args.seed)
    })?;
    Ok(Verdict::Done)
}

/// Renders worlds for a sheet.
struct SheetMaker {
    renderer: Box<dyn Renderer>,
    sheet: WorldSheet,
}

impl SheetMaker {
    fn new(choice: RendererChoice) -> Result<Self> {
        Ok(Self { renderer: render::create(choice)?, sheet: WorldSheet::default() })
    }

    fn add(&mut self, generated: &Generated) -> Result<()> {
        let world = World::from_toml(&generated.toml, format!("{}.toml", generated.spec.name))?;
        let camera = &world.spec.camera;
        let projection = world.projection_of_size(CELL_PX, CELL_PX * camera.height_px / camera.width_px);
        let mut seen = Panorama::black(projection);
        let view = View { projection, robot: world.home, bodies: &world.body_poses() };
        self.renderer.render(&Scene::new(&world)?, &view, &mut seen)?;
        Ok(self.sheet.add(&world, &seen)?)
    }
}

/// A knob as `--knobs --json` shows it.
#[derive(Serialize)]
struct KnobRow {
    knob: &'static str,
    unit: &'static str,
    usual: [f64; 2],
    allowed: [f64; 2],
    meaning: &'static str,
}

fn list_knobs(kind: Kind, context: &Context) -> Result<Verdict> {
    let rows: Vec<KnobRow> = Knob::ALL
        .iter()
        .filter_map(|knob| {
            let ranges = knob.ranges(kind)?;
            let (knob, unit, meaning) = (knob.name(), knob.unit(), knob.meaning());
            Some(KnobRow { knob, unit, usual: ranges.usual, allowed: ranges.allowed, meaning })
        })
        .collect();
    context.print(&rows, || {
        let mut text = format!("{:<18} {:<5} {:<12} {:<12} meaning\n", "knob", "unit", "usual", "allowed");
        for KnobRow { knob, unit, usual: [low, high], allowed: [least, most], meaning } in &rows {
            let (usual, allowed) = (format!("{low}..{high}"), format!("{least}..{most}"));
            let _ = writeln!(text, "{knob:<18} {unit:<5} {usual:<12} {allowed:<12} {meaning}");
        }
        let usual = usual_outlines(kind);
        let names = Outline::ALL.iter().filter(|o| usual.contains(o)).map(|o| o.name()).collect::<Vec<_>>().join(",");
        let _ = writeln!(text, "{OUTLINE:<18} {:<5} {names}: shape of the room from above", "");
        text
    })?;
    Ok(Verdict::Done)
}
