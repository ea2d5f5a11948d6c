//! Remarks on the profiles of rail and wheel: how they were read, and how well their points describe them.

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! profile_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// The shape of a profile shows that its z is positive upward; z was mirrored.
            Info ProfileZMirrored {
                /// Whose.
                profile: &'static str = "rail",
            }
            advice: "Give `mirror_z` to decide this yourself.",
            detail: format!("{profile}: z was recognised as positive upward and has been mirrored"),

            /// The flange of a wheel is not at the end of y that is usual for the format; the direction of y was taken from the flange.
            Info ProfileYMirrored {
                /// Whose.
                profile: &'static str = "wheel",
                /// Whether y grows toward the flange (`positive`) or away from it (`negative`).
                flange: &'static str = "positive",
            }
            advice: "Give `mirror_y` to decide this yourself.",
            detail: if *flange == "positive" {
                format!("{profile}: the flange was found at the positive end of y, so y has been mirrored (mirror_y: true)")
            } else {
                format!(
                    "{profile}: the flange was found at the negative end of y, so y has not been mirrored as is usual for this format \
                     (mirror_y: false)"
                )
            },

            /// A stated direction of y or z contradicts the shape of the profile.
            Warning ProfileSenseContradicted {
                /// Whose.
                profile: &'static str = "wheel",
                /// The member that states it.
                member: &'static str = "mirror_y",
                /// Its value.
                given: &'static str = "true",
            }
            advice: "Omit `mirror_y` or `mirror_z`, or check the measurement. The case is solved as stated.",
            detail: format!(
                "{profile}: {member}: {given} is stated, but the shape of the points shows the opposite; the case is solved as stated"
            ),

            /// `flange_back_position_mm` was omitted, and the back of the flange was found in the points of the wheel.
            Info FlangeBackFound {
                /// Whose.
                profile: &'static str = "wheel",
                /// y of the back.
                position_mm: f64 = 0.0,
            }
            advice: "Give `flange_back_position_mm` to decide this yourself.",
            detail: format!(
                "{profile}: flange_back_position_mm was omitted; the back of the flange was found at y = {position_mm:.2} mm and was used"
            ),

            /// The stated position of the back of a flange differs from that in the points of the wheel.
            Warning FlangeBackContradicted {
                /// Whose.
                profile: &'static str = "wheel",
                /// The stated position.
                given_mm: f64 = -50.0,
                /// y of the back in the points.
                found_mm: f64 = -70.0,
            }
            advice: "Omit `flange_back_position_mm`, or check it. The case is solved as stated.",
            detail: format!(
                "{profile}: flange_back_position_mm: {given_mm} is stated, but the back of the flange was found at y = {found_mm:.2} mm; the case is \
                 solved as stated"
            ),

            /// The header of a profile file states another number of points than the file has, commented-out rows included.
            Warning ProfileCountDiffers {
                /// Whose.
                profile: &'static str = "rail",
                /// Points by the header.
                stated: usize = 82,
                /// Rows that were read.
                found: usize = 83,
            }
            advice: "No action is needed if the file was edited by hand; otherwise check that it is complete.",
            detail: format!("{profile}: {found} points were read, while the header of the file states {stated}"),

            /// Rows of numbers above the points of a profile file were read as a part of its header.
            Info ProfileHeaderRows {
                /// Whose.
                profile: &'static str = "wheel",
                /// Rows of numbers in the header.
                count: usize = 1,
                /// Line of the first.
                line: usize = 7,
            }
            advice: "No action is needed if these rows are not points: old files have dimensions of the wheel there.",
            detail: format!("{profile}: rows of numbers above the points ({count}, the first in line {line}) were read as a part of the header"),

            /// The unit in the case differs from the unit in the file of a profile; the unit in the case was used.
            Warning ProfileUnitDiffers {
                /// Whose.
                profile: &'static str = "rail",
                /// Length of the stated unit.
                stated_mm: f64 = 1.0,
                /// Length of the unit that the file names.
                file_mm: f64 = 1000.0,
            }
            advice: "Omit `unit` to use the unit of the file.",
            detail: format!("{profile}: unit states {stated_mm} mm per unit of length, while the file states {file_mm} mm; unit was used"),

            /// The size of a profile is unusual in mm, but usual in another unit.
            Warning ProfileSizeUnusual {
                /// Whose.
                profile: &'static str = "rail",
                /// Its width.
                width_mm: f64 = 7.2,
                /// The unit in which its width would be usual.
                unit: &'static str = "cm",
            }
            advice: "State `unit` of the cross-section if its numbers are not in mm; for models of a reduced scale no action is needed.",
            detail: format!("{profile}: the profile is {width_mm} mm wide; if its numbers are in {unit}, state unit: \"{unit}\"", width_mm = short(width_mm)),

            /// Points of a profile that nearly coincide were merged.
            Info ProfilePointsMerged {
                /// Whose.
                profile: &'static str = "rail",
                /// Points left out.
                count: usize = 11,
                /// Points nearer than this are one.
                nearer_than_mm: f64 = 0.001,
            }
            advice: "No action is needed: files often repeat points at the joints of arcs.",
            detail: format!("{profile}: {count} points less than {nearer_than_mm} mm from another one were merged with it"),

            /// Points of a profile that ran backwards were dropped.
            Warning ProfilePointsDropped {
                /// Whose.
                profile: &'static str = "rail",
                /// Points left out.
                count: usize = 2,
            }
            advice: "Check the measurement where pieces are joined.",
            detail: format!("{profile}: {count} points that ran backwards (zig-zag) were dropped"),

            /// One or two points at an end of a profile, far from all others, were dropped.
            Info ProfileEndDropped {
                /// Whose.
                profile: &'static str = "wheel",
                /// Points left out.
                count: usize = 1,
                /// Their distance from the next point.
                distance_mm: f64 = 67.0,
            }
            advice: "No action is needed if the profile ends there; otherwise check the file.",
            detail: format!("{profile}: {count} stray points at an end, {distance_mm} mm from the next one, were dropped", distance_mm = short(distance_mm)),

            /// A profile has the shape of the other body.
            Warning ProfileOfOtherBody {
                /// Which.
                profile: &'static str = "rail",
                /// What it looks like.
                like: &'static str = "a wheel with its flange",
            }
            advice: "Check that rail and wheel were not exchanged. If each looks like the other, the case is refused.",
            detail: format!("the profile given as {profile} looks like {like}; were rail and wheel exchanged?"),

            /// The smoothing of a profile was chosen from its noise and the pressure, as requested.
            Info SmoothingChosen {
                /// Whose.
                profile: &'static str = "rail",
                /// Cut wavelength; 0 for none.
                smoothing_mm: f64 = 3.4,
            }
            advice: "No action is needed; give `smoothing_mm` as a number to use the same smoothing in other cases.",
            detail: if *smoothing_mm > 0.0 {
                format!("{profile}: smoothed by {smoothing_mm} mm, chosen from the noise of its points", smoothing_mm = short(smoothing_mm))
            } else {
                format!("{profile}: not smoothed, because its points have little noise")
            },

            /// The points of a profile are too few or too far apart to distinguish noise from shape, so `smoothing_mm: "auto"` chose no
            /// smoothing.
            Warning SmoothingUndecided {
                /// Whose.
                profile: &'static str = "rail",
                /// Median distance of its points.
                spacing_mm: f64 = 4.0,
            }
            advice: "Send points that lie nearer to each other, 0.25 mm at gauge corner and flange, or give `smoothing_mm` as a number.",
            detail: format!(
                "{profile}: with points {spacing_mm} mm apart, noise cannot be distinguished from shape, so no smoothing is used",
                spacing_mm = short(spacing_mm)
            ),

            /// One point of a profile near the contact, or a few neighbours, are off the curve of the points on both sides.
            Warning ProfileOutlier {
                /// Whose.
                profile: &'static str = "rail",
                /// Place on the profile of the point farthest off.
                at_y_mm: f64 = -3.2,
                /// Distance of this point from the curve.
                distance_um: f64 = 200.0,
                /// Number of points that are off.
                points: usize = 1,
                /// Places of the first and of the last of them.
                y_mm: [f64; 2] = [-3.2, -3.2],
                /// Roughness of this profile as the pressure that flattens it.
                waviness_mpa: f64 = 900.0,
                /// That of both profiles over the largest pressure.
                share: f64 = 0.4,
            }
            advice: "Remove or correct the points; smoothing only spreads their error.",
            detail: if *points == 1 {
                format!(
                    "the {profile}'s point at y = {at_y_mm:.2} mm is {distance_um} µm off the curve of its neighbours, equivalent to \
                     {waviness_mpa} MPa of contact pressure: remove or correct it",
                distance_um = short(distance_um),
                waviness_mpa = short(waviness_mpa)
                )
            } else {
                format!(
                    "the {profile}'s points jump at y = {at_y_mm:.2} mm: {points} points from y {:.2} to {:.2} mm are up to {distance_um} µm off the \
                     curve of their neighbours, equivalent to {waviness_mpa} MPa of contact pressure: remove or correct them", y_mm[0], y_mm[1],
                distance_um = short(distance_um),
                waviness_mpa = short(waviness_mpa)
                )
            },

            /// A profile jumps between two points near the contact.
            Warning ProfileStep {
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
            advice: "Measure this part again, or join the pieces better: smoothing does not remove a step, and forces are wrong as well.",
            detail: format!(
                "the {profile}'s points jump by {} µm at y = {at_y_mm:.2} mm, equivalent to {waviness_mpa} MPa of contact pressure: smoothing does \
                 not remove a step, measure this part again", short(height_um.abs()),
                waviness_mpa = short(waviness_mpa)
            ),

            /// The points of a profile lie on straight chords between fewer points, as linear resampling leaves them.
            Warning ProfilePolygon {
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
            advice: "Send the points as measured, without resampling, or give the `smoothing_mm` named here.",
            detail: format!(
                "the {profile}'s points under the patch (y {:.1} to {:.1} mm) lie on straight chords of {chord_mm} mm, as linear resampling leaves \
                 them; the kinks are equivalent to {waviness_mpa} MPa of contact pressure: send the points as measured{}",
                y_mm[0], y_mm[1],
                smoothing_mm.map_or_else(String::new, |length| format!(", or give smoothing_mm: {length}")),
                chord_mm = short(chord_mm),
                waviness_mpa = short(waviness_mpa)
            ),

            /// Noise of the points of a profile, from the measurement or from rounding, changes the pressure considerably.
            Warning ProfileNoise {
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
            advice: "Give the `smoothing_mm` named here, or `\"auto\"`; send points with more decimals where they were rounded.",
            detail: format!(
                "noise of {noise_um} µm{} at points {spacing_mm} mm apart makes waves on the {profile} (y {:.1} to {:.1} mm) equivalent \
                 to {waviness_mpa} MPa of contact pressure{}",
                rounding_mm.map_or_else(String::new, |step| format!(" (heights rounded to {step} mm)")),
                y_mm[0], y_mm[1],
                smoothing_mm.map_or_else(String::new, |length| format!(": give smoothing_mm: {length}")),
                noise_um = short(noise_um),
                spacing_mm = short(spacing_mm),
                waviness_mpa = short(waviness_mpa)
            ),

            /// Waves of a profile that are neither noise nor a single fault change the pressure considerably.
            Warning ProfileWaves {
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
            advice: "If they come from the measurement, remove them with a `smoothing_mm` of about their length; real waves belong to the result.",
            detail: format!(
                "waves on the {profile} shorter than {shorter_than_mm} mm (y {:.1} to {:.1} mm) are equivalent to {waviness_mpa} MPa of \
                 contact pressure: if they come from the measurement, remove them with smoothing_mm", y_mm[0], y_mm[1],
                shorter_than_mm = short(shorter_than_mm),
                waviness_mpa = short(waviness_mpa)
            ),

            /// The points of a profile under the contact are so far apart that the curve between them is uncertain.
            Warning ProfileSpacing {
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
            advice: "Send points 0.5 mm apart on the tread, 0.25 mm at gauge corner and flange.",
            detail: format!(
                "the {profile}'s points are {spacing_mm} mm apart where it touches (y {:.1} to {:.1} mm), {spacing_over_width} times the width of the \
                 patch; the curve between them is uncertain by {ambiguity_mpa} MPa of pressure: send more points there", y_mm[0], y_mm[1],
                spacing_mm = short(spacing_mm),
                spacing_over_width = short(spacing_over_width),
                ambiguity_mpa = short(ambiguity_mpa)
            ),

            /// A profile has a stretch without points near the contact in which the bodies may also touch.
            Warning ProfileHole {
                /// Whose.
                profile: &'static str = "rail",
                /// The stretch, from and to.
                y_mm: [f64; 2] = [-25.0, 25.0],
                /// Its length.
                hole_mm: f64 = 50.0,
            }
            advice: "Send the points there: the contact may be elsewhere than found.",
            detail: format!(
                "the {profile} has no points from y {:.1} to {:.1} mm ({hole_mm} mm), where the bodies may touch: the contact may be elsewhere than \
                 found; send the points there", y_mm[0], y_mm[1],
                hole_mm = short(hole_mm)
            ),
        }
    };
}
pub(crate) use profile_remarks;
