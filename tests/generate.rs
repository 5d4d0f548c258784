//! Generated worlds: sound, the same to the byte, driven through, and as the knobs say.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says so by panicking")]

use wayhome::geometry::Vector2;
use wayhome::random::Seed;
use wayhome::world::generate::{Drawn, Generated, Kind, Knob, Knobs, Outline, generate};
use wayhome::world::spec::MotionSpec;
use wayhome::world::{Draft, World};

fn made(kind: Kind, seed: u64, settings: &[&str]) -> Generated {
    let mut knobs = Knobs::default();
    settings.iter().for_each(|s| knobs.set(s).unwrap());
    generate(kind, seed, &knobs).unwrap()
}

fn loaded(generated: &Generated) -> World {
    World::from_toml(&generated.toml, format!("{}.toml", generated.spec.name)).unwrap()
}

#[test]
fn all_kinds_are_sound_worlds_with_far_starts() {
    for kind in Kind::rooms() {
        let farthest_m = if kind == Kind::Hall { 6.8 } else { 2.5 };
        for seed in 0..100 {
            let generated = made(kind, seed, &[]);
            let world = loaded(&generated);
            assert_eq!(world.spec, generated.spec, "the text is the world");
            let far = world.named_start("far").unwrap();
            let distance_m = (far.position() - world.home.position()).norm();
            assert!(
                distance_m >= farthest_m && distance_m <= world.spec.start.max_distance_m + 1e-9,
                "{kind} {seed}: {distance_m}"
            );
            world.random_start(&mut Seed(seed).stream("start")).unwrap();
        }
    }
}

/// The places of a grid of 10 cm that a robot reaches from home by straight moves, each checked as a whole.
fn flooded(world: &World) -> Vec<Vector2<f64>> {
    const STEP_M: f64 = 0.1;
    let at = |(column, row): (i32, i32)| world.home.position() + Vector2::new(f64::from(column), f64::from(row)) * STEP_M;
    let mut reached = std::collections::BTreeSet::from([(0, 0)]);
    let mut queue = vec![(0, 0)];
    while let Some((column, row)) = queue.pop() {
        for next in [(column - 1, row), (column + 1, row), (column, row - 1), (column, row + 1)] {
            if !reached.contains(&next) && world.is_corridor_free(at((column, row)), at(next)).is_ok() {
                reached.insert(next);
                queue.push(next);
            }
        }
    }
    reached.into_iter().map(at).collect()
}

/// Whether the robot drives through all doors of inner walls, from home and out again on the other side.
fn doors_are_passed(world: &World) -> Result<(), String> {
    if world.spec.walls.iter().all(|wall| wall.openings.is_empty()) {
        return Ok(());
    }
    let places = flooded(world);
    for wall in &world.spec.walls {
        let [from, to] = [wall.from_m, wall.to_m].map(|[x, y]| Vector2::new(x, y));
        let along = (to - from) / (to - from).norm();
        let left = Vector2::new(-along.y, along.x);
        for door in &wall.openings {
            let middle = from + along * (door.from_start_m + 0.5 * door.width_m);
            for side in [-1.0, 1.0] {
                let beyond = |p: &&Vector2<f64>| (0.05..0.6).contains(&(*p - middle).dot(&(left * side)));
                let mut near = places.iter().filter(beyond).filter(|p| (*p - middle).norm() < 0.6);
                if !near.any(|p| world.is_corridor_free(*p, middle).is_ok()) {
                    return Err(format!("no way to the door of {} on side {side}", wall.name));
                }
            }
        }
    }
    Ok(())
}

/// What a world holds by the checks of a file, not by those of the generator.
fn check_ways(kind: Kind, seed: u64, settings: &[&str]) {
    let world = loaded(&made(kind, seed, settings));
    assert_eq!(world.unreachable_starts(), [], "{kind} {seed} {settings:?}");
    let mut stream = Seed(seed).stream("start");
    for _ in 0..3 {
        let start = world.random_start(&mut stream).unwrap();
        assert!(world.is_corridor_free(start.position(), world.home.position()).is_ok());
    }
    assert_eq!(doors_are_passed(&world), Ok(()), "{kind} {seed} {settings:?}");
}

#[test]
fn home_is_reached_from_all_starts_and_through_all_doors() {
    for &kind in Kind::ALL {
        for seed in 500..if kind == Kind::Flat { 540 } else { 512 } {
            check_ways(kind, seed, &[]);
        }
    }
}

/// At both ends of what each knob allows: where no drawing serves, the kind says so, and what is made is sound.
#[test]
fn extreme_knobs_make_sound_worlds_or_none() {
    for kind in Kind::rooms() {
        let mut refused = Vec::new();
        let mut sets: Vec<Vec<String>> = Vec::new();
        for knob in Knob::ALL {
            let ends = knob.ranges(kind).map(|r| r.allowed);
            sets.extend(ends.into_iter().flatten().map(|end| vec![format!("{}={end}", knob.name())]));
        }
        sets.push(["clutter=1", "walkers=20", "zones=12", "camera_height_m=1.8"].map(str::to_owned).into());
        for set in &sets {
            let settings: Vec<&str> = set.iter().map(String::as_str).collect();
            let mut knobs = Knobs::default();
            settings.iter().for_each(|s| knobs.set(s).unwrap());
            match generate(kind, 77, &knobs) {
                // A hall of 80 m is like one of 20 and takes long to look through.
                Ok(_) if settings[0].starts_with("length_m") || settings[0].starts_with("width_m") => {
                    loaded(&made(kind, 77, &settings));
                }
                Ok(_) => check_ways(kind, 77, &settings),
                Err(fault) => {
                    assert!(fault.to_string().contains("no place for home that the robot reaches"), "{fault}");
                    refused.push(settings.join(" "));
                }
            }
        }
        assert!(10 * refused.len() <= sets.len(), "{kind}: none with {refused:?}");
    }
}

#[test]
fn all_rooms_of_a_flat_are_entered() {
    for seed in 0..4 {
        let world = loaded(&made(Kind::Flat, seed, &["rooms=4", "outline=rectangle", "clutter=0", "walkers=0"]));
        assert_eq!(world.partitions.len(), 3, "four rooms have three walls between them");
        let places = flooded(&world);
        for wall in &world.partitions {
            for side in [-1.0, 1.0] {
                let left = Vector2::new(-wall.along.y, wall.along.x);
                let beside = wall.from + wall.along * (0.5 * wall.length_m) + left * (side * 0.6);
                assert!(places.iter().any(|p| (p - beside).norm() < 0.45), "seed {seed}: {} on side {side}", wall.name);
            }
        }
    }
}

#[test]
fn one_seed_is_one_world() {
    for &kind in Kind::ALL {
        for seed in [0, 7, u64::MAX] {
            let [a, b] = [(); 2].map(|()| made(kind, seed, &["clutter=0.3..0.6"]));
            assert_eq!(a.toml, b.toml);
            assert_ne!(a.toml, made(kind, seed ^ 1, &["clutter=0.3..0.6"]).toml);
            if kind == Kind::Mixture {
                assert_eq!(a.toml, made(a.kind, seed, &["clutter=0.3..0.6"]).toml, "a mixture's room is that of its kind");
            }
        }
    }
    // Whatever opens a world opens these, and what it hashes is the file.
    let opened = World::open("office:17").unwrap();
    let office = made(Kind::Office, 17, &[]);
    assert_eq!((&opened.spec, &opened.sha256), (&office.spec, &loaded(&office).sha256));
    assert_eq!(Draft::open("office:17").unwrap().world().unwrap(), opened);
    let kinds: std::collections::BTreeSet<_> = (0..60).map(|seed| made(Kind::Mixture, seed, &[]).kind).collect();
    assert_eq!(kinds.len(), Kind::rooms().count());
}

#[test]
fn knobs_hold_and_leave_the_others_alone() {
    let size = |world: &World| {
        let (low, high) = wayhome::world::polygon::bounds(&world.outline);
        high - low
    };
    for kind in Kind::rooms().filter(|k| *k != Kind::Corridor) {
        let settings = ["length_m=13.5", "width_m=9..9.5", "camera_height_m=1.1", "friction=0.4", "walkers=2", "zones=3"];
        let generated = made(kind, 3, &settings);
        let world = loaded(&generated);
        assert!((size(&world).x - 13.5).abs() < 2e-3 && size(&world).y > 8.99 && size(&world).y < 9.51, "{kind}");
        assert_eq!((world.spec.camera.height_m, world.spec.floor.friction), (1.1, 0.4));
        assert!(world.spec.floor.zones.iter().all(|z| z.friction == generated.drawn.get(Knob::ZoneFriction)));
        let walk = |b: &&wayhome::world::Body| matches!(b.motion, Some(MotionSpec::Path { .. }));
        assert_eq!(world.bodies.iter().filter(walk).count(), 2, "{kind}");
        assert_eq!(world.spec.floor.zones.len(), 3);
        let others = |drawn: &Drawn| [Knob::Clutter, Knob::Richness, Knob::Light].map(|k| drawn.get(k));
        assert_eq!(others(&generated.drawn), others(&made(kind, 3, &[]).drawn));
    }
    let long = loaded(&made(Kind::Corridor, 1, &["length_m=60", "outline=rectangle", "door_spacing_m=4"]));
    assert!((size(&long).x - 60.0).abs() < 0.5 && size(&long).y < 3.0);
    assert!(long.outline.len() > 4 + 4 * 14, "a recess for each of at least 14 doors");
    assert!((5..=8).contains(&made(Kind::Lab, 1, &["outline=polygon"]).spec.room.outline_m.len()));
    assert_eq!(made(Kind::Lab, 1, &["outline=l"]).drawn.outline, Outline::L);
    let bodies = |clutter: &str| loaded(&made(Kind::Lab, 5, &[clutter])).bodies.len();
    assert!(bodies("clutter=0") < bodies("clutter=0.4") && bodies("clutter=0.4") < bodies("clutter=1"));
    // With all of it alike, a wall's pattern has the period and seed of each other patterned one.
    let alike = made(Kind::Lab, 2, &["repetition=1", "richness=1"]);
    let walls: std::collections::BTreeSet<_> = alike.spec.room.walls.iter().map(|w| w.seed).collect();
    assert_eq!(walls.len(), 1);
    assert!(walls.first().unwrap().is_some());
}

/// One seed is one world, to the byte, on every machine: the digests were made on one and hold on all.
#[test]
fn bytes_of_worlds_are_those_of_their_seed() {
    let digest = |kind: Kind| wayhome::storage::sha256(made(kind, 11, &[]).toml.as_bytes())[..16].to_owned();
    let found: Vec<(String, String)> = Kind::rooms().map(|kind| (kind.to_string(), digest(kind))).collect();
    let wanted: [(&str, &str); 7] = [
        ("lab", "b92604c19fa6ae7f"),
        ("office", "d1a9dddd857a3840"),
        ("flat", "92c3364d5dbd4114"),
        ("corridor", "4543f8cdb286251c"),
        ("hall", "5139603c4c9500d3"),
        ("warehouse", "b71f1f6302688cf2"),
        ("bare", "e74bc9108d1835fc"),
    ];
    assert_eq!(
        found,
        wanted.map(|(kind, digest)| (kind.to_owned(), digest.to_owned())),
        "a change of the generator changes all sets"
    );
}

#[test]
fn what_cannot_be_is_told() {
    let fault = |kind: Kind, settings: &[&str]| {
        let mut knobs = Knobs::default();
        settings.iter().try_for_each(|s| knobs.set(s)).and_then(|()| generate(kind, 1, &knobs)).unwrap_err().to_string()
    };
    for (kind, settings, wanted) in [
        (Kind::Flat, &["length_m=1", "width_m=1"][..], "length_m of kind flat: found 1, allowed is 5 to 40 m"),
        (Kind::Lab, &["length_m=8..6"], "length_m: found 8..6, allowed is a range that rises: 6..8"),
        (Kind::Lab, &["cluter=0.5"], "did you mean clutter?"),
        (Kind::Lab, &["clutter=many"], "a number, or two of them"),
        (Kind::Lab, &["clutter=nan"], "a number, or two of them"),
        (Kind::Lab, &["clutter"], "KNOB=VALUE"),
        (Kind::Lab, &["walkers=0.2..0.8"], "a whole number in it"),
        (Kind::Hall, &["aisle_m=2"], "knob of kind hall: found aisle_m"),
        (Kind::Corridor, &["outline=polygon"], "outline of kind corridor: found polygon, allowed is rectangle, l, t"),
        (Kind::Lab, &["outline=round"], "one or several of rectangle"),
        (Kind::Mixture, &["length_m=4"], "of kind"),
    ] {
        let message = fault(kind, settings);
        assert!(message.contains(wanted), "{kind} {settings:?}: {message}");
    }
}
