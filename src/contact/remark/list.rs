//! The list of all remarks. An entry has the code, severity, figures and sentence of a remark, and the explanation that clients read at
//! `/v1/remarks`.
//!
//! Codes never change. The name of a figure ends in its unit and differs from the members of `RemarkEntry`. A figure is a number, a count, a
//! pair, a word or optional.

use std::collections::BTreeMap;

use crate::remark::kind::{AsFigure, Figure, RemarkKind, Severity, percent, remarks, short, span};

remarks! {
    // Members of a case.

    /// The friction coefficient is larger than is usual.
    Warning FrictionUnusual {
        /// The given coefficient.
        coefficient: f64 = 1.5,
        /// Largest value without a remark.
        usual_max: f64 = 1.0,
    }
    advice: "Check `friction.coefficient`: dry steel has about 0.3 to 0.6.",
    detail: "the friction coefficient {coefficient} is more than {usual_max}",

    /// A number is unusual for wheel and rail, but usual in another unit.
    Warning UnitSuspected {
        /// The given number.
        given: f64 = 75.0,
        /// The unit of the member.
        unit: String = "N".to_owned(),
        /// The unit in which it is probably given.
        likely_unit: String = "kN".to_owned(),
    }
    advice: "Check the unit of the member that `pointer` names; if the number is intended, no action is needed.",
    detail: "{given} {unit} is unusual for wheel and rail: is it given in {likely_unit}?",

    /// The materials of the bodies differ. They are combined, but the coupling of pressure and traction is neglected.
    Warning CouplingNeglected {
        /// Difference parameter K (Kalker 1990, eq. 1.44).
        difference_parameter: @short f64 = 0.021,
    }
    advice: "Expect errors of the order of K in tractions, or use `boundary_element`, which includes the coupling.",
    detail: "the two bodies differ (K = {difference_parameter}); the coupling of pressure and traction is neglected",

    /// The materials of the bodies differ. The effect of pressure on tractions is included, the effect of tractions on pressure
    /// is not.
    Warning CouplingFirstOrder {
        /// Difference parameter K (Kalker 1990, eq. 1.44).
        difference_parameter: @short f64 = 0.1,
        /// Remaining error of forces relative to the friction limit; it is part of the error estimates.
        error: @short f64 = 0.018,
    }
    advice: "The error estimates include this error. Steady motions include both effects, except motions whose tractions separate or join patches.",
    detail: "the two bodies differ (K = {difference_parameter}); the effect of pressure on tractions is included, the effect of tractions on \
         pressure is not; this leaves an error of {error} of the friction limit",

    // Profiles of rail and wheel: how they were read, and how well their points describe them.

    /// The shape of a profile shows that its z is positive upward; z was mirrored.
    Info ProfileZMirrored {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
    }
    advice: "Give `mirror_z` to decide this yourself.",
    detail: "{profile}: z was recognised as positive upward and has been mirrored",

    /// The flange of a wheel is not at the end of y that is usual for the format; the direction of y was taken from the flange.
    Info ProfileYMirrored {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// Whether y grows toward the flange (`positive`) or away from it (`negative`).
        flange: &'static str = "positive",
    }
    advice: "Give `mirror_y` to decide this yourself.",
    detail: {
        if *flange == "positive" {
            format!("{profile}: the flange was found at the positive end of y, so y has been mirrored (mirror_y: true)")
        } else {
            format!(
                "{profile}: the flange was found at the negative end of y, so y has not been mirrored as is usual for this format \
                 (mirror_y: false)"
            )
        }
    },

    /// A stated direction of y or z contradicts the shape of the profile.
    Warning ProfileSenseContradicted {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// The member that states the direction.
        member: &'static str = "mirror_y",
        /// Its value.
        given: &'static str = "true",
    }
    advice: "Omit `mirror_y` or `mirror_z`, or check the measurement. The case is solved as stated.",
    detail: "{profile}: {member}: {given} is stated, but the shape of the points shows the opposite; the case is solved as stated",

    /// `flange_back_position_mm` was omitted, and the back of the flange was found in the points of the wheel.
    Info FlangeBackFound {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// y of the back.
        position_mm: f64 = 0.0,
    }
    advice: "Give `flange_back_position_mm` to decide this yourself.",
    detail: "{profile}: flange_back_position_mm was omitted; the back of the flange was found at y = {position_mm:.2} mm and was used",

    /// The stated position of the back of a flange differs from that in the points of the wheel.
    Warning FlangeBackContradicted {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// The stated position.
        given_mm: f64 = -50.0,
        /// y of the back in the points.
        found_mm: f64 = -70.0,
    }
    advice: "Omit `flange_back_position_mm`, or check it. The case is solved as stated.",
    detail: "{profile}: flange_back_position_mm: {given_mm} is stated, but the back of the flange was found at y = {found_mm:.2} mm; the case is \
         solved as stated",

    /// The tread of a wheel is far from z = 0, where `rolling_radius_mm` is measured.
    Warning WheelHeightUnusual {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// y of the tread, 70 mm from the back of the flange.
        y_mm: f64 = 0.0,
        /// z there, positive down.
        z_mm: f64 = 30.0,
    }
    advice: "Check the origin of z: `rolling_radius_mm` is the radius at z = 0 of the wheel's cross-section. Give the radius there, or move the points.",
    detail: "{profile}: the tread, 70 mm from the back of the flange at y = {y_mm:.2} mm, has z = {z_mm:.2} mm; rolling_radius_mm is the radius at \
         z = 0",

    /// The header of a profile file states another number of points than the file has, commented-out rows included.
    Warning ProfileCountDiffers {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Number of points stated in the header.
        stated: usize = 82,
        /// Number of rows that were read.
        found: usize = 83,
    }
    advice: "No action is needed if the file was edited by hand; otherwise check that it is complete.",
    detail: "{profile}: {found} points were read, while the header of the file states {stated}",

    /// Rows of numbers above the points of a profile file were read as a part of its header.
    Info ProfileHeaderRows {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// Number of rows of numbers in the header.
        count: usize = 1,
        /// Line number of the first.
        line: usize = 7,
    }
    advice: "No action is needed if these rows are not points: old files have dimensions of the wheel there.",
    detail: "{profile}: rows of numbers above the points ({count}, the first in line {line}) were read as a part of the header",

    /// The unit in the case differs from the unit in the file of a profile; the unit in the case was used.
    Warning ProfileUnitDiffers {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Length of the stated unit.
        stated_mm: f64 = 1.0,
        /// Length of the unit that the file names.
        file_mm: f64 = 1000.0,
    }
    advice: "Omit `unit` to use the unit of the file.",
    detail: "{profile}: unit states {stated_mm} mm per unit of length, while the file states {file_mm} mm; unit was used",

    /// The size of a profile is unusual in mm, but usual in another unit.
    Warning ProfileSizeUnusual {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Its width.
        width_mm: @short f64 = 7.2,
        /// The unit in which its width would be usual.
        unit: &'static str = "cm",
    }
    advice: "State `unit` of the cross-section if its numbers are not in mm; for models of a reduced scale no action is needed.",
    detail: "{profile}: the profile is {width_mm} mm wide; if its numbers are in {unit}, state unit: \"{unit}\"",

    /// Points of a profile that nearly coincide were merged.
    Info ProfilePointsMerged {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Number of dropped points.
        count: usize = 11,
        /// Points closer than this are merged.
        nearer_than_mm: f64 = 0.001,
    }
    advice: "No action is needed: files often repeat points at the joints of arcs.",
    detail: "{profile}: {count} points less than {nearer_than_mm} mm from another one were merged with it",

    /// Points of a profile that ran backwards were dropped.
    Warning ProfilePointsDropped {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Number of dropped points.
        count: usize = 2,
    }
    advice: "Check the measurement where pieces are joined.",
    detail: "{profile}: {count} points that ran backwards (zig-zag) were dropped",

    /// One or two points at an end of a profile, far from all others, were dropped.
    Info ProfileEndDropped {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// Number of dropped points.
        count: usize = 1,
        /// Their distance from the next point.
        distance_mm: @short f64 = 67.0,
    }
    advice: "No action is needed if the profile ends there; otherwise check the file.",
    detail: "{profile}: {count} stray points at an end, {distance_mm} mm from the next one, were dropped",

    /// A profile has the shape of the other body.
    Warning ProfileOfOtherBody {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// The shape that it has.
        like: &'static str = "a wheel with its flange",
    }
    advice: "Check that rail and wheel were not exchanged. If each looks like the other, the case is refused.",
    detail: "the profile given as {profile} looks like {like}; were rail and wheel exchanged?",

    /// The smoothing of a profile was chosen from its noise and the pressure, as requested.
    Info SmoothingChosen {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Cut-off wavelength; 0 for no smoothing.
        smoothing_mm: f64 = 3.4,
    }
    advice: "No action is needed; give `smoothing_mm` as a number to use the same smoothing in other cases.",
    detail: {
        if *smoothing_mm > 0.0 {
            format!("{profile}: smoothed by {smoothing_mm} mm, chosen from the noise of its points", smoothing_mm = short(smoothing_mm))
        } else {
            format!("{profile}: not smoothed, because its points have little noise")
        }
    },

    /// The points of a profile are too few or too far apart to distinguish noise from shape, so `smoothing_mm: "auto"` chose no
    /// smoothing.
    Warning SmoothingUndecided {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Median distance of its points.
        spacing_mm: @short f64 = 4.0,
    }
    advice: "Send points that lie nearer to each other, 0.25 mm at gauge corner and flange, or give `smoothing_mm` as a number.",
    detail: "{profile}: with points {spacing_mm} mm apart, noise cannot be distinguished from shape, so no smoothing is used",

    /// One point of a profile near the contact, or a few neighbours, are off the curve of the points on both sides.
    Warning ProfileOutlier {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// y of the point with the largest distance.
        at_y_mm: f64 = -3.2,
        /// Distance of this point from the curve of its neighbours.
        distance_um: @short f64 = 200.0,
        /// Number of points that are off.
        points: usize = 1,
        /// y of the first and the last of them.
        y_mm: [f64; 2] = [-3.2, -3.2],
        /// Roughness of the profile as the pressure that flattens it.
        waviness_mpa: @short f64 = 900.0,
        /// Roughness of both profiles divided by the largest pressure.
        share: f64 = 0.4,
    }
    advice: "Remove or correct the points; smoothing only spreads their error.",
    detail: {
        if *points == 1 {
            format!(
                "the {profile}'s point at y = {at_y_mm:.2} mm is {distance_um} µm off the curve of its neighbours, equivalent to \
                 {waviness_mpa} MPa of contact pressure: remove or correct it"
            )
        } else {
            format!(
                "the {profile}'s points jump at y = {at_y_mm:.2} mm: {points} points from y {:.2} to {:.2} mm are up to {distance_um} µm off the \
                 curve of their neighbours, equivalent to {waviness_mpa} MPa of contact pressure: remove or correct them",
                y_mm[0], y_mm[1]
            )
        }
    },

    /// A profile jumps between two points near the contact.
    Warning ProfileStep {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// y on the profile.
        at_y_mm: f64 = -3.2,
        /// Height of the step, positive if the profile rises with y.
        height_um: f64 = 50.0,
        /// Roughness of the profile as the pressure that flattens it.
        waviness_mpa: @short f64 = 900.0,
        /// Roughness of both profiles divided by the largest pressure.
        share: f64 = 0.4,
    }
    advice: "Measure this part again, or join the pieces better: smoothing does not remove a step, and forces are wrong as well.",
    detail: (
        "the {profile}'s points jump by {} µm at y = {at_y_mm:.2} mm, equivalent to {waviness_mpa} MPa of contact pressure: smoothing does \
         not remove a step, measure this part again",
        short(height_um.abs())
    ),

    /// The points of a profile lie on straight chords between fewer points, as linear resampling leaves them.
    Warning ProfilePolygon {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Range of y on the profile.
        y_mm: @span [f64; 2] = [-6.0, 5.0],
        /// Length of the chords.
        chord_mm: @short f64 = 0.5,
        /// Roughness of the profile as the pressure that flattens it.
        waviness_mpa: @short f64 = 200.0,
        /// Roughness of both profiles divided by the largest pressure.
        share: f64 = 0.15,
        /// Suggested smoothing, if any.
        smoothing_mm: Option<f64> = Some(2.5),
    }
    advice: "Send the points as measured, without resampling, or give the `smoothing_mm` named here.",
    detail: (
        "the {profile}'s points under the patch (y {y_mm} mm) lie on straight chords of {chord_mm} mm, as linear resampling leaves \
         them; the kinks are equivalent to {waviness_mpa} MPa of contact pressure: send the points as measured{}",
        smoothing_mm.map_or_else(String::new, |length| format!(", or give smoothing_mm: {length}"))
    ),

    /// Noise of the points of a profile, from the measurement or from rounding, changes the pressure considerably.
    Warning ProfileNoise {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Range of y on the profile.
        y_mm: @span [f64; 2] = [-6.0, 5.0],
        /// Standard deviation along the normal.
        noise_um: @short f64 = 1.9,
        /// Mean distance of the points.
        spacing_mm: @short f64 = 0.25,
        /// Step of which all heights are multiples, if any.
        rounding_mm: Option<f64> = Some(0.01),
        /// Roughness of the profile as the pressure that flattens it.
        waviness_mpa: @short f64 = 210.0,
        /// Roughness of both profiles divided by the largest pressure.
        share: f64 = 0.17,
        /// Suggested smoothing, if any.
        smoothing_mm: Option<f64> = Some(4.0),
    }
    advice: "Give the `smoothing_mm` named here, or `\"auto\"`; send points with more decimals where they were rounded.",
    detail: (
        "noise of {noise_um} µm{} at points {spacing_mm} mm apart makes waves on the {profile} (y {y_mm} mm) equivalent \
         to {waviness_mpa} MPa of contact pressure{}",
        rounding_mm.map_or_else(String::new, |step| format!(" (heights rounded to {step} mm)")),
        smoothing_mm.map_or_else(String::new, |length| format!(": give smoothing_mm: {length}"))
    ),

    /// Waves of a profile that are neither noise nor a single fault change the pressure considerably.
    Warning ProfileWaves {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// Range of y on the profile.
        y_mm: @span [f64; 2] = [-6.0, 5.0],
        /// Upper bound of their wavelength.
        shorter_than_mm: @short f64 = 3.0,
        /// Roughness of the profile as the pressure that flattens it.
        waviness_mpa: @short f64 = 210.0,
        /// Roughness of both profiles divided by the largest pressure.
        share: f64 = 0.17,
    }
    advice: "If they come from the measurement, remove them with a `smoothing_mm` of about their length; real waves belong to the result.",
    detail: "waves on the {profile} shorter than {shorter_than_mm} mm (y {y_mm} mm) are equivalent to {waviness_mpa} MPa of \
         contact pressure: if they come from the measurement, remove them with smoothing_mm",

    /// The points of a profile under the contact are so far apart that the curve between them is uncertain.
    Warning ProfileSpacing {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Interval of y of the largest distance between neighbouring points.
        y_mm: @span [f64; 2] = [-4.1, 3.9],
        /// Length of the interval.
        spacing_mm: @short f64 = 8.0,
        /// Length of the interval divided by the width of the patch.
        spacing_over_width: @short f64 = 0.8,
        /// Pressure that flattens the difference between two curves through the points.
        ambiguity_mpa: @short f64 = 400.0,
    }
    advice: "Send points 0.5 mm apart on the tread, 0.25 mm at gauge corner and flange.",
    detail: "the {profile}'s points are {spacing_mm} mm apart where it touches (y {y_mm} mm), {spacing_over_width} times the width of the \
         patch; the curve between them is uncertain by {ambiguity_mpa} MPa of pressure: send more points there",

    /// A profile has a stretch without points near the contact in which the bodies may also touch.
    Warning ProfileHole {
        /// `rail` or `wheel`.
        profile: &'static str = "rail",
        /// Range of y of the stretch.
        y_mm: @span [f64; 2] = [-25.0, 25.0],
        /// Length of the interval.
        hole_mm: @short f64 = 50.0,
    }
    advice: "Send the points there: the contact may be elsewhere than found.",
    detail: "the {profile} has no points from y {y_mm} mm ({hole_mm} mm), where the bodies may touch: the contact may be elsewhere than \
         found; send the points there",

    // Contact of a wheel and a rail: its position, and what its model neglects.

    /// The contact is on the tip of the flange, as on a wheel that climbs or has derailed.
    Warning ContactOnFlangeTip {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// Range of y on the profile.
        y_mm: @span [f64; 2] = [-58.0, -52.0],
    }
    advice: "Check lateral shift, gauge, flange-back distance and position.",
    detail: "the contact at y {y_mm} mm of the {profile} is on the tip of its flange, as on a wheel that climbs or has derailed: check lateral \
         shift, gauge and flange-back distance",

    /// The contact is near the end of a profile, so that part of it may be cut off.
    Warning ContactAtProfileEnd {
        /// `rail` or `wheel`.
        profile: &'static str = "wheel",
        /// Range of y on the profile.
        y_mm: @span [f64; 2] = [52.0, 58.0],
        /// Length of the profile beyond the contact.
        left_mm: @short f64 = 2.0,
    }
    advice: "Check lateral shift and gauge, or send at least 5 mm of profile beyond the contact.",
    detail: "the contact at y {y_mm} mm of the {profile} is {left_mm} mm from the end of its profile: check lateral shift and gauge, or send \
         a longer profile",

    /// The target is smaller than the uncertainty due to the measurement of the profiles; a finer solution does not improve the
    /// result.
    Info TargetBelowProfileUncertainty {
        /// The target, relative to μN.
        target: @percent f64 = 1e-3,
        /// Uncertainty of the forces due to the profiles, relative to μN.
        uncertainty: @percent f64 = 0.02,
    }
    advice: "A better measurement reduces the uncertainty; a smaller target does not.",
    detail: "the profiles leave forces uncertain by {uncertainty} % of μN, more than the target of {target} %",

    /// The target is smaller than the error that the factors for the turn of the contact surface leave: a finer solve adds nothing.
    Info TargetBelowCurveError {
        /// The target, relative to μN.
        target: @percent f64 = 5e-3,
        /// Error of forces due to the factors, relative to μN; it is part of the error estimates.
        error: @percent f64 = 0.035,
    }
    advice: "The error is part of the estimates; `target_met` judges the rest of them. Give `influence` \"half_space\" to leave the factors out.",
    detail: "the surface turns under the contact, which leaves forces uncertain by {error} % of μN, more than the target of {target} %",

    /// The case names no reference surface and cannot be solved on the curve of the rail, so it is solved on planes of contact.
    Warning OnPlanes {
        /// The reason.
        reason: String = "only boundary_element is solved on the curve of the rail".to_owned(),
    }
    advice: "Expect larger errors than the error estimate where the rail bends under a patch: 15 % of μN at a gauge corner. Give `reference_surface` \"plane\" to solve on planes without this remark.",
    detail: "solved on planes of contact: {reason}",

    /// The slope of the surface changes over the contact by more than the range for which influence factors are known.
    Info TurnBeyondRange {
        /// Turn of the rail's surface from one end of the contact to the other.
        turn_rad: @short f64 = 1.4,
        /// Turn up to which the factors were compared with boundary elements.
        range_rad: f64 = 1.25,
    }
    advice: "Treat the forces as approximate: the influence between the ends of the contact is extrapolated, and the rail head is not a half-space there.",
    detail: "the surface turns by {turn_rad} rad over the contact; the influence between its ends is known up to {range_rad} rad",

    /// The tractions of one of several motions change the number of patches or have no solution; the pressures of this motion
    /// are those without tractions.
    Warning NormalForcesAloneBalance {}
    advice: "Submit the motion as a separate case to include the effect of its tractions on the pressures and of its friction on the vertical balance.",
    detail: "the tractions of this motion change the number of patches, which must be the same for all motions of a case, or have no \
             solution: its pressures are those without tractions, and normal forces alone balance the load",

    /// All points of a history under a vertical force have the pressures of its last point.
    Info PressuresOfLastPoint {
        /// Largest relative difference between the vertical forces of a point and the last one.
        part: @percent f64 = 0.12,
    }
    advice: "Compare `total.force_z_n` of the points with the load; end the history where the forces are needed, or give `normal_force_n`.",
    detail: "all points of a history have the pressures of its last one, at which the vertical force is met; at other points friction \
         changes the vertical force by up to {part} %, which the error estimates of their forces include",

    // The normal problem: region, pressure and load.

    /// Pressure and region still change when the grid of the normal problem is refined.
    Warning GapRough {}
    advice: "Smooth the gap; if the surfaces are really as rough as this, give it on a finer grid.",
    detail: "the gap is rough: pressure and region still change when the grid of the normal problem is refined",

    /// A patch that carries a noticeable part of the load has few cells in the normal problem.
    Warning PatchCoarse {
        /// Number of cells across its narrower side.
        cells_across: f64 = 4.0,
        /// Its share of the load.
        load_share: @percent f64 = 0.059,
    }
    advice: "Take the width and the pressure of this patch as uncertain by some per cent; if it matters, solve it in a separate case.",
    detail: "the patch carries {load_share} % of the load and has only {cells_across:.0} cells across: its width and its pressure are uncertain by \
         some per cent",

    /// A given pressure does not fall to 0 at the edge of its grid.
    Warning PressureCutAtEdge {}
    advice: "Give the pressure over the whole region where it is more than 0, with one row of zeros around it.",
    detail: "the pressure does not fall to 0 at the edge of the grid; the contact is taken to end within the next spacing",

    /// A patch of a given pressure has few samples.
    Warning PressureCoarse {
        /// Number of samples in the rolling direction.
        samples_x: usize = 4,
        /// Number of samples in the lateral direction.
        samples_y: usize = 7,
    }
    advice: "Give the pressure on a finer grid.",
    detail: "the patch has only {samples_x} by {samples_y} samples of pressure; its force and its edge are uncertain by some per cent",

    /// The given pressure jumps from one sample to the next, more than it would at the edge of a contact. Strips and cells do not follow
    /// the jump, and errors may be larger than estimated.
    Warning PressureJumps {
        /// x of the largest jump, halfway between two samples.
        x_mm: @short f64 = 1.5,
        /// y of the largest jump.
        y_mm: @short f64 = -0.5,
        /// Height of the jump divided by the largest pressure.
        share_of_largest: @short f64 = 0.8,
    }
    advice: "Give finer samples, or smooth the pressure over two or three of them.",
    detail: "the pressure jumps by {share_of_largest} of its largest value between samples at ({x_mm}, {y_mm}) mm, which strips and cells do not follow",

    /// The contact is long compared with the rolling radius: the bodies are nearly conformal.
    Warning NearlyConformal {
        /// Length of the contact along rolling.
        length_mm: @short f64 = 14.2,
        /// Rolling radius.
        rolling_radius_mm: f64 = 20.0,
    }
    advice: "Half-spaces do not describe such bodies: treat the result as approximate.",
    detail: "the contact is {length_mm} mm long, compared with a rolling radius of {rolling_radius_mm} mm: the bodies are nearly \
         conformal, and half-spaces do not describe them",

    /// The bodies overlap so deeply that strains are too large for linear elasticity.
    Warning StrainsTooLarge {
        /// Approach from first touch.
        overlap_mm: @short f64 = 1.1,
        /// Smaller half width of the contact.
        half_width_mm: @short f64 = 3.4,
    }
    advice: "Check units and load. If they are right, the bodies yield and pressures are lower than those of the result.",
    detail: "the bodies overlap by {overlap_mm} mm, compared with a half width of {half_width_mm} mm of the contact: strains are too large for linear elasticity",

    /// The patch is large compared with the radii of the bodies, so that half-spaces do not describe them.
    Warning PatchLarge {
        /// `rolling` or `lateral`.
        direction: &'static str = "rolling",
        /// Half width of the patch in this direction.
        half_width_mm: @short f64 = 210.0,
        /// Relative radius in this direction.
        radius_mm: f64 = 460.0,
    }
    advice: "Check the units of load and radii: bodies are like half-spaces only if the half width is below a third of the radius.",
    detail: "the patch has a half width of {half_width_mm} mm in the {direction} direction, compared with a radius of {radius_mm} mm",

    /// The largest pressure is far above the strength of steel.
    Warning PressureImplausible {
        /// Largest pressure.
        pressure_max_mpa: @short f64 = 8100.0,
        /// Largest value without a remark.
        usual_max_mpa: f64 = 5000.0,
    }
    advice: "Check the units of load and geometry. If they are right, the bodies yield and the pressure is lower than that of the result.",
    detail: "the largest pressure is {pressure_max_mpa} MPa, more than {usual_max_mpa} MPa: bodies of steel would yield",

    /// A length of the track or the wheelset is unusual in mm, but usual in another unit.
    Warning LengthUnusual {
        /// The given length.
        length_mm: f64 = 1.435,
        /// The unit in which it would be usual.
        unit: &'static str = "m",
    }
    advice: "Check its unit: lengths are in mm.",
    detail: "{length_mm} mm is unusual here and would be usual in {unit}: lengths are in mm",

    /// The largest pressure is above the shakedown limit of rail steel.
    Info PressureAboveShakedown {
        /// Largest pressure.
        pressure_max_mpa: f64 = 1900.0,
        /// The shakedown limit.
        shakedown_limit_mpa: f64 = 1500.0,
    }
    advice: "The result is elastic. Harder steel has a higher limit; traction lowers it.",
    detail: "the largest pressure of {pressure_max_mpa:.0} MPa is above {shakedown_limit_mpa} MPa, the shakedown limit of rail steel R260 in \
         pure rolling: repeated passages deform the surface plastically",

    /// The load is larger than any wheel carries.
    Warning LoadImplausible {
        /// Normal force of all patches.
        normal_force_n: @short f64 = 1e12,
        /// Largest value without a remark.
        usual_max_n: f64 = 1e7,
    }
    advice: "Check its unit: forces are in N.",
    detail: "the normal force is {normal_force_n} N, more than {usual_max_n:e} N",

    // Motions and their forces.

    /// Creepages are so large that they are no longer a small part of the rolling speed.
    Warning CreepageLarge {
        /// Longitudinal creepage.
        creepage_x: @short f64 = 5.0,
        /// Lateral creepage.
        creepage_y: @short f64 = 0.0,
        /// Spin times √(area/π) of the patch; absent if the patch is not known yet.
        spin_times_length: Option<f64> = Some(0.002),
        /// Largest value without a remark.
        usual_max: f64 = 0.2,
    }
    advice: "Check the unit (creepages are ratios, spin is in 1/mm). At such sliding speeds forces also depend on heat and wear.",
    detail: {
        let spin = spin_times_length.map(|spin| format!(" and the spin times the length of the patch is {}", short(spin)));
        let spin = spin.unwrap_or_default();
        format!("the creepages are {creepage_x} and {creepage_y}{spin}; the theory is made for values up to {usual_max}")
    },

    /// The second discretisation rule did not converge; forces come from the first alone.
    Warning SecondRuleFailed {}
    advice: "Use the forces with their larger error estimate, or try another mesh or target.",
    detail: "the trapezoid rule did not converge; forces come from the three-point rule and their error is larger",

    /// A solve for the gradients of a motion did not converge.
    Warning GradientsNotConverged {}
    advice: "The forces are not affected. Without gradients, take differences between motions.",
    detail: "a solve for the gradients of this motion did not converge; they are missing",

    /// The contact passes so slowly that heat also flows along the surface.
    Warning HeatSpreads {
        /// Péclet number.
        peclet: @short f64 = 0.24,
        /// Smallest value without a remark.
        least: f64 = 10.0,
    }
    advice: "Take the temperatures as an upper bound; check the speed, which is in mm/s.",
    detail: "the Péclet number is {peclet}; temperatures are computed as if heat flowed only into the depth, which holds from about {least} on",

    /// The estimated error exceeds the target, or is unknown.
    Warning TargetMissed {
        /// The reference of error and target.
        relative_to: &'static str = "μN",
        /// Estimated error; absent if it is unknown.
        estimate: Option<f64> = Some(2.3e-3),
        /// The target.
        target: f64 = 1e-3,
    }
    advice: "Use the numbers with their error estimate, or request a larger target.",
    detail: {
        match estimate {
            Some(estimate) => format!("the error relative to {relative_to} is estimated at {}, the target was {target}", short(estimate)),
            None => format!("the error relative to {relative_to} is unknown, the target was {target}"),
        }
    },

    /// The error is a large part of the force, although it is a small part of μN.
    Info ErrorLargeForForce {
        /// Estimated error divided by the tangential force.
        error_over_force: f64 = 0.25,
        /// Tangential force divided by μN.
        force_over_limit: @short f64 = 0.02,
        /// Largest ratio of error and force without a remark.
        usual_max: f64 = 0.1,
    }
    advice: "Give `solver.relative_to: \"force\"` to solve to a share of the force, or a smaller `target_error`.",
    detail: (
        "the force is {force_over_limit} of μN, and its estimated error is {:.0} % of it; the target counts relative to μN",
        100.0 * error_over_force
    ),

    /// No creepage gives the prescribed force; the result has the nearest force found.
    Warning ForceUnreachable {
        /// Prescribed longitudinal force, if any.
        wanted_x_n: Option<f64> = Some(29_000.0),
        /// Prescribed lateral force, if any.
        wanted_y_n: Option<f64> = None,
        /// Longitudinal force of the result.
        found_x_n: f64 = 28_100.0,
        /// Lateral force of the result.
        found_y_n: f64 = -350.0,
    }
    advice: "Prescribe a smaller force: the tractions due to spin use up a part of μN. The motion has `saturated: true`.",
    detail: {
        let wanted = |force: &Option<f64>| {
            force.map_or_else(|| "free".to_owned(), |force| format!("{force} N"))
        };
        format!(
            "no creepage gives the prescribed force (x: {}, y: {}); the nearest found is {found_x_n:.6e} N, {found_y_n:.6e} N",
            wanted(wanted_x_n), wanted(wanted_y_n)
        )
    },

    /// An iteration ended before it met its tolerance; its result is used.
    Warning IterationInexact {
        /// The iteration.
        iteration: &'static str = "force control",
        /// The reason why it ended, as a clause.
        reason: &'static str = "the iteration limit was reached",
        /// Its last residual.
        residual: f64 = 3e-5,
        /// The tolerance of the residual.
        tolerance: f64 = 2e-6,
    }
    advice: "Compare `residual` with `tolerance` to decide whether the result is accurate enough; the error estimate does not include this deviation.",
    detail: "{iteration} ended before its tolerance was met: {reason}; the residual is {residual:.2e}, the tolerance {tolerance:.2e}",

    /// The scatter of the wear coefficients is not published; a stated factor replaces it.
    Info CoefficientScatterStated {
        /// The factor.
        factor: f64 = 2.0,
    }
    advice: "Give the scatter of your own measurements as `coefficient_factor`.",
    detail: "no scatter of the coefficients of this wear map is published; it is assumed to be a factor of {factor} with a probability of 90 %",

    /// The contact pressure of a worn profile exceeds the hardness of the steel.
    Warning PressureAboveHardness {
        /// Largest pressure of the evolution.
        largest_mpa: f64 = 3100.0,
        /// Hardness.
        hardness_mpa: f64 = 2550.0,
    }
    advice: "Plastic flow would round the section there. Add states of traction, braking and other shifts to the traffic: a traffic without them leaves a ridge where nothing slips.",
    detail: "the largest pressure is {largest_mpa:.0} MPa, above the hardness of {hardness_mpa:.0} MPa; plastic flow is not modelled",

    /// A condensed traffic does not meet its tolerance.
    Warning TrafficCoarse {
        /// Its error.
        traffic_error: @percent f64 = 0.06,
        /// The tolerance.
        tolerance_asked: @percent f64 = 0.03,
    }
    advice: "Raise `accuracy.states_max`.",
    detail: "twice the number of states would change the distribution of wear by {traffic_error} %; the tolerance is {tolerance_asked} %",

    /// Part of the traffic could not be solved and causes no wear.
    Warning StatesUnsolved {
        /// Largest share of the traffic that could not be solved.
        unsolved_share: @percent f64 = 0.03,
    }
    advice: "`failure` in the states of the records says why.",
    detail: "up to {unsolved_share} % of the traffic could not be solved and causes no wear",

    /// An evolution ended before its extent.
    Warning EvolutionEndedEarly {
        /// The reason.
        reason: String = "the largest number of steps, 1000, is done".to_owned(),
        /// Share of the extent that is done.
        done_share: @percent f64 = 0.4,
    }
    advice: "The records are those up to the end. Raise `accuracy.steps_max` or `accuracy.step_depth_mm`, or shorten the extent.",
    detail: "the evolution ended when {done_share} % of its extent was done: {reason}",
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::remark::entry::RemarkEntry;
    use crate::remark::list::Remark;

    #[test]
    fn every_code_is_listed_once_and_documented() {
        let kinds = Remark::kinds();
        assert_eq!(kinds.len(), Remark::examples().len());
        let codes: BTreeSet<_> = kinds.iter().map(|kind| kind.code).collect();
        assert_eq!(codes.len(), kinds.len(), "a code stands twice");
        for kind in kinds {
            let words = kind.code.split('-');
            let kebab =
                |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase());
            assert!(
                words.into_iter().all(kebab),
                "{} is no kebab-case",
                kind.code
            );
            for text in [kind.meaning, kind.advice] {
                assert!(
                    text.len() > 15 && text.ends_with('.'),
                    "{}: {text}",
                    kind.code
                );
            }
            assert!(
                kind.example.len() > 15 && !kind.example.ends_with('.'),
                "{}: {}",
                kind.code,
                kind.example
            );
        }
    }

    #[test]
    fn figures_have_names_of_their_own() {
        let members = serde_json::to_value(RemarkEntry {
            patch: Some(0),
            point: Some(0),
            also_at_points: vec![[1, 2]],
            pointer: Some(String::new()),
            ..Remark::GapRough {}.into()
        });
        let members = members.unwrap();
        for (kind, example) in Remark::kinds().iter().zip(Remark::examples()) {
            assert!(
                kind.figures.iter().all(|name| members.get(name).is_none()),
                "{} has a figure named as a member of every remark",
                kind.code
            );
            let given = example.figures();
            let left_out = kind.figures.len() - given.len();
            // Of optional figures at least one is shown.
            assert!(
                left_out == 0 || !given.is_empty(),
                "{}: {given:?}",
                kind.code
            );
        }
    }
}
