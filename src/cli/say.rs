//! Words for the terminal that do not mind who has stopped reading: `ripstop plan scene.weave | head -1` ends like any
//! command, where the standard macros would panic.

use std::fmt::Arguments;
use std::io::Write;

/// A line on standard output.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::say::out(format_args!("{}\n", format_args!($($text)*))) };
}

/// Text on standard output as it is.
macro_rules! say_as_is {
    ($($text:tt)*) => { $crate::cli::say::out(format_args!($($text)*)) };
}

/// A line on standard error.
macro_rules! complain {
    ($($text:tt)*) => { $crate::cli::say::err(format_args!("{}\n", format_args!($($text)*))) };
}

/// Text on standard error as it is.
macro_rules! complain_as_is {
    ($($text:tt)*) => { $crate::cli::say::err(format_args!($($text)*)) };
}

pub fn out(text: Arguments<'_>) {
    // A reader that has gone wants no more; results are in files, and the exit code tells the rest.
    let _ = std::io::stdout().lock().write_fmt(text);
}

pub fn err(text: Arguments<'_>) {
    // Nobody is left to be told.
    let _ = std::io::stderr().lock().write_fmt(text);
}
