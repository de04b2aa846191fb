//! What a program in C has anyway: files, and without Rust's standard library memory and an end.

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
    // SAFETY: both end with a zero.
    let file = unsafe { fopen(path.as_ptr(), c"rb".as_ptr()) };
    if file.is_null() {
        return Err("cannot be opened");
    }
    let mut bytes = Vec::new();
    loop {
        bytes.reserve(STEP);
        let room = bytes.spare_capacity_mut();
        // SAFETY: the file is open, and there is as much room.
        let count = unsafe { fread(room.as_mut_ptr().cast(), 1, room.len(), file) };
        // SAFETY: so many more have been read.
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

#[cfg(not(any(feature = "std", test)))]
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

    // SAFETY: these are the promises of C's functions.
    unsafe impl GlobalAlloc for Malloc {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            if layout.align() > ALIGNMENT {
                return core::ptr::null_mut();
            }
            // SAFETY: any size is allowed.
            unsafe { malloc(layout.size()).cast() }
        }

        unsafe fn dealloc(&self, place: *mut u8, _: Layout) {
            // SAFETY: it is from `malloc`.
            unsafe { free(place.cast()) }
        }

        unsafe fn realloc(&self, place: *mut u8, _: Layout, size: usize) -> *mut u8 {
            // SAFETY: it is from `malloc`, and aligned to no more.
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
