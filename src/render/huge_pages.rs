//! Memory for textures on large pages.
//!
//! Each column of a panorama reads texels on pages of its own. With pages of 4 KiB the processor looks up an address for nearly
//! every one of them, which takes as long as shading it, twice so in a virtual machine. Linux gives pages of 2 MiB to whoever
//! asks; on most systems only then. It is advice: nothing depends on its being taken.

/// So many texels of 0, on large pages where the system has some. As much memory as textures take comes fresh from the system: it is
/// not touched before the first texel is written, by whichever thread that is.
pub(super) fn zeroed(texels: usize) -> Vec<u32> {
    let mut room = vec![0; texels];
    advise(&mut room);
    room
}

#[cfg(not(target_os = "linux"))]
fn advise(_: &mut [u32]) {}

/// Asks for large pages.
#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
fn advise(room: &mut [u32]) {
    const PAGE: usize = 4096;
    let bytes = size_of_val(room);
    let start = room.as_mut_ptr().cast::<u8>();
    // Advice goes to whole pages: those that lie inside of the vector's memory.
    let skipped = start.align_offset(PAGE);
    if let Some(length) = bytes.checked_sub(skipped).map(|length| length / PAGE * PAGE).filter(|length| *length > 0) {
        // SAFETY: the range lies within memory that belongs to `room`, and this advice changes neither what memory holds nor who
        // may use it.
        let advised = unsafe { rustix::mm::madvise(start.add(skipped).cast(), length, rustix::mm::Advice::LinuxHugepage) };
        if let Err(error) = advised {
            log::debug!("no large pages for textures: {error}");
        }
    }
}
