//! The library for C and C++. It implements `sabaki.h`, which lies beside this file.
//!
//! By default only a Rust library is built. The header says how to build a library for C.
//!
//! Architecture invariant: only this module uses names or types of C.
//!
//! The unit tests of this package link a second copy of it, by way of the packages that they use, so their own copy exports no names.
#![cfg_attr(test, allow(dead_code))]

/// Functions of `sabaki.h`. Without a return type, the body may fail, by `?`: the function then returns a status, which is [`OK`](status::OK)
/// after the end of the body. Pointers that may be null are options of references.
macro_rules! exported {
    ($(unsafe extern "C" fn $name:ident($($given:ident: $type:ty),* $(,)?) $(-> $out:ty)? $body:block)*) => {
        $(exported!(@one $name [$($given: $type),*] [$($out)?] $body);)*
    };
    (@one $name:ident [$($given:ident: $type:ty),*] [] $body:block) => {
        exported!(@one $name [$($given: $type),*] [$crate::capi::status::Status] {
            $crate::capi::status::call(|| {
                $body
                Ok($crate::capi::status::OK)
            })
        });
    };
    (@one $name:ident [$($given:ident: $type:ty),*] [$out:ty] $body:block) => {
        /// # Safety
        /// As `sabaki.h` says.
        #[cfg_attr(not(test), unsafe(no_mangle))]
        pub(super) unsafe extern "C" fn $name($($given: $type),*) -> $out $body
    };
}

mod api;
mod crowd;
mod culler;
mod device;
mod game;
mod game_inputs;
mod game_state;
mod graph;
mod log;
mod memory;
mod sized;
mod status;

use std::ffi::{CStr, c_char};

/// Reads a text, for example a path.
///
/// # Safety
/// Null, or a text that ends with a zero byte and outlives the result.
unsafe fn text<'a>(pointer: *const c_char) -> Result<&'a str, String> {
    if pointer.is_null() {
        return Err("a text is NULL".to_owned());
    }
    // SAFETY: the caller vouches for the text.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| "a text is not UTF-8".to_owned())
}

/// The value behind a pointer of the caller. Null is an error that names `what`.
fn given<T>(pointer: Option<T>, what: &str) -> Result<T, String> {
    pointer.ok_or_else(|| format!("{what} is NULL"))
}

/// Slice of the caller's elements.
///
/// # Safety
/// Null only with a count of 0; otherwise that many valid elements, which are not written to while the result lives.
unsafe fn given_slice<'a, T>(
    pointer: *const T,
    count: usize,
    what: &str,
) -> Result<&'a [T], String> {
    if count == 0 {
        return Ok(&[]);
    }
    // SAFETY: the caller vouches for the pointer and the count.
    unsafe {
        given(pointer.as_ref(), what)?;
        Ok(std::slice::from_raw_parts(pointer, count))
    }
}

/// Mutable slice of the caller's elements, like [`given_slice`].
///
/// # Safety
/// Null only with a count of 0; otherwise that many elements that nobody else uses while the result lives.
unsafe fn given_slice_mut<'a, T>(
    pointer: *mut T,
    count: usize,
    what: &str,
) -> Result<&'a mut [T], String> {
    if count == 0 {
        return Ok(&mut []);
    }
    // SAFETY: the caller vouches for the pointer and the count.
    unsafe {
        given(pointer.as_ref(), what)?;
        Ok(std::slice::from_raw_parts_mut(pointer, count))
    }
}
