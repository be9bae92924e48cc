//! LDLᵀ factorisation of the joint-space inertia, to solve for joint accelerations.

use super::lanes::Lanes;
use crate::model::DOFS;

/// The factors `L D Lᵀ` of a symmetric positive definite matrix: L is lower triangular with ones on its diagonal, D diagonal.
#[derive(Debug, Clone, Copy)]
pub struct Ldlt<T> {
    /// Strictly lower triangle: L (unit diagonal). The diagonal holds 1 / D.
    l: [[T; DOFS]; DOFS],
}

impl<T: Lanes> Ldlt<T> {
    /// Factorises a matrix given by its lower triangle.
    #[inline(always)]
    pub fn new(matrix: &[[T; DOFS]; DOFS]) -> Self {
        let mut l = *matrix;
        let one = T::splat(1.0);
        for j in 0..DOFS {
            // Row j of L·D, left of the diagonal.
            let mut scaled = [one; DOFS];
            let mut pivot = l[j][j];
            for k in 0..j {
                scaled[k] = l[j][k];
                // l[j][k] still holds L·D; divide by D now.
                let unit = l[j][k] * l[k][k];
                pivot -= scaled[k] * unit;
                l[j][k] = unit;
            }
            l[j][j] = one / pivot;
            for i in j + 1..DOFS {
                let mut sum = l[i][j];
                for k in 0..j {
                    sum -= l[i][k] * l[j][k];
                }
                l[i][j] = sum;
            }
        }
        Self { l }
    }

    /// Solves `matrix · x = rhs` for x.
    #[inline(always)]
    pub fn solve(&self, rhs: &[T; DOFS]) -> [T; DOFS] {
        let l = &self.l;
        let mut x = *rhs;
        for i in 0..DOFS {
            for k in 0..i {
                x[i] -= l[i][k] * x[k];
            }
        }
        for i in 0..DOFS {
            x[i] = x[i] * l[i][i];
        }
        for i in (0..DOFS).rev() {
            for k in i + 1..DOFS {
                x[i] -= l[k][i] * x[k];
            }
        }
        x
    }
}
