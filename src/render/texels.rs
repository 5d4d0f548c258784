//! The one place of this crate without checks: looking up texels whose places are known to be in their tile, and asking for
//! texels ahead of time.
//!
//! A third of the time of a picture goes into looking up texels, and half of that would go into checking places that a mask has
//! just confined to the tile.

#![allow(unsafe_code)]

/// Texels of a tile, a power of two of them, and at least one more after them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Texels<'a> {
    texels: &'a [u32],
    mask: u32,
}

impl<'a> Texels<'a> {
    /// 2^`log2_count` texels of an atlas from `base` on.
    ///
    /// # Panics
    /// When the atlas does not have them and one more.
    #[inline(always)]
    pub fn new(atlas: &'a [u32], base: usize, log2_count: u32) -> Self {
        let count = 1_usize << log2_count;
        Self { texels: &atlas[base..=base + count], mask: count as u32 - 1 }
    }

    /// The texel at `place` and the one that is stored after it. Places beyond the tile wrap around.
    #[inline(always)]
    pub fn pair(&self, place: u32) -> [u32; 2] {
        let place = (place & self.mask) as usize;
        // SAFETY: `mask` is the length of the slice less 2, so that `place` and the place after it are in the slice.
        unsafe { self.texels.as_ptr().add(place).cast::<[u32; 2]>().read() }
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
