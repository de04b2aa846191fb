//! Tables for C and C++: what `sateen.h` beside this file declares and explains.
//!
//! Functions are named as those of [`Table`], with `sateen_` before. They check what they are given: null, lengths, overlaps and
//! alignment give a [`Status`], and nothing unwinds into C. What they cannot check is written at the function, as in the
//! header: that pointers lead to as much as is said, and that a table is one and has not been freed.
#![expect(unsafe_code, reason = "the memory is C's")]

mod buffers;
mod libc;
mod status;

pub use buffers::{Colours, Directions};
pub use status::Status;

use alloc::borrow::ToOwned;
use alloc::boxed::Box;
use alloc::ffi::CString;
use alloc::vec::Vec;
use core::ffi::{CStr, c_char, c_void};
use core::{ptr, slice};

use buffers::{albedos_of, direction_of, put, say};
use status::guarded;

use crate::lookup::{Quantity, View};
use crate::math::simd::Level;
use crate::table::{Error, Table};

/// A loaded table: `sateen_table` in C. It never changes, but for the count of misses, which threads share.
pub struct Handle {
    table: Table,
    /// Of the threads.
    names: Vec<CString>,
}

/// Makes a handle of what was loaded, or says why there is none.
///
/// # Safety
/// `handle` is valid for a write, if not null, and `message` for `message_bytes` of them.
unsafe fn loaded(
    load: impl FnOnce() -> Result<Table, Refusal>,
    handle: *mut *mut Handle,
    message: *mut c_char,
    message_bytes: usize,
) -> Status {
    let made = guarded(|| {
        // SAFETY: as the caller promises.
        unsafe { put(handle, ptr::null_mut()) }.ok_or(Refusal::Null("table"))?;
        let table = load()?;
        // Names are visible ASCII.
        let names = table.threads().iter();
        let names = names.map(|thread| CString::new(thread.name()).unwrap_or_default());
        let names = names.collect();
        // SAFETY: as above.
        unsafe { put(handle, Box::into_raw(Box::new(Handle { table, names }))) };
        Ok(())
    });
    let refusal = made.unwrap_or(Err(Refusal::Panic)).err();
    // SAFETY: as the caller promises.
    unsafe { say(message, message_bytes, refusal.as_ref()) };
    refusal.map_or(Status::Ok, |refusal| refusal.status())
}

/// Why nothing was loaded.
enum Refusal {
    Null(&'static str),
    Table(Error),
    /// The file, and what could not be done with it.
    File(CString, &'static str),
    TableOfFile(CString, Error),
    Panic,
}

impl Refusal {
    fn status(&self) -> Status {
        match self {
            Self::Null(_) => Status::NullArgument,
            Self::Table(error) => Status::of(error),
            Self::File(..) => Status::File,
            Self::TableOfFile(_, error) => Status::of(error),
            Self::Panic => Status::Internal,
        }
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Null(what) => write!(f, "{what} is null"),
            Self::Table(error) => error.fmt(f),
            Self::File(path, what) => write!(f, "{}: {what}", path.to_string_lossy()),
            Self::TableOfFile(path, error) => write!(f, "{}: {error}", path.to_string_lossy()),
            Self::Panic => f.write_str(Status::Internal.text()),
        }
    }
}

/// [`Table::from_bytes`].
///
/// # Safety
/// `bytes` leads to `length` bytes, `table` to a pointer, `message` to `message_bytes` bytes, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_from_bytes(
    bytes: *const c_void,
    length: usize,
    table: *mut *mut Handle,
    message: *mut c_char,
    message_bytes: usize,
) -> Status {
    let load = || {
        // SAFETY: as the caller promises.
        let bytes = unsafe { bytes_of(bytes, length) }?;
        Table::from_bytes(bytes).map_err(Refusal::Table)
    };
    // SAFETY: as the caller promises.
    unsafe { loaded(load, table, message, message_bytes) }
}

/// [`Table::from_static`].
///
/// # Safety
/// As for [`sateen_from_bytes`]; and the bytes are there and do not change until the table is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_from_mapped(
    bytes: *const c_void,
    length: usize,
    table: *mut *mut Handle,
    message: *mut c_char,
    message_bytes: usize,
) -> Status {
    let load = || {
        // SAFETY: as the caller promises: nothing but the table keeps them, and no clone is made of it.
        let bytes: &'static [u8] = unsafe { bytes_of(bytes, length) }?;
        Table::from_static(bytes).map_err(Refusal::Table)
    };
    // SAFETY: as the caller promises.
    unsafe { loaded(load, table, message, message_bytes) }
}

/// Reads a file whole, and [`Table::from_bytes`] of it.
///
/// # Safety
/// `path` ends with a zero, `table` leads to a pointer, `message` to `message_bytes` bytes, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_from_file(
    path: *const c_char,
    table: *mut *mut Handle,
    message: *mut c_char,
    message_bytes: usize,
) -> Status {
    let load = || {
        if path.is_null() {
            return Err(Refusal::Null("path"));
        }
        // SAFETY: as the caller promises.
        let path = unsafe { CStr::from_ptr(path) };
        let bytes = libc::read(path).map_err(|what| Refusal::File(path.to_owned(), what))?;
        Table::from_bytes(&bytes).map_err(|error| Refusal::TableOfFile(path.to_owned(), error))
    };
    // SAFETY: as the caller promises.
    unsafe { loaded(load, table, message, message_bytes) }
}

/// # Safety
/// `bytes` leads to `length` bytes, or is null.
unsafe fn bytes_of<'a>(bytes: *const c_void, length: usize) -> Result<&'a [u8], Refusal> {
    if bytes.is_null() {
        return Err(Refusal::Null("bytes"));
    }
    if length > isize::MAX as usize {
        return Err(Refusal::Table(Error::TooLarge {
            bytes: length as u64,
        }));
    }
    // SAFETY: as the caller promises.
    Ok(unsafe { slice::from_raw_parts(bytes.cast(), length) })
}

/// Frees a table. Null is none.
///
/// # Safety
/// The table was loaded by one of these functions, and nobody uses it any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_free(table: *mut Handle) {
    if !table.is_null() {
        // SAFETY: as the caller promises.
        drop(unsafe { Box::from_raw(table) });
    }
}

/// What a status means, in English.
#[unsafe(no_mangle)]
pub extern "C" fn sateen_status_text(status: i32) -> *const c_char {
    Status::c_text(status).as_ptr()
}

/// The version of the library.
#[unsafe(no_mangle)]
pub extern "C" fn sateen_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// Something of a table, or what is said of null.
///
/// # Safety
/// The table is one that has been loaded and not freed, or null.
unsafe fn query<'a, T>(table: *const Handle, otherwise: T, of: impl FnOnce(&'a Handle) -> T) -> T {
    // SAFETY: as the caller promises.
    unsafe { table.as_ref() }.map_or(otherwise, of)
}

/// How many threads the table has.
///
/// # Safety
/// That of [`query`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_thread_count(table: *const Handle) -> usize {
    // SAFETY: as the caller promises.
    unsafe { query(table, 0, |handle| handle.names.len()) }
}

/// The name of a thread, as long as the table is there; null if there is none.
///
/// # Safety
/// That of [`query`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_thread_name(table: *const Handle, thread: usize) -> *const c_char {
    let name = |handle: &Handle| handle.names.get(thread).map(|name| name.as_ptr());
    // SAFETY: as the caller promises.
    unsafe { query(table, None, name) }.unwrap_or(ptr::null())
}

/// The fabric's own albedo of a thread.
///
/// # Safety
/// That of [`query`]; `albedo` leads to three floats, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_thread_albedo(
    table: *const Handle,
    thread: usize,
    albedo: *mut f32,
) -> Status {
    // SAFETY: as the caller promises.
    let Some(handle) = (unsafe { table.as_ref() }) else {
        return Status::NullArgument;
    };
    let Some(of) = handle.table.threads().get(thread) else {
        return Status::OutOfRange;
    };
    // SAFETY: as the caller promises.
    match unsafe { put(albedo.cast(), of.albedo()) } {
        Some(()) => Status::Ok,
        None => Status::NullArgument,
    }
}

/// [`Table::metadata`]: text that is as long as is put to `length`, and there as long as the table.
///
/// # Safety
/// That of [`query`]; `length` leads to a number, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_metadata(
    table: *const Handle,
    length: *mut usize,
) -> *const c_char {
    // SAFETY: as the caller promises.
    let text = unsafe { query(table, "", |handle| handle.table.metadata()) };
    // SAFETY: as the caller promises.
    unsafe { put(length, text.len()) };
    text.as_ptr().cast()
}

/// [`Table::decoded_bytes`].
///
/// # Safety
/// That of [`query`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_decoded_bytes(table: *const Handle) -> usize {
    // SAFETY: as the caller promises.
    unsafe { query(table, 0, |handle| handle.table.decoded_bytes()) }
}

/// [`Table::lent_bytes`].
///
/// # Safety
/// That of [`query`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_lent_bytes(table: *const Handle) -> usize {
    // SAFETY: as the caller promises.
    unsafe { query(table, 0, |handle| handle.table.lent_bytes()) }
}

/// [`Table::misses`].
///
/// # Safety
/// That of [`query`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_misses(table: *const Handle) -> usize {
    // SAFETY: as the caller promises.
    unsafe { query(table, 0, |handle| handle.table.misses()) }
}

/// [`Table::reset_misses`].
///
/// # Safety
/// That of [`query`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_reset_misses(table: *const Handle) {
    // SAFETY: as the caller promises.
    unsafe { query(table, (), |handle| handle.table.reset_misses()) }
}

/// Functions of one pair and of many.
macro_rules! evaluate {
    ($quantity:ident, $one:ident, $one_with:ident, $batch:ident, $batch_with:ident) => {
        /// One pair, with the fabric's own albedos.
        ///
        /// # Safety
        /// That of [`query`]; `wi`, `wr` and `value` lead to three floats each, or are null.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $one(
            table: *const Handle,
            wi: *const f32,
            wr: *const f32,
            value: *mut f32,
        ) -> Status {
            // SAFETY: as the caller promises.
            unsafe { $one_with(table, ptr::null(), 0, wi, wr, value) }
        }

        /// One pair, with other albedos.
        ///
        /// # Safety
        /// As before; `albedos` leads to `albedo_count` times three floats, or is null.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $one_with(
            table: *const Handle,
            albedos: *const f32,
            albedo_count: usize,
            wi: *const f32,
            wr: *const f32,
            value: *mut f32,
        ) -> Status {
            // SAFETY: as the caller promises.
            unsafe {
                one(
                    table,
                    albedos,
                    albedo_count,
                    Quantity::$quantity,
                    [wi, wr],
                    value,
                )
            }
        }

        /// Many pairs, with the fabric's own albedos.
        ///
        /// # Safety
        /// That of [`query`]; each slice has `pairs` floats, or is null.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $batch(
            table: *const Handle,
            pairs: usize,
            wi: Directions,
            wr: Directions,
            values: Colours,
        ) -> Status {
            // SAFETY: as the caller promises.
            unsafe { $batch_with(table, ptr::null(), 0, pairs, wi, wr, values) }
        }

        /// Many pairs, with other albedos.
        ///
        /// # Safety
        /// As before; `albedos` leads to `albedo_count` times three floats, or is null.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $batch_with(
            table: *const Handle,
            albedos: *const f32,
            albedo_count: usize,
            pairs: usize,
            wi: Directions,
            wr: Directions,
            values: Colours,
        ) -> Status {
            // SAFETY: as the caller promises.
            unsafe {
                many(
                    table,
                    albedos,
                    albedo_count,
                    Quantity::$quantity,
                    pairs,
                    [wi, wr],
                    values,
                )
            }
        }
    };
}

evaluate!(
    Brdf,
    sateen_eval,
    sateen_eval_with,
    sateen_eval_batch,
    sateen_eval_batch_with
);
evaluate!(
    Rho,
    sateen_eval_cos,
    sateen_eval_cos_with,
    sateen_eval_cos_batch,
    sateen_eval_cos_batch_with
);

/// # Safety
/// That of `sateen_eval_with`.
unsafe fn one(
    table: *const Handle,
    albedos: *const f32,
    albedo_count: usize,
    quantity: Quantity,
    pair: [*const f32; 2],
    value: *mut f32,
) -> Status {
    let evaluate = || {
        // SAFETY: as the caller promises.
        let handle = unsafe { table.as_ref() }.ok_or(Status::NullArgument)?;
        // SAFETY: as the caller promises.
        let albedos = unsafe { albedos_of(albedos, albedo_count) }?;
        // SAFETY: as the caller promises.
        let [wi, wr] = pair.map(|w| unsafe { direction_of(w) });
        let (wi, wr) = (wi?, wr?);
        let colour = match quantity {
            Quantity::Brdf => handle.table.eval_with(albedos, wi, wr),
            Quantity::Rho => handle.table.eval_cos_with(albedos, wi, wr),
        };
        // SAFETY: as the caller promises.
        unsafe { put(value.cast(), colour) }.ok_or(Status::NullArgument)
    };
    Status::of_result(guarded(evaluate))
}

/// Pairs that are evaluated before the next values are zeroed: so few that these stay in the nearest cache, and a multiple of all
/// numbers of lanes.
const BLOCK: usize = 1024;

/// # Safety
/// That of `sateen_eval_batch_with`.
unsafe fn many(
    table: *const Handle,
    albedos: *const f32,
    albedo_count: usize,
    quantity: Quantity,
    pairs: usize,
    [wi, wr]: [Directions; 2],
    values: Colours,
) -> Status {
    let evaluate = || {
        // SAFETY: as the caller promises.
        let handle = unsafe { table.as_ref() }.ok_or(Status::NullArgument)?;
        if pairs == 0 {
            return Ok(());
        }
        values.check(pairs, &[&wi, &wr], (albedos, albedo_count))?;
        // SAFETY: as the caller promises.
        let albedos = unsafe { albedos_of(albedos, albedo_count) }?;
        // SAFETY: they have been checked for so many pairs, which the caller promises, and that nobody writes to them meanwhile.
        let (wi, wr) = unsafe { (wi.slices(pairs), wr.slices(pairs)) };
        let level = Level::detect();
        for start in (0..pairs).step_by(BLOCK) {
            let here = start..pairs.min(start + BLOCK);
            // SAFETY: as before; the blocks of before are no longer used.
            let values = unsafe { values.zeroed(&here) };
            let [wi, wr] = [wi, wr].map(|w| w.map(|w| &w[here.clone()]));
            let table = &handle.table;
            table.eval_batch_at(level, albedos, quantity, wi, wr, values);
        }
        Ok(())
    };
    Status::of_result(guarded(evaluate))
}

/// A direction that has been drawn: `sateen_sample` in C. All zeros if there is none.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct Sample {
    wi: [f32; 3],
    rho: [f32; 3],
    pdf: f32,
}

/// [`Table::has_sampling`].
///
/// # Safety
/// That of [`query`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_has_sampling(table: *const Handle) -> i32 {
    // SAFETY: as the caller promises.
    unsafe { query(table, 0, |handle| handle.table.has_sampling().into()) }
}

/// [`Table::sample_cos`], with other albedos.
///
/// # Safety
/// That of [`query`]; `albedos` leads to `albedo_count` times three floats, `wr` to three, `u` to two and `sample` to a sample, or they are
/// null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_sample_cos(
    table: *const Handle,
    albedos: *const f32,
    albedo_count: usize,
    wr: *const f32,
    u: *const f32,
    sample: *mut Sample,
) -> Status {
    let draw = |view: View<'_>| {
        if u.is_null() {
            return Err(Status::NullArgument);
        }
        // SAFETY: the caller promises two floats; they need not be aligned.
        let u = unsafe { u.cast::<[f32; 2]>().read_unaligned() };
        let drawn = view.sample_cos(u).map(|drawn| Sample {
            wi: drawn.wi,
            rho: drawn.rho,
            pdf: drawn.pdf,
        });
        Ok(drawn.unwrap_or_default())
    };
    // SAFETY: as the caller promises.
    unsafe { at_view(table, albedos, albedo_count, wr, sample, draw) }
}

/// [`Table::pdf`], with other albedos.
///
/// # Safety
/// That of [`query`]; `albedos` leads to `albedo_count` times three floats, `wi` and `wr` to three and `pdf` to one, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_pdf(
    table: *const Handle,
    albedos: *const f32,
    albedo_count: usize,
    wi: *const f32,
    wr: *const f32,
    pdf: *mut f32,
) -> Status {
    // SAFETY: as the caller promises.
    let density = |view: View<'_>| Ok(view.pdf(unsafe { direction_of(wi) }?));
    // SAFETY: as the caller promises.
    unsafe { at_view(table, albedos, albedo_count, wr, pdf, density) }
}

/// [`Table::albedo`], with other albedos of threads.
///
/// # Safety
/// That of [`query`]; `albedos` leads to `albedo_count` times three floats, `wr` and `albedo` to three, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sateen_albedo(
    table: *const Handle,
    albedos: *const f32,
    albedo_count: usize,
    wr: *const f32,
    albedo: *mut f32,
) -> Status {
    let of = |view: View<'_>| view.albedo().ok_or(Status::NoAlbedo);
    // SAFETY: as the caller promises.
    unsafe { at_view(table, albedos, albedo_count, wr, albedo.cast(), of) }
}

/// # Safety
/// That of [`sateen_albedo`]; `to` leads to a `T`, or is null.
unsafe fn at_view<T>(
    table: *const Handle,
    albedos: *const f32,
    albedo_count: usize,
    wr: *const f32,
    to: *mut T,
    of: impl FnOnce(View<'_>) -> Result<T, Status>,
) -> Status {
    let evaluate = || {
        // SAFETY: as the caller promises.
        let handle = unsafe { table.as_ref() }.ok_or(Status::NullArgument)?;
        // SAFETY: as the caller promises.
        let albedos = unsafe { albedos_of(albedos, albedo_count) }?;
        // SAFETY: as the caller promises.
        let wr = unsafe { direction_of(wr) }?;
        let value = of(handle.table.at_view(albedos, wr))?;
        // SAFETY: as the caller promises.
        unsafe { put(to, value) }.ok_or(Status::NullArgument)
    };
    Status::of_result(guarded(evaluate))
}
