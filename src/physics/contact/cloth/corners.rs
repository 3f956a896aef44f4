//! Functions of three or four corners, written out: `array::map` is left as a call by the compiler, which costs more than what
//! it calls in the inmost loops.

#[inline(always)]
pub(super) fn three<T: Copy, U>([a, b, c]: [T; 3], of: impl Fn(T) -> U) -> [U; 3] {
    [of(a), of(b), of(c)]
}

#[inline(always)]
pub(super) fn four<T: Copy, U>([a, b, c, d]: [T; 4], of: impl Fn(T) -> U) -> [U; 4] {
    [of(a), of(b), of(c), of(d)]
}
