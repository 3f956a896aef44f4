//! Four numbers side by side: on AVX2 where the machine has it, asked at run time, and one after the other elsewhere.
//!
//! Both do the same IEEE operations in the same order, none fused, so that the bits do not depend on the machine.

use std::ops::{AddAssign, SubAssign};

use glam::DVec3;

/// Four numbers in a row: one of each of four triangles, or a vector of a node and what fills it up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Four(pub [f64; 4]);

impl Four {
    /// The fourth is zero.
    #[inline(always)]
    pub fn from_vector(v: DVec3) -> Four {
        Four([v.x, v.y, v.z, 0.0])
    }

    #[inline(always)]
    pub fn vector(self) -> DVec3 {
        let [x, y, z, _] = self.0;
        DVec3::new(x, y, z)
    }
}

impl AddAssign<DVec3> for Four {
    #[inline(always)]
    fn add_assign(&mut self, v: DVec3) {
        *self = Four::from_vector(self.vector() + v);
    }
}

impl SubAssign<DVec3> for Four {
    #[inline(always)]
    fn sub_assign(&mut self, v: DVec3) {
        *self = Four::from_vector(self.vector() - v);
    }
}

/// A machine's way to do four at a time. What it computes lane by lane is the same on every one.
pub trait Lanes: Copy {
    type V: Copy;

    fn splat(self, x: f64) -> Self::V;
    fn load(self, from: &[f64; 4]) -> Self::V;
    fn store(self, v: Self::V) -> [f64; 4];
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    fn div(self, a: Self::V, b: Self::V) -> Self::V;
    /// The larger in each lane; `a` where one of them is not a number.
    fn larger(self, a: Self::V, b: Self::V) -> Self::V;
    /// `v` where `test` is above zero, zero elsewhere.
    fn where_positive(self, test: Self::V, v: Self::V) -> Self::V;
    /// From four vectors to their x, y and z.
    fn turned(self, from: [&Four; 4]) -> [Self::V; 3];
    /// Back: x, y, z of four vectors to the vectors, their fourth zero.
    fn turned_back(self, v: [Self::V; 3]) -> [Self::V; 4];
    /// The same with vectors that lie without gaps.
    fn unpacked(self, from: &[DVec3; 4]) -> [Self::V; 3];
    fn packed(self, v: [Self::V; 3], to: &mut [DVec3; 4]);
    /// Says that what lies `ahead` items after this one in its array will soon be wanted. Changes no result.
    fn soon<T>(self, item: &T, ahead: usize);
}

/// A kernel that is compiled once for each machine. `run` and all that it calls must be `#[inline(always)]`.
pub trait Kernel {
    type Output;

    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// What the machine that runs this can do.
#[derive(Clone, Copy, Debug)]
pub enum Machine {
    Plain(Plain),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl Machine {
    /// The best of this one.
    pub fn here() -> Machine {
        #[cfg(target_arch = "x86_64")]
        if let Some(features) = pulp::x86::V3::try_new() {
            return Machine::Avx2(Avx2(features));
        }
        Machine::Plain(Plain)
    }

    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Machine::Plain(plain) => kernel.run(plain),
            #[cfg(target_arch = "x86_64")]
            Machine::Avx2(avx2) => avx2.0.vectorize(OnAvx2 { kernel, avx2 }),
        }
    }
}

/// One lane after the other.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

#[inline(always)]
fn lanewise(a: [f64; 4], b: [f64; 4], of: impl Fn(f64, f64) -> f64) -> [f64; 4] {
    [of(a[0], b[0]), of(a[1], b[1]), of(a[2], b[2]), of(a[3], b[3])]
}

impl Lanes for Plain {
    type V = [f64; 4];

    #[inline(always)]
    fn splat(self, x: f64) -> [f64; 4] {
        [x; 4]
    }

    #[inline(always)]
    fn load(self, from: &[f64; 4]) -> [f64; 4] {
        *from
    }

    #[inline(always)]
    fn store(self, v: [f64; 4]) -> [f64; 4] {
        v
    }

    #[inline(always)]
    fn add(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        lanewise(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        lanewise(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        lanewise(a, b, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        lanewise(a, b, |a, b| a / b)
    }

    #[inline(always)]
    fn larger(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        lanewise(a, b, |a, b| if b > a { b } else { a })
    }

    #[inline(always)]
    fn where_positive(self, test: [f64; 4], v: [f64; 4]) -> [f64; 4] {
        lanewise(test, v, |test, v| if test > 0.0 { v } else { 0.0 })
    }

    #[inline(always)]
    fn turned(self, from: [&Four; 4]) -> [[f64; 4]; 3] {
        let [a, b, c, d] = from.map(|v| v.0);
        [[a[0], b[0], c[0], d[0]], [a[1], b[1], c[1], d[1]], [a[2], b[2], c[2], d[2]]]
    }

    #[inline(always)]
    fn turned_back(self, [x, y, z]: [[f64; 4]; 3]) -> [[f64; 4]; 4] {
        [[x[0], y[0], z[0], 0.0], [x[1], y[1], z[1], 0.0], [x[2], y[2], z[2], 0.0], [x[3], y[3], z[3], 0.0]]
    }

    #[inline(always)]
    fn unpacked(self, [a, b, c, d]: &[DVec3; 4]) -> [[f64; 4]; 3] {
        [[a.x, b.x, c.x, d.x], [a.y, b.y, c.y, d.y], [a.z, b.z, c.z, d.z]]
    }

    #[inline(always)]
    fn packed(self, [x, y, z]: [[f64; 4]; 3], to: &mut [DVec3; 4]) {
        *to = std::array::from_fn(|k| DVec3::new(x[k], y[k], z[k]));
    }

    #[inline(always)]
    fn soon<T>(self, _: &T, _: usize) {}
}

/// Proof that the machine has AVX2.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub struct Avx2(pulp::x86::V3);

#[cfg(target_arch = "x86_64")]
struct OnAvx2<K> {
    kernel: K,
    avx2: Avx2,
}

#[cfg(target_arch = "x86_64")]
impl<K: Kernel> pulp::NullaryFnOnce for OnAvx2<K> {
    type Output = K::Output;

    #[inline(always)]
    fn call(self) -> K::Output {
        self.kernel.run(self.avx2)
    }
}

/// Bytes of a line of cache.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

#[cfg(target_arch = "x86_64")]
impl Lanes for Avx2 {
    type V = std::arch::x86_64::__m256d;

    #[inline(always)]
    fn splat(self, x: f64) -> Self::V {
        self.0.avx._mm256_set1_pd(x)
    }

    #[inline(always)]
    fn load(self, from: &[f64; 4]) -> Self::V {
        pulp::cast(*from)
    }

    #[inline(always)]
    fn store(self, v: Self::V) -> [f64; 4] {
        pulp::cast(v)
    }

    #[inline(always)]
    fn add(self, a: Self::V, b: Self::V) -> Self::V {
        self.0.avx._mm256_add_pd(a, b)
    }

    #[inline(always)]
    fn sub(self, a: Self::V, b: Self::V) -> Self::V {
        self.0.avx._mm256_sub_pd(a, b)
    }

    #[inline(always)]
    fn mul(self, a: Self::V, b: Self::V) -> Self::V {
        self.0.avx._mm256_mul_pd(a, b)
    }

    #[inline(always)]
    fn div(self, a: Self::V, b: Self::V) -> Self::V {
        self.0.avx._mm256_div_pd(a, b)
    }

    #[inline(always)]
    fn larger(self, a: Self::V, b: Self::V) -> Self::V {
        // The instruction gives its second operand where the comparison is false.
        self.0.avx._mm256_max_pd(b, a)
    }

    #[inline(always)]
    fn where_positive(self, test: Self::V, v: Self::V) -> Self::V {
        let avx = self.0.avx;
        avx._mm256_and_pd(avx._mm256_cmp_pd::<{ std::arch::x86_64::_CMP_GT_OQ }>(test, avx._mm256_setzero_pd()), v)
    }

    #[inline(always)]
    fn turned(self, [a, b, c, d]: [&Four; 4]) -> [Self::V; 3] {
        let avx = self.0.avx;
        // Halves of 128 bits are put together as they are loaded, so that three shuffles remain.
        let (even, odd) =
            (self.pair([a.0[0], a.0[1]], [c.0[0], c.0[1]]), self.pair([b.0[0], b.0[1]], [d.0[0], d.0[1]]));
        let (even_z, odd_z) =
            (self.pair([a.0[2], a.0[3]], [c.0[2], c.0[3]]), self.pair([b.0[2], b.0[3]], [d.0[2], d.0[3]]));
        [avx._mm256_unpacklo_pd(even, odd), avx._mm256_unpackhi_pd(even, odd), avx._mm256_unpacklo_pd(even_z, odd_z)]
    }

    #[inline(always)]
    fn turned_back(self, [x, y, z]: [Self::V; 3]) -> [Self::V; 4] {
        let avx = self.0.avx;
        let zero = avx._mm256_setzero_pd();
        let (even, odd) = (avx._mm256_unpacklo_pd(x, y), avx._mm256_unpackhi_pd(x, y));
        let (even_z, odd_z) = (avx._mm256_unpacklo_pd(z, zero), avx._mm256_unpackhi_pd(z, zero));
        [
            avx._mm256_permute2f128_pd::<0x20>(even, even_z),
            avx._mm256_permute2f128_pd::<0x20>(odd, odd_z),
            avx._mm256_permute2f128_pd::<0x31>(even, even_z),
            avx._mm256_permute2f128_pd::<0x31>(odd, odd_z),
        ]
    }

    #[inline(always)]
    fn unpacked(self, [a, b, c, d]: &[DVec3; 4]) -> [Self::V; 3] {
        let avx = self.0.avx;
        let xy = self.pair([a.x, a.y], [c.x, c.y]);
        let zx = self.pair([a.z, b.x], [c.z, d.x]);
        let yz = self.pair([b.y, b.z], [d.y, d.z]);
        [
            avx._mm256_blend_pd::<0b1010>(xy, zx),
            avx._mm256_shuffle_pd::<0b0101>(xy, yz),
            avx._mm256_blend_pd::<0b1010>(zx, yz),
        ]
    }

    #[inline(always)]
    fn packed(self, [x, y, z]: [Self::V; 3], to: &mut [DVec3; 4]) {
        let avx = self.0.avx;
        let xy = self.store(avx._mm256_unpacklo_pd(x, y));
        let zx = self.store(avx._mm256_blend_pd::<0b1010>(z, x));
        let yz = self.store(avx._mm256_unpackhi_pd(y, z));
        *to = [
            DVec3::new(xy[0], xy[1], zx[0]),
            DVec3::new(zx[1], yz[0], yz[1]),
            DVec3::new(xy[2], xy[3], zx[2]),
            DVec3::new(zx[3], yz[2], yz[3]),
        ];
    }

    #[inline(always)]
    fn soon<T>(self, item: &T, ahead: usize) {
        let first = std::ptr::from_ref(item).wrapping_add(ahead).cast::<i8>();
        for line in 0..size_of::<T>().div_ceil(LINE) {
            self.0.sse._mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(first.wrapping_add(line * LINE));
        }
    }
}

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    #[inline(always)]
    fn pair(self, low: [f64; 2], high: [f64; 2]) -> std::arch::x86_64::__m256d {
        let avx = self.0.avx;
        avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(pulp::cast(low)), pulp::cast(high))
    }
}
