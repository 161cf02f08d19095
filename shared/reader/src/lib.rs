//! A library for C and C++: what a running robot believes, and the names of what beliefs refer to by number.
//!
//! `docs/examples/c/leo_reader.h` declares its functions, and `leo_messages.h` the types; `docs/beliefs.md` explains
//! both. A null pointer is allowed wherever a reference is optional. A panic ends the process.
#![expect(unsafe_code, reason = "functions for C have names of their own, and take a string of C")]

mod reader;

use std::ffi::{CStr, OsStr, c_char};
use std::mem::MaybeUninit;
use std::os::unix::ffi::OsStrExt as _;
use std::path::Path;

use message::{Belief, BeliefHead, Symbols, Text};

pub use reader::{Reader, ReaderError};

/// There is no new frame.
const NOTHING_NEW: i64 = -1;
/// No frame could be received.
const FAILED: i64 = -2;

/// Memory of the caller for a value; null if the caller does not want it.
type Out<'a, T> = Option<&'a mut MaybeUninit<T>>;

/// Joins the domain of a robot. Null on failure; then `error` contains the reason.
///
/// # Safety
///
/// `domain` is null, or points to a string that ends with a zero byte. `error` is null, or points to a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn leo_reader_open(domain: *const c_char, error: Out<'_, Text>) -> Option<Box<Reader>> {
    let opened = if domain.is_null() {
        Err(ReaderError::NoDomain)
    } else {
        // SAFETY: it is not null, and the caller guarantees that a zero byte ends it.
        let domain = unsafe { CStr::from_ptr(domain) };
        Reader::open(Path::new(OsStr::from_bytes(domain.to_bytes())))
    };
    match opened {
        Ok(reader) => Some(Box::new(reader)),
        Err(reason) => {
            tell(error, &reason);
            None
        }
    }
}

/// Takes the newest frame of beliefs of a perspective, and writes its head. Returns the number of its beliefs, -1 if there
/// is no new frame or no reader, or -2 on an error, which `error` then contains.
#[unsafe(no_mangle)]
pub extern "C" fn leo_reader_next(
    reader: Option<&mut Reader>,
    perspective: u32,
    head: Out<'_, BeliefHead>,
    error: Out<'_, Text>,
) -> i64 {
    let Some(reader) = reader else { return NOTHING_NEW };
    match reader.next(perspective) {
        Ok(None) => NOTHING_NEW,
        Ok(Some((newest, count))) => {
            write(head, newest);
            i64::try_from(count).unwrap_or(FAILED)
        }
        Err(reason) => {
            tell(error, &reason);
            FAILED
        }
    }
}

/// Writes a belief of the newest frame taken, by its index from zero; 1 if there is one, else 0.
#[unsafe(no_mangle)]
pub extern "C" fn leo_reader_belief(reader: Option<&Reader>, index: u64, belief: Out<'_, Belief>) -> i32 {
    let found = usize::try_from(index).ok().zip(reader).and_then(|(index, reader)| reader.belief(index));
    found.map_or(0, |found| write(belief, *found))
}

/// Writes the names for beliefs of an incarnation of the belief process; 1 if it has a board of names, else 0.
#[unsafe(no_mangle)]
pub extern "C" fn leo_reader_symbols(
    reader: Option<&mut Reader>,
    incarnation: u64,
    symbols: Out<'_, Symbols>,
) -> i32 {
    reader.and_then(|reader| reader.symbols(incarnation)).map_or(0, |found| write(symbols, found))
}

/// Leaves the domain, and frees the reader.
#[unsafe(no_mangle)]
pub extern "C" fn leo_reader_close(reader: Option<Box<Reader>>) {
    drop(reader);
}

/// Writes a value to the caller's memory; 1.
fn write<T>(to: Out<'_, T>, value: T) -> i32 {
    if let Some(to) = to {
        to.write(value);
    }
    1
}

fn tell(error: Out<'_, Text>, reason: &ReaderError) {
    write(error, Text::new(&reason.to_string()));
}
