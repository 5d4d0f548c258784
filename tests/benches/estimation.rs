//! Time of the filter: `cargo bench --bench estimation`.
//!
//! - `filter step, 50 landmarks`: the whole step of the anchored filter on its way home, prediction, gating and update.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use wayhome::estimation::anchored::{AnchoredFilter, FilterSettings};
use wayhome::geometry::{Pose, Twist, Vector2, angle_of, direction};
use wayhome::observation::{Bearing, HomeSnapshot, LandmarkId, Odometry};
use wayhome::random::{Seed, standard_normal};

const LANDMARKS: usize = 50;
const SD_RAD: f64 = 0.005;

fn benches(c: &mut Criterion) {
    let mut noise = Seed(1).stream("noise");
    let places: Vec<Vector2<f64>> = (0..LANDMARKS).map(|k| direction(k as f64 * 0.7) * (2.0 + libm::cos(k as f64))).collect();
    let mut see = |pose: &Pose| -> Vec<Bearing> {
        let bearing = |(k, l): (usize, &Vector2<f64>)| Bearing {
            id: LandmarkId(k as u32),
            azimuth_rad: angle_of(pose.inverse_transform(*l)) + SD_RAD * standard_normal(&mut noise),
            sd_rad: SD_RAD,
        };
        places.iter().enumerate().map(bearing).collect()
    };
    // Sees home, finds it from 2 m away, and is then timed on the way, between two runs of the smoother.
    let settings = FilterSettings { history_steps: 40, ..FilterSettings::default() };
    let mut filter = AnchoredFilter::new(settings, &HomeSnapshot { bearings: see(&Pose::IDENTITY) });
    let mut truth = Pose::new(1.6, 1.2, 2.2);
    let twist = Twist { v: 0.2, omega: 0.1 };
    let mut odometry = Odometry::default();
    for _ in 0..60 {
        filter.step(&odometry, &see(&truth));
        truth = truth.advanced(twist, 0.1);
        odometry = Odometry { twist, dt_s: 0.1 };
    }
    let bearings = see(&truth);
    let mut trial = filter.clone();
    assert!(trial.step(&odometry, &bearings).matched >= 45, "the filter has found home and uses its landmarks");
    c.bench_function("filter step, 50 landmarks", |b| {
        b.iter_batched_ref(|| filter.clone(), |filter| filter.step(&odometry, &bearings), BatchSize::SmallInput);
    });
}

criterion_group!(all, benches);
criterion_main!(all);
