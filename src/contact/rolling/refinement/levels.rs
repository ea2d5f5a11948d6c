//! Which meshes a case climbs: sizes from the number of cells and the shape of the patch, made once and shared by all
//! motions.

use std::sync::Arc;

use crate::contact::case::problem::{Problem, Resolution};
use crate::contact::case::words::{MeshSize, Method};
use crate::contact::error::SolveError;
use crate::contact::rolling::methods::fastsim;
use crate::contact::rolling::operator_store::{CaseOperators, OperatorStore};
use crate::contact::rolling::refinement::warm_start::Trail;
use crate::contact::rolling::strip_mesh::Level;

/// Cells of the first level of a patch that is not slender.
pub const CELLS_FIRST: f64 = 64.0;
/// Cells of the finest level a target may ask for.
pub const CELLS_MAX: u32 = 2048;
/// Fewest strips, and cells in one, that the rules are good for; twice as many in slender patches.
const SIDE_MIN: f64 = 4.0;
/// Patches longer than this many times their width, or the reverse, are slender.
const SLENDER: f64 = 5.0;

/// A mesh serves as long as the pole is this near to where the cells gather: within the bump of their density.
const POLE_MOVED: f64 = 0.15;
/// Places of poles are rounded to multiples of this.
const POLE_GRID: f64 = 0.05;

/// What the tractions of a motion look like, as far as the mesh should know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regime {
    /// Nothing is known yet.
    Unknown,
    /// A stick zone of some size; with spin in a patch that is longer than wide (others do not care).
    Sticking {
        /// There is spin, and the patch is longer than wide.
        spinning: bool,
    },
    /// Hardly any stick, and tractions that turn about a place in the patch: along its chord and across the patch,
    /// each from −1 to 1.
    Spinning([f64; 2]),
}

impl Regime {
    /// Cells along a strip divided by strips, for a patch of half-length a and half-width b. Factors and exponents lie on
    /// flat optima over 62 Hertz contacts with a/b from 0.2 to 5; with spin and stick in a long patch, over 14 random ellipses
    /// with a/b > 5 on 500 cells: error .0007, half of that with the exponent 0.3.
    fn shape(self, a_over_b: f64) -> f64 {
        match self {
            Regime::Unknown => 1.25 * a_over_b.powf(0.45),
            Regime::Sticking { spinning: true } => 1.3,
            Regime::Sticking { spinning: false } => 1.3 * a_over_b.powf(0.3),
            Regime::Spinning(_) => 0.85 * a_over_b.powf(0.4),
        }
    }
}

/// What a level is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Strips and cells.
    pub size: MeshSize,
    /// What it was made for.
    pub regime: Regime,
}

impl Plan {
    /// Where cells and strips gather, if anywhere.
    #[must_use]
    pub fn pole(&self) -> Option<[f64; 2]> {
        match self.regime {
            Regime::Spinning(pole) => Some(pole),
            Regime::Unknown | Regime::Sticking { .. } => None,
        }
    }

    /// Does the mesh serve a regime that was found on it?
    #[must_use]
    pub fn serves(&self, found: Regime) -> bool {
        match (self.regime, found) {
            (Regime::Sticking { .. }, Regime::Sticking { .. }) => true,
            (Regime::Spinning(made), Regime::Spinning(found)) => {
                (made[0] - found[0]).hypot(made[1] - found[1]) < POLE_MOVED
            }
            _ => false,
        }
    }

    /// Do the meshes of two plans differ in size only, so that the change between them tells what is left?
    #[must_use]
    pub fn is_like(&self, other: &Plan) -> bool {
        match (self.regime, other.regime) {
            (Regime::Sticking { .. }, Regime::Sticking { .. })
            | (Regime::Spinning(_), Regime::Spinning(_)) => self.size.strips != other.size.strips,
            _ => false,
        }
    }
}

impl From<MeshSize> for Plan {
    fn from(size: MeshSize) -> Self {
        let regime = Regime::Unknown;
        Plan { size, regime }
    }
}

/// Levels that are kept from one motion to the next: a few paths of about four levels. Sweeps come back to levels of the last few
/// motions only; of a creep map of 900 motions at fixed spin, half as many make no difference.
pub const LEVELS_KEPT: usize = 32;

/// The levels of a case that exist; the least recently used are dropped between motions.
#[derive(Debug)]
pub struct Ladder<'a> {
    problem: &'a Problem,
    operators: Arc<CaseOperators>,
    /// With their numbers, which are never given twice, in the order of their last use.
    levels: Vec<(usize, Level)>,
    made: usize,
    /// What the motions solved so far left on the levels.
    pub trail: Trail,
    /// The levels that the last motion climbed.
    pub path: Vec<usize>,
    /// Where the next motion of a sweep may begin.
    pub begin: Option<Plan>,
    /// Length over width of the patch that carries most.
    a_over_b: f64,
    patches: f64,
}

impl<'a> Ladder<'a> {
    /// No levels yet; their operators come from a store.
    #[must_use]
    pub fn new(problem: &'a Problem, store: &Arc<OperatorStore>) -> Ladder<'a> {
        let patches = problem.region.patches();
        let heaviest = patches
            .iter()
            .max_by(|a, b| a.normal_force.total_cmp(&b.normal_force));
        let a_over_b = heaviest.map_or(1.0, |p| {
            (p.extent[1] - p.extent[0]) / (p.extent[3] - p.extent[2])
        });
        Ladder {
            problem,
            operators: CaseOperators::new(store),
            levels: Vec::new(),
            made: 0,
            trail: Trail::default(),
            path: Vec::new(),
            begin: None,
            a_over_b,
            patches: patches.len() as f64,
        }
    }

    /// How many times more slender the patch is than the meshes were made for; at least 1.
    #[must_use]
    pub fn slenderness(&self) -> f64 {
        (self.a_over_b.max(1.0 / self.a_over_b) / SLENDER).max(1.0)
    }

    /// Cells of the first level.
    #[must_use]
    pub fn cells_first(&self) -> f64 {
        CELLS_FIRST * self.slenderness().sqrt().min(2.0)
    }

    /// The sizes that a method always takes: the mesh of the client, else the two levels of the dense method or the one of
    /// the simplified theory.
    #[must_use]
    pub fn fixed_sizes(resolution: Resolution, method: Method) -> Option<Vec<MeshSize>> {
        let size = |strips, cells| MeshSize { strips, cells };
        match (resolution, method) {
            (Resolution::Mesh(size), Method::LiuHsu | Method::Fastsim) => Some(vec![size]),
            (Resolution::Mesh(_), _) => None,
            (Resolution::Target(_), Method::LiuHsu) => Some(vec![size(6, 12), size(12, 24)]),
            (Resolution::Target(_), Method::Fastsim) => Some(vec![fastsim::MESH]),
            (Resolution::Target(_), _) => None,
        }
    }

    /// The plan with about so many cells over all patches, an even number of strips, and a pole where the tractions turn
    /// about one. Poles lie on a grid, so that motions that differ little share their levels.
    #[must_use]
    pub fn plan(&self, cells: u32, regime: Regime) -> Plan {
        let regime = match regime {
            Regime::Spinning(pole) if self.patches == 1.0 => {
                Regime::Spinning(pole.map(|p| (p / POLE_GRID).round() * POLE_GRID))
            }
            Regime::Spinning(_) => Regime::Sticking { spinning: true },
            Regime::Unknown | Regime::Sticking { .. } => regime,
        };
        let regime = match regime {
            Regime::Sticking { spinning } => Regime::Sticking {
                spinning: spinning && self.a_over_b > 1.0,
            },
            other => other,
        };
        Plan {
            size: self.size(cells, regime),
            regime,
        }
    }

    fn size(&self, cells: u32, regime: Regime) -> MeshSize {
        let cells = f64::from(cells) / self.patches;
        let shape = regime.shape(self.a_over_b);
        let least = SIDE_MIN * self.slenderness().min(2.0);
        let strips =
            (2.0 * (0.5 * (cells / shape).sqrt().max(least)).round()).min(cells.max(least));
        let along = (cells / strips).round().max(least);
        MeshSize {
            strips: strips as u32,
            cells: along as u32,
        }
    }

    /// The number of the level of this plan; it is made if it is not there.
    ///
    /// # Errors
    /// If no strip meets a patch.
    pub fn level(&mut self, plan: Plan) -> Result<usize, SolveError> {
        if let Some(place) = self.levels.iter().position(|(_, level)| level.plan == plan) {
            // The last used stand last.
            self.levels[place..].rotate_left(1);
            return Ok(self.levels[self.levels.len() - 1].0);
        }
        let operators = Arc::clone(&self.operators);
        let level = Level::with_operators(self.problem, plan, operators)?;
        self.levels.push((self.made, level));
        self.made += 1;
        Ok(self.made - 1)
    }

    /// A level by its number; it must have been used since the last [`Ladder::trim`], or lie on the path.
    #[must_use]
    pub fn get(&self, level: usize) -> &Level {
        let found = self
            .levels
            .iter()
            .rev()
            .find(|(number, _)| *number == level);
        let Some((_, level)) = found else {
            unreachable!("level {level} was dropped while it was in use")
        };
        level
    }

    /// Drops the least recently used levels beyond [`LEVELS_KEPT`], and what motions left on them. Called between motions: no answer
    /// may refer to a level by its number after that.
    pub fn trim(&mut self) {
        let surplus = self.levels.len().saturating_sub(LEVELS_KEPT);
        let dropped = self.levels.drain(..surplus).map(|(number, _)| number);
        for number in dropped {
            self.trail.forget(number);
            self.path.retain(|on_path| *on_path != number);
        }
    }
}
