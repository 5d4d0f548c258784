//! Many pictures in order, with bounded memory.
//!
//! Pictures are rendered in groups. While one group is shown to the caller the next one is rendered, so that at most two groups
//! are in memory, whatever the length of the batch. Their buffers are reused from group to group.

use super::{Renderer, Scene, View};
use crate::error::Result;
use crate::panorama::Panorama;

/// Bytes of a pixel of a [`Panorama`]: colour, range and instance.
const PIXEL_BYTES: usize = 10;
/// Bytes of a group for each thread, where the pictures are so small that more than one fits: enough of them that no thread waits
/// long at the end of a group, and no more than stay near the processor: with four times as many, 1440 x 180 took a third longer.
const GROUP_BYTES: usize = 4 << 20;
/// Most pictures of a group for each thread: more would only let the first result wait longer.
const MOST_PER_THREAD: usize = 16;

/// Pictures of a group, when the largest of a batch has `pixels`: as many for each thread.
fn group_length(pixels: usize) -> usize {
    let threads = rayon::current_num_threads();
    (GROUP_BYTES / (PIXEL_BYTES * pixels.max(1))).clamp(1, MOST_PER_THREAD) * threads
}

/// The driver behind [`Renderer::render_batch`].
pub(super) fn run<R: Renderer + ?Sized>(
    renderer: &mut R,
    scene: &Scene,
    views: &[View<'_>],
    sink: &mut (dyn FnMut(usize, &mut [Panorama]) -> Result<()> + Send),
) -> Result<()> {
    let pixels = views.iter().map(|v| v.projection.pixels()).max().unwrap_or(0);
    let length = group_length(pixels);
    let mut groups = views.chunks(length);
    let Some(first) = groups.next() else { return Ok(()) };
    let empty = |count| vec![Panorama::empty(); count];
    let (mut shown, mut rendered) = (empty(first.len()), empty(views.len().saturating_sub(first.len()).min(length)));
    renderer.render_group(scene, first, &mut shown)?;
    let (mut start, mut count) = (0, first.len());
    for group in groups {
        let next = &mut rendered[..group.len()];
        let (told, made) = rayon::join(|| sink(start, &mut shown[..count]), || renderer.render_group(scene, group, next));
        told?;
        made?;
        std::mem::swap(&mut shown, &mut rendered);
        (start, count) = (start + count, group.len());
    }
    sink(start, &mut shown[..count])
}
