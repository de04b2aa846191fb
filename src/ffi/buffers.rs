//! Memory of C's, checked as far as it can be.

use core::ffi::c_char;
use core::fmt::{self, Write};
use core::ops::Range;
use core::slice;

use super::Status;

/// Directions as slices of x, y and z: `sateen_directions` in C.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Directions {
    x: *const f32,
    y: *const f32,
    z: *const f32,
}

/// Linear RGB as slices of red, green and blue: `sateen_colours` in C.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Colours {
    r: *mut f32,
    g: *mut f32,
    b: *mut f32,
}

impl Directions {
    fn pointers(&self) -> [*const f32; 3] {
        [self.x, self.y, self.z]
    }

    /// # Safety
    /// [`Colours::check`] has passed them for so many floats, which are there, and as long as `'a` nobody writes to them.
    pub(super) unsafe fn slices<'a>(&self, pairs: usize) -> [&'a [f32]; 3] {
        // SAFETY: as the caller promises; they are neither null nor unaligned, nor longer than memory, by the check.
        self.pointers()
            .map(|pointer| unsafe { slice::from_raw_parts(pointer, pairs) })
    }
}

impl Colours {
    fn pointers(&self) -> [*mut f32; 3] {
        [self.r, self.g, self.b]
    }

    /// That slices of so many floats are neither null nor beside the alignment of floats, and that those written to share no
    /// memory with others.
    pub(super) fn check(
        &self,
        pairs: usize,
        directions: &[&Directions; 2],
        (albedos, albedo_count): (*const f32, usize),
    ) -> Result<(), Status> {
        let written = self.pointers().map(|pointer| Span::new(pointer, pairs));
        let read = directions.map(|directions| {
            directions
                .pointers()
                .map(|pointer| Span::new(pointer, pairs))
        });
        let mut spans = [Span::default(); 10];
        for (span, checked) in spans
            .iter_mut()
            .zip(written.into_iter().chain(read[0]).chain(read[1]))
        {
            *span = checked?;
        }
        if !albedos.is_null() {
            spans[9] = Span::new(albedos, albedo_count.saturating_mul(3))?;
        }
        for (index, written) in spans[..3].iter().enumerate() {
            if spans[index + 1..].iter().any(|other| written.meets(*other)) {
                return Err(Status::InvalidBuffer);
            }
        }
        Ok(())
    }

    /// Some of them, zeros at first: C may never have written to them, and there is no slice of what is not initialised.
    ///
    /// # Safety
    /// [`Colours::check`] has passed them for as many floats as `here` ends with, which are there, and as long as `'a` nobody else reads or
    /// writes those in it.
    pub(super) unsafe fn zeroed<'a>(&self, here: &Range<usize>) -> [&'a mut [f32]; 3] {
        self.pointers().map(|pointer| {
            // SAFETY: `here` ends within the floats that the caller promises; they are neither null nor unaligned, nor longer than memory, by
            // the check, which has also found that the three share none.
            unsafe {
                let pointer = pointer.add(here.start);
                pointer.write_bytes(0, here.len());
                slice::from_raw_parts_mut(pointer, here.len())
            }
        })
    }
}

/// Addresses from one to before another.
#[derive(Clone, Copy, Default)]
struct Span {
    from: usize,
    to: usize,
}

impl Span {
    fn new(pointer: *const f32, floats: usize) -> Result<Self, Status> {
        if pointer.is_null() {
            return Err(Status::NullArgument);
        }
        let from = pointer.addr();
        let bytes = floats.checked_mul(size_of::<f32>());
        let bytes = bytes.filter(|bytes| *bytes <= isize::MAX as usize);
        let to = bytes.and_then(|bytes| from.checked_add(bytes));
        let to = to.filter(|_| pointer.is_aligned());
        Ok(Self {
            from,
            to: to.ok_or(Status::InvalidBuffer)?,
        })
    }

    fn meets(self, other: Self) -> bool {
        self.from < other.to && other.from < self.to
    }
}

/// Albedos, three floats each: none if null.
///
/// # Safety
/// There are as many, if it is not null.
pub(super) unsafe fn albedos_of<'a>(
    albedos: *const f32,
    count: usize,
) -> Result<&'a [[f32; 3]], Status> {
    if albedos.is_null() {
        return if count == 0 {
            Ok(&[])
        } else {
            Err(Status::NullArgument)
        };
    }
    Span::new(albedos, count.saturating_mul(3))?;
    // SAFETY: as the caller promises; they are aligned, and no longer than memory, by the span.
    Ok(unsafe { slice::from_raw_parts(albedos.cast(), count) })
}

/// # Safety
/// There are three floats, if it is not null.
pub(super) unsafe fn direction_of(w: *const f32) -> Result<[f32; 3], Status> {
    if w.is_null() {
        return Err(Status::NullArgument);
    }
    // SAFETY: the caller promises three floats; they need not be aligned.
    Ok(unsafe { w.cast::<[f32; 3]>().read_unaligned() })
}

/// Writes a value to where it is wanted; `None` if that is null.
///
/// # Safety
/// There is room for it, if it is not null.
pub(super) unsafe fn put<T>(to: *mut T, value: T) -> Option<()> {
    if to.is_null() {
        return None;
    }
    // SAFETY: the caller promises room; it need not be aligned.
    unsafe { to.write_unaligned(value) };
    Some(())
}

/// Writes a message, or an empty one, as much of it as there is room for, and a zero. Null wants none.
///
/// # Safety
/// There are so many bytes, if it is not null.
pub(super) unsafe fn say(to: *mut c_char, bytes: usize, message: Option<&impl fmt::Display>) {
    if to.is_null() || bytes == 0 || bytes > isize::MAX as usize {
        return;
    }
    // SAFETY: the caller promises as much room.
    unsafe { to.cast::<u8>().write_bytes(0, bytes) };
    // SAFETY: as before; all of them are zeros now, and no longer than memory.
    let room = unsafe { slice::from_raw_parts_mut(to.cast::<u8>(), bytes) };
    let (_, room) = room.split_last_mut().expect("there is a byte");
    if let Some(message) = message {
        // What does not fit is left out.
        let _ = write!(Text { room }, "{message}");
    }
}

/// Text into a buffer, until it is full.
struct Text<'a> {
    room: &'a mut [u8],
}

impl Write for Text<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut fits = text.len().min(self.room.len());
        while !text.is_char_boundary(fits) {
            fits -= 1;
        }
        let (here, rest) = core::mem::take(&mut self.room).split_at_mut(fits);
        here.copy_from_slice(&text.as_bytes()[..fits]);
        if fits < text.len() {
            return Err(fmt::Error);
        }
        self.room = rest;
        Ok(())
    }
}
