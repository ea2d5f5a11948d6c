//! Cases to begin with: those of `api/examples`, which the contract shows and `/v1/examples` answers.

/// Name, summary and text of each.
pub(super) const EXAMPLES: [(&str, &str, &str); 17] = [
    (
        "hertz-steel",
        "A wheel on a rail by its radii, with both creepages and spin",
        include_str!("../../api/examples/hertz-steel.case.json"),
    ),
    (
        "spin",
        "An ellipse with lateral creepage and spin",
        include_str!("../../api/examples/spin.case.json"),
    ),
    (
        "uic60-crown",
        "A wheel on a UIC60-like crown of arcs, as a measured gap: region and pressure are found",
        include_str!("../../api/examples/uic60-crown.case.json"),
    ),
    (
        "area-132re-crown",
        "A coned wheel on an AREA-132RE-like crown, touching beside the middle",
        include_str!("../../api/examples/area-132re-crown.case.json"),
    ),
    (
        "two-patches",
        "A gap on a grid with two contact patches",
        include_str!("../../api/examples/two-patches.case.json"),
    ),
    (
        "wheel-rail",
        "A wheel on a rail by their cross-sections, under a vertical force, with the motion of the wheelset",
        include_str!("../../api/examples/wheel-rail.case.json"),
    ),
    (
        "wheel-rail-flange",
        "A wheel on a rail by their cross-sections, touching at the gauge corner and at the flange",
        include_str!("../../api/examples/wheel-rail-flange.case.json"),
    ),
    (
        "wheelset",
        "A wheelset on both rails at three shifts, rolling freely, with its equivalent conicity",
        include_str!("../../api/examples/wheelset.case.json"),
    ),
    (
        "maintenance",
        "What one wheel does to a rail: stresses below the worst point, wear and fatigue, temperatures",
        include_str!("../../api/examples/maintenance.case.json"),
    ),
    (
        "friction",
        "A creep curve of a wet rail: friction that falls with slip, and a layer between the bodies",
        include_str!("../../api/examples/friction.case.json"),
    ),
    (
        "unlike-bodies",
        "A soft roller driving on steel: bodies whose pressure and tractions depend on each other",
        include_str!("../../api/examples/unlike-bodies.case.json"),
    ),
    (
        "rolling",
        "Rolling that changes: a shift, driving, then braking, each with what the contact remembers",
        include_str!("../../api/examples/rolling.case.json"),
    ),
    (
        "pressure-grid",
        "A given pressure over a patch of any shape",
        include_str!("../../api/examples/pressure-grid.case.json"),
    ),
    (
        "sweep",
        "A creep curve: many motions on the same patch",
        include_str!("../../api/examples/sweep.case.json"),
    ),
    (
        "paper-figure-3",
        "Slip and stick under longitudinal creepage and several spins, as figure 3 of Liu and Hsu, on a patch without symmetry",
        include_str!("../../api/examples/paper-figure-3.case.json"),
    ),
    (
        "paper-figure-4",
        "Slip and stick under pure spin, down to separate poles, as their figure 4",
        include_str!("../../api/examples/paper-figure-4.case.json"),
    ),
    (
        "paper-figure-5",
        "Force and moment against longitudinal creepage, as their figure 5",
        include_str!("../../api/examples/paper-figure-5.case.json"),
    ),
];
