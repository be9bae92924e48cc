//! The binomial distribution with probability ½, as the paired tests need it.

/// The distribution of the number of heads K in `n` fair coin tosses.
#[derive(Debug)]
pub(crate) struct SymmetricBinomial {
    /// `pmf[k]` = P(K = k), k from 0 to n.
    pmf: Vec<f64>,
    /// `tail[k]` = P(K ≥ k), k from 0 to n + 1.
    tail: Vec<f64>,
}

impl SymmetricBinomial {
    pub(crate) fn new(n: u32) -> Self {
        let n = n as usize;
        // First the binomial coefficients C(n, k), divided by the largest one, C(n, n / 2), from the middle outwards.
        // Quotients below 1e-308 underflow to 0, which does not matter.
        let mut pmf = vec![0.0; n + 1];
        let middle = n / 2;
        pmf[middle] = 1.0;
        for k in (0..middle).rev() {
            pmf[k] = pmf[k + 1] * (k + 1) as f64 / (n - k) as f64;
        }
        for k in middle + 1..=n {
            pmf[k] = pmf[n - k];
        }
        let total: f64 = pmf.iter().sum();
        for probability in &mut pmf {
            *probability /= total;
        }
        let mut tail = vec![0.0; n + 2];
        for k in (0..=n).rev() {
            tail[k] = tail[k + 1] + pmf[k];
        }
        Self { pmf, tail }
    }

    /// P(K = k) for k = 0, 1, … n.
    pub(crate) fn probabilities(&self) -> impl Iterator<Item = f64> + '_ {
        self.pmf.iter().copied()
    }

    /// P(K ≥ k); 1 for a negative k, 0 beyond n.
    pub(crate) fn at_least(&self, k: i128) -> f64 {
        match usize::try_from(k) {
            Err(_) if k < 0 => 1.0,
            Err(_) => 0.0,
            Ok(k) => self.tail.get(k).copied().unwrap_or(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Binomial, DiscreteCDF};

    #[test]
    fn tails_agree_with_exact_integers() {
        for n in 0..=60u32 {
            let tosses = SymmetricBinomial::new(n);
            let mut coefficient: u128 = 1; // C(n, k), first for k = n
            let mut tail: u128 = 0;
            for k in (0..=n).rev() {
                tail += coefficient;
                let exact = tail as f64 / 2f64.powi(n as i32);
                let got = tosses.at_least(i128::from(k));
                assert!(
                    (got - exact).abs() <= 1e-13 * exact,
                    "n = {n}, k = {k}: {got} / {exact}"
                );
                coefficient = coefficient * u128::from(k) / u128::from(n - k + 1);
            }
        }
    }

    #[test]
    fn tails_agree_with_statrs() {
        for n in [100u32, 999, 2000] {
            let tosses = SymmetricBinomial::new(n);
            let reference = Binomial::new(0.5, u64::from(n)).unwrap();
            for k in (1..=n).step_by(7) {
                let got = tosses.at_least(i128::from(k));
                let want = reference.sf(u64::from(k) - 1);
                assert!(
                    (got - want).abs() < 1e-10,
                    "n = {n}, k = {k}: {got} / {want}"
                );
            }
        }
    }

    #[test]
    fn tails_beyond_range_are_one_or_zero() {
        let tosses = SymmetricBinomial::new(3);
        assert_eq!(tosses.at_least(-1), 1.0);
        assert_eq!(tosses.at_least(4), 0.0);
        assert_eq!(tosses.at_least(i128::MAX), 0.0);
        assert_eq!(SymmetricBinomial::new(0).at_least(0), 1.0);
    }
}
