//! Constructors and setters for a [`Case`] in Rust, and [`Case::solve`].
//!
//! Such a case passes the same checks as one from JSON, and has the same answer and the same digest.

use std::collections::BTreeMap;

use serde_json::to_value;
use thiserror::Error;

use crate::case::solver::Limits;
use crate::case::words::contact::{Contact, FLANGE_BACKS, GAUGE, Load, SurfaceName};
use crate::case::words::cross_section::CrossSection;
use crate::case::words::friction::Friction;
use crate::case::words::material::{Elastic, Material};
use crate::case::words::motion::{AskedMotion, Motions, Wheelset};
use crate::case::words::solver::{Case, MethodName, Output, Solver};
use crate::error::{CaseError, Fault, SolveError};
use crate::geometry::formats::Format;
use crate::geometry::wheel_rail::Side;
use crate::half_space::bent_surface::Influence;
use crate::monitor::Unmonitored;
use crate::problem::checked_case::CheckedCase;
use crate::solution::words::answer::Solution;
use crate::{check, solve};

/// Why a case has no answer.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// The case has faults.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The solve failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

impl Case {
    /// Creates a case without load and motion that requests resultants by `auto` with the default target.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Load, Material, Motion};
    ///
    /// let contact = Contact::radii(460.0, 300.0);
    /// let solution = Case::new(Material::steel(), Friction::coulomb(0.3), contact)
    ///     .load(Load::normal_force(100e3))
    ///     .motion(Motion::creepages(0.001, 0.0, 0.0001))
    ///     .solve()?;
    /// let patch = &solution.patches[0];
    /// assert!((patch.pressure_max_mpa - 1226.8).abs() < 1.0);
    /// assert!(patch.points[0].force_x_n > 0.0);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    pub fn new(material: Material, friction: Friction, contact: Contact) -> Case {
        Case {
            name: None,
            labels: BTreeMap::new(),
            material,
            friction,
            contact,
            load: None,
            motion: Motions::Many(Vec::new()),
            solver: Solver::default(),
            outputs: vec![Output::Resultants],
            subsurface: None,
            damage: None,
            thermal: None,
        }
    }

    /// Sets the load.
    #[must_use]
    pub fn load(mut self, load: Load) -> Case {
        self.load = Some(load);
        self
    }

    /// Sets the motion: an [`AskedMotion`], a `Vec` of them, a [`Wheelset`], or any other [`Motions`].
    #[must_use]
    pub fn motion(mut self, motion: impl Into<Motions>) -> Case {
        self.motion = motion.into();
        self
    }

    /// Sets the allowed error of the resultants relative to the friction limit μN, 1e-4 to 0.5.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Load, Material, Motion};
    ///
    /// let case = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::ellipse(6.0, 4.0))
    ///     .load(Load::normal_force(80e3))
    ///     .motion(Motion::creepages(0.0005, 0.0005, 0.0))
    ///     .target_error(0.001);
    /// let point = &case.solve()?.patches[0].points[0];
    /// assert_eq!(point.target_met, Some(true));
    /// assert!(point.error_estimate.unwrap().force_x_n <= 0.001 * 0.3 * 80e3);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    #[must_use]
    pub fn target_error(mut self, target: f64) -> Case {
        self.solver.target_error = Some(target);
        self
    }

    /// Sets the method.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Load, Material, Method, Motion};
    ///
    /// let case = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::ellipse(6.0, 4.0))
    ///     .load(Load::normal_force(80e3))
    ///     .motion(Motion::creepages(0.001, 0.0, 0.0));
    /// let force = |method| {
    ///     let solution = case.clone().method(method).solve()?;
    ///     Ok::<f64, railhead_contact::Error>(solution.total[0].force_x_n)
    /// };
    /// let (exact, table) = (force(Method::BoundaryElement)?, force(Method::Table)?);
    /// assert!((table - exact).abs() < 0.02 * 0.3 * 80e3);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    #[must_use]
    pub fn method(mut self, method: MethodName) -> Case {
        self.solver.method = method;
        self
    }

    /// Sets the outputs.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Limits, Load, Material, Motion, Output, Unmonitored};
    ///
    /// let case = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::ellipse(6.0, 4.0))
    ///     .load(Load::normal_force(80e3))
    ///     .motion(Motion::creepages(0.001, 0.0, 0.0))
    ///     .outputs([Output::Resultants, Output::Tractions]);
    /// let (_, fields) = railhead_contact::solve(&case.check(&Limits::default())?, &Unmonitored)?;
    /// assert!(!fields.patches.is_empty());
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    #[must_use]
    pub fn outputs(mut self, outputs: impl IntoIterator<Item = Output>) -> Case {
        self.outputs = outputs.into_iter().collect();
        self
    }

    /// Checks the case against physics and limits.
    ///
    /// # Errors
    /// All faults of the case.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Limits, Load, Material, Motion};
    ///
    /// let error = Case::new(Material::steel(), Friction::coulomb(-0.3), Contact::radii(460.0, -300.0))
    ///     .load(Load::normal_force(100e3))
    ///     .motion(Motion::creepages(0.001, 0.0, 0.0))
    ///     .check(&Limits::default())
    ///     .unwrap_err();
    /// let pointers: Vec<&str> = error.0.iter().map(|fault| fault.pointer.as_str()).collect();
    /// assert_eq!(pointers, ["/friction/coefficient", "/contact/lateral_mm"]);
    /// ```
    pub fn check(&self, limits: &Limits) -> Result<CheckedCase, CaseError> {
        let value = to_value(self).map_err(|error| {
            let fault = Fault::new("", error.to_string());
            CaseError(vec![fault])
        })?;
        check(&value, limits)
    }

    /// Checks and solves the case within the default limits. [`solve`](crate::solve()) also returns the values per cell and takes a monitor.
    ///
    /// # Errors
    /// The faults of the case, or the reason why there is no answer.
    pub fn solve(&self) -> Result<Solution, Error> {
        let (solution, _) = solve(&self.check(&Limits::default())?, &Unmonitored)?;
        Ok(solution)
    }
}

impl Material {
    /// Steel on steel: G = 82 000 MPa, ν = 0.28.
    pub fn steel() -> Material {
        Material::Same(Elastic::of_shear_modulus(82_000.0, 0.28))
    }
}

impl Elastic {
    /// Creates a material from its shear modulus in MPa and Poisson's ratio.
    pub fn of_shear_modulus(shear_modulus_mpa: f64, poisson_ratio: f64) -> Elastic {
        Elastic {
            shear_modulus_mpa: Some(shear_modulus_mpa),
            young_modulus_mpa: None,
            poisson_ratio,
        }
    }

    /// Creates a material from its Young's modulus in MPa and Poisson's ratio.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Elastic, Friction, Load, Material, Motion};
    ///
    /// let material = Material::Pair {
    ///     lower: Elastic::of_young_modulus(210_000.0, 0.28),
    ///     upper: Elastic::of_young_modulus(70_000.0, 0.33),
    /// };
    /// let solution = Case::new(material, Friction::coulomb(0.2), Contact::radii(50.0, 50.0))
    ///     .load(Load::normal_force(1e3))
    ///     .motion(Motion::creepages(0.001, 0.0, 0.0))
    ///     .solve()?;
    /// assert!(solution.material.difference_parameter != 0.0);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    pub fn of_young_modulus(young_modulus_mpa: f64, poisson_ratio: f64) -> Elastic {
        Elastic {
            shear_modulus_mpa: None,
            young_modulus_mpa: Some(young_modulus_mpa),
            poisson_ratio,
        }
    }
}

impl Friction {
    /// Coulomb friction with a constant coefficient.
    pub fn coulomb(coefficient: f64) -> Friction {
        Friction {
            coefficient: Some(coefficient),
            ..Friction::default()
        }
    }
}

impl Contact {
    /// Bodies with the relative radii of curvature along and across the rolling direction, in mm.
    pub fn radii(rolling_mm: f64, lateral_mm: f64) -> Contact {
        Contact::Radii {
            rolling_mm,
            lateral_mm,
        }
    }

    /// An elliptic patch with the semi-axes along and across the rolling direction, in mm, under Hertz's pressure.
    pub fn ellipse(a_mm: f64, b_mm: f64) -> Contact {
        Contact::Ellipse { a_mm, b_mm }
    }

    /// A wheel on a rail of standard track (gauge 1435 mm, backs of the flanges 1360 mm apart), in the middle of the track.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, CrossSection, Format, Friction, Load, Material, Side, Wheelset};
    ///
    /// let rail = CrossSection::text(Format::Columns, include_str!("examples/60e1.txt"));
    /// let wheel = CrossSection::text(Format::Columns, include_str!("examples/s1002.txt"));
    /// let contact = Contact::profiles(rail, wheel, Side::Right, 460.0);
    /// let solution = Case::new(Material::steel(), Friction::coulomb(0.3), contact)
    ///     .load(Load::vertical_force(75e3))
    ///     .motion(Wheelset::rolling_freely(20e3, 460.0))
    ///     .solve()?;
    /// // The balance of the load is solved to a part of 5e-4.
    /// assert!((solution.total[0].force_z_n.unwrap() + 75e3).abs() < 5e-4 * 75e3);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    pub fn profiles(
        rail: CrossSection,
        wheel: CrossSection,
        side: Side,
        rolling_radius_mm: f64,
    ) -> Contact {
        Contact::Profiles {
            rail: Box::new(rail),
            wheel: Box::new(wheel),
            side,
            rolling_radius_mm,
            gauge_mm: Some(GAUGE),
            gauge_height_mm: None,
            rail_origin_mm: None,
            cant_rad: 0.0,
            flange_back_distance_mm: FLANGE_BACKS,
            flange_back_position_mm: None,
            lateral_shift_mm: 0.0,
            yaw_rad: 0.0,
            roll_rad: 0.0,
            accept_rough_profiles: false,
            reference_surface: None,
            influence: None,
        }
    }

    /// Requires the curved surface of the rail, which is the default, and sets the influence on it. Contacts other than profiles stay unchanged.
    ///
    /// ```
    /// use railhead_contact::{
    ///     Case, Contact, CrossSection, Format, Friction, Load, Material, Side, SurfaceInfluence, Wheelset,
    /// };
    ///
    /// let rail = CrossSection::text(Format::Columns, include_str!("examples/60e1.txt"));
    /// let wheel = CrossSection::text(Format::Columns, include_str!("examples/s1002.txt"));
    /// let contact = Contact::profiles(rail, wheel, Side::Right, 460.0);
    /// let solution = Case::new(
    ///     Material::steel(),
    ///     Friction::coulomb(0.3),
    ///     contact.on_curve(SurfaceInfluence::AngleCorrected),
    /// )
    /// .load(Load::vertical_force(75e3))
    /// .motion(Wheelset::rolling_freely(20e3, 460.0))
    /// .solve()?;
    /// assert!((solution.total[0].force_z_n.unwrap() + 75e3).abs() < 10.0);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    #[must_use]
    pub fn on_curve(self, influence: Influence) -> Contact {
        self.on_surface(SurfaceName::Curve, Some(influence))
    }

    /// Requires planes of contact. Contacts other than profiles stay unchanged.
    #[must_use]
    pub fn on_planes(self) -> Contact {
        self.on_surface(SurfaceName::Plane, None)
    }

    fn on_surface(mut self, surface: SurfaceName, how: Option<Influence>) -> Contact {
        if let Contact::Profiles {
            reference_surface,
            influence,
            ..
        } = &mut self
        {
            (*reference_surface, *influence) = (Some(surface), how);
        }
        self
    }
}

impl CrossSection {
    /// Creates a cross-section from points `[y, z]` in mm in order along it; y is positive to the field side, z positive down.
    pub fn points(points_mm: Vec<[f64; 2]>) -> CrossSection {
        CrossSection {
            points_mm: Some(points_mm),
            ..CrossSection::default()
        }
    }

    /// Creates a cross-section from the content of a file.
    pub fn text(format: Format, text: impl Into<String>) -> CrossSection {
        CrossSection {
            format: Some(format),
            text: Some(text.into()),
            ..CrossSection::default()
        }
    }
}

impl Load {
    /// Normal force in N.
    pub fn normal_force(normal_force_n: f64) -> Load {
        Load {
            normal_force_n: Some(normal_force_n),
            ..Load::default()
        }
    }

    /// Vertical force of the wheel or the wheelset in N.
    pub fn vertical_force(vertical_force_n: f64) -> Load {
        Load {
            vertical_force_n: Some(vertical_force_n),
            ..Load::default()
        }
    }

    /// Approach of distant points in mm.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Load, Material, Motion};
    ///
    /// // The force of a Hertz contact grows with the approach to the power 3/2.
    /// let force = |approach| {
    ///     let solution = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::radii(460.0, 300.0))
    ///         .load(Load::approach(approach))
    ///         .motion(Motion::creepages(0.001, 0.0, 0.0))
    ///         .solve()?;
    ///     Ok::<f64, railhead_contact::Error>(solution.patches[0].normal_force_n)
    /// };
    /// assert!((force(0.08)? / force(0.02)? - 8.0).abs() < 1e-6);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    pub fn approach(approach_mm: f64) -> Load {
        Load {
            approach_mm: Some(approach_mm),
            ..Load::default()
        }
    }
}

impl AskedMotion {
    /// Creates a motion from longitudinal and lateral creepage, and spin in 1/mm.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Load, Material, Motion};
    ///
    /// // A creep curve: the force grows with the creepage up to the friction limit.
    /// let motions: Vec<Motion> =
    ///     (1..=10).map(|k| Motion::creepages(0.0005 * f64::from(k), 0.0, 0.0)).collect();
    /// let solution = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::radii(460.0, 300.0))
    ///     .load(Load::normal_force(100e3))
    ///     .motion(motions)
    ///     .solve()?;
    /// let forces: Vec<f64> = solution.total.iter().map(|total| total.force_x_n).collect();
    /// assert!(forces.is_sorted() && forces[9] <= 0.3 * 100e3);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    pub fn creepages(creepage_x: f64, creepage_y: f64, spin_per_mm: f64) -> AskedMotion {
        AskedMotion {
            creepage_x: Some(creepage_x),
            creepage_y: Some(creepage_y),
            spin_per_mm,
            ..AskedMotion::default()
        }
    }

    /// Creates a motion with longitudinal and lateral force on the lower body in N, and spin in 1/mm. The creepages are computed.
    ///
    /// ```
    /// use railhead_contact::{Case, Contact, Friction, Load, Material, Motion};
    ///
    /// let solution = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::radii(460.0, 300.0))
    ///     .load(Load::normal_force(100e3))
    ///     .motion(Motion::forces(10e3, 0.0, 0.0))
    ///     .solve()?;
    /// let point = &solution.patches[0].points[0];
    /// assert!(point.motion.creepage_x > 0.0 && (point.force_x_n - 10e3).abs() < 200.0);
    /// # Ok::<(), railhead_contact::Error>(())
    /// ```
    pub fn forces(force_x_n: f64, force_y_n: f64, spin_per_mm: f64) -> AskedMotion {
        AskedMotion {
            force_x_n: Some(force_x_n),
            force_y_n: Some(force_y_n),
            spin_per_mm,
            ..AskedMotion::default()
        }
    }
}

impl Wheelset {
    /// A wheelset at a speed in mm/s whose wheels roll freely at a radius in mm, without lateral velocity, yaw rate and roll rate.
    pub fn rolling_freely(speed_mm_per_s: f64, radius_mm: f64) -> Wheelset {
        Wheelset {
            speed_mm_per_s,
            free_rolling_radius_mm: Some(radius_mm),
            ..Wheelset::default()
        }
    }
}

impl From<AskedMotion> for Motions {
    fn from(motion: AskedMotion) -> Motions {
        Motions::One(motion)
    }
}

impl From<Vec<AskedMotion>> for Motions {
    fn from(motions: Vec<AskedMotion>) -> Motions {
        Motions::Many(motions)
    }
}

impl From<Wheelset> for Motions {
    fn from(wheelset: Wheelset) -> Motions {
        Motions::Wheelset { wheelset }
    }
}
