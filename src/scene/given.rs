//! Values that remember where they came from.

use serde::{Deserialize, Serialize};

use crate::diagnostics::Span;

/// How a value came to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// Written in the user's file.
    Written,
    /// A kind's default, in the standard library.
    Default,
    /// `--set path=value` or `quick`.
    Set,
    /// Inside a component.
    Component,
    /// A library material or part.
    Library,
}

/// Where a value came from: the place that wrote it and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Origin {
    pub span: Span,
    pub how: How,
}

/// A value in SI units and its origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Given<T> {
    pub value: T,
    pub origin: Origin,
}

impl<T> Given<T> {
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Given<U> {
        Given { value: change(self.value), origin: self.origin }
    }

    pub fn span(&self) -> Span {
        self.origin.span
    }
}

impl<T> std::ops::Deref for Given<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}
