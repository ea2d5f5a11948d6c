//! Counts for which motions `liu_hsu` converges, with the same motions on every region.

use railhead_contact::mesh::Grading;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::methods::liu_hsu::active_set::{
    InitialGuess, ZonesRun, ZonesTermination,
};
use railhead_contact::rolling::methods::liu_hsu::solve::{coarse_pole, solve, solve_with};
use railhead_contact::rolling::slip_rules::Rule;

use crate::regions::{Contact, Region, motion};

/// Returns 218 normalised motions: creepage 0 to 3 in four directions, spin 0 to 20.
pub fn motions() -> Vec<[f64; 3]> {
    let root = std::f64::consts::FRAC_1_SQRT_2;
    let mut motions = Vec::new();
    for spin in [0.0, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0] {
        if spin > 0.0 {
            motions.push([0.0, 0.0, spin]);
        }
        for size in [0.1, 0.3, 0.6, 1.0, 2.0, 3.0] {
            for [x, y] in [[1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [root, root]] {
                // Without spin, the third direction is the mirror image of the second.
                if spin > 0.0 || y >= 0.0 {
                    motions.push([size * x, size * y, spin]);
                }
            }
        }
    }
    motions
}

/// Numbers of motions that converged, and how the others ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counts {
    pub motions: usize,
    /// Motions that converge from guess 1 alone.
    pub guess_1: usize,
    /// Motions that converge from guess 2 alone, about the pole of a coarse mesh. Without spin there is no guess 2, and guess 1 counts.
    pub guess_2: usize,
    /// Motions that converge from guess 1 or else guess 2, as in the paper.
    pub paper: usize,
    /// Motions that converge with the complete method: the paper's guesses, then a start from tractions of the boundary element method.
    pub shipped: usize,
    /// Failures of each of the two guesses: Newton–Raphson divergence, repeating zones, other.
    pub failures: [[usize; 3]; 2],
    /// Divisions and Newton–Raphson steps of the converged runs of each guess.
    pub work: [[u32; 2]; 2],
}

impl Counts {
    /// Returns one row of the table.
    pub fn row(&self) -> String {
        let per_run = |k: usize, runs: usize| {
            let [outer, newton] = self.work[k].map(|w| f64::from(w) / runs.max(1) as f64);
            let [diverged, repeated, other] = self.failures[k];
            format!("{outer:.1} + {newton:.1}, {diverged}/{repeated}/{other}")
        };
        format!(
            "{:3} | {:3} | {:3} | {:3} of {} | {} | {}",
            self.guess_1,
            self.guess_2,
            self.paper,
            self.shipped,
            self.motions,
            per_run(0, self.guess_1),
            per_run(1, self.guess_2),
        )
    }
}

/// Runs every guess alone on each motion. The coarse mesh has at most 25 cells.
pub fn count(region: Region, rule: Rule, mesh: (usize, &Grading), motions: &[[f64; 3]]) -> Counts {
    let per_patch = |strips: usize| {
        if region == Region::TwoCircles {
            strips / 2
        } else {
            strips
        }
    };
    let fine = Contact::new(region, per_patch(mesh.0), mesh.1);
    let coarse = Contact::new(region, per_patch(5), &Grading::uniform(5));
    let (on_fine, on_coarse) = (fine.equations(rule), coarse.equations(rule));
    let mut counts = Counts {
        motions: motions.len(),
        ..Counts::default()
    };
    let mut t = vec![0.0; 2 * on_fine.padded()];
    for state in motions {
        let motion = motion(*state);
        let (rigid, rigid_coarse) = (on_fine.rigid(&motion), on_coarse.rigid(&motion));
        let stage = fine.stage(&on_fine, &rigid, motion, 1e-8);
        let first_stage = coarse.stage(&on_coarse, &rigid_coarse, motion, 1e-8);
        let pole = coarse_pole(&first_stage, &Unmonitored).unwrap();
        let mut converges = [false; 2];
        for (k, guess) in [
            InitialGuess::RigidSlip,
            pole.map_or(InitialGuess::RigidSlip, InitialGuess::SpinPole),
        ]
        .into_iter()
        .enumerate()
        {
            t.fill(0.0);
            let outcome = solve_with(&stage, guess, &mut t, &Unmonitored).unwrap();
            converges[k] = outcome.exit().converged();
            counts.note(k, outcome.last());
        }
        counts.guess_1 += usize::from(converges[0]);
        counts.guess_2 += usize::from(converges[1]);
        let paper = converges[0] || converges[1];
        counts.paper += usize::from(paper);
        let shipped = paper
            || solve(&stage, None, &mut t, &Unmonitored)
                .unwrap()
                .exit()
                .converged();
        counts.shipped += usize::from(shipped);
    }
    counts
}

impl Counts {
    fn note(&mut self, k: usize, attempt: &ZonesRun) {
        match attempt.exit {
            ZonesTermination::Converged => {
                self.work[k][0] += attempt.outer_iterations;
                self.work[k][1] += attempt.newton_iterations;
            }
            ZonesTermination::NewtonDiverged => self.failures[k][0] += 1,
            ZonesTermination::ZonesRepeat => self.failures[k][1] += 1,
            _ => self.failures[k][2] += 1,
        }
    }
}
