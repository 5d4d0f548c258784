//! The one place of this crate without checks: looking up texels whose places are known to be in their level, and asking for
//! texels ahead of time.
//!
//! A third of the time of a picture goes into looking up texels, and half of that would go into checking places that have
//! just been confined to the level.

#![allow(unsafe_code)]

use super::scene::MipLevel;

/// Texels of a level.
#[derive(Debug, Clone, Copy)]
pub(super) struct Texels<'a> {
    texels: &'a [u32],
    pitch: u32,
    /// The last place that has a neighbour along both axes.
    last: u32,
}

impl<'a> Texels<'a> {
    /// The texels of a level in the atlas.
    ///
    /// # Panics
    /// When the atlas does not have them.
    #[inline(always)]
    pub fn new(atlas: &'a [u32], level: MipLevel) -> Self {
        let pitch = level.pitch();
        let texels = &atlas[level.base as usize..][..(pitch * pitch) as usize];
        // Three at least, but a shorter one would make `last` the place before the first.
        assert!(pitch >= 2, "a level has borders");
        Self { texels, pitch, last: pitch * pitch - pitch - 2 }
    }

    /// Where texel (u, v) is, from (-1, -1) on. Any number gives a place that [`Texels::square`] takes.
    #[inline(always)]
    pub fn place(&self, u: u32, v: u32) -> u32 {
        let place = u.wrapping_add(1).wrapping_mul(self.pitch).wrapping_add(v).wrapping_add(1);
        place.min(self.last)
    }

    /// The texel at a place and the one after it along v, and the two that lie next to them along u.
    #[inline(always)]
    pub fn square(&self, place: u32) -> [[u32; 2]; 2] {
        let near = place.min(self.last) as usize;
        let far = near + self.pitch as usize;
        // SAFETY: there are `pitch` squared texels, of which `far` is at most the last but one.
        unsafe {
            let at = |place: usize| self.texels.as_ptr().add(place).cast::<[u32; 2]>().read_unaligned();
            [at(near), at(far)]
        }
    }
}

/// Asks the processor to bring the first of some texels near, which it does while it goes on with other work.
#[inline(always)]
pub(super) fn fetch(texels: &[u32]) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint; no address is wrong, and nothing that the program can see changes.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(texels.as_ptr().cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = texels;
}
