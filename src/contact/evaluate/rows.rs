//! Evaluates rows without meshes: the Hertz ellipse of each, and its creep forces by the table or by FASTSIM.

use std::convert::Infallible;
use std::f64::consts::PI;

use serde_json::Value;

use crate::case::contact_task::plausible;
use crate::case::words::friction::COEFFICIENT_LEAST;
use crate::case::words::solver::{MethodName, Output};
use crate::evaluate::answer::{RowAnswer, RowNumbers, RowStatus, RowsAnswer};
use crate::evaluate::variable::{Row, Variable};
use crate::evaluate::varied::{Values, VariedColumn};
use crate::normal::hertz::{Ellipse, HertzShape};
use crate::problem::checked_case::CheckedCase;
use crate::rolling::methods::fastsim::{self, EllipseMesh};
use crate::rolling::methods::table::evaluate::{Creep, EllipseTable};
use crate::rolling::methods::table::file::table;
use crate::rolling::methods::table::solve::RATIO_RANGE;
use crate::rolling::refinement::gradients::{STEP, slope};
use crate::rolling::task::{RelativeTo, Resolution};

/// Rows that can be evaluated without meshes.
#[derive(Debug)]
pub struct Rows<'a> {
    rows: usize,
    /// The numbers that all rows share.
    fixed: Row,
    varied: Vec<(Variable, &'a [f64])>,
    /// Combined shear modulus in MPa and Poisson's ratio, if the bodies have separate materials.
    pair: Option<[f64; 2]>,
    /// Whether the case gives Young's modulus.
    young: bool,
    /// Kalker's reduction factor; 1 for clean surfaces.
    reduction: f64,
    /// Whether the case gives radii rather than semi-axes.
    radii: bool,
    method: RowMethod,
    target: Option<f64>,
    relative_to: RelativeTo,
    gradients: bool,
}

#[derive(Debug)]
enum RowMethod {
    /// The table. If `auto` chose it, rows above the target are left to the solver.
    Table { auto: bool },
    /// FASTSIM with its mesh and its stated error.
    Fastsim(Box<EllipseMesh>, f64),
}

impl<'a> Rows<'a> {
    /// Returns the rows of a case; `None` if they need the solver. `case` is that of the first row, and `checked` its checked form.
    pub fn new(
        case: &Value,
        checked: &CheckedCase,
        columns: &'a [VariedColumn],
    ) -> Option<Rows<'a>> {
        if !is_plain(case, checked) {
            return None;
        }
        let rows = columns.first().map_or(1, |column| column.values.len());
        let of_bodies = case.pointer("/material/lower").is_some();
        let varied = columns.iter().map(|column| {
            let variable = Variable::at(&column.pointer)?;
            let Values::Numbers(numbers) = &column.values else {
                return None;
            };
            let allowed = variable.allowed();
            let good = numbers.len() == rows
                && numbers.iter().all(|number| allowed.contains(*number))
                && !(of_bodies && column.pointer.starts_with("/material"));
            good.then_some((variable, &numbers[..]))
        });
        let varied = varied.collect::<Option<Vec<_>>>()?;
        let mut fixed = [f64::NAN; 12];
        for variable in Variable::all() {
            let number = case.pointer(variable.pointer()).and_then(Value::as_f64);
            fixed[variable as usize] = number.unwrap_or(variable.absent());
        }
        let method = method_of(checked)?;
        let elasticity = &checked.problem.elasticity;
        let given = |variable: Variable| case.pointer(variable.pointer()).is_some();
        Some(Rows {
            rows,
            fixed,
            varied,
            pair: (!given(Variable::PoissonRatio))
                .then_some([elasticity.shear_modulus, elasticity.poisson_ratio]),
            young: given(Variable::YoungModulus),
            reduction: checked.problem.interface.reduction,
            radii: given(Variable::Rolling),
            method,
            target: checked.run.resolution.target(),
            relative_to: checked.run.relative_to,
            gradients: checked.run.wants(Output::Gradients),
        })
    }

    /// Evaluates the rows.
    pub fn evaluate(&self) -> RowsAnswer {
        let Ok(answer) = self.evaluate_to(|| Ok::<_, Infallible>(()));
        answer
    }

    /// Evaluates the rows. `step` is called after each row and may end the evaluation.
    ///
    /// # Errors
    /// The error that `step` returned.
    pub(crate) fn evaluate_to<E>(
        &self,
        mut step: impl FnMut() -> Result<(), E>,
    ) -> Result<RowsAnswer, E> {
        let mut answer = RowsAnswer::with_capacity(self.rows, self.gradients);
        for row in self.answers() {
            answer.push(row);
            step()?;
        }
        Ok(answer)
    }

    /// Returns the answers to the rows in order. A row with a number that is not finite has no answer.
    pub fn answers(&self) -> impl Iterator<Item = RowAnswer> {
        let mut shapes = Shapes::default();
        (0..self.rows).map(move |number| {
            let mut row = self.fixed;
            for (variable, values) in &self.varied {
                row[*variable as usize] = values[number];
            }
            let answer = self.answer_row(&row, &mut shapes);
            answer.finite(self.gradients)
        })
    }

    fn answer_row(&self, row: &Row, shapes: &mut Shapes) -> RowAnswer {
        let at = |variable: Variable| row[variable as usize];
        let [modulus, poisson] = self.material(row);
        let (force, friction) = (at(Variable::NormalForce), at(Variable::Friction));
        let [a, b] = if self.radii {
            let radii = [at(Variable::Rolling), at(Variable::Lateral)];
            let shape = shapes.hertz(radii);
            shape.semi_axes(force, modulus / (1.0 - poisson))
        } else {
            [at(Variable::SemiAxisA), at(Variable::SemiAxisB)]
        };
        let patch = RowPatch {
            force,
            limit: friction * force,
            c: (a * b).sqrt(),
            ratio: a / b,
            modulus: self.reduction * modulus,
            poisson,
        };
        let ellipse = Ellipse {
            a,
            b,
            pressure_max: 1.5 * (force / a) / (PI * b),
            approach: 0.0,
            normal_force: force,
        };
        let is_tiny = friction > 0.0 && friction < COEFFICIENT_LEAST;
        if is_tiny || plausible(&ellipse.patch(), "/load").is_err() {
            return RowAnswer::without(RowStatus::Refused);
        }
        let motion = [
            at(Variable::CreepageX),
            at(Variable::CreepageY),
            at(Variable::Spin),
        ];
        let Some((creep, slopes)) = self.creep(&patch, motion, shapes) else {
            return RowAnswer::without(RowStatus::NotCovered);
        };
        let of = match self.relative_to {
            RelativeTo::FrictionLimit => 1.0,
            RelativeTo::Force if patch.limit > 0.0 => {
                let [x, y, _] = creep.force;
                (patch.limit * x).hypot(patch.limit * y) / patch.limit
            }
            RelativeTo::Force => 0.0,
        };
        let missed = self.target.is_some_and(|target| creep.bound > target * of);
        let status = match (missed, &self.method) {
            (false, _) => RowStatus::Ok,
            (true, RowMethod::Table { auto: true }) => {
                return RowAnswer::without(RowStatus::NeedsSolver);
            }
            (true, _) => RowStatus::TargetMissed,
        };
        RowAnswer {
            numbers: patch.numbers(&creep, motion),
            gradients: match self.gradients {
                true => patch.gradients(slopes),
                false => [f64::NAN; 9],
            },
            status,
        }
    }

    /// Returns shear modulus in MPa and Poisson's ratio of a row.
    fn material(&self, row: &Row) -> [f64; 2] {
        let at = |variable: Variable| row[variable as usize];
        self.pair.unwrap_or_else(|| {
            let poisson = at(Variable::PoissonRatio);
            let modulus = if self.young {
                at(Variable::YoungModulus) / (2.0 * (1.0 + poisson))
            } else {
                at(Variable::ShearModulus)
            };
            [modulus, poisson]
        })
    }

    /// Returns the creep forces of a patch relative to μN with their derivatives; `None` if the table does not cover the patch.
    fn creep(
        &self,
        patch: &RowPatch,
        motion: [f64; 3],
        shapes: &mut Shapes,
    ) -> Option<(Creep, Slopes)> {
        if patch.limit == 0.0 {
            let is_still = motion == [0.0; 3];
            let creep = Creep {
                force: [0.0; 3],
                stick: if is_still { 1.0 } else { 0.0 },
                bound: 0.0,
            };
            return Some((creep, Slopes::default()));
        }
        let unit = patch.unit();
        let creepage = [
            unit * motion[0],
            unit * motion[1],
            unit * patch.c * motion[2],
        ];
        match &self.method {
            RowMethod::Fastsim(mesh, class) => {
                let at = |creepage| mesh.creep(patch.ratio, patch.poisson, creepage);
                let (force, stick) = at(creepage);
                let creep = Creep {
                    force,
                    stick,
                    bound: *class,
                };
                if !self.gradients {
                    return Some((creep, Slopes::default()));
                }
                let moved = |component: usize, times: f64| {
                    let mut moved = creepage;
                    moved[component] += times * STEP;
                    at(moved).0
                };
                let values = [0, 1, 2].map(|j| [-2.0, -1.0, 1.0, 2.0].map(|times| moved(j, times)));
                let slopes = [0, 1, 2].map(|k| {
                    [0, 1, 2].map(|j| slope(values[j].map(|force: [f64; 3]| force[k]), STEP).0)
                });
                Some((creep, slopes))
            }
            RowMethod::Table { .. } if !RATIO_RANGE.contains(&patch.ratio) => None,
            RowMethod::Table { .. } => {
                let ellipse = shapes.table(patch.ratio, patch.poisson);
                let slopes = self.gradients.then(|| ellipse.slopes(creepage));
                Some((ellipse.creep(creepage), slopes.unwrap_or_default()))
            }
        }
    }
}

/// Derivatives of forces and moment relative to μN by dimensionless creepages and spin.
type Slopes = [[f64; 3]; 3];

/// The patch of a row.
struct RowPatch {
    /// Normal force in N.
    force: f64,
    /// μN in N.
    limit: f64,
    /// √(ab) in mm.
    c: f64,
    /// a/b.
    ratio: f64,
    /// Shear modulus in MPa, reduced by Kalker's factor.
    modulus: f64,
    poisson: f64,
}

impl RowPatch {
    /// Returns the factor that makes creepages dimensionless.
    fn unit(&self) -> f64 {
        self.modulus * self.c * self.c / self.limit
    }

    /// Converts creep forces to the numbers of a row.
    fn numbers(&self, creep: &Creep, motion: [f64; 3]) -> RowNumbers {
        let (limit, c) = (self.limit, self.c);
        let [x, y, moment] = creep.force;
        let [x, y, moment] = [limit * x, limit * y, limit * c * moment];
        let error = limit * creep.bound;
        let area = PI * c * c;
        [
            self.force,
            x,
            y,
            moment,
            error,
            error * c,
            motion[0] * x + motion[1] * y + motion[2] * moment,
            creep.stick,
            area,
            1.5 * self.force / area,
            1.0,
            f64::NAN,
        ]
    }

    /// Converts derivatives to those by creepages and spin in 1/mm. Without friction there are none.
    fn gradients(&self, slopes: Slopes) -> [f64; 9] {
        let unit = match self.limit > 0.0 {
            true => self.limit * self.unit(),
            false => 0.0,
        };
        let arm = |k: usize| if k == 2 { self.c } else { 1.0 };
        std::array::from_fn(|place| {
            let (force, creepage) = (place / 3, place % 3);
            slopes[force][creepage] * unit * arm(force) * arm(creepage)
        })
    }
}

/// The last shapes that were computed; neighbouring rows often share them.
#[derive(Debug, Default)]
struct Shapes {
    hertz: Option<([f64; 2], HertzShape)>,
    table: Option<([f64; 2], EllipseTable<'static>)>,
}

impl Shapes {
    fn hertz(&mut self, radii: [f64; 2]) -> HertzShape {
        cached(&mut self.hertz, radii, || {
            HertzShape::of_radii(radii[0], radii[1])
        })
    }

    fn table(&mut self, ratio: f64, poisson: f64) -> EllipseTable<'static> {
        let key = [ratio, poisson];
        cached(&mut self.table, key, || table().ellipse(ratio, poisson))
    }
}

/// Returns the cached value if it has this key, otherwise computes and caches it.
fn cached<T: Copy>(
    cache: &mut Option<([f64; 2], T)>,
    key: [f64; 2],
    compute: impl FnOnce() -> T,
) -> T {
    let known = cache.filter(|(known, _)| *known == key);
    cache.insert(known.unwrap_or_else(|| (key, compute()))).1
}

/// Whether the table or FASTSIM can answer the rows: one motion with creepages on an ellipse under a normal force.
fn is_plain(case: &Value, checked: &CheckedCase) -> bool {
    let CheckedCase { problem, run, .. } = checked;
    let asked_mesh = matches!(run.resolution, Resolution::Mesh(_));
    // The creepages of a list or a sweep of one motion are not at the pointers of the variables.
    let listed = |motion: &Value| motion.is_array() || motion.get("sweep").is_some();
    problem.plain().is_some()
        && problem.motions.len() == 1
        && !case.get("motion").is_some_and(listed)
        && problem.history.is_none()
        && problem.forces.iter().all(|forces| *forces == [None; 2])
        && case.pointer(Variable::NormalForce.pointer()).is_some()
        && match run.method_asked {
            MethodName::Fastsim => true,
            MethodName::Table => problem.elasticity.difference == 0.0,
            MethodName::Auto => problem.elasticity.difference == 0.0 && !asked_mesh,
            MethodName::BoundaryElement | MethodName::LiuHsu => false,
        }
}

/// Returns the method of the rows; `None` if FASTSIM has no mesh of the requested size.
fn method_of(checked: &CheckedCase) -> Option<RowMethod> {
    Some(match (checked.run.method_asked, checked.run.resolution) {
        (MethodName::Fastsim, resolution) => {
            let size = match resolution {
                Resolution::Mesh(size) => size,
                Resolution::Target(_) => fastsim::MESH,
            };
            let bound = checked.run.traction_bound;
            let error = fastsim::stated_error(size);
            RowMethod::Fastsim(Box::new(EllipseMesh::new(size, bound).ok()?), error)
        }
        (method, _) => RowMethod::Table {
            auto: method == MethodName::Auto,
        },
    })
}
