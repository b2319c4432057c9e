//! Structs that can grow: they begin with their size in bytes, which the caller sets. What a caller of an older header does not have
//! takes its default.

use std::ptr::copy_nonoverlapping;

/// A struct of `sabaki.h` that begins with its size.
///
/// # Safety
/// It is `repr(C)`, begins with a `u32`, and has numbers and nullable pointers alone.
pub(super) unsafe trait Grows: Copy {
    /// Its name in messages.
    const NAME: &'static str;

    /// What a caller's struct that is shorter takes.
    fn blank() -> Self;
}

/// Structs whose blank is zeros.
macro_rules! sized {
    ($($type:ty, $name:literal;)*) => {
        $(
            // SAFETY: the struct is of that kind.
            unsafe impl $crate::capi::sized::Grows for $type {
                const NAME: &'static str = $name;

                fn blank() -> Self {
                    // SAFETY: numbers of 0, and pointers that are null.
                    unsafe { std::mem::zeroed() }
                }
            }
        )*
    };
}
pub(super) use sized;

/// The size of a caller's struct, which is checked.
///
/// # Safety
/// Null, or the caller's struct.
unsafe fn size_of_given<T: Grows>(pointer: *const T) -> Result<usize, String> {
    let (name, own) = (T::NAME, size_of::<T>());
    if pointer.is_null() {
        return Err(format!("{name} is NULL"));
    }
    // SAFETY: it begins with its size.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    match size {
        0..8 => Err(format!("the size of {name} is {size}; set it to sizeof")),
        _ if size > own => Err(format!(
            "the size of {name} is {size}; this library is older than the header and has {own}"
        )),
        _ => Ok(size),
    }
}

/// Reads a caller's struct.
///
/// # Safety
/// Null, or a struct of as many bytes as it says.
pub(super) unsafe fn read<T: Grows>(pointer: *const T) -> Result<T, String> {
    // SAFETY: the caller vouches for the struct.
    unsafe {
        let size = size_of_given(pointer)?;
        Ok(read_bytes(pointer.cast(), size))
    }
}

/// # Safety
/// There are `size` bytes, at most those of the struct.
unsafe fn read_bytes<T: Grows>(bytes: *const u8, size: usize) -> T {
    let mut value = T::blank();
    // SAFETY: the caller vouches for the bytes; all that they may be are values of its numbers and pointers.
    unsafe { copy_nonoverlapping(bytes, (&raw mut value).cast(), size) };
    value
}

/// Reads an array of structs, all of the size that the first one has.
///
/// # Safety
/// Null only with a count of 0; otherwise that many structs of as many bytes as the first one says.
pub(super) unsafe fn read_array<T: Grows>(
    pointer: *const T,
    count: usize,
) -> Result<impl Iterator<Item = T>, String> {
    let size = match count {
        0 => 0,
        // SAFETY: the caller vouches for the first one.
        _ => unsafe { size_of_given(pointer) }?,
    };
    let first = pointer.cast::<u8>();
    Ok((0..count).map(move |index| {
        // SAFETY: the caller vouches for that many of this size.
        unsafe { read_bytes(first.wrapping_add(index * size), size) }
    }))
}

/// Writes as much of the values as the caller's structs have, which keep their size.
///
/// # Safety
/// Null only with a capacity of 0; otherwise room for that many structs of as many bytes as the first one says.
pub(super) unsafe fn write_array<T: Grows>(
    values: impl Iterator<Item = T>,
    to: *mut T,
    capacity: usize,
) -> Result<(), String> {
    if capacity == 0 {
        return Ok(());
    }
    // SAFETY: the caller vouches for the first one.
    let size = unsafe { size_of_given(to) }?;
    for (index, value) in values.take(capacity).enumerate() {
        let to = to.cast::<u8>().wrapping_add(index * size);
        // SAFETY: the caller vouches for that many of this size; the first four bytes are the size.
        unsafe {
            copy_nonoverlapping((&raw const value).cast(), to, size);
            to.cast::<u32>().write(size as u32);
        }
    }
    Ok(())
}

/// Writes as much of a value as the caller's struct has, like [`write_array`].
///
/// # Safety
/// Null, or a struct of as many bytes as it says.
pub(super) unsafe fn write<T: Grows>(value: T, to: *mut T) -> Result<(), String> {
    // SAFETY: the caller vouches for the struct.
    unsafe { write_array(std::iter::once(value), to, 1) }
}
