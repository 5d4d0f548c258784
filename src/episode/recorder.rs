//! Watching an episode closely: every control step with all that belongs to it, as it happens.

use super::record::{Record, Step};
use super::summary::Summary;
use crate::error::Result;
use crate::geometry::Pose;
use crate::observation::{Bearing, HomeSnapshot};
use crate::panorama::Panorama;
use crate::physics::Collision;

/// One control step with what the loop saw of it.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// Truth, odometry, command and belief.
    pub step: &'a Step,
    /// Bearings that the method got; none while the robot comes to rest.
    pub bearings: &'a [Bearing],
    /// Panorama of this step, where the sensor has a camera; none while the robot comes to rest.
    pub panorama: Option<&'a Panorama>,
    /// True poses of the bodies, in the order of `World::bodies`.
    pub bodies: &'a [Pose],
    /// Contacts that began since the last step.
    pub collisions: &'a [Collision],
}

/// Keeps what happens in an episode, for example in a file. It is only told: nothing that it does changes the run, but an error
/// ends it.
pub trait Recorder: Send {
    /// The episode begins: what was seen at home, and the panorama from there where the sensor has a camera.
    ///
    /// # Errors
    /// When it cannot be kept.
    fn begin(&mut self, home: &HomeSnapshot, panorama: Option<&Panorama>) -> Result<()> {
        let _ = (home, panorama);
        Ok(())
    }

    /// A control step, in the order of time.
    ///
    /// # Errors
    /// When it cannot be kept.
    fn record(&mut self, moment: &Moment<'_>) -> Result<()> {
        let _ = moment;
        Ok(())
    }

    /// The episode has ended. One that is interrupted or fails ends without it.
    ///
    /// # Errors
    /// When what is left cannot be kept.
    fn finish(&mut self, record: &Record, summary: &Summary) -> Result<()> {
        let _ = (record, summary);
        Ok(())
    }
}

/// Many at once, in their order.
impl<R: Recorder + ?Sized> Recorder for Vec<Box<R>> {
    fn begin(&mut self, home: &HomeSnapshot, panorama: Option<&Panorama>) -> Result<()> {
        self.iter_mut().try_for_each(|recorder| recorder.begin(home, panorama))
    }

    fn record(&mut self, moment: &Moment<'_>) -> Result<()> {
        self.iter_mut().try_for_each(|recorder| recorder.record(moment))
    }

    fn finish(&mut self, record: &Record, summary: &Summary) -> Result<()> {
        self.iter_mut().try_for_each(|recorder| recorder.finish(record, summary))
    }
}
