//! Cholesky's factor of the leading columns of a dense symmetric matrix, and what it leaves of the rest.

/// Columns that are factored before the rest is brought up to date.
const PANEL: usize = 48;
/// Rows and columns of the piece of the product that stays in registers.
const ROWS: usize = 8;
const COLUMNS: usize = 4;

/// A square matrix by columns of which the lower half counts, with slack behind every column and behind the last one so
/// that pieces of [`ROWS`] × [`COLUMNS`] may begin anywhere.
#[derive(Clone, Debug, Default)]
pub struct Front {
    size: usize,
    values: Vec<f64>,
    /// Room: the panel in pieces of [`ROWS`] rows, column by column.
    packed: Vec<f64>,
}

impl Front {
    /// Zero, of `size` rows.
    pub fn clear(&mut self, size: usize) {
        self.size = size;
        self.values.clear();
        self.values.resize((size + ROWS) * (size + COLUMNS), 0.0);
    }

    fn stride(&self) -> usize {
        self.size + ROWS
    }

    /// Rows from `row` on of a column.
    pub fn column(&self, column: usize, row: usize) -> &[f64] {
        let from = column * self.stride();
        &self.values[from + row..from + self.size]
    }

    pub fn column_mut(&mut self, column: usize, row: usize) -> &mut [f64] {
        let (from, size) = (column * self.stride(), self.size);
        &mut self.values[from + row..from + size]
    }

    /// L of the first `columns` columns in their place, and A − L·Lᵀ in the rest. `false` where a pivot is not above its
    /// own `floor`.
    pub fn factor(&mut self, columns: usize, floor: &[f64]) -> bool {
        let mut from = 0;
        while from < columns {
            let to = (from + PANEL).min(columns);
            if !self.factor_panel(from, to, floor) {
                return false;
            }
            self.pack(from, to);
            self.subtract_products(to, to - from);
            from = to;
        }
        true
    }

    /// Columns `from..to`, whose earlier ones are already taken off.
    fn factor_panel(&mut self, from: usize, to: usize, floor: &[f64]) -> bool {
        let (stride, size) = (self.stride(), self.size);
        for j in from..to {
            let (left, right) = self.values.split_at_mut(j * stride);
            let own = &mut right[j..size];
            for p in from..j {
                let before = &left[p * stride + j..p * stride + size];
                let share = before[0];
                own.iter_mut().zip(before).for_each(|(own, before)| *own -= share * before);
            }
            let pivot = own[0];
            if pivot.is_nan() || pivot <= floor[j] {
                return false;
            }
            let inverse = 1.0 / pivot.sqrt();
            own.iter_mut().for_each(|own| *own *= inverse);
        }
        true
    }

    /// Rows from `to` on of columns `from..to`, in pieces.
    fn pack(&mut self, from: usize, to: usize) {
        let (stride, width) = (self.stride(), to - from);
        let pieces = (self.size - to).div_ceil(ROWS);
        self.packed.clear();
        self.packed.resize(pieces * width * ROWS, 0.0);
        for p in 0..width {
            let column = &self.values[(from + p) * stride + to..(from + p) * stride + self.size];
            for (piece, rows) in column.chunks(ROWS).enumerate() {
                let at = (piece * width + p) * ROWS;
                self.packed[at..at + rows.len()].copy_from_slice(rows);
            }
        }
    }

    /// Takes the product of the packed columns with themselves off all that lies behind them.
    fn subtract_products(&mut self, to: usize, width: usize) {
        let (stride, behind) = (self.stride(), self.size - to);
        let pieces: Vec<&[f64]> = self.packed.chunks_exact(width * ROWS).collect();
        for column in (0..behind).step_by(COLUMNS) {
            let across = pieces[column / ROWS];
            let first = column % ROWS;
            for (piece, down) in pieces.iter().enumerate().skip(column / ROWS) {
                let products = products(down, across, first);
                let row = to + piece * ROWS;
                for (c, product) in products.iter().enumerate() {
                    let at = (to + column + c) * stride + row;
                    let values = &mut self.values[at..at + ROWS];
                    values.iter_mut().zip(product).for_each(|(value, product)| *value -= product);
                }
            }
        }
    }
}

/// Rows of `down` times [`COLUMNS`] rows of `across` from `first` on, summed over the packed columns.
#[inline(always)]
fn products(down: &[f64], across: &[f64], first: usize) -> [[f64; ROWS]; COLUMNS] {
    let mut sums = [[0.0; ROWS]; COLUMNS];
    for (down, across) in down.as_chunks::<ROWS>().0.iter().zip(across.as_chunks::<ROWS>().0) {
        for (c, sums) in sums.iter_mut().enumerate() {
            let share = across[first + c];
            for (sum, down) in sums.iter_mut().zip(down) {
                *sum += share * down;
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::draw;

    /// L·Lᵀ of a random positive matrix of many sizes gives it back, and the rest is Schur's complement.
    #[test]
    fn a_product_is_factored_back() {
        for (size, columns) in [(1, 1), (7, 3), (8, 8), (61, 50), (130, 97), (200, 200)] {
            let entry = |i: usize, j: usize| {
                let (i, j) = (i.max(j), i.min(j));
                draw::uniform(3, i as u32, j as u32) - 0.5 + if i == j { size as f64 } else { 0.0 }
            };
            let mut front = Front::default();
            front.clear(size);
            for j in 0..size {
                front.column_mut(j, j).iter_mut().enumerate().for_each(|(i, value)| *value = entry(j + i, j));
            }
            assert!(front.factor(columns, &vec![0.0; columns]));
            for j in 0..size {
                for i in j..size {
                    let product: f64 =
                        (0..columns.min(j + 1)).map(|p| front.column(p, i)[0] * front.column(p, j)[0]).sum();
                    let rest = if j < columns { 0.0 } else { front.column(j, i)[0] };
                    let off = (product + rest - entry(i, j)).abs();
                    assert!(off < 1e-12 * size as f64, "{size} {columns}: {i} {j} off by {off:e}");
                }
            }
        }
    }

    #[test]
    fn a_pivot_under_its_floor_is_told() {
        let mut front = Front::default();
        front.clear(2);
        front.column_mut(0, 0).copy_from_slice(&[1.0, 2.0]);
        front.column_mut(1, 1).copy_from_slice(&[4.0]);
        assert!(!front.factor(2, &[1e-14, 4e-14]));
    }
}
