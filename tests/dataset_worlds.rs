//! Data sets over many worlds: one set, the same bytes however it is made, each row with its world.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says so by panicking")]

#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use support::{assert_exit, assert_same_files, run};
use wayhome::Error;
use wayhome::dataset::check::check;
use wayhome::dataset::plan::{Headings, Places, Request};
use wayhome::dataset::series::{Series, SeriesJob};
use wayhome::panorama::Panorama;
use wayhome::panorama_set::{LayoutKind, PanoramaSet};
use wayhome::render::{CpuRenderer, Renderer, Scene, View};
use wayhome::report::dataset::card;
use wayhome::table::{Cells, Table};
use wayhome::world::World;

/// A set over five worlds in each layout that holds such: the same bytes in one go, in shards and after a full stop; each frame is what
/// its world looks like from there, and says which world that is.
#[test]
fn many_worlds_are_one_set() {
    let base = tempfile::tempdir().unwrap();
    let rooms = base.path().join("rooms");
    std::fs::create_dir(&rooms).unwrap();
    for name in ["b", "a"] {
        std::fs::write(rooms.join(format!("{name}.toml")), World::open("bare:8").unwrap().spec.to_toml()).unwrap();
    }
    let given = format!("bare:3..4,office:1,{}", rooms.display());
    for layout in [LayoutKind::Folder, LayoutKind::ImageFolder, LayoutKind::Webdataset] {
        let request = Request {
            places: Places::Random(39),
            headings: Headings::Random(2),
            conditions: ["original", "night+moved"].iter().map(|c| c.parse().unwrap()).collect(),
            size_px: Some((180, 24)),
            layout,
            seed: 3,
            licence: "Apache-2.0".into(),
            command: "test".into(),
        };
        let series = Series::new(&given, request).unwrap();
        let (whole, joined) = (base.path().join(format!("{layout:?}")), base.path().join(format!("{layout:?}-joined")));
        let make = |out: &Path, shard, calls: usize| {
            let mut left = calls;
            SeriesJob { series: &series, out, shard, extras: &card }.run(&mut CpuRenderer::new(), &mut |_| {
                left = left.saturating_sub(1);
                if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        };
        let made = make(&whole, (1, 1), usize::MAX).unwrap();
        assert_eq!((made.rendered, made.complete, series.worlds(), series.frames()), (156, true, 5, 156));
        let found = check(&whole, &|_, _| ControlFlow::Continue(())).unwrap();
        assert!(found.faults.is_empty(), "{layout:?}: {:?}", found.faults);
        assert!(!make(&joined, (2, 3), usize::MAX).unwrap().complete);
        assert!(matches!(make(&joined, (3, 3), 3), Err(Error::Interrupted)));
        assert!(make(&joined, (1, 1), usize::MAX).unwrap().complete);
        assert_same_files(&whole, &joined);

        let set = PanoramaSet::open(&whole).unwrap();
        assert_eq!(set.entries().len(), 156);
        let mut counts = BTreeMap::<(String, String), usize>::new();
        for (k, entry) in set.entries().iter().enumerate() {
            let named = entry.world.clone().unwrap();
            *counts.entry((named.kind.clone(), named.world.clone())).or_default() += 1;
            if entry.condition == "original" && k % 7 == 0 {
                let world = World::open(&named.world).unwrap();
                let (pose, mut wanted) = (entry.pose.unwrap(), Panorama::empty());
                let view = View { projection: set.load(k).unwrap().projection, robot: pose, bodies: &world.body_poses() };
                CpuRenderer::new().render(&Scene::new(&world).unwrap(), &view, &mut wanted).unwrap();
                let seen = set.load(k).unwrap();
                assert!(seen.rgba.chunks_exact(4).zip(wanted.rgba.chunks_exact(4)).all(|(a, b)| a[..3] == b[..3]), "{named:?}");
                assert_eq!(seen.instance, wanted.instance);
            }
        }
        let folder = rooms.display().to_string();
        let file = |name: &str| (folder.clone(), rooms.join(name).display().to_string());
        let generated = |kind: &str, seed: u32| (kind.to_owned(), format!("{kind}:{seed}"));
        let wanted = [
            (file("a.toml"), 32),
            (file("b.toml"), 32),
            (generated("bare", 3), 28),
            (generated("bare", 4), 32),
            (generated("office", 1), 32),
        ];
        assert_eq!(counts, BTreeMap::from(wanted));
        let table = Table::from_parquet(std::fs::read(whole.join("truth/frames-000004.parquet")).unwrap()).unwrap();
        let (Some(Cells::Text(worlds)), Some(Cells::Text(kinds))) = (table.column("world"), table.column("kind")) else {
            panic!()
        };
        assert!(
            worlds.iter().all(|w| w.as_deref() == Some("office:1")) && kinds.iter().all(|k| k.as_deref() == Some("office"))
        );
        let about: serde_json::Value =
            serde_json::from_slice(&std::fs::read(whole.join("worlds/000002.json")).unwrap()).unwrap();
        assert_eq!(
            (about["world"].as_str(), about["spots"].as_u64(), about["first_spot"].as_u64()),
            (Some("office:1"), Some(16), Some(30))
        );
    }
    // Another room under the same name is another set.
    std::fs::write(rooms.join("a.toml"), World::open("bare:9").unwrap().spec.to_toml()).unwrap();
    let out = base.path().join("Folder").display().to_string();
    let arguments = ["dataset", "--worlds", &given, "--count", "39", "--out", &out];
    assert_exit(&run(base.path(), &arguments), 1, &["another set"]);
    for (arguments, code, words) in [
        (&["dataset", "--worlds", "bare:1..9", "--count", "8"][..], 2, ["found 8 for 9 worlds", "at least one a world"]),
        (&["dataset", "--worlds", "castle:1..9", "--count", "9"], 2, ["castle", "lab, office, flat"]),
        (&["dataset", "--worlds", "bare:1..9"], 2, ["--count", "required"]),
        (&["dataset", "lab", "--count", "9"], 2, ["--worlds", "required"]),
        (&["dataset", "lab", "--worlds", "bare:1", "--count", "9"], 2, ["cannot be used with", "--worlds"]),
        (
            &["dataset", "--worlds", "bare:1", "--count", "9", "--layout", "vardy"],
            2,
            ["vardy for several worlds", "image-folder"],
        ),
    ] {
        assert_exit(&run(base.path(), arguments), code, &words);
    }
}
