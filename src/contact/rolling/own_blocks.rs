//! Own blocks of the strips: the effect of a strip on itself, for each rule and parity.

use std::sync::{Arc, Mutex, PoisonError};

use crate::contact::half_space::strip_operator::kind::Parity;
use crate::contact::rolling::slip_equations::SlipEquations;
use crate::contact::rolling::slip_rules::Rule;

/// Own blocks of the operator, fixed for a rule and mesh.
#[derive(Debug)]
pub struct OwnBlocks {
    /// `M_xx` of every segment, column by column, one segment after the other.
    xx: Vec<f64>,
    /// `M_yy`, likewise.
    yy: Vec<f64>,
    /// Start of each segment's block, and one more.
    starts: Vec<usize>,
}

impl OwnBlocks {
    /// Collects the blocks.
    #[must_use]
    pub fn new(equations: &SlipEquations) -> OwnBlocks {
        let mut starts = Vec::with_capacity(equations.segments() + 1);
        starts.push(0);
        for j in 0..equations.segments() {
            starts.push(starts[j] + equations.segment(j).len().pow(2));
        }
        let length = starts[equations.segments()];
        let (mut xx, mut yy) = (vec![0.0; length], vec![0.0; length]);
        let mut differences = [Vec::new(), Vec::new()];
        for (j, range) in starts.windows(2).enumerate() {
            let (xx, yy) = (&mut xx[range[0]..range[1]], &mut yy[range[0]..range[1]]);
            equations.own_block(j, [xx, yy], &mut differences);
        }
        OwnBlocks { xx, yy, starts }
    }

    /// `M_xx` and `M_yy` of every segment, column by column.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (&[f64], &[f64])> {
        let ranges = self.starts.windows(2).map(|range| range[0]..range[1]);
        ranges.map(|range| (&self.xx[range.clone()], &self.yy[range]))
    }

    /// Bytes of the blocks.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        8 * (self.xx.len() + self.yy.len()) as u64
    }

    /// `−(M_xx + M_yy)/2` on the diagonal, cell by cell.
    #[must_use]
    pub fn diagonal(&self, equations: &SlipEquations) -> Vec<f64> {
        let mut diagonal = vec![0.0; equations.cells()];
        for (j, (xx, yy)) in self.blocks().enumerate() {
            let n = equations.segment(j).len();
            for (k, i) in equations.segment(j).enumerate() {
                diagonal[i] = -0.5 * (xx[k * n + k] + yy[k * n + k]);
            }
        }
        diagonal
    }
}

/// Bytes of all own blocks that an operator may get, for segments with these numbers of cells: one set for each of the three rules. A
/// folded operator has a second set for each, one half of it for either parity. Blocks of a contact with a layer come on top.
#[must_use]
pub fn bytes_max(lengths: impl Iterator<Item = usize>, folded: bool) -> u64 {
    let one: usize = lengths.map(|n| 2 * n * n).sum();
    let parities = if folded { 2 } else { 1 };
    8 * 3 * parities * one as u64
}

/// What own blocks depend on besides the operator: rule, parity and the bits of the flexibility of a layer.
type Kind = (Rule, Option<Parity>, u64);

/// The own blocks of a level, made once for each rule and parity.
#[derive(Debug, Default)]
pub struct SharedBlocks {
    made: Mutex<Vec<(Kind, Arc<OwnBlocks>)>>,
}

impl SharedBlocks {
    /// The blocks of a rule and parity with a layer of this flexibility; `make` is called if they are not there. Of layers only the last
    /// is kept.
    pub fn get(
        &self,
        rule: Rule,
        parity: Option<Parity>,
        layer: f64,
        make: impl FnOnce() -> OwnBlocks,
    ) -> Arc<OwnBlocks> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        let kind = (rule, parity, layer.to_bits());
        if let Some((_, blocks)) = made.iter().find(|(made, _)| *made == kind) {
            return Arc::clone(blocks);
        }
        let blocks = Arc::new(make());
        made.retain(|((other, of, bits), _)| {
            (*other, *of, *bits == 0) != (rule, parity, layer == 0.0)
        });
        made.push((kind, Arc::clone(&blocks)));
        blocks
    }
}
