//! The stored numbers of the operator between strips. Only this file asks whether they are in single or double precision.

use pulp::WithSimd;

use crate::contact::half_space::strip_operator::assembly::OperatorAssembly;
use crate::contact::half_space::strip_operator::kind::Precision;
use crate::contact::half_space::strip_operator::product::{Product, RowLayout};
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::numerics::simd;

/// The stored numbers.
#[derive(Debug, Clone)]
pub(crate) enum Matrix {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl Matrix {
    /// Computes the rows of an operator.
    ///
    /// # Errors
    /// The monitor stopped the work.
    pub(crate) fn of_rows(
        assembly: &OperatorAssembly,
        precision: Precision,
        monitor: &dyn Monitor,
    ) -> Result<Matrix, Stop> {
        match precision {
            Precision::Single => assembly.matrix(monitor).map(Matrix::Single),
            Precision::Double => assembly.matrix(monitor).map(Matrix::Double),
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        match self {
            Matrix::Single(matrix) => size_of_val(&matrix[..]),
            Matrix::Double(matrix) => size_of_val(&matrix[..]),
        }
    }

    pub(crate) fn at(&self, place: usize) -> f64 {
        match self {
            Matrix::Single(matrix) => f64::from(matrix[place]),
            Matrix::Double(matrix) => matrix[place],
        }
    }

    /// The [`Product`] of all rows with tractions along x and across, which are narrowed first where the numbers are.
    pub(crate) fn multiply(
        &self,
        layout: RowLayout,
        tractions: [&[f64]; 2],
        out: [&mut [f64]; 2],
        narrow: &mut [Vec<f32>; 2],
    ) {
        match self {
            Matrix::Single(matrix) => {
                for (narrow, values) in narrow.iter_mut().zip(tractions) {
                    narrow.clear();
                    narrow.extend(values.iter().map(|v| *v as f32));
                }
                let [tx, ty] = narrow;
                multiply(matrix, layout, [tx, ty], out);
            }
            Matrix::Double(matrix) => multiply(matrix, layout, tractions, out),
        }
    }
}

/// The product with numbers of one width.
fn multiply<'a, T>(
    matrix: &'a [T],
    layout: RowLayout,
    [tx, ty]: [&'a [T]; 2],
    [out_x, out_y]: [&'a mut [f64]; 2],
) where
    Product<'a, T>: WithSimd<Output = ()>,
{
    simd::dispatch(Product {
        matrix,
        layout,
        tx,
        ty,
        out_x,
        out_y,
    });
}
