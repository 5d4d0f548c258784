//! Memory for textures on large pages.
//!
//! Each column of a panorama reads texels on pages of its own. With pages of 4 KiB the processor looks up an address for nearly
//! every one of them, which takes as long as shading it, twice so in a virtual machine. Linux gives pages of 2 MiB to whoever
//! asks; on most systems only then. It is advice: nothing depends on its being taken.

/// Room for so many texels.
#[cfg(not(target_os = "linux"))]
pub(super) fn with_capacity(texels: usize) -> Vec<u32> {
    Vec::with_capacity(texels)
}

/// Room for so many texels, on large pages where the system has some.
#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
pub(super) fn with_capacity(texels: usize) -> Vec<u32> {
    const PAGE: usize = 4096;
    let mut room: Vec<u32> = Vec::with_capacity(texels);
    let spare = room.spare_capacity_mut();
    let bytes = size_of_val(spare);
    let start = spare.as_mut_ptr().cast::<u8>();
    // Advice goes to whole pages: those that lie inside of the vector's memory.
    let skipped = start.align_offset(PAGE);
    if let Some(length) = bytes.checked_sub(skipped).map(|length| length / PAGE * PAGE).filter(|length| *length > 0) {
        // SAFETY: the range lies within an allocation that belongs to `room`, and this advice changes neither what memory holds
        // nor who may use it.
        let advised = unsafe { rustix::mm::madvise(start.add(skipped).cast(), length, rustix::mm::Advice::LinuxHugepage) };
        if let Err(error) = advised {
            log::debug!("no large pages for textures: {error}");
        }
    }
    room
}
