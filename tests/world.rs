//! World files: the built-in worlds, what validation finds, and where a robot may start.

use wayhome::geometry::Pose;
use wayhome::random::Seed;
use wayhome::world::World;

#[test]
fn random_starts_keep_their_promises() {
    for name in World::builtin_names() {
        let world = World::open(name).expect(name);
        let start = &world.spec.start;
        let mut quadrants = [false; 4];
        for seed in 0..200 {
            let pose = world.random_start(&mut Seed(seed).stream("start")).expect(name);
            let offset = world.home.inverse_transform(pose.position());
            assert!(offset.norm() >= start.min_distance_m && offset.norm() <= start.max_distance_m);
            world.is_free(&pose, start.clearance_m, &world.body_poses()).expect("clearance");
            // The straight way home, walked in small steps, for an independent look at the corridor.
            let standing: Vec<Pose> =
                world.bodies.iter().map(|b| if b.motion.is_some() { Pose::new(-1e3, 0.0, 0.0) } else { b.pose }).collect();
            for k in 0..=100 {
                let at = pose.position() + (world.home.position() - pose.position()) * (f64::from(k) / 100.0);
                world.is_free(&Pose::new(at.x, at.y, 0.0), -1e-9, &standing).expect("corridor");
            }
            quadrants[usize::from(offset.x > 0.0) + 2 * usize::from(offset.y > 0.0)] = true;
            assert_eq!(pose, world.random_start(&mut Seed(seed).stream("start")).expect(name), "same seed, same start");
        }
        assert_eq!(quadrants, [true; 4], "{name}: starts lie all round home");
    }
}
