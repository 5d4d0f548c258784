//! The one place of this crate without checks: looking up texels whose places are known to be there, and asking for texels
//! ahead of time.
//!
//! A third of the time of a picture goes into looking up texels, and half of that would go into checking places that have
//! just been confined.

#![allow(unsafe_code)]

use super::scene::MipLevel;

/// Texels looked up at once: the 32-bit lanes of the widest vector.
pub(super) const LANES: usize = 16;
/// Texels or colours of as many pixels, red in the lowest byte. Or where texels are.
pub(super) type Block = [u32; LANES];
/// Texels that lie next to one another along v.
pub(super) type Pair = [u32; 2];

/// How a block of texels is looked up; what is found is the same.
pub(super) trait LookUp: Copy {
    /// The texels at some places and those that follow. They are written to their place at once: a copy of what was written one by
    /// one would wait for it.
    ///
    /// # Safety
    /// There must be such texels from `texels` on.
    unsafe fn pairs(self, texels: *const u32, places: &Block, out: &mut [Pair; LANES]);
}

/// One pair after the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct OneByOne;

impl LookUp for OneByOne {
    #[inline(always)]
    unsafe fn pairs(self, texels: *const u32, places: &Block, out: &mut [Pair; LANES]) {
        for (pair, place) in out.iter_mut().zip(places) {
            // SAFETY: the caller knows that both texels are there.
            *pair = unsafe { texels.add(*place as usize).cast::<Pair>().read_unaligned() };
        }
    }
}

/// Eight pairs with one instruction, on a processor that has it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gathered(());

impl Gathered {
    /// `None` where the processor cannot.
    pub fn new() -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        return is_x86_feature_detected!("avx512f").then_some(Self(()));
        #[cfg(not(target_arch = "x86_64"))]
        None
    }
}

impl LookUp for Gathered {
    #[inline(always)]
    unsafe fn pairs(self, texels: *const u32, places: &Block, out: &mut [Pair; LANES]) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: there is no `Gathered` where the processor cannot; the caller knows that the texels are there.
        unsafe {
            gather(texels, places, out);
        }
        #[cfg(not(target_arch = "x86_64"))]
        // SAFETY: the caller's.
        unsafe {
            OneByOne.pairs(texels, places, out);
        }
    }
}

/// # Safety
/// As for [`LookUp::pairs`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
unsafe fn gather(texels: *const u32, places: &Block, out: &mut [Pair; LANES]) {
    use std::arch::x86_64::{_mm256_loadu_si256, _mm512_i32gather_epi64, _mm512_storeu_si512};

    let (from, to) = (places.as_ptr(), out.as_mut_ptr());
    // SAFETY: each half reads 8 of 16 places and writes 8 of 16 pairs; the caller knows that the texels are there.
    unsafe {
        let first = _mm512_i32gather_epi64::<4>(_mm256_loadu_si256(from.cast()), texels.cast());
        let second = _mm512_i32gather_epi64::<4>(_mm256_loadu_si256(from.add(LANES / 2).cast()), texels.cast());
        _mm512_storeu_si512(to.cast(), first);
        _mm512_storeu_si512(to.add(LANES / 2).cast(), second);
    }
}

/// The texels at some places, of which those bits count that are below `N`, a power of two, and those that follow.
#[inline(always)]
pub(super) fn pairs<const N: usize, const M: usize>(
    look_up: impl LookUp,
    texels: &[u32; M],
    places: &Block,
    out: &mut [Pair; LANES],
) {
    const { assert!(N.is_power_of_two() && N < M) };
    let places = places.map(|place| place & (N as u32 - 1));
    // SAFETY: a place is at most N - 1, and the next less than M.
    unsafe { look_up.pairs(texels.as_ptr(), &places, out) }
}

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

    /// The texels at some places and those that follow them along v, and the same next to them along u.
    #[inline(always)]
    pub fn squares(&self, look_up: impl LookUp, places: &Block, [near, far]: &mut [[Pair; LANES]; 2]) {
        let mut confined = [0; LANES];
        for k in 0..LANES {
            confined[k] = places[k].min(self.last);
        }
        let texels = self.texels.as_ptr();
        // SAFETY: there are `pitch` squared texels, of which any confined place and the one `pitch` after it are at most the last
        // but one.
        unsafe {
            look_up.pairs(texels, &confined, near);
            look_up.pairs(texels.add(self.pitch as usize), &confined, far);
        }
    }

    /// The same at a single place.
    #[inline(always)]
    pub fn square(&self, place: u32) -> [Pair; 2] {
        let near = place.min(self.last) as usize;
        // SAFETY: as above.
        let at = |place: usize| unsafe { self.texels.as_ptr().add(place).cast::<Pair>().read_unaligned() };
        [at(near), at(near + self.pitch as usize)]
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
