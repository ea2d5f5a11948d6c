//! Products of the strip operator with tractions, in single or double precision, in SIMD lanes.

use pulp::{Simd, WithSimd};

/// Returns the number of blocks of a row; `folded` if two mirror images share it.
pub(crate) fn blocks(folded: bool) -> usize {
    if folded { 6 } else { 3 }
}

/// The division of the rows of a matrix into blocks, and the roles of the blocks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowLayout {
    /// Number of blocks of a row.
    pub(crate) blocks: usize,
    /// Length of a block.
    pub(crate) stride: usize,
    /// The blocks for `xx, a, b, yy`.
    pub(crate) roles: [usize; 4],
}

/// A product with all rows: `out_x = xx tx + a ty`, `out_y = b tx + yy ty`.
pub(crate) struct Product<'a, T> {
    pub(crate) matrix: &'a [T],
    pub(crate) layout: RowLayout,
    pub(crate) tx: &'a [T],
    pub(crate) ty: &'a [T],
    pub(crate) out_x: &'a mut [f64],
    pub(crate) out_y: &'a mut [f64],
}

/// The product for one precision, with four running sums per row and two rows at once, so that sums do not wait for each other.
macro_rules! product {
    ($number:ty, $lanes:ident, $zero:ident, $multiply_add:ident, $add:ident, $sum:ident) => {
        impl Product<'_, $number> {
            /// The products with `ROWS` rows of the matrix.
            #[inline(always)]
            fn rows<S: Simd, const ROWS: usize>(
                &self,
                simd: S,
                rows: &[$number],
            ) -> [[f64; 2]; ROWS] {
                let RowLayout {
                    blocks,
                    stride,
                    roles,
                } = self.layout;
                let (tx, _) = S::$lanes(self.tx);
                let ty = &S::$lanes(self.ty).0[..tx.len()];
                let mut parts = [[tx; 4]; ROWS];
                for (row, parts) in parts.iter_mut().enumerate() {
                    for (part, role) in parts.iter_mut().zip(roles) {
                        let start = (row * blocks + role) * stride;
                        *part = &S::$lanes(&rows[start..start + stride]).0[..tx.len()];
                    }
                }
                let mut sums = [[simd.$zero(0.0); 4]; ROWS];
                for i in 0..tx.len() {
                    for (sums, [xx, a, b, yy]) in sums.iter_mut().zip(&parts) {
                        sums[0] = simd.$multiply_add(xx[i], tx[i], sums[0]);
                        sums[1] = simd.$multiply_add(a[i], ty[i], sums[1]);
                        sums[2] = simd.$multiply_add(b[i], tx[i], sums[2]);
                        sums[3] = simd.$multiply_add(yy[i], ty[i], sums[3]);
                    }
                }
                let mut found = [[0.0; 2]; ROWS];
                for (found, [s0, s1, s2, s3]) in found.iter_mut().zip(sums) {
                    found[0] = f64::from(simd.$sum(simd.$add(s0, s1)));
                    found[1] = f64::from(simd.$sum(simd.$add(s2, s3)));
                }
                found
            }
        }

        impl WithSimd for Product<'_, $number> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) {
                let length = self.layout.blocks * self.layout.stride;
                let count = self.matrix.len() / length;
                for k in (0..count / 2).map(|k| 2 * k) {
                    let rows = &self.matrix[k * length..(k + 2) * length];
                    let [first, second] = self.rows::<S, 2>(simd, rows);
                    [self.out_x[k], self.out_y[k]] = first;
                    [self.out_x[k + 1], self.out_y[k + 1]] = second;
                }
                if count % 2 == 1 {
                    let k = count - 1;
                    let [last] = self.rows::<S, 1>(simd, &self.matrix[k * length..count * length]);
                    [self.out_x[k], self.out_y[k]] = last;
                }
            }
        }
    };
}

product!(
    f32,
    as_simd_f32s,
    splat_f32s,
    mul_add_e_f32s,
    add_f32s,
    reduce_sum_f32s
);
product!(
    f64,
    as_simd_f64s,
    splat_f64s,
    mul_add_e_f64s,
    add_f64s,
    reduce_sum_f64s
);
