//! Many pictures in order, with bounded memory, from a renderer that makes several at once.
//!
//! Pictures are rendered in groups. While one group is shown to the caller the next one is rendered, so that at most two groups
//! are in memory, whatever the length of the batch. Their buffers are reused from group to group.

use super::{Renderer, Scene, View};
use crate::error::Result;
use crate::panorama::Panorama;

/// Bytes of a pixel of a [`Panorama`]: colour, range and instance.
const PIXEL_BYTES: usize = 10;
/// Bytes of a group for each thread, where the pictures are so small that more than one fits: enough of them that threads can
/// share in showing them, and so little memory that it stays near the processor.
const GROUP_BYTES: usize = 4 << 20;
/// Most pictures of a group for each thread: more would only let the first result wait longer.
const MOST_PER_THREAD: usize = 16;
/// Most bytes of a group, but for one picture. Threads share pictures where that leaves fewer of them than threads: on a machine of
/// many threads, one each of the largest would need more memory than it has.
const MOST_BYTES: usize = 512 << 20;

/// Pictures of a group for so many threads, when the largest of a batch has `pixels`: the most that are shown at once. Twice as
/// many are in memory.
pub(super) fn group_length(pixels: usize, threads: usize) -> usize {
    let bytes = PIXEL_BYTES * pixels.max(1);
    let each = (GROUP_BYTES / bytes).clamp(1, MOST_PER_THREAD);
    (each * threads).min((MOST_BYTES / bytes).max(1))
}

/// The driver behind [`Renderer::render_batch`].
pub(super) fn run<R: Renderer + ?Sized>(
    renderer: &mut R,
    scene: &Scene,
    views: &[View<'_>],
    sink: &mut (dyn FnMut(usize, &mut [Panorama]) -> Result<()> + Send),
) -> Result<()> {
    let pixels = views.iter().map(|v| v.projection.pixels()).max().unwrap_or(0);
    let length = group_length(pixels, rayon::current_num_threads());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_bounded_in_pictures_and_in_bytes() {
        assert_eq!(group_length(64 * 8, 2), 32);
        assert_eq!(group_length(1440 * 180, 2), 2);
        assert_eq!(group_length(4680 * 480, 16), 16);
        for threads in [1, 16, 256] {
            assert_eq!(group_length(16_384 * 4096, threads), 1);
            let pixels = 8192 * 1024;
            assert!((1..=6).contains(&group_length(pixels, threads)));
        }
    }
}
