//! A small data set: panoramas of a world on a grid, with all that is true of them.

use std::error::Error;
use std::ops::ControlFlow;

use wayhome::dataset::check::check;
use wayhome::dataset::conditions::Condition;
use wayhome::dataset::pipeline::Job;
use wayhome::dataset::plan::{Headings, Places, Plan, Request};
use wayhome::panorama_set::LayoutKind;
use wayhome::render::CpuRenderer;
use wayhome::world::World;

fn main() -> Result<(), Box<dyn Error>> {
    let world = World::open("lab")?;
    let request = Request {
        places: Places::Grid { columns: 3, rows: 2, spacing_m: 0.5, origin_m: None },
        headings: Headings::Fixed(vec![0.0]),
        conditions: vec![Condition::original()],
        size_px: Some((360, 45)),
        layout: LayoutKind::Folder,
        seed: 1,
        licence: "CC-BY-4.0".into(),
        command: "cargo run --release --example data_set".into(),
    };
    let plan = Plan::new(&world, request)?;
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("lab-grid");
    let job = Job { plan: &plan, out: &out, shard: (1, 1), extras: &|_, _, _| Ok(Vec::new()) };
    let made = job.run(&mut CpuRenderer::new(), &mut |_| ControlFlow::Continue(()))?;
    let found = check(&out, &|_, _| ControlFlow::Continue(()))?;
    eprintln!("{} panoramas, {} files of {} bytes, {} faults", made.rendered, found.files, found.bytes, found.faults.len());
    if made.complete && made.rendered == plan.frames() && found.faults.is_empty() {
        Ok(())
    } else {
        Err("not as expected".into())
    }
}
