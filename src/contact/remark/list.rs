//! The list of all remarks. To add one, add it here and nowhere else: code, severity, figures and sentence, and what the client
//! reads about it at `/v1/remarks`.
//!
//! Codes never change. Figures have their unit in their name and must not be named as a member of
//! `RemarkEntry`. A figure may be a number, a count, a pair, a word or optional.

use std::collections::BTreeMap;

use crate::contact::remark::figure::{AsFigure, Figure};
use crate::contact::remark::kind::{RemarkKind, Severity};
use crate::contact::remark::table::remarks;

remarks! {
    // The case.

    /// The friction coefficient is larger than is usual.
    FrictionUnusual {
        /// The coefficient given.
        coefficient: f64 = 1.5,
        /// The largest that passes without a remark.
        usual_max: f64 = 1.0,
    }
    code: "friction-unusual",
    severity: Warning,
    advice: "Check `friction.coefficient`: dry steel has about 0.3 to 0.6.",
    detail: format!("the friction coefficient {coefficient} is more than {usual_max}"),

    /// The two bodies differ. Their materials are combined, but pressure and traction are solved one after the other.
    CouplingNeglected {
        /// Difference parameter K (Kalker 1990, eq. 1.44).
        difference_parameter: f64 = 0.021,
    }
    code: "coupling-neglected",
    severity: Warning,
    advice: "Expect errors of the order of K in tractions; above 0.05 cases are refused.",
    detail: format!(
        "the two bodies differ (K = {difference_parameter:.4}); the coupling of pressure and traction is neglected"
    ),

    // Profiles.

    /// The shape of a profile says that its z is positive up; it was mirrored.
    ProfileZMirrored {
        /// Whose.
        profile: &'static str = "rail",
    }
    code: "profile-z-mirrored",
    severity: Info,
    advice: "State `mirror_z` to say so yourself.",
    detail: format!("{profile}: z was found to be positive up and has been mirrored"),

    /// The flange of a wheel was found at positive y; y was mirrored.
    ProfileYMirrored {
        /// Whose.
        profile: &'static str = "wheel",
    }
    code: "profile-y-mirrored",
    severity: Info,
    advice: "State `mirror_y` to say so yourself.",
    detail: format!("{profile}: the flange was found at positive y, so that y has been mirrored"),

    /// Points of a profile that lie nearly at the same place were merged.
    ProfilePointsMerged {
        /// Whose.
        profile: &'static str = "rail",
        /// Points left out.
        count: usize = 11,
        /// Points nearer than this are one.
        nearer_than_mm: f64 = 0.001,
    }
    code: "profile-points-merged",
    severity: Info,
    advice: "Nothing: files that repeat points at the joints of arcs are common.",
    detail: format!("{profile}: {count} points nearer than {nearer_than_mm} mm to another one were merged"),

    /// Points of a profile that ran back between their neighbours were dropped.
    ProfilePointsDropped {
        /// Whose.
        profile: &'static str = "rail",
        /// Points left out.
        count: usize = 2,
    }
    code: "profile-points-dropped",
    severity: Warning,
    advice: "Check the measurement where pieces are joined.",
    detail: format!("{profile}: {count} points that ran back (zig-zag) were dropped"),

    /// One or two points at an end of a profile, far from all others, were dropped.
    ProfileEndDropped {
        /// Whose.
        profile: &'static str = "wheel",
        /// Points left out.
        count: usize = 1,
        /// Their distance from the next point.
        distance_mm: f64 = 67.0,
    }
    code: "profile-end-dropped",
    severity: Info,
    advice: "Nothing if the profile ends there; else check the file.",
    detail: format!("{profile}: {count} stray points at an end, {distance_mm:.1} mm from the next one, were dropped"),

    /// A profile has the shape of the other body.
    ProfileOfOtherBody {
        /// Which.
        profile: &'static str = "rail",
        /// What it looks like.
        like: &'static str = "a wheel with its flange",
    }
    code: "profile-of-other-body",
    severity: Warning,
    advice: "Check that rail and wheel were not exchanged. Where both look like the other the case is refused.",
    detail: format!("the profile given as {profile} looks like {like}; were rail and wheel exchanged?"),

    /// The smoothing of a profile was chosen from its noise and the pressure, as the case asked for.
    SmoothingChosen {
        /// Whose.
        profile: &'static str = "rail",
        /// Cut wavelength; 0 for none.
        smoothing_mm: f64 = 3.4,
    }
    code: "smoothing-chosen",
    severity: Info,
    advice: "Nothing; give `smoothing_mm` as a number to use the same for other cases.",
    detail: format!("{profile}: smoothed by {smoothing_mm:.2} mm, chosen from the noise of its points"),

    /// The points of a profile are too few or too far apart to tell their noise from its shape, so that `smoothing_mm: "auto"` chose no smoothing.
    SmoothingUndecided {
        /// Whose.
        profile: &'static str = "rail",
        /// Median distance of its points.
        spacing_mm: f64 = 4.0,
    }
    code: "smoothing-undecided",
    severity: Warning,
    advice: "Send points that lie nearer to each other, 0.25 mm at gauge corner and flange, or give `smoothing_mm` as a number.",
    detail: format!(
        "{profile}: points {spacing_mm:.1} mm apart do not tell noise from shape, so that no smoothing could be chosen; none is in use"
    ),

    /// One point of a profile near the contact is off the curve of its neighbours.
    ProfileOutlier {
        /// Whose.
        profile: &'static str = "rail",
        /// Where on the profile.
        at_y_mm: f64 = -3.2,
        /// Distance from the curve.
        distance_um: f64 = 200.0,
        /// Roughness of this profile as the pressure that flattens it.
        waviness_mpa: f64 = 900.0,
        /// That of both profiles over the largest pressure.
        share: f64 = 0.4,
    }
    code: "profile-outlier",
    severity: Warning,
    advice: "Remove or correct the point; smoothing spreads it.",
    detail: format!(
        "the {profile}'s point at y = {at_y_mm:.2} mm is {distance_um:.1} µm off the curve of its neighbours, worth {waviness_mpa:.0} MPa: \
         remove or correct it"
    ),

    /// A profile jumps between two points near the contact.
    ProfileStep {
        /// Whose.
        profile: &'static str = "rail",
        /// Where on the profile.
        at_y_mm: f64 = -3.2,
        /// Height, positive upward with y.
        height_um: f64 = 50.0,
        /// Roughness of this profile as the pressure that flattens it.
        waviness_mpa: f64 = 900.0,
        /// That of both profiles over the largest pressure.
        share: f64 = 0.4,
    }
    code: "profile-step",
    severity: Warning,
    advice: "Measure this part again, or join the pieces better: no smoothing heals a step, and forces are off as well.",
    detail: format!(
        "the {profile}'s points jump by {:.1} µm at y = {at_y_mm:.2} mm, worth {waviness_mpa:.0} MPa: no smoothing heals a step, measure \
         this part again", height_um.abs()
    ),

    /// The points of a profile lie on straight chords between fewer points, as linear resampling leaves them.
    ProfilePolygon {
        /// Whose.
        profile: &'static str = "rail",
        /// Where on the profile, from and to.
        y_mm: [f64; 2] = [-6.0, 5.0],
        /// Length of the chords.
        chord_mm: f64 = 0.5,
        /// Roughness of this profile as the pressure that flattens it.
        waviness_mpa: f64 = 200.0,
        /// That of both profiles over the largest pressure.
        share: f64 = 0.15,
        /// Smoothing that is advised.
        smoothing_mm: Option<f64> = Some(2.5),
    }
    code: "profile-polygon",
    severity: Warning,
    advice: "Send the points as measured, without resampling, or give the `smoothing_mm` named here.",
    detail: format!(
        "the {profile}'s points under the patch (y {:.1} to {:.1} mm) lie on straight chords of {chord_mm:.2} mm, as linear resampling leaves \
         them; the kinks are worth {waviness_mpa:.0} MPa: send the points as measured{}",
        y_mm[0], y_mm[1],
        smoothing_mm.map_or_else(String::new, |length| format!(", or give smoothing_mm: {length}"))
    ),

    /// Noise of the points of a profile, of the measurement or of rounding, is worth a good part of the pressure.
    ProfileNoise {
        /// Whose.
        profile: &'static str = "rail",
        /// Where on the profile, from and to.
        y_mm: [f64; 2] = [-6.0, 5.0],
        /// Standard deviation along the normal.
        noise_um: f64 = 1.9,
        /// Mean distance of the points.
        spacing_mm: f64 = 0.25,
        /// Step of which all heights are multiples, if there is one.
        rounding_mm: Option<f64> = Some(0.01),
        /// Roughness of this profile as the pressure that flattens it.
        waviness_mpa: f64 = 210.0,
        /// That of both profiles over the largest pressure.
        share: f64 = 0.17,
        /// Smoothing that is advised.
        smoothing_mm: Option<f64> = Some(4.0),
    }
    code: "profile-noise",
    severity: Warning,
    advice: "Give the `smoothing_mm` named here, or `\"auto\"`; send points with more decimals where they were rounded.",
    detail: format!(
        "noise of {noise_um:.2} µm{} at points {spacing_mm:.2} mm apart makes waves on the {profile} (y {:.1} to {:.1} mm) worth \
         {waviness_mpa:.0} MPa{}",
        rounding_mm.map_or_else(String::new, |step| format!(" (heights rounded to {step} mm)")),
        y_mm[0], y_mm[1],
        smoothing_mm.map_or_else(String::new, |length| format!(": give smoothing_mm: {length}"))
    ),

    /// Waves of a profile that are neither noise nor a single fault are worth a good part of the pressure.
    ProfileWaves {
        /// Whose.
        profile: &'static str = "wheel",
        /// Where on the profile, from and to.
        y_mm: [f64; 2] = [-6.0, 5.0],
        /// Their length at most.
        shorter_than_mm: f64 = 3.0,
        /// Roughness of this profile as the pressure that flattens it.
        waviness_mpa: f64 = 210.0,
        /// That of both profiles over the largest pressure.
        share: f64 = 0.17,
    }
    code: "profile-waves",
    severity: Warning,
    advice: "Where they come from the measurement, smooth them with a `smoothing_mm` of about their length; real waves are part of the answer.",
    detail: format!(
        "waves on the {profile} shorter than {shorter_than_mm:.1} mm (y {:.1} to {:.1} mm) are worth {waviness_mpa:.0} MPa: smooth them with \
         smoothing_mm where they come from the measurement", y_mm[0], y_mm[1]
    ),

    /// The points of a profile under the contact are so far apart that the curve between them is open.
    ProfileSpacing {
        /// Whose.
        profile: &'static str = "rail",
        /// The widest distance of neighbouring points, from and to.
        y_mm: [f64; 2] = [-4.1, 3.9],
        /// Its length.
        spacing_mm: f64 = 8.0,
        /// The same over the width of the patch.
        spacing_over_width: f64 = 0.8,
        /// Pressure that flattens the difference of two curves through the points.
        ambiguity_mpa: f64 = 400.0,
    }
    code: "profile-spacing",
    severity: Warning,
    advice: "Send points 0.5 mm apart on the tread, 0.25 mm at gauge corner and flange.",
    detail: format!(
        "the {profile}'s points are {spacing_mm:.1} mm apart where it touches (y {:.1} to {:.1} mm), {spacing_over_width:.2} times the width of the \
         patch; the curve between them is open by {ambiguity_mpa:.0} MPa: send more points there", y_mm[0], y_mm[1]
    ),

    /// A profile has a stretch without points near the contact over which the bodies may touch as well.
    ProfileHole {
        /// Whose.
        profile: &'static str = "rail",
        /// The stretch, from and to.
        y_mm: [f64; 2] = [-25.0, 25.0],
        /// Its length.
        hole_mm: f64 = 50.0,
    }
    code: "profile-hole",
    severity: Warning,
    advice: "Send the points there: the contact may be elsewhere than found.",
    detail: format!(
        "the {profile} has no points from y {:.1} to {:.1} mm ({hole_mm:.1} mm), where the bodies may touch: the contact may be elsewhere than \
         found; send the points there", y_mm[0], y_mm[1]
    ),

    /// The contact is on the tip of the flange, as on a wheel that climbs or has derailed.
    ContactOnFlangeTip {
        /// Whose.
        profile: &'static str = "wheel",
        /// Where on the profile, from and to.
        y_mm: [f64; 2] = [-58.0, -52.0],
    }
    code: "contact-on-flange-tip",
    severity: Warning,
    advice: "Check lateral shift, gauge, flange-back distance and position.",
    detail: format!(
        "the contact at y {:.1} to {:.1} mm of the {profile} is on the tip of its flange, as on a wheel that climbs or has derailed: check lateral \
         shift, gauge and flange-back distance", y_mm[0], y_mm[1]
    ),

    /// The contact is near the end of a profile, so that part of it may be cut off.
    ContactAtProfileEnd {
        /// Whose.
        profile: &'static str = "wheel",
        /// Where on the profile, from and to.
        y_mm: [f64; 2] = [52.0, 58.0],
        /// What is left of the profile beyond the contact.
        left_mm: f64 = 2.0,
    }
    code: "contact-at-profile-end",
    severity: Warning,
    advice: "Check lateral shift and gauge, or send at least 5 mm of profile beyond the contact.",
    detail: format!(
        "the contact at y {:.1} to {:.1} mm of the {profile} is {left_mm:.1} mm from the end of its profile: check lateral shift and gauge, or send \
         a longer profile", y_mm[0], y_mm[1]
    ),

    /// The target is smaller than what the measurement of the profiles leaves open: a finer solve says nothing more.
    TargetBelowProfileUncertainty {
        /// The target, relative to μN.
        target: f64 = 1e-3,
        /// What the profiles leave open of the forces, relative to μN.
        uncertainty: f64 = 0.02,
    }
    code: "target-below-profile-uncertainty",
    severity: Info,
    advice: "Better points help, a smaller target does not.",
    detail: format!(
        "the profiles leave {:.1} % of μN open, more than the target of {:.1} %", 100.0 * uncertainty, 100.0 * target
    ),

    /// A patch reaches the line on the rail at which the contact was divided between two planes of contact. It ends there by that division, not
    /// as a contact does: if its largest pressure lies on that line, it grows with the fineness of the grid.
    PatchCut {
        /// y of the line on the cross-section of the rail.
        rail_y_mm: f64 = -18.4,
    }
    code: "patch-cut",
    severity: Warning,
    advice: "Do not use pressures near that line, nor the largest one if `gap-rough` stands beside this. Two patches have grown into one that bends; under less load they are two.",
    detail: format!(
        "the patch reaches the line y = {rail_y_mm:.2} mm on the rail, where the contact is divided between two planes: its edge and its \
         pressure there are those of the division"
    ),

    /// The rail turns over the contact by so much that a plane of contact and half-spaces describe it roughly.
    ContactTurns {
        /// Change of the rail's inclination over the patch.
        turn_rad: f64 = 0.5,
    }
    code: "contact-turns",
    severity: Warning,
    advice: "Take pressures and the direction of forces as approximate: conformal contact is not modelled.",
    detail: format!(
        "the rail turns by {turn_rad:.2} rad over the contact, which a plane of contact and half-spaces describe roughly"
    ),

    /// The force jumps at the height of the wheel that carries the load, where patches merge; forces were scaled to the load.
    ForceJumps {
        /// Load over force found.
        factor: f64 = 1.004,
    }
    code: "force-jumps",
    severity: Warning,
    advice: "Vary the lateral place of the wheel a little to see how far the answer depends on it.",
    detail: format!(
        "the force jumps at this height of the wheel, where patches merge; forces were scaled by {factor:.4}"
    ),

    /// Patches lie in gaps of their own, where they do not press on each other's half-space, and that could matter.
    PatchesUncoupled {
        /// By how much the force of a patch would change, relative to the load.
        share: f64 = 0.012,
        /// Least distance of two load centres.
        distance_mm: f64 = 38.0,
    }
    code: "patches-uncoupled",
    severity: Warning,
    advice: "Expect that a part of the load moves from one patch to the other; this is not part of the error estimate.",
    detail: format!(
        "patches {distance_mm:.1} mm apart are solved as if each were alone; pressing on each other they would exchange {:.1} % of the load",
        100.0 * share
    ),

    /// Several motions share their patches, so that the vertical load is balanced by normal forces alone.
    NormalForcesAloneBalance {}
    code: "normal-forces-alone-balance",
    severity: Warning,
    advice: "Ask for the motions in cases of their own if friction is to carry its share of the load.",
    detail: "normal forces alone balance the vertical force, because several motions share their patches; the total of a motion has its \
             friction on top".to_owned(),

    // The normal problem.

    /// Pressure and region still change with the grid of the normal problem.
    GapRough {}
    code: "gap-rough",
    severity: Warning,
    advice: "Smooth the gap, or give it on a finer grid if it is as rough as that.",
    detail: "the gap is rough: pressure and region still change with the grid of the normal problem".to_owned(),

    /// A patch that carries a noticeable part of the load has few cells in the normal problem.
    PatchCoarse {
        /// Cells across its narrower side.
        cells_across: f64 = 4.0,
        /// Its part of the load.
        load_share: f64 = 0.059,
    }
    code: "patch-coarse",
    severity: Warning,
    advice: "Take the width and the pressure of this patch as uncertain by some per cent; solve it in a case of its own if it matters.",
    detail: format!(
        "the patch carries {:.1} % of the load and has only {cells_across:.0} cells across: its width and its pressure are uncertain by \
         some per cent",
        100.0 * load_share
    ),

    /// A given pressure does not fall to 0 at the edge of its grid.
    PressureCutAtEdge {}
    code: "pressure-cut-at-edge",
    severity: Warning,
    advice: "Give the pressure as far out as it is more than 0, and one row of zeros around it.",
    detail: "the pressure does not fall to 0 at the edge of the grid; the contact is taken to end within the next spacing".to_owned(),

    /// A patch of a given pressure has few samples.
    PressureCoarse {
        /// Samples along rolling.
        samples_x: usize = 4,
        /// Samples across.
        samples_y: usize = 7,
    }
    code: "pressure-coarse",
    severity: Warning,
    advice: "Give the pressure on a finer grid.",
    detail: format!(
        "the patch has only {samples_x} by {samples_y} samples of pressure; its force and its edge are uncertain by some per cent"
    ),

    /// The given pressure jumps from one sample to the next as at no edge of a contact: strips and cells do not follow it, and
    /// errors may be larger than estimated.
    PressureJumps {
        /// Where, halfway between the two samples; the largest jump.
        x_mm: f64 = 1.5,
        /// The same across.
        y_mm: f64 = -0.5,
        /// The fall over the largest pressure.
        share_of_largest: f64 = 0.8,
    }
    code: "pressure-jumps",
    severity: Warning,
    advice: "Give finer samples, or smooth the pressure over two or three of them.",
    detail: format!(
        "the pressure jumps by {share_of_largest:.2} of its largest value between samples at ({x_mm:.4}, {y_mm:.4}) mm, which strips and cells do not follow"
    ),

    /// The contact is long against the rolling radius: the bodies are nearly conformal.
    NearlyConformal {
        /// Length of the contact along rolling.
        length_mm: f64 = 14.2,
        /// Rolling radius.
        rolling_radius_mm: f64 = 20.0,
    }
    code: "nearly-conformal",
    severity: Warning,
    advice: "Half-spaces do not describe such bodies: take the answer as a rough one.",
    detail: format!(
        "the contact is {length_mm:.3} mm long, against a rolling radius of {rolling_radius_mm} mm: the bodies are nearly \
         conformal, which half-spaces do not describe"
    ),

    /// The bodies overlap so deeply that strains are too large for linear elasticity.
    StrainsTooLarge {
        /// Approach from first touch.
        overlap_mm: f64 = 1.1,
        /// Smaller half width of the contact.
        half_width_mm: f64 = 3.4,
    }
    code: "strains-too-large",
    severity: Warning,
    advice: "Check units and load. If they are right, the bodies yield and pressures are lower than the answer says.",
    detail: format!(
        "the bodies overlap by {overlap_mm:.3e} mm, against a half width of {half_width_mm:.3e} mm of the contact: strains are too \
         large for linear elasticity"
    ),

    /// The patch is large against the radii of the bodies, which half-spaces do not describe.
    PatchLarge {
        /// `rolling` or `lateral`.
        direction: &'static str = "rolling",
        /// Half width of the patch in this direction.
        half_width_mm: f64 = 210.0,
        /// Relative radius in this direction.
        radius_mm: f64 = 460.0,
    }
    code: "patch-large",
    severity: Warning,
    advice: "Check the unit of the load and the radii: contacts of half-spaces are smaller than a third of the radius.",
    detail: format!(
        "the patch has a half width of {half_width_mm:.3e} mm along {direction}, against a radius of {radius_mm} mm"
    ),

    /// The largest pressure is beyond what steel bears by far.
    PressureImplausible {
        /// Largest pressure.
        pressure_max_mpa: f64 = 8100.0,
        /// The largest that passes without a remark.
        usual_max_mpa: f64 = 5000.0,
    }
    code: "pressure-implausible",
    severity: Warning,
    advice: "Check the units of load and geometry. If they are right, the bodies yield and the pressure is lower than the answer says.",
    detail: format!(
        "the largest pressure is {pressure_max_mpa:.4e} MPa, more than {usual_max_mpa} MPa: bodies of steel would yield"
    ),

    /// The load is larger than any wheel bears.
    LoadImplausible {
        /// Normal force of all patches.
        normal_force_n: f64 = 1e12,
        /// The largest that passes without a remark.
        usual_max_n: f64 = 1e7,
    }
    code: "load-implausible",
    severity: Warning,
    advice: "Check its unit: forces are in N.",
    detail: format!("the normal force is {normal_force_n:.3e} N, more than {usual_max_n:e} N"),

    // Motions.

    /// Creepages are so large that they are no small part of the rolling speed any more.
    CreepageLarge {
        /// Longitudinal creepage.
        creepage_x: f64 = 5.0,
        /// Lateral creepage.
        creepage_y: f64 = 0.0,
        /// Spin times √(area/π) of the patch; absent where the patch is not known yet.
        spin_times_length: Option<f64> = Some(0.002),
        /// The largest that passes without a remark.
        usual_max: f64 = 0.2,
    }
    code: "creepage-large",
    severity: Warning,
    advice: "Check the unit (creepages are ratios, spin is in 1/mm). Forces of sliding like this follow from heat and wear as well.",
    detail: {
        let spin = spin_times_length.map_or_else(String::new, |spin| format!(", spin times length of the patch {spin:.3e}"));
        format!("the creepages are {creepage_x:.3e} and {creepage_y:.3e}{spin}; the theory is for small ones, up to {usual_max}")
    },

    /// The second discretisation rule did not converge; forces come from the first alone.
    SecondRuleFailed {}
    code: "second-rule-failed",
    severity: Warning,
    advice: "Use the forces with their larger error estimate, or try another mesh.",
    detail: "the trapezoid rule did not converge; forces come from the three-point rule and their error is larger".to_owned(),

    /// The error is not known to be below the target.
    TargetMissed {
        /// Estimated error relative to μN; absent if it is unknown.
        estimate: Option<f64> = Some(2.3e-3),
        /// The target.
        target: f64 = 1e-3,
    }
    code: "target-missed",
    severity: Warning,
    advice: "Use the numbers with the error estimate beside them, or ask for a larger target.",
    detail: match estimate {
        Some(estimate) => format!(
            "the error relative to μN is estimated at {estimate:.2e}, the target was {target}"
        ),
        None => format!("the error relative to μN is unknown, the target was {target}"),
    },

    /// No creepage gives the prescribed force; the nearest force found is answered.
    ForceUnreachable {
        /// Force asked for along rolling; absent if it was free.
        wanted_x_n: Option<f64> = Some(29_000.0),
        /// Force asked for across; absent if it was free.
        wanted_y_n: Option<f64> = None,
        /// Force found along rolling.
        found_x_n: f64 = 28_100.0,
        /// Force found across.
        found_y_n: f64 = -350.0,
    }
    code: "force-unreachable",
    severity: Warning,
    advice: "Ask for less: spin takes its share of μN. The motion has `saturated: true`.",
    detail: {
        let wanted = |force: &Option<f64>| {
            force.map_or_else(|| "free".to_owned(), |force| format!("{force} N"))
        };
        format!(
            "no creepage gives the force asked for (x: {}, y: {}); the nearest found is {found_x_n:.6e} N, {found_y_n:.6e} N",
            wanted(wanted_x_n), wanted(wanted_y_n)
        )
    },

    /// An iteration ended before it met its tolerance, and its result was used all the same.
    IterationInexact {
        /// Which iteration.
        iteration: &'static str = "force control",
        /// How it ended, as a clause.
        reason: &'static str = "the trials were used up",
        /// Its last residual, in the measure of the iteration.
        residual: f64 = 3e-5,
        /// The residual that was wanted.
        tolerance: f64 = 2e-6,
    }
    code: "iteration-inexact",
    severity: Warning,
    advice: "Judge by `residual` against `tolerance` whether the answer is still good enough; it is not part of the error estimate.",
    detail: format!(
        "{iteration} ended before its tolerance was met: {reason}; the residual is {residual:.2e}, {tolerance:.2e} was wanted"
    ),
}

#[cfg(test)]
mod tests;
