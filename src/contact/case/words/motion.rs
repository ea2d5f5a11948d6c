//! The member `motion` of a case: one motion, a list, a sweep, a history or the motion of a wheelset.

use railhead_macros::{Members, Words, keyword, none_is_absent};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::case::words::object::{AllowedRange, Member, Object, shown};
use crate::rolling::history::plan::HistoryStart;

/// A motion of a case: creepages and spin. A tangential force may replace a creepage; the creepage is then computed and reported.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, ToSchema, Members)]
#[members(faults_of_components)]
pub struct AskedMotion {
    /// Longitudinal creepage, dimensionless; default 0.
    #[member(closed(-1e6, 1e6, ""))]
    pub creepage_x: Option<f64>,
    /// Lateral creepage, dimensionless; default 0.
    #[member(closed(-1e6, 1e6, ""))]
    pub creepage_y: Option<f64>,
    /// Spin in 1/mm.
    #[member(closed(-1e6, 1e6, "1/mm"), default)]
    pub spin_per_mm: f64,
    /// Longitudinal force on the lower body in N, over all patches, at most μN. Excludes `creepage_x`. With `profiles`: only for a single
    /// motion.
    #[member(closed(-1e15, 1e15, "N"))]
    pub force_x_n: Option<f64>,
    /// Lateral force on the lower body in N, over all patches, at most μN. Excludes `creepage_y`. With `profiles`: only for a single
    /// motion, in track axes and including normal forces.
    #[member(closed(-1e15, 1e15, "N"))]
    pub force_y_n: Option<f64>,
    /// Rolling speed in mm/s; affects only temperatures, Archard's wear and friction that falls with slip.
    #[member(positive(1e9, "mm/s"))]
    pub speed_mm_per_s: Option<f64>,
}

/// One motion, a list of motions on the same patch, or a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Motions {
    /// One motion; omitted components are 0, but at least one must be given.
    One(AskedMotion),
    /// Several motions on the same patch, solved in order.
    Many(Vec<AskedMotion>),
    /// Motions generated from lists or ranges of their components.
    Sweep {
        /// Values of the components.
        sweep: Sweep,
    },
    /// A motion that changes with the rolled distance.
    History {
        /// Motions, forces and shifts, distance by distance.
        history: History,
        /// State at distance 0; default `rest`.
        #[schema(required = false)]
        start: HistoryStart,
    },
    /// The motion of the wheelset, from which the creepages of each patch follow; for `profiles` and `wheelset`.
    Wheelset {
        /// How the wheelset moves.
        wheelset: Wheelset,
    },
    /// Several motions of the wheelset, for the contact `wheelset` only. `combine: together`: one motion per position, or all in the same
    /// position; `grid`: every position with every motion, motions varying fastest.
    Wheelsets {
        /// How the wheelset moves; never empty.
        wheelset: Vec<Wheelset>,
    },
}

/// Motion of a wheelset. Exactly one of `angular_velocity_rad_per_s`, `free_rolling_radius_mm`, `drive_torque_n_mm` and `force_x_n` is given;
/// `force_y_n` excludes `lateral_velocity_mm_per_s`.
///
/// With the speed V, the axle e, the angular velocity ω = Ω e + (roll rate, 0, yaw rate) and r from the wheelset's centre to the
/// patch, the wheel's material moves with v = (V, lateral velocity, 0) + ω × r; the creepages of a patch with the tangent t and the
/// normal n are v_x / V, v · t / V and the spin ω · n / V.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, ToSchema, Members)]
pub struct Wheelset {
    /// Speed V along x in mm/s, more than 0.
    #[member(positive(1e9, "mm/s"))]
    pub speed_mm_per_s: f64,
    /// Angular velocity Ω about the axle in rad/s, positive for rolling forward.
    #[member(closed(-1e6, 1e6, "rad/s"))]
    pub angular_velocity_rad_per_s: Option<f64>,
    /// Radius in mm at which the wheel would roll freely: Ω is the speed divided by this radius.
    #[member(positive(1e9, "mm"))]
    pub free_rolling_radius_mm: Option<f64>,
    /// Torque about the axle that a drive or a brake exerts on the wheelset, in N mm, positive if it drives forward; for the contact
    /// `wheelset` only. The angular velocity that balances it is computed; 0 is free rolling.
    #[member(closed(-1e15, 1e15, "N mm"))]
    pub drive_torque_n_mm: Option<f64>,
    /// Longitudinal force on the rail in N, over all patches of the wheel; for the contact `profiles` only. The angular velocity is
    /// computed.
    #[member(closed(-1e15, 1e15, "N"))]
    pub force_x_n: Option<f64>,
    /// Velocity of the centre to the left in mm/s; default 0.
    #[member(closed(-1e9, 1e9, "mm/s"))]
    pub lateral_velocity_mm_per_s: Option<f64>,
    /// Lateral force on the rail in N, over all patches of the wheel, in track axes and including normal forces; for the contact `profiles`
    /// only. The lateral velocity is computed.
    #[member(closed(-1e15, 1e15, "N"))]
    pub force_y_n: Option<f64>,
    /// Yaw rate in rad/s; default 0.
    #[member(closed(-1e6, 1e6, "rad/s"), default)]
    pub yaw_rate_rad_per_s: f64,
    /// Roll rate in rad/s; default 0.
    #[member(closed(-1e6, 1e6, "rad/s"), default)]
    pub roll_rate_rad_per_s: f64,
}

/// Values of the motion's components; omitted components are 0.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_components, faults_of_sweep)]
pub struct Sweep {
    /// Longitudinal creepage.
    #[member(with = swept, closed(-1e6, 1e6, ""))]
    pub creepage_x: Option<Swept>,
    /// Lateral creepage.
    #[member(with = swept, closed(-1e6, 1e6, ""))]
    pub creepage_y: Option<Swept>,
    /// Spin in 1/mm.
    #[member(with = swept, closed(-1e6, 1e6, "1/mm"))]
    pub spin_per_mm: Option<Swept>,
    /// Longitudinal force on the lower body in N, in place of `creepage_x`.
    #[member(with = swept, closed(-1e15, 1e15, "N"))]
    pub force_x_n: Option<Swept>,
    /// Lateral force on the lower body in N, in place of `creepage_y`.
    #[member(with = swept, closed(-1e15, 1e15, "N"))]
    pub force_y_n: Option<Swept>,
    /// Rolling speed in mm/s, the same for all motions; affects only temperatures, Archard's wear and friction that falls with slip.
    #[member(positive(1e9, "mm/s"))]
    pub speed_mm_per_s: Option<f64>,
    /// `together` (default): all components that vary have the same number of values, and motion n has value n of each; `grid`: every
    /// combination of values. In a grid, the last component of this list varies fastest; a force takes the position of the creepage that it
    /// replaces.
    #[member(default)]
    pub combine: Combine,
}

/// How several components of a sweep are combined.
#[keyword(Default, Words)]
pub enum Combine {
    /// Motion n has value n of every component; all components that vary have the same number of values.
    #[default]
    Together,
    /// Every combination.
    Grid,
}

impl Combine {
    /// Returns the number of combinations of components with these numbers of values.
    pub(crate) fn count<const N: usize>(self, lengths: [usize; N]) -> u128 {
        let lengths = lengths.into_iter().map(|length| length as u128);
        match self {
            Combine::Together => lengths.max().unwrap_or(0),
            Combine::Grid => lengths.product(),
        }
    }

    /// Returns the index of each component's value in combination `k`. A single value is part of every combination.
    pub(crate) fn indices<const N: usize>(self, lengths: [usize; N], k: usize) -> [usize; N] {
        let mut rest = k;
        let mut indices = [0; N];
        for (index, length) in indices.iter_mut().zip(lengths).rev() {
            *index = match self {
                Combine::Together => k.min(length - 1),
                Combine::Grid => rest % length,
            };
            rest /= length;
        }
        indices
    }
}

/// The values of one component of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Swept {
    /// The same value in every motion.
    Constant(f64),
    /// Equally spaced values.
    Range(Range),
    /// A list of values, in this order.
    List(ValueList),
}

/// A list of values.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ValueList {
    /// The values, at least one.
    #[schema(min_items = 1)]
    pub values: Vec<f64>,
}

impl Swept {
    /// The number of values.
    pub fn points(&self) -> usize {
        match self {
            Swept::Constant(_) => 1,
            Swept::Range(range) => range.points as usize,
            Swept::List(list) => list.values.len(),
        }
    }

    /// Returns the values in order.
    pub fn values(&self) -> Vec<f64> {
        match self {
            Swept::Constant(value) => vec![*value],
            Swept::Range(range) => range.values(),
            Swept::List(list) => list.values.clone(),
        }
    }
}

/// A motion that changes as the bodies roll. Creepages, spin and forces change linearly between distances and are constant before the first
/// one. The result has a point at each distance.
///
/// At a distance equal to the previous one, or at a first distance of 0, the bodies do not roll but are displaced: by `shift_x_mm`,
/// `shift_y_mm` and `turn_rad`, or until the prescribed forces are reached. Two equal distances can therefore describe a jump of a creepage
/// or force.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_history)]
pub struct History {
    /// Distance rolled since the start in mm, never decreasing.
    #[member(with = course, closed(0.0, 1e9, "mm"), what = "an array of distances in mm")]
    pub distance_mm: Course,
    /// Longitudinal creepage.
    #[member(with = course, closed(-1e6, 1e6, ""))]
    pub creepage_x: Option<Course>,
    /// Lateral creepage.
    #[member(with = course, closed(-1e6, 1e6, ""))]
    pub creepage_y: Option<Course>,
    /// Spin in 1/mm.
    #[member(with = course, closed(-1e6, 1e6, "1/mm"))]
    pub spin_per_mm: Option<Course>,
    /// Longitudinal force on the lower body in N, in place of `creepage_x`; the creepages and shifts that produce it are computed.
    #[member(with = course, closed(-1e15, 1e15, "N"))]
    pub force_x_n: Option<Course>,
    /// Lateral force on the lower body in N, in place of `creepage_y`.
    #[member(with = course, closed(-1e15, 1e15, "N"))]
    pub force_y_n: Option<Course>,
    /// Rolling speed in mm/s; required by friction that falls with slip.
    #[member(positive(1e9, "mm/s"))]
    pub speed_mm_per_s: Option<f64>,
    /// Displacement of the upper body relative to the lower one along x in mm, since the previous point; 0 where the bodies roll.
    #[member(with = course, closed(-1e6, 1e6, "mm"))]
    pub shift_x_mm: Option<Course>,
    /// Displacement along y, as `shift_x_mm`.
    #[member(with = course, closed(-1e6, 1e6, "mm"))]
    pub shift_y_mm: Option<Course>,
    /// Rotation of the upper body relative to the lower one about z in rad, since the previous point; 0 where the bodies roll.
    #[member(with = course, closed(-10.0, 10.0, "rad"))]
    pub turn_rad: Option<Course>,
}

impl History {
    /// Returns the components with their names, the shifts last.
    pub(crate) fn courses(&self) -> [(&'static str, Option<&Course>); 8] {
        [
            ("creepage_x", &self.creepage_x),
            ("creepage_y", &self.creepage_y),
            ("spin_per_mm", &self.spin_per_mm),
            ("force_x_n", &self.force_x_n),
            ("force_y_n", &self.force_y_n),
            ("shift_x_mm", &self.shift_x_mm),
            ("shift_y_mm", &self.shift_y_mm),
            ("turn_rad", &self.turn_rad),
        ]
        .map(|(name, course)| (name, course.as_ref()))
    }
}

/// One value for all points of a history, or one value per point.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Course {
    /// One value for all points.
    Constant(f64),
    /// Equally spaced values.
    Range(Range),
    /// One value per point.
    Values(Vec<f64>),
}

impl Course {
    /// The number of values; 1 for a constant.
    pub fn points(&self) -> usize {
        match self {
            Course::Constant(_) => 1,
            Course::Range(range) => range.points as usize,
            Course::Values(values) => values.len(),
        }
    }

    /// Returns the value at each of `points` points.
    pub fn values(&self, points: usize) -> Vec<f64> {
        match self {
            Course::Constant(value) => vec![*value; points],
            Course::Range(range) => range.values(),
            Course::Values(values) => values.clone(),
        }
    }
}

/// Equally spaced values, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Range {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values, at least 1.
    #[schema(minimum = 1)]
    pub points: u32,
}

impl Range {
    /// Returns the values. The first and the last are exactly `from` and `to`.
    pub fn values(&self) -> Vec<f64> {
        let last = self.points.saturating_sub(1);
        (0..self.points)
            .map(|n| {
                if n == 0 {
                    self.from
                } else if n == last {
                    self.to
                } else {
                    let t = f64::from(n) / f64::from(last);
                    self.from * (1.0 - t) + self.to * t
                }
            })
            .collect()
    }
}

/// Maximum number of values in a sweep, a history or a grid axis. The limits of the service apply in addition.
pub(crate) const POINTS_MAX: u32 = 1_000_000;
/// The components of a motion. The forces have the order of the creepages that they replace.
const COMPONENTS: [&str; 5] = [
    "creepage_x",
    "creepage_y",
    "spin_per_mm",
    "force_x_n",
    "force_y_n",
];

/// Reads the required member `motion` of a case.
pub(crate) fn read(case: &mut Object) -> Option<Motions> {
    let what = "an object with at least one of creepage_x, creepage_y, spin_per_mm, force_x_n, force_y_n, an array of such objects, {\"sweep\": …} or {\"history\": …}";
    let value = case.required("motion", what)?;
    let kind = case
        .value("contact")
        .and_then(|contact| contact.get("type"));
    let kind = kind.and_then(Value::as_str);
    let (of_profiles, of_wheelset) = (kind == Some("profiles"), kind == Some("wheelset"));
    match value {
        Value::Object(members) if members.contains_key("sweep") && !of_wheelset => {
            let mut block = case.child("motion")?;
            block.only(&["sweep"]);
            let sweep = Sweep::read(&mut block, "sweep")?;
            Some(Motions::Sweep { sweep })
        }
        Value::Object(members) if members.contains_key("history") => {
            read_history(&mut case.child("motion")?)
        }
        Value::Object(members) if members.contains_key("wheelset") => {
            let mut block = case.child("motion")?;
            block.only(&["wheelset"]);
            if !of_profiles && !of_wheelset {
                let detail = "given for another contact than \"type\": \"profiles\" or \"wheelset\"; give creepages instead";
                return block.refuse("wheelset", detail);
            }
            match members.get("wheelset") {
                Some(Value::Array(motions)) if of_wheelset && !motions.is_empty() => {
                    let read = |motions: &mut Object, index: &str| {
                        wheelset(&mut motions.child(index)?, true)
                    };
                    let wheelset = block.each("wheelset", 1..=usize::MAX, "", read)?;
                    Some(Motions::Wheelsets { wheelset })
                }
                _ => {
                    let wheelset = wheelset(&mut block.child("wheelset")?, of_wheelset)?;
                    Some(Motions::Wheelset { wheelset })
                }
            }
        }
        _ if of_wheelset => {
            let what = "the motion of the wheelset is needed, such as {\"wheelset\": {\"speed_mm_per_s\": 20000, \"drive_torque_n_mm\": 0}}, from which \
                        every patch gets its own creepages";
            let pointer = case.pointer_to("motion");
            let given = shown(value);
            case.faults()
                .refuse(pointer, format!("{given} given; {what}"))
        }
        Value::Object(_) => motion(case, "motion").map(Motions::One),
        _ => {
            let motions = case.each("motion", 1..=usize::MAX, what, motion);
            motions.map(Motions::Many)
        }
    }
}

fn motion(block: &mut Object, name: &str) -> Option<AskedMotion> {
    let read = AskedMotion::read(block, name)?;
    let left_out = |force: Option<f64>| force.is_none().then_some(0.0);
    Some(AskedMotion {
        creepage_x: read.creepage_x.or(left_out(read.force_x_n)),
        creepage_y: read.creepage_y.or(left_out(read.force_y_n)),
        ..read
    })
}

/// Reads the motion of a wheelset. It may balance a torque on both rails, or longitudinal and lateral forces on one rail.
fn wheelset(block: &mut Object, on_both_rails: bool) -> Option<Wheelset> {
    let (balanced, refused) = match on_both_rails {
        true => ("drive_torque_n_mm", &["force_x_n", "force_y_n"][..]),
        false => ("force_x_n", &["drive_torque_n_mm"][..]),
    };
    let foreign = block.given(refused);
    for name in &foreign {
        block.fault(
            name,
            format!("given, but such a contact can balance only {balanced}"),
        );
    }
    let read = Wheelset::members(block);
    let angular = "angular_velocity_rad_per_s";
    let radius = "free_rolling_radius_mm";
    block.exactly_one(&[angular, radius, balanced], |block| {
        let rate = AllowedRange::closed(-1e6, 1e6, "rad/s");
        let detail = format!("missing; {rate} is needed, or {radius} or {balanced} instead");
        block.fault(angular, detail);
    })?;
    if let [velocity, force] = block.given(&["lateral_velocity_mm_per_s", "force_y_n"])[..] {
        return block.exclude(velocity, force);
    }
    let read = read.filter(|_| foreign.is_empty())?;
    let still = read.force_y_n.is_none().then_some(0.0);
    Some(Wheelset {
        lateral_velocity_mm_per_s: read.lateral_velocity_mm_per_s.or(still),
        ..read
    })
}

/// Refuses components that are combined one by one and differ in their number of values.
pub(crate) fn faults_of_sweep(block: &mut Object, read: Option<&Sweep>) -> Option<()> {
    let sweep = read?;
    let components = [
        &sweep.creepage_x,
        &sweep.creepage_y,
        &sweep.spin_per_mm,
        &sweep.force_x_n,
        &sweep.force_y_n,
    ];
    let points = components.into_iter().flatten().map(Swept::points);
    let points: Vec<usize> = points.collect();
    let mut varying = points.iter().filter(|points| **points > 1);
    let first = varying.next();
    if sweep.combine == Combine::Together && varying.any(|points| Some(points) != first) {
        return block.refuse_object(format!(
            "components with {} values given; components combined \"together\" need the same number of values, which \"combine\": \"grid\" does not",
            points.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
        ));
    }
    Some(())
}

/// Refuses a motion that gives both a creepage and its force, or no component at all.
pub(crate) fn faults_of_components<T>(block: &mut Object, _: Option<&T>) -> Option<()> {
    let mut sound = Some(());
    for (creepage, force) in [("creepage_x", "force_x_n"), ("creepage_y", "force_y_n")] {
        if block.has(creepage) && block.has(force) {
            sound = block.exclude(creepage, force);
        }
    }
    if block.given(&COMPONENTS).is_empty() {
        sound = block.refuse_object(format!(
            "no motion given; at least one of {} is needed, with the value 0 if nothing moves",
            COMPONENTS.join(", ")
        ));
    }
    sound
}

/// Reads a number, `{"from": …, "to": …, "points": …}` or `{"values": […]}`.
pub(crate) fn swept(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Swept> {
    let what = "a number, {\"from\": …, \"to\": …, \"points\": …} or {\"values\": […]}";
    match block.value(name)? {
        Value::Number(_) => block.number(name, allowed).map(Swept::Constant),
        Value::Object(members) if members.contains_key("values") => {
            list(block, name, allowed).map(Swept::List)
        }
        Value::Object(_) => range(block, name, allowed).map(Swept::Range),
        _ => block.mistaken(name, what),
    }
}

fn list(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<ValueList> {
    let mut block = block.child(name)?;
    block.only(&["values"]);
    let what = format!("an array of 1 to {POINTS_MAX} numbers");
    let values = block.number_array("values", 1..=POINTS_MAX as usize, &what, allowed)?;
    Some(ValueList { values })
}

fn range(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Range> {
    let mut block = block.child(name)?;
    let (from, to, points) = block.range(allowed, 1, POINTS_MAX)?;
    if points == 1 && from.to_bits() != to.to_bits() {
        let detail = format!(
            "1 given for a range from {from} to {to}; at least 2 points are needed unless from equals to"
        );
        return block.refuse("points", detail);
    }
    Some(Range { from, to, points })
}

/// Reads the object `{"history": …, "start": …}`.
fn read_history(block: &mut Object) -> Option<Motions> {
    block.only(&["history", "start"]);
    let start = block.optional("start", |block, name| block.word(name, HistoryStart::WORDS));
    let mut block = block.child("history")?;
    let history = History::members(&mut block)?;
    let start = start?.unwrap_or_default();
    let courses = history.courses();
    if start != HistoryStart::Pressed && courses.iter().all(|(_, course)| course.is_none()) {
        let names = courses.map(|(name, _)| name).join(", ");
        return block.refuse_object(format!(
            "no motion given; at least one of {names} is needed"
        ));
    }
    let distances = history.distance_mm.values(1);
    let mut sound = Some(());
    for (name, course) in &courses[5..] {
        if let Some(course) = course {
            sound = sound.and(shifted_at_rest(&mut block, name, course, &distances, start));
        }
    }
    sound.map(|()| Motions::History { history, start })
}

/// Refuses a force together with its creepage or shift, a number of values other than one per distance, and decreasing distances.
pub(crate) fn faults_of_history(block: &mut Object, read: Option<&History>) -> Option<()> {
    let mut sound = Some(());
    for (force, others) in [
        ("force_x_n", ["creepage_x", "shift_x_mm"]),
        ("force_y_n", ["creepage_y", "shift_y_mm"]),
    ] {
        for other in others {
            if block.has(force) && block.has(other) {
                let detail =
                    format!("given together with {other}; a force is prescribed in its place");
                sound = block.refuse(force, detail);
            }
        }
    }
    let read = read?;
    let distances = read.distance_mm.values(1);
    let points = distances.len();
    for (name, course) in read.courses() {
        let count = match course {
            None | Some(Course::Constant(_)) => continue,
            Some(course) => course.points(),
        };
        if count != points {
            let detail = format!(
                "{count} values given for {points} distances; give one value per distance, or one number"
            );
            sound = block.refuse(name, detail);
        }
    }
    if let Some(k) = (1..points).find(|k| distances[*k] < distances[k - 1]) {
        let [before, given] = [distances[k - 1], distances[k]];
        let detail = format!("{given} given after {before}; distances may not decrease");
        return block.refuse_element("distance_mm", k, detail);
    }
    sound
}

/// Refuses a shift other than 0 at a point to which the bodies roll, or at the start of steady rolling.
fn shifted_at_rest(
    block: &mut Object,
    name: &str,
    course: &Course,
    distances: &[f64],
    start: HistoryStart,
) -> Option<()> {
    let values = course.values(distances.len());
    let rolls = |k: usize| match k {
        0 => distances[0] > 0.0 || start == HistoryStart::Steady,
        _ => distances[k] > distances[k - 1],
    };
    let wrong = (0..distances.len()).find(|k| values[*k] != 0.0 && rolls(*k));
    let Some(k) = wrong else { return Some(()) };
    let detail = format!(
        "{} given for point {k}, to which the bodies roll; a shift belongs to a point with the distance of the point before, or to a first \
         point with the distance 0 that starts from \"rest\" or \"pressed\"",
        values[k]
    );
    match course {
        Course::Values(_) => block.refuse_element(name, k, detail),
        _ => block.refuse(name, detail),
    }
}

/// Reads a number, an array of one value per point, or `{"from": …, "to": …, "points": …}`.
pub(crate) fn course(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Course> {
    match block.value(name)? {
        Value::Number(_) => block.number(name, allowed).map(Course::Constant),
        Value::Array(elements) if (1..=POINTS_MAX as usize).contains(&elements.len()) => {
            block.numbers(name, allowed).map(Course::Values)
        }
        Value::Object(_) => {
            let (from, to, points) = block.child(name)?.range(allowed, 2, POINTS_MAX)?;
            Some(Course::Range(Range { from, to, points }))
        }
        _ => {
            let what = format!(
                "a number, an array of 1 to {POINTS_MAX} numbers or {{\"from\": …, \"to\": …, \"points\": …}}"
            );
            block.mistaken(name, &what)
        }
    }
}
