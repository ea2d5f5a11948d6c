//! Cases to begin with: those of `api/examples`, which the contract shows and `/v1/examples` answers.

macro_rules! examples {
    ($($name:literal: $summary:literal;)*) => {
        [$((
            $name,
            $summary,
            include_str!(concat!("../../api/examples/", $name, ".case.json")),
        )),*]
    };
}

/// Name, summary and text of each.
pub(super) const EXAMPLES: [(&str, &str, &str); 17] = examples! {
    "hertz-steel": "A wheel on a rail by its radii, with both creepages and spin";
    "spin": "An ellipse with lateral creepage and spin";
    "uic60-crown": "A wheel on a UIC60-like crown of arcs, as a measured gap: region and pressure are found";
    "area-132re-crown": "A coned wheel on an AREA-132RE-like crown, touching beside the middle";
    "two-patches": "A gap on a grid with two contact patches";
    "wheel-rail": "A wheel on a rail by their cross-sections, under a vertical force, with the motion of the wheelset";
    "wheel-rail-flange": "A wheel on a rail by their cross-sections, touching at the gauge corner and at the flange";
    "wheelset": "A wheelset on both rails at three shifts, rolling freely, with its equivalent conicity";
    "maintenance": "What one wheel does to a rail: stresses below the worst point, wear and fatigue, temperatures";
    "friction": "A creep curve of a wet rail: friction that falls with slip, and a layer between the bodies";
    "unlike-bodies": "A soft roller driving on steel: bodies whose pressure and tractions depend on each other";
    "rolling": "Rolling that changes: a shift, driving, then braking, each with what the contact remembers";
    "pressure-grid": "A given pressure over a patch of any shape";
    "sweep": "A creep curve: many motions on the same patch";
    "paper-figure-3": "Slip and stick under longitudinal creepage and several spins, as figure 3 of Liu and Hsu, on a patch without symmetry";
    "paper-figure-4": "Slip and stick under pure spin, down to separate poles, as their figure 4";
    "paper-figure-5": "Force and moment against longitudinal creepage, as their figure 5";
};
