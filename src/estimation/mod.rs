//! Estimators: where is the robot relative to home, from bearings and odometry alone.
//!
//! - [`anchored`]: the filter of the main job; nothing needs to be known at the start.
//! - [`homes`]: several of them at once, where a view may show more than one place.
//! - [`paper`]: the paper's six-state EKF, exactly as printed but for the transition Jacobian; it must be started near the truth.
//! - [`observability`]: what of the paper's state its bearings can tell at all.
//! - [`two_view`]: the way from one view to another, from their landmarks alone.
//! - [`resection`] and [`gaussian`] serve the anchored filter.
//!
//! Knows of: bearings and odometry. Must not know of pictures, worlds or the truth.

pub mod anchored;
mod dense;
pub mod gaussian;
pub mod homes;
pub mod observability;
pub mod paper;
pub mod resection;
pub mod two_view;
