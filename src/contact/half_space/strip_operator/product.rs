//! Products of the operator between strips with tractions, in single or double precision, in the machine's lanes.

use pulp::{Simd, WithSimd};

/// How the rows of a matrix are divided, and which part of a row acts as what.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowLayout {
    /// Blocks of a row.
    pub(crate) blocks: usize,
    /// Length of a block.
    pub(crate) stride: usize,
    /// The blocks that act as `xx, a, b, yy`.
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

/// The product for one width of numbers: four running sums per row.
macro_rules! product {
    ($number:ty, $lanes:ident, $zero:ident, $multiply_add:ident, $add:ident, $sum:ident) => {
        impl WithSimd for Product<'_, $number> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) {
                let RowLayout {
                    blocks,
                    stride,
                    roles,
                } = self.layout;
                let (tx, _) = S::$lanes(self.tx);
                let ty = &S::$lanes(self.ty).0[..tx.len()];
                let rows = self.matrix.chunks_exact(blocks * stride);
                for (row, (out_x, out_y)) in rows.zip(self.out_x.iter_mut().zip(self.out_y)) {
                    let [xx, a, b, yy] =
                        roles.map(|k| &S::$lanes(&row[k * stride..(k + 1) * stride]).0[..tx.len()]);
                    let [mut s0, mut s1, mut s2, mut s3] = [simd.$zero(0.0); 4];
                    for i in 0..tx.len() {
                        s0 = simd.$multiply_add(xx[i], tx[i], s0);
                        s1 = simd.$multiply_add(a[i], ty[i], s1);
                        s2 = simd.$multiply_add(b[i], tx[i], s2);
                        s3 = simd.$multiply_add(yy[i], ty[i], s3);
                    }
                    *out_x = f64::from(simd.$sum(simd.$add(s0, s1)));
                    *out_y = f64::from(simd.$sum(simd.$add(s2, s3)));
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
