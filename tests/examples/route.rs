//! A route taught and repeated: snapshots kept in a file, followed from it by night and backwards, and held against the truth.

use std::error::Error;
use std::ops::ControlFlow;

use wayhome::episode::Look;
use wayhome::render::RendererChoice;
use wayhome::route::follow::Way;
use wayhome::route::measure::RepeatRow;
use wayhome::route::repeat::{Repeating, repeat};
use wayhome::route::scene::{EVERY, SIZE_PX, Stage};
use wayhome::route::store::{FileStore, Form, SnapshotStore};
use wayhome::route::teach::{Teaching, teach};
use wayhome::route::tour::tour;
use wayhome::world::{LightPreset, World};

fn main() -> Result<(), Box<dyn Error>> {
    let world = World::open("flat:3")?;
    let stage = Stage::new(&world, SIZE_PX, EVERY, RendererChoice::Cpu)?;
    let lesson = teach(&stage, &tour(&world, 1, 12.0)?, &Teaching::default(), &mut |_| ControlFlow::Continue(()))?;
    let folder = tempfile::tempdir()?;
    let mut store = FileStore { path: folder.path().join("route.bin"), form: Form::Full };
    let bytes = store.keep(&lesson.route)?;
    let route = store.recall()?;
    eprintln!("{:.1} m, {} snapshots, {bytes} bytes", route.length_m(), route.snapshots.len());
    let night = Look { light: Some(LightPreset::Night), ..Look::default() };
    let back = Repeating { way: Way::Backwards, ..Repeating::default() };
    for (name, repeating) in [("by night", Repeating { look: night, ..Repeating::default() }), ("backwards", back)] {
        let row = RepeatRow::new(&repeat(&stage, &route, &lesson.truth, &repeating, 7, &mut |_| ControlFlow::Continue(()))?);
        eprintln!("{name}: {}, {:.1} cm from the taught path", row.outcome, 100.0 * row.cross_track_mean_m.unwrap_or(f64::NAN));
        assert!(row.completed, "{row:?}");
    }
    Ok(())
}
