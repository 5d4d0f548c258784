//! Generated worlds a second: `cargo bench --bench generate`, on one core.
//!
//! - `make`: drawing a world, checking what the robot reaches, writing it as TOML.
//! - `make and load`: the same, then reading the TOML and all checks of a world file.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use wayhome::world::World;
use wayhome::world::generate::{Kind, Knobs, generate};

fn benches(c: &mut Criterion) {
    let knobs = Knobs::default();
    for &kind in Kind::ALL {
        let mut group = c.benchmark_group(kind.name());
        group.throughput(Throughput::Elements(1));
        // Seed after seed, because rooms of one kind differ.
        let mut seed = 0;
        let mut next = || {
            seed = (seed + 1) % 1000;
            generate(kind, seed, &knobs).unwrap()
        };
        group.bench_function("make", |b| b.iter(&mut next));
        group.bench_function("make and load", |b| b.iter(|| World::from_toml(&next().toml, "bench.toml").unwrap()));
        group.finish();
    }
}

criterion_group!(generation, benches);
criterion_main!(generation);
