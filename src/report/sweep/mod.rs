//! The folder of a stress study, and the page that shows what came of it.

mod store;

pub use store::{Rate, StudyFolder};
