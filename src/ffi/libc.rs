//! What a program in C has anyway: files, and for a library without Rust's standard library memory and an end.

use alloc::vec::Vec;
use core::ffi::{CStr, c_char, c_int, c_void};

unsafe extern "C" {
    fn fopen(path: *const c_char, mode: *const c_char) -> *mut c_void;
    fn fread(to: *mut c_void, size: usize, count: usize, file: *mut c_void) -> usize;
    fn ferror(file: *mut c_void) -> c_int;
    fn fclose(file: *mut c_void) -> c_int;
}

/// Files are read by as many bytes at a time.
const STEP: usize = 1 << 16;

/// The bytes of a file, or what could not be done with it.
pub(super) fn read(path: &CStr) -> Result<Vec<u8>, &'static str> {
    // SAFETY: both are strings that end with a zero.
    let file = unsafe { fopen(path.as_ptr(), c"rb".as_ptr()) };
    if file.is_null() {
        return Err("cannot be opened");
    }
    let mut bytes = Vec::new();
    loop {
        bytes.reserve(STEP);
        let room = bytes.spare_capacity_mut();
        // SAFETY: the file is open, and `room` has as many bytes, which `fread` only writes.
        let count = unsafe { fread(room.as_mut_ptr().cast(), 1, room.len(), file) };
        // SAFETY: `fread` has written the first `count` bytes of the room, of which it was allowed no more than there are.
        unsafe { bytes.set_len(bytes.len() + count) };
        if count == 0 {
            break;
        }
    }
    // SAFETY: it is open, and not used after it has been closed.
    let has_failed = unsafe { ferror(file) != 0 } | unsafe { fclose(file) != 0 };
    if has_failed {
        return Err("cannot be read");
    }
    Ok(bytes)
}

/// What Rust's standard library would bring. A program may have these once: so that no crate that depends on this one can switch them on, it
/// takes `--cfg sateen_runtime`, which `scripts/capi.sh --lean` gives the library alone.
#[cfg(sateen_runtime)]
mod runtime {
    use core::alloc::{GlobalAlloc, Layout};
    use core::ffi::c_void;

    unsafe extern "C" {
        fn malloc(size: usize) -> *mut c_void;
        fn realloc(place: *mut c_void, size: usize) -> *mut c_void;
        fn free(place: *mut c_void);
        fn abort() -> !;
    }

    /// C's allocator.
    struct Malloc;

    /// What `malloc` aligns to everywhere. Nothing here needs more.
    const ALIGNMENT: usize = align_of::<f64>();

    // SAFETY: `malloc` and `realloc` give memory of its size that nobody else has, aligned to at least ALIGNMENT, or null; none of them
    // unwinds. More aligned memory is refused below.
    unsafe impl GlobalAlloc for Malloc {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            if layout.align() > ALIGNMENT {
                return core::ptr::null_mut();
            }
            // SAFETY: `malloc` takes any size.
            unsafe { malloc(layout.size()).cast() }
        }

        unsafe fn dealloc(&self, place: *mut u8, _: Layout) {
            // SAFETY: the caller promises that it is from `alloc` or `realloc`, and has not been freed.
            unsafe { free(place.cast()) }
        }

        unsafe fn realloc(&self, place: *mut u8, _: Layout, size: usize) -> *mut u8 {
            // SAFETY: as for `dealloc`; what `alloc` did not refuse is aligned to no more than what this gives.
            unsafe { realloc(place.cast(), size).cast() }
        }
    }

    #[global_allocator]
    static ALLOCATOR: Malloc = Malloc;

    #[panic_handler]
    fn end(_: &core::panic::PanicInfo<'_>) -> ! {
        // SAFETY: it may always be called.
        unsafe { abort() }
    }
}
