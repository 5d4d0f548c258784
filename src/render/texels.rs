//! The one place of this crate without checks: looking up texels whose places are known to be there, and making whole numbers of
//! such that are known to fit.
//!
//! Each pixel of a floor looks up four texels, at places that have just been confined to their level: nothing is left to check.

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
    /// Whether what was found had better be used at once, block by block. Otherwise all is looked up before any of it is calculated
    /// with: a vector that was just written in parts takes long to load.
    const AT_ONCE: bool;

    /// The texels at some places and those that follow. They are written to their place at once: a copy of what was written one by
    /// one would wait for it.
    ///
    /// # Safety
    /// There must be such texels from `texels` on, and no place may be 2^31 or more: a gather takes it for a negative one.
    unsafe fn pairs(self, texels: *const u32, places: &Block, out: &mut [Pair; LANES]);
}

/// One pair after the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct OneByOne;

impl LookUp for OneByOne {
    const AT_ONCE: bool = false;

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
    const AT_ONCE: bool = true;

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
    const { assert!(N.is_power_of_two() && N < M && N < 1 << 31) };
    let places = places.map(|place| place & (N as u32 - 1));
    // SAFETY: a place is at most N - 1, less than 2^31, and the next less than M.
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
        // Three at least, but a shorter one would make `last` the place before the first; no place may be 2^31 or more.
        assert!((2..=46_340).contains(&pitch), "a level has borders and fits into memory");
        let texels = &atlas[level.base as usize..][..(pitch * pitch) as usize];
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
        // SAFETY: there are `pitch` squared texels, fewer than 2^31, of which any confined place and the one `pitch` after it are at most
        // the last but one.
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

/// `x` as a whole number, rounded towards zero; at least `-2^31` and at most `2^31 - 128`, and 0 where `x` is no number. It is what
/// a cast with `as` is but for the upper end, which costs vectors of them less.
#[inline(always)]
pub(super) fn whole(x: f32) -> i32 {
    const LEAST: f32 = -2_147_483_648.0;
    // The greatest f32 below 2^31.
    const MOST: f32 = 2_147_483_520.0;
    let x = if x.is_nan() { 0.0 } else { x };
    let x = if x > LEAST { x } else { LEAST };
    let x = if x < MOST { x } else { MOST };
    // SAFETY: it lies between the two, whole numbers that 32 bits hold.
    unsafe { x.to_int_unchecked() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look_up(
        look_up: impl LookUp,
        texels: &[u32; 20],
        level: &Texels<'_>,
        places: &Block,
    ) -> ([Pair; LANES], [[Pair; LANES]; 2]) {
        let (mut strip, mut squares) = ([[0; 2]; LANES], [[[0; 2]; LANES]; 2]);
        pairs::<16, _>(look_up, texels, places, &mut strip);
        level.squares(look_up, places, &mut squares);
        (strip, squares)
    }

    /// The last texels of a level and of a strip, and places beyond, one by one and, where the processor can, gathered.
    #[test]
    fn gathered_texels_are_those_looked_up_one_by_one() {
        let texels: [u32; 20] = std::array::from_fn(|k| 7 * k as u32);
        let level = Texels::new(&texels, MipLevel { base: 4, size: 2 });
        let places: Block = std::array::from_fn(|k| if k < 12 { k as u32 } else { u32::MAX - k as u32 });
        let (strip, squares) = look_up(OneByOne, &texels, &level, &places);
        for k in 0..LANES {
            let (place, confined) = (places[k] as usize % 16, (places[k] as usize).min(4 * 4 - 6));
            assert_eq!(strip[k], [texels[place], texels[place + 1]]);
            let at = |place: usize| [texels[4 + place], texels[5 + place]];
            assert_eq!([squares[0][k], squares[1][k]], [at(confined), at(confined + 4)]);
            assert_eq!(level.square(places[k]), [at(confined), at(confined + 4)]);
        }
        if let Some(gathered) = Gathered::new() {
            assert_eq!(look_up(gathered, &texels, &level, &places), (strip, squares));
        }
    }

    /// A cast gives others only above the greatest number that it can hold as well.
    #[test]
    fn whole_numbers_are_those_of_a_cast() {
        for x in [0.0, 0.99, 1.5, 8_388_607.5, 2e9, 2_147_483_520.0, f32::NAN] {
            assert_eq!([whole(x), whole(-x)], [x as i32, -x as i32], "{x}");
        }
        for x in [2_147_483_648.0, f32::MAX, f32::INFINITY] {
            assert_eq!([whole(x), whole(-x)], [i32::MAX - 127, i32::MIN], "{x}");
        }
    }
}
