//! The paper's numbers.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a failing test shows its table, and fails by panicking")]

use wayhome::study::paper::ideal::{Ideal, Twists};
use wayhome::study::paper::*;
use wayhome::estimation::paper::*;
use wayhome::world::World;
use wayhome::geometry::Pose;

#[test]
fn explore() {
    let ideal = Ideal::of(&World::open("paper-ideal").unwrap()).unwrap();
    for (name, twists) in [
        ("base", Twists::default()),
        ("euler", Twists { settings: PaperSettings { prediction: Prediction::Euler, ..Default::default() }, ..Default::default() }),
        ("printed G", Twists { settings: PaperSettings { transition: Transition::Printed, ..Default::default() }, ..Default::default() }),
        ("euler printed G", Twists { settings: PaperSettings { transition: Transition::Printed, prediction: Prediction::Euler, ..Default::default() }, ..Default::default() }),
        ("noise .3", Twists { noise: Some((0.005, 1)), ..Default::default() }),
        ("noise 18", Twists { noise: Some((0.316, 1)), ..Default::default() }),
        ("beta 5", Twists { beta: 5.0, ..Default::default() }),
        ("beta 1.01", Twists { beta: 1.01, ..Default::default() }),
    ] {
        for (what, f) in [("true", (|p: &Pose| *p) as fn(&Pose)->Pose), ("R*1.2", |p| Pose::new(1.2*p.x, 1.2*p.y, p.heading)), ("R50,+.5", |p| { let t = p.y.atan2(p.x)+0.5; Pose::new(0.5*t.cos(), 0.5*t.sin(), p.heading)}), ("guess", |_| Pose::new(0.5*0.1f64.cos(), 0.5*0.1f64.sin(), 0.0)),
            ("alpha+10deg", |p| Pose::new(p.x, p.y, p.heading+0.17)), ("R*1.01", |p| Pose::new(1.01*p.x, 1.01*p.y, p.heading))] {
            println!("{name} {what}");
            for run in ideal.runs(&twists, f) {
                println!("   {:?} {} {:?} straight {:.1} rmse {:?}", run.law, run.start, run.track.time_s(), run.track.straight_s, run.track.rmse().map(|r| r.map(|v| format!("{v:.1e}"))));
            }
        }
    }
}

#[test]
fn explore_images() {
    use wayhome::study::paper::images::*;
    for set in [ImageSet::Vardy, ImageSet::Paper] {
        let t = std::time::Instant::now();
        let case = ImageCase::new(set, None).unwrap();
        println!("{set:?} {:?} matches {} objects {}", t.elapsed(), case.field.matches_mean, case.field.objects.len());
        for o in &case.field.objects {
            let fix = case.field.fix(o).unwrap();
            println!("  {:.0} deg found {} range {:.2} rms {:.3} deg worst {:.3}", o.home_rad.to_degrees(), o.seen_rad.iter().flatten().count(), fix.point.norm(), fix.rms_rad.to_degrees(), fix.worst_rad.to_degrees());
        }
        for (name, settings) in [("right", image_settings()), ("printed G", PaperSettings { transition: Transition::Printed, ..image_settings() })] {
            println!("{name}");
            for run in case.runs(settings, |p| *p) {
                println!("   {:?} {} {:?} straight {:.1} rmse {:?}", run.law, run.start, run.track.time_s(), run.track.straight_s, run.track.rmse().map(|r| r.map(|v| format!("{v:.1e}"))));
            }
        }
    }
}
