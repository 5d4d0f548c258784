//! All that the page is made of, each part made when it is first asked for.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use super::claims::{Claims, ImageClaims, claims, image_claims};
use super::contest::{Contest, Source, contest};
use super::course::{Course, Run, Variant};
use super::ideal::Ideal;
use super::images::{ImageCase, ImageSet};
use crate::error::Result;
use crate::study::observability::{Facing, ObservabilityMap, map};
use crate::world::World;

/// Distance between places of the observability maps, m.
const MAP_SPACING_M: f64 = 0.05;

/// What the paper's ideal setting and its two sets of images show.
pub struct Evidence {
    /// The world of the ideal setting.
    pub world: World,
    /// The ideal setting.
    pub ideal: Ideal,
    dataset: Option<PathBuf>,
    table_one: OnceCell<Vec<Run>>,
    claims: OnceCell<Claims>,
    homeward: OnceCell<ObservabilityMap>,
    sets: [OnceCell<SetEvidence>; 2],
}

impl Evidence {
    /// Of the built-in worlds; `dataset` is the folder of a set on disk that takes the place of a rendered one.
    ///
    /// # Errors
    /// When the world cannot be opened.
    pub fn new(dataset: Option<&Path>) -> Result<Self> {
        let world = World::open("paper-ideal")?;
        Ok(Self {
            ideal: Ideal::of(&world)?,
            world,
            dataset: dataset.map(Path::to_owned),
            table_one: OnceCell::new(),
            claims: OnceCell::new(),
            homeward: OnceCell::new(),
            sets: [const { OnceCell::new() }; 2],
        })
    }

    /// Table I's runs.
    pub(crate) fn table_one(&self) -> Result<&Vec<Run>> {
        made(&self.table_one, || self.ideal.runs(&Variant::default()))
    }

    /// Experiments on the ideal setting.
    pub(crate) fn claims(&self) -> Result<&Claims> {
        made(&self.claims, || claims(&self.ideal))
    }

    /// Observability in the ideal setting, driving towards home.
    pub(crate) fn homeward(&self) -> Result<&ObservabilityMap> {
        made(&self.homeward, || map(&self.world, Facing::Homeward, MAP_SPACING_M))
    }

    /// The same, facing along x everywhere.
    pub(crate) fn east(&self) -> Result<ObservabilityMap> {
        map(&self.world, Facing::Heading(0.0), MAP_SPACING_M)
    }

    /// A set of images.
    pub(crate) fn set(&self, set: ImageSet) -> Result<&SetEvidence> {
        made(&self.sets[set as usize], || {
            let case = ImageCase::new(set, self.dataset.as_deref())?;
            Ok(SetEvidence { case, runs: OnceCell::new(), claims: OnceCell::new(), contests: OnceCell::new() })
        })
    }
}

/// What a set of images shows.
pub struct SetEvidence {
    /// The set.
    pub case: ImageCase,
    runs: OnceCell<Vec<Run>>,
    claims: OnceCell<ImageClaims>,
    contests: OnceCell<[Contest; 2]>,
}

impl SetEvidence {
    /// The runs of its table.
    pub(crate) fn runs(&self) -> Result<&Vec<Run>> {
        made(&self.runs, || self.case.runs(&Variant::of_images()))
    }

    /// Experiments on it.
    pub(crate) fn claims(&self) -> Result<&ImageClaims> {
        made(&self.claims, || image_claims(&self.case))
    }

    /// Fig. 8 on it: with bearings from images, and from points.
    pub(crate) fn contests(&self) -> Result<&[Contest; 2]> {
        made(&self.contests, || Ok([contest(&self.case, Source::Images)?, contest(&self.case, Source::Points)?]))
    }
}

/// The value of a cell, made if it is not there yet.
fn made<T>(cell: &OnceCell<T>, make: impl FnOnce() -> Result<T>) -> Result<&T> {
    if let Some(value) = cell.get() {
        return Ok(value);
    }
    let value = make()?;
    Ok(cell.get_or_init(|| value))
}
