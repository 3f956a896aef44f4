//! Self-contact culling by normal cones and contours.

use super::candidates::Reference;
use super::features::Features;
use super::tree::Tree;

/// Nothing is culled yet.
#[derive(Default)]
pub(super) struct Contours;

impl Contours {
    pub fn new(_: &Features, _: &[Tree]) -> Self {
        Self
    }
    pub fn watch(&mut self, _: &Features, _: &Tree, _: u32, _: &Reference) {}
    pub fn clear(&mut self, _: &Features, _: &Tree, _: u32, _: [u32; 2], _: &Reference) -> bool {
        false
    }
}
