//! Evolution of worn profiles under a traffic, step by step.
//!
//! An [`Evolution`](task::Evolution) consists of a case of a wheel on a rail, a traffic of many states of it, and a plan. Its
//! [`step`](task::Evolution::step) computes the next serialisable [state](crate::solution::words::evolution::EvolutionState) from the present one
//! alone. An evolution can therefore be interrupted after any step and continued elsewhere to the same bits.
//!
//! The first step condenses the [`traffic`]. Every other step solves all states on the present sections like any other case, adds up their wear along
//! the [`section`]s ([`pass`]), and moves these ([`step`]). [`record`] makes the answer.

pub mod pass;
pub mod record;
pub mod section;
pub mod step;
pub mod task;
pub mod traffic;

#[cfg(test)]
mod tests {
    //! Laws of an evolution.

    use std::ops::ControlFlow;
    use std::time::Duration;

    use serde_json::{Value, json};

    use crate::case::solver::Limits;
    use crate::evolution::pass::pass;
    use crate::evolution::section::{area_between, distance};
    use crate::evolution::task::{Evolution, Sections, SolveContext};
    use crate::geometry::profile::Body;
    use crate::monitor::{Monitor, Stop, Unmonitored};
    use crate::solution::words::evolution::{EvolutionRecord, EvolutionState};

    /// The shipped example of a wheel on a rail.
    fn template() -> Value {
        let text = include_str!("../../../api/examples/wheel-rail.case.json");
        let mut case: Value = serde_json::from_str(text).expect("an example is JSON");
        for name in ["name", "outputs"] {
            case.as_object_mut().expect("an object").remove(name);
        }
        case
    }

    /// An evolution of the example with some lateral shifts.
    fn request(shifts: &[f64], passes: &[f64], records: u32) -> Value {
        json!({
            "template": template(),
            "traffic": { "columns": { "/contact/lateral_shift_mm": shifts }, "passes": passes },
            "extent": { "axle_passes": 4e5, "wheel_distance_km": 2e4 },
            "records": records,
            "accuracy": { "states_max": 8 },
        })
    }

    fn checked(request: &Value) -> Evolution {
        Evolution::check(request, &Limits::default()).expect("no faults")
    }

    fn run(task: &Evolution) -> (EvolutionState, Vec<EvolutionRecord>) {
        run_from(task, task.begin())
    }

    fn run_from(
        task: &Evolution,
        mut state: EvolutionState,
    ) -> (EvolutionState, Vec<EvolutionRecord>) {
        let context = SolveContext::default();
        let mut records = Vec::new();
        while !task.is_over(&state) {
            let (next, record) = task.step(&context, &state, &Unmonitored).expect("a step");
            records.extend(record);
            state = next;
        }
        (state, records)
    }

    /// A flat wheel on the round head of a rail under pure longitudinal creepage: symmetric about y = 0.
    fn symmetric(records: u32, axles: f64) -> Value {
        let rail: Vec<[f64; 2]> = (0..=240)
            .map(|k| 0.25 * f64::from(k) - 30.0)
            .map(|y| [y, 300.0 - (300.0_f64.powi(2) - y * y).sqrt()])
            .collect();
        let wheel: Vec<[f64; 2]> = (0..=240)
            .map(|k| [0.25 * f64::from(k) - 30.0, 0.0])
            .collect();
        let section = |points| json!({ "points_mm": points, "mirror_y": false, "mirror_z": false });
        json!({
            "template": {
                "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
                "friction": { "coefficient": 0.3 },
                "contact": {
                    "type": "profiles", "rail": section(rail), "wheel": section(wheel), "side": "left", "rolling_radius_mm": 460,
                    "rail_origin_mm": 750, "flange_back_distance_mm": 1360, "flange_back_position_mm": -70,
                    // On the curve of the rail, strips slip without creepage because their radii differ.
                    "reference_surface": "plane",
                },
                "load": { "vertical_force_n": 80e3 },
                "motion": { "creepage_x": 0.002 },
            },
            "traffic": { "columns": { "/load/vertical_force_n": [80e3] } },
            "wearing": "rail",
            "extent": { "axle_passes": axles },
            "records": records,
            "accuracy": { "step_tolerance": 1.0, "step_depth_mm": 1.0 },
        })
    }

    #[test]
    fn a_symmetric_problem_stays_symmetric_and_loses_the_volume_of_its_wear() {
        let task = checked(&symmetric(2, 2e5));
        let (state, _) = run(&task);
        let depth = &state.bodies[0].worn.depth_mm;
        let most = depth.iter().copied().fold(0.0, f64::max);
        let off = depth
            .iter()
            .zip(depth.iter().rev())
            .map(|(a, b)| (a - b).abs());
        // The cells of the pressures are not symmetric about the middle, and the large step leaves edges with peaks of pressure.
        let off = off.fold(0.0, f64::max);
        assert!(off < 0.15 * most, "{off} {most}");
        let lost = area_between(
            Body::Rail,
            &state.bodies[0].start_mm,
            &state.bodies[0].worn.points_mm,
        );
        let worn: f64 = state.bodies[0].regimes_mm2.iter().sum();
        assert!((lost / worn - 1.0).abs() < 1e-3, "{lost} {worn}");
        assert!((lost / state.bodies[0].worn.worn_area_mm2 - 1.0).abs() < 1e-9);
        assert_eq!(state.bodies[1].worn.points_mm, state.bodies[1].start_mm);
        assert_eq!(state.bodies[1].worn.worn_area_mm2, 0.0);
    }

    #[test]
    fn the_conicity_of_a_record_is_that_of_a_wheelset_with_its_sections() {
        let mut request = request(&[-2.0], &[1.0], 1);
        request["accuracy"] = json!({ "step_tolerance": 1.0, "step_depth_mm": 1.0 });
        let task = checked(&request);
        let (_, records) = run(&task);
        let record = records.last().expect("a record");
        let section = |points: &[[f64; 2]]| json!({ "points_mm": points, "mirror_y": false, "mirror_z": false });
        let text = include_str!("../../../api/examples/wheelset.case.json");
        let mut case: Value = serde_json::from_str(text).expect("an example is JSON");
        let contact = &mut case["contact"];
        contact["rail"] = section(&record.rail.points_mm);
        contact["wheel"] = section(&record.wheel.points_mm);
        contact["rail_origin_mm"] = json!(task.geometry.rail_origin());
        contact["flange_back_position_mm"] = json!(task.geometry.placement.flange_back_position);
        contact["lateral_shift_mm"] = json!(0);
        contact["accept_rough_profiles"] = json!(true);
        // The kinematics do not depend on friction.
        case["friction"] = json!({ "coefficient": 0.0 });
        case["motion"] =
            json!({ "wheelset": { "speed_mm_per_s": 2e4, "free_rolling_radius_mm": 460 } });
        let case = crate::check(&case, &Limits::default()).expect("no faults");
        let (solution, _) = crate::solve(&case, &Unmonitored).expect("a solution");
        let kinematics = solution
            .wheelset
            .expect("a wheelset")
            .kinematics
            .expect("kinematics");
        let found = kinematics.conicity[2].conicity.expect("a conicity");
        let of_record = record.conicity.expect("a conicity");
        assert!((of_record - found).abs() < 2e-4, "{of_record} {found}");
    }

    /// Halving the step at least halves the distance to the finest run.
    #[test]
    fn steps_converge() {
        let depths: Vec<Vec<f64>> = [1, 2, 4, 16]
            .map(|records| {
                run(&checked(&symmetric(records, 4e4))).0.bodies[0]
                    .worn
                    .depth_mm
                    .clone()
            })
            .into();
        let off = |k: usize| -> f64 {
            let pairs = depths[k].iter().zip(&depths[3]);
            pairs.map(|(depth, finest)| (depth - finest).abs()).sum()
        };
        assert!(
            off(1) < 0.5 * off(0) && off(2) < 0.5 * off(1),
            "{} {} {}",
            off(0),
            off(1),
            off(2)
        );
    }

    #[test]
    fn without_friction_or_creepage_nothing_wears() {
        let mut without_friction = symmetric(1, 2e5);
        without_friction["template"]["friction"]["coefficient"] = 0.0.into();
        let mut without_creepage = symmetric(1, 2e5);
        without_creepage["template"]["motion"]["creepage_x"] = 0.0.into();
        for request in [without_friction, without_creepage] {
            let task = checked(&request);
            let (state, records) = run(&task);
            assert_eq!(state.bodies[0].worn.points_mm, state.bodies[0].start_mm);
            assert_eq!(state.bodies[0].worn.worn_area_mm2, 0.0);
            assert!(
                records
                    .iter()
                    .all(|record| record.contact.unsolved_share == 0.0)
            );
        }
    }

    #[test]
    fn an_evolution_that_reaches_its_largest_number_of_steps_keeps_its_records() {
        let mut plan = symmetric(4, 2e5);
        plan["accuracy"]["steps_max"] = json!(3);
        plan["accuracy"]["step_depth_mm"] = json!(0.01);
        plan["limits"] = json!({ "height_mm": 1.0 });
        let task = checked(&plan);
        let (state, records) = run(&task);
        let last = records.last().expect("a record").clone();
        assert_eq!((state.steps, last.progress.share), (3, state.share));
        assert!(state.share > 0.0 && state.share < 1.0, "{}", state.share);
        assert!(last.rail.worn_area_mm2 > 0.0 && last.rail == records[records.len() - 1].rail);
        let answer = task.answer(&state, records);
        let remark = answer
            .remarks
            .iter()
            .find(|r| r.code == "evolution-ended-early");
        let detail = &remark.expect("a remark").detail;
        assert!(detail.contains("steps_max = 3"), "{detail}");
        assert_eq!(answer.limits[0].reached, None);
    }

    #[test]
    fn an_evolution_without_time_keeps_its_records() {
        struct NoTime;
        impl Monitor for NoTime {
            fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
                ControlFlow::Break(Stop::OutOfTime)
            }

            fn elapsed(&self) -> Duration {
                Duration::ZERO
            }
        }
        let mut plan = symmetric(4, 2e5);
        plan["limits"] = json!({ "height_mm": 1.0 });
        let task = checked(&plan);
        let context = SolveContext::default();
        let mut state = task.begin();
        let mut records = Vec::new();
        while state.share == 0.0 {
            assert!(task.step(&context, &state, &NoTime).is_err());
            let (next, record) = task.step(&context, &state, &Unmonitored).expect("a step");
            records.extend(record);
            state = next;
        }
        let (ended, record) = task.step(&context, &state, &NoTime).expect("an end");
        assert!(task.is_over(&ended) && record.is_none() && ended.share == state.share);
        let answer = task.answer(&ended, records);
        let remarks = answer.remarks.iter();
        let mut own = remarks.filter(|remark| remark.code == "evolution-ended-early");
        let detail = &own.next().expect("a remark").detail;
        assert!(detail.contains("ran out of time"), "{detail}");
        assert_eq!(answer.records.len(), 1);
        assert_eq!(answer.limits[0].reached, None);
    }

    #[test]
    fn warnings_of_states_are_in_the_answer() {
        let mut plan = request(&[0.0, -30.0], &[19.0, 1.0], 1);
        plan["extent"] = json!({ "axle_passes": 1e3, "wheel_distance_km": 1 });
        plan["accuracy"] = json!({ "step_tolerance": 1.0 });
        let task = checked(&plan);
        let (state, records) = run(&task);
        let answer = task.answer(&state, records);
        let codes: Vec<&str> = answer.remarks.iter().map(|r| r.code.as_str()).collect();
        let found = codes
            .iter()
            .filter(|code| **code == "contact-on-flange-tip");
        assert_eq!(found.count(), 1, "{codes:?}");
        let tip = answer
            .remarks
            .iter()
            .find(|r| r.code == "contact-on-flange-tip");
        let detail = &tip.expect("a remark").detail;
        let of_row = "(lateral_shift_mm -30), 5 % of the traffic in all: the contact at y";
        assert!(
            detail.starts_with("record 0, state ") && detail.contains(of_row),
            "{detail}"
        );
    }

    #[test]
    fn twice_the_passes_at_half_the_weight_are_the_same() {
        let once = checked(&request(&[-2.0, 1.0], &[1.0, 3.0], 1));
        let twice = checked(&request(&[-2.0, 1.0, -2.0, 1.0], &[0.5, 1.5, 0.5, 1.5], 1));
        let [once, twice] = [&once, &twice].map(|task| {
            let mut state = task.begin();
            for _ in 0..3 {
                state = task
                    .step(&SolveContext::default(), &state, &Unmonitored)
                    .expect("a step")
                    .0;
            }
            state
        });
        assert!(once.share > 0.0 && (once.share - twice.share).abs() < 1e-12);
        for (a, b) in once.bodies[0]
            .worn
            .points_mm
            .iter()
            .zip(&twice.bodies[0].worn.points_mm)
        {
            assert!((a[1] - b[1]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }

    /// With creepages of mean 0 and widely spread loads, the reported error covers the true one, which decreases with the number of states.
    #[test]
    fn the_error_of_a_condensed_traffic_covers_what_all_rows_wear() {
        let rows = 48;
        let loads: Vec<f64> = (0..rows)
            .map(|k| 60e3 + 1e3 * f64::from(k % 8) * 4.0)
            .collect();
        let creepages: Vec<f64> = (0..rows)
            .map(|k| 1e-3 * (f64::from(k * 7 % 48) / 23.5 - 1.0))
            .collect();
        let mut asked = symmetric(1, 2e4);
        asked["traffic"] = json!({ "columns": {
            "/load/vertical_force_n": loads, "/motion/creepage_x": creepages
        } });
        let wear = |states: u32, tolerance: f64| {
            let mut asked = asked.clone();
            asked["accuracy"]["states_max"] = json!(states);
            asked["accuracy"]["states_tolerance"] = json!(tolerance);
            let task = checked(&asked);
            let (state, _) = run(&task);
            let traffic = state.traffic;
            (
                state.bodies[0].worn.worn_area_mm2,
                traffic.error[0],
                traffic.states.len(),
            )
        };
        let (all, _, count) = wear(48, 1e-12);
        assert_eq!(count, 48);
        let mut last = f64::INFINITY;
        for states in [4, 8, 24] {
            let (worn, told, _) = wear(states, 1e-12);
            let error = (worn / all - 1.0).abs();
            assert!(
                error <= 1.2 * told,
                "{states} states: {error} off, {told} told"
            );
            assert!(error <= last, "{states} states: {error} off, {last} before");
            last = error;
        }
        assert!(last < 0.05, "{last}");
    }

    /// The wheel touches the round head at R sin(roll). The wear of few states is spread by R times the standard deviation of the roll of their rows,
    /// and differs from that of all rows by no more than the reported error.
    #[test]
    fn the_wear_of_a_state_is_spread_over_the_places_of_its_rows() {
        let rolls: Vec<f64> = (0..25).map(|k| 1e-3 * f64::from(k - 12)).collect();
        let mut asked = symmetric(1, 2e3);
        asked["traffic"] = json!({ "columns": { "/contact/roll_rad": rolls } });
        let run_with = |states: u32| {
            let mut asked = asked.clone();
            asked["accuracy"]["states_max"] = json!(states);
            asked["accuracy"]["states_tolerance"] = json!(1e-12);
            let (state, _) = run(&checked(&asked));
            (state.bodies[0].worn.depth_mm.clone(), state.traffic)
        };
        let (all, _) = run_with(25);
        for states in [1, 2, 4] {
            let (few, traffic) = run_with(states);
            let off: f64 = all.iter().zip(&few).map(|(a, b)| (a - b).abs()).sum();
            let off = off / all.iter().sum::<f64>();
            assert!(
                off < 1.2 * traffic.error[0],
                "{states}: {off}, {} told",
                traffic.error[0]
            );
            for state in &traffic.states {
                let rows = f64::from(state.rows);
                let wanted = 300e-3 * ((rows * rows - 1.0) / 12.0).sqrt();
                let spread = state.spread_mm[0];
                assert!(
                    (spread / wanted - 1.0).abs() < 0.15,
                    "{states}: {spread} {wanted}"
                );
            }
        }
    }

    #[test]
    fn the_target_of_an_event_is_a_section_of_its_body() {
        let mut plan = request(&[0.0], &[1.0], 1);
        let [rail, wheel] = ["rail", "wheel"].map(|body| plan["template"]["contact"][body].clone());
        plan["events"] = json!([{ "at": 0, "grind": wheel }, { "at": 0, "reprofile": rail }]);
        let refused = Evolution::check(&plan, &Limits::default()).err();
        let error = refused.expect("sections of the other body").to_string();
        for pointer in ["/events/0/grind", "/events/1/reprofile"] {
            assert!(error.contains(pointer), "{error}");
        }
    }

    /// An evolution that is interrupted after any step and continued from its text by other threads gives the same bits.
    #[test]
    fn an_evolution_is_continued_to_the_same_bits() {
        let mut plan = request(&[-2.0, 1.0], &[1.0, 3.0], 2);
        plan["extent"] = json!({ "axle_passes": 2e4, "wheel_distance_km": 1e3 });
        plan["events"] = json!([{ "at": 5e3, "friction_coefficient": 0.15 }, { "at": 1e4, "grind": plan["template"]["contact"]["rail"], "depth_mm": 0.05 }]);
        let task = checked(&plan);
        let (whole, records) = run(&task);
        assert_eq!(records.len(), 6, "start, end, two of each event");
        let context = SolveContext {
            threads: 2,
            ..SolveContext::default()
        };
        let (mut state, mut again) = (task.begin(), Vec::new());
        while !task.is_over(&state) {
            let text = serde_json::to_string(&state).expect("text");
            let read: EvolutionState = serde_json::from_str(&text).expect("a state");
            let (next, record) = task.step(&context, &read, &Unmonitored).expect("a step");
            again.extend(record);
            state = next;
        }
        assert_eq!(
            serde_json::to_string(&state).expect("text"),
            serde_json::to_string(&whole).expect("text")
        );
        assert_eq!(again, records);
        let ground = &records[records.len() - 1].rail;
        assert!(
            ground.machined_area_mm2 > 1.0,
            "{}",
            ground.machined_area_mm2
        );
    }

    /// An evolution of half the extent and another one that starts from its sections give the wear of one over the whole extent.
    #[test]
    fn an_evolution_in_two_parts_wears_as_a_whole() {
        let (whole, _) = run(&checked(&symmetric(2, 4e4)));
        let (first, _) = run(&checked(&symmetric(1, 2e4)));
        let mut rest = symmetric(1, 2e4);
        rest["template"]["contact"]["rail"]["points_mm"] = json!(first.bodies[0].worn.points_mm);
        let (second, _) = run(&checked(&rest));
        let [one, parts] = [
            whole.bodies[0].worn.worn_area_mm2,
            first.bodies[0].worn.worn_area_mm2 + second.bodies[0].worn.worn_area_mm2,
        ];
        assert!((parts / one - 1.0).abs() < 2e-3, "{parts} {one}");
        for y in [-4.0, 0.0, 2.5] {
            let height =
                |points: &[[f64; 2]]| distance(points, [y, -1e2], [0.0, 1.0]).expect("below");
            let [start, one, parts] = [
                &whole.bodies[0].start_mm,
                &whole.bodies[0].worn.points_mm,
                &second.bodies[0].worn.points_mm,
            ]
            .map(|points| height(points));
            assert!(
                (parts - one).abs() < 0.01 * (one - start),
                "{y}: {start} {one} {parts}"
            );
        }
    }

    /// The wear of a pass across both sections is the friction power of the strips by the map's mild slope.
    #[test]
    fn wear_across_a_section_is_that_of_the_power_of_the_cells() {
        let request = request(&[0.0], &[1.0], 1);
        let task = checked(&request);
        let [rail, wheel] = task.start();
        let on = Sections {
            points: [&rail, &wheel],
            friction: None,
            radius: 0.0,
        };
        let found =
            pass(&task, &SolveContext::default(), on, &[0.0], &Unmonitored).expect("solved");
        let mut case = task.case(on, &[0.0]).expect("a case");
        case["outputs"] = json!(["resultants", "tractions", "slip", "zones"]);
        case.as_object_mut().expect("an object").remove("damage");
        let case = crate::check(&case, &Limits::default()).expect("no faults");
        let (solution, fields) = crate::solve(&case, &Unmonitored).expect("solved");
        let centre = solution.patches[0].position.expect("a place");
        // kg/m³ are µg/mm³.
        let slope = task.figures.usfd.mild_slope * 1e-3 / task.figures.density_kg_per_m3;
        let (cells, values) = (&fields.patches[0].meshes[0], &fields.patches[0].points[0]);
        let of = |values: &Option<Vec<f64>>, k: usize| values.as_ref().expect("values")[k];
        // Right of the load centre, in the coordinate to the left: the field side of a right rail.
        let (mut all, mut right) = (0.0, 0.0);
        for k in 0..cells.x_mm.len() {
            let power = of(&values.traction_x_mpa, k) * of(&values.slip_x, k)
                + of(&values.traction_y_mpa, k) * of(&values.slip_y, k);
            let worn = slope * power * cells.dx_mm[k] * cells.dy_mm[k];
            all += worn;
            right += if cells.y_mm[k] < -1.0 { worn } else { 0.0 };
        }
        let sum: f64 = found.wear[0].area.iter().sum();
        assert!((sum / all - 1.0).abs() < 0.02, "{sum} {all}");
        let beyond = |points: &[[f64; 2]], centre: [f64; 2], area: &[f64]| -> f64 {
            let pairs = points.iter().zip(area);
            pairs
                .filter(|(at, _)| at[0] > centre[0] + 1.0)
                .map(|(_, area)| area)
                .sum()
        };
        let on_rail = beyond(&rail, centre.rail_mm, &found.wear[0].area);
        assert!(
            (on_rail - right).abs() < 0.02 * all + 0.1 * right,
            "{on_rail} {right} {all}"
        );
        let on_wheel = beyond(&wheel, centre.wheel_mm, &found.wear[1].area);
        let turn = 2.0 * std::f64::consts::PI * centre.rolling_radius_mm;
        assert!(
            (on_wheel * turn - right).abs() < 0.02 * all + 0.1 * right,
            "{} {right}",
            on_wheel * turn
        );
    }

    /// Samples have the means and variances of the distributions, columns are uncorrelated, and a table of the same rows is the same traffic.
    #[test]
    fn distributions_are_sampled_evenly_and_independently() {
        let mut sampled = request(&[0.0], &[1.0], 1);
        sampled["traffic"] = json!({ "samples": 3000, "columns": {
            "/contact/lateral_shift_mm": { "min": -6, "max": 6, "mean": 1, "standard_deviation": 1.5 },
            "/load/vertical_force_n": { "min": 50e3, "max": 110e3 },
        } });
        let task = checked(&sampled);
        let column = |name: &str| {
            let k = task.pointers.iter().position(|pointer| pointer == name);
            &task.columns[k.expect("a column")]
        };
        let [shifts, loads] = ["/contact/lateral_shift_mm", "/load/vertical_force_n"].map(column);
        let moments = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / 3000.0;
            let squares = values.iter().map(|value| (value - mean).powi(2));
            (mean, (squares.sum::<f64>() / 3000.0).sqrt())
        };
        let ((shift, shift_spread), (load, load_spread)) = (moments(shifts), moments(loads));
        // The bounds cut off 1e-3 of the normal distribution.
        assert!(
            (shift - 1.0).abs() < 0.02 && (shift_spread - 1.5).abs() < 0.02,
            "{shift} {shift_spread}"
        );
        assert!(
            (load - 80e3).abs() < 50.0 && (load_spread - 60e3 / 12.0_f64.sqrt()).abs() < 50.0,
            "{load} {load_spread}"
        );
        let pairs = shifts.iter().zip(loads);
        let products: f64 = pairs.map(|(a, b)| (a - shift) * (b - load)).sum();
        assert!((products / 3000.0 / shift_spread / load_spread).abs() < 0.02);
        let mut table = sampled.clone();
        table["traffic"] = json!({ "columns": { "/contact/lateral_shift_mm": shifts, "/load/vertical_force_n": loads } });
        let table = checked(&table);
        assert_eq!(
            (&table.columns, &table.shares),
            (&task.columns, &task.shares)
        );
    }

    #[test]
    fn faults_of_distributions_name_what_is_allowed() {
        let good = json!({ "min": 0, "max": 1 });
        for (traffic, pointer, detail) in [
            (
                json!({ "columns": { "/contact/lateral_shift_mm": { "min": 2, "max": 1 } } }),
                "/traffic/columns/~1contact~1lateral_shift_mm/max",
                "from 2 to",
            ),
            (
                json!({ "columns": { "/contact/lateral_shift_mm": { "min": 0, "max": 1, "mean": 0.5 } } }),
                "/traffic/columns/~1contact~1lateral_shift_mm/standard_deviation",
                "missing",
            ),
            (
                json!({ "columns": { "/contact/lateral_shift_mm": [0, 1], "/load/vertical_force_n": [7e4] } }),
                "/traffic/columns/~1load~1vertical_force_n",
                "2 rows",
            ),
            (
                json!({ "columns": { "/contact/lateral_shift_mm": good }, "samples": 0 }),
                "/traffic/samples",
                "1 to 200000",
            ),
            (
                json!({ "columns": { "/contact/lateral_shift_mm": good }, "passes": [1] }),
                "/traffic/passes",
                "4096 rows",
            ),
            (
                json!({ "columns": { "/contact/lateral_shift_mm": [0, 1] }, "samples": 5 }),
                "/traffic/columns/~1contact~1lateral_shift_mm",
                "5 rows",
            ),
        ] {
            let mut bad = request(&[0.0], &[1.0], 1);
            bad["traffic"] = traffic;
            let error = Evolution::check(&bad, &Limits::default()).expect_err("a fault");
            let told = error
                .0
                .iter()
                .any(|fault| fault.pointer == pointer && fault.detail.contains(detail));
            assert!(told, "{pointer}: {:?}", error.0);
        }
    }

    #[test]
    fn faults_name_the_place_the_value_and_what_is_allowed() {
        let good = request(&[0.0, 1.0], &[1.0, 1.0], 2);
        let fault = |pointer: &str, value: Value| {
            let mut bad = good.clone();
            *bad.pointer_mut(pointer).expect("a place") = value;
            let error = Evolution::check(&bad, &Limits::default()).expect_err("a fault");
            (error.0[0].pointer.clone(), error.0[0].detail.clone())
        };
        let cases = [
            (
                "/extent/axle_passes",
                json!(-5),
                "/extent/axle_passes",
                "-5",
            ),
            (
                "/traffic/passes",
                json!([1.0]),
                "/traffic/passes",
                "of length 1",
            ),
            (
                "/traffic/columns/~1contact~1lateral_shift_mm/1",
                json!(5e4),
                "/traffic/columns/~1contact~1lateral_shift_mm/1",
                "50000",
            ),
            (
                "/template/contact/rail",
                json!({ "guard_rail_points_mm": [[-80.0, 0.0]] }),
                "/template/contact/rail/guard_rail_points_mm",
                "running rail",
            ),
            (
                "/template/contact/type",
                json!("radii"),
                "/template/contact/type",
                "profiles",
            ),
            (
                "/template/friction/coefficient",
                json!(-1),
                "/template/friction/coefficient",
                "-1",
            ),
            (
                "/accuracy/states_max",
                json!(0.5),
                "/accuracy/states_max",
                "0.5",
            ),
        ];
        for (place, value, pointer, detail) in cases {
            let (found, told) = fault(place, value);
            assert!(
                found == pointer && told.contains(detail),
                "{place}: {found}: {told}"
            );
        }
    }
}
