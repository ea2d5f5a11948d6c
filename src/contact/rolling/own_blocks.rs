//! Own blocks of the strips: the effect of a strip on itself, for each rule and parity.

use std::sync::{Arc, Mutex, PoisonError};

use crate::contact::half_space::strip_operator::kind::Parity;
use crate::contact::rolling::slip_equations::SlipEquations;
use crate::contact::rolling::slip_rules::Rule;

/// Own blocks of the operator, fixed for a rule and mesh.
#[derive(Debug)]
pub struct OwnBlocks {
    /// `M_xx` and `M_yy` of every segment, column by column.
    pub(crate) blocks: Vec<(Vec<f64>, Vec<f64>)>,
}

impl OwnBlocks {
    /// Collects the blocks.
    #[must_use]
    pub fn new(equations: &SlipEquations) -> OwnBlocks {
        OwnBlocks {
            blocks: (0..equations.segments())
                .map(|j| equations.own_block(j))
                .collect(),
        }
    }

    /// Bytes of the blocks.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let numbers = self.blocks.iter().map(|(xx, yy)| xx.len() + yy.len());
        8 * numbers.sum::<usize>() as u64
    }

    /// `−(M_xx + M_yy)/2` on the diagonal, cell by cell.
    #[must_use]
    pub fn diagonal(&self, equations: &SlipEquations) -> Vec<f64> {
        let mut diagonal = vec![0.0; equations.cells()];
        for (j, (xx, yy)) in self.blocks.iter().enumerate() {
            let n = equations.segment(j).len();
            for (k, i) in equations.segment(j).enumerate() {
                diagonal[i] = -0.5 * (xx[k * n + k] + yy[k * n + k]);
            }
        }
        diagonal
    }
}

/// Bytes of all own blocks that an operator may get, of segments with these numbers of cells: three rules, and if half of the
/// influence is enough, two parities of one half each beside both together.
#[must_use]
pub fn bytes_max(lengths: impl Iterator<Item = usize>, folded: bool) -> u64 {
    let one: usize = lengths.map(|n| 2 * n * n).sum();
    let parities = if folded { 2 } else { 1 };
    8 * 3 * parities * one as u64
}

/// The own blocks of one rule and parity.
type Made = (Rule, Option<Parity>, Arc<OwnBlocks>);

/// The own blocks of a level, made once for each rule and parity.
#[derive(Debug, Default)]
pub struct SharedBlocks {
    made: Mutex<Vec<Made>>,
}

impl SharedBlocks {
    /// The blocks of a rule and parity; `make` is called if they are not there.
    pub fn get(
        &self,
        rule: Rule,
        parity: Option<Parity>,
        make: impl FnOnce() -> OwnBlocks,
    ) -> Arc<OwnBlocks> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, _, blocks)) = made.iter().find(|m| (m.0, m.1) == (rule, parity)) {
            return Arc::clone(blocks);
        }
        let blocks = Arc::new(make());
        made.push((rule, parity, Arc::clone(&blocks)));
        blocks
    }
}
