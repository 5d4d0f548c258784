//! Data sets: many panoramas of a world with all that is true of them, in a layout that the field's tools read.
//!
//! A [`Plan`](plan::Plan) lays a set out before anything is rendered: places and headings ([`plan`]), conditions ([`conditions`])
//! and the parts that the work is cut into. A [`Job`](pipeline::Job) makes what is missing of it ([`pipeline`]) with the truth
//! of each frame ([`truth`]); the records that it leaves ([`parts`]) are what a later run goes on from and what a
//! [`check`](check::check) holds the files against. How a layout names and codes its files is the business of
//! [`panorama_set`](crate::panorama_set).
//!
//! The bytes of a set follow from its command alone: not from the number of threads, nor from how often the work was
//! interrupted, nor from how it was split over machines.
//!
//! A [`Series`](series::Series) is a set over many worlds, each of which is made when its frames are and then dropped.
//!
//! Knows of: worlds, the renderer and the layouts of sets. Must not know of episodes.

pub mod check;
pub mod conditions;
pub mod film;
pub mod parts;
pub mod pipeline;
pub mod plan;
pub mod series;
pub mod truth;
