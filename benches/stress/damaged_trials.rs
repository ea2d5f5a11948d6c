//! Trials on damaged profiles: the errors of the answers, and their remarks.

use serde_json::{Value, json};

use crate::damaged::{Damage, Pair, Place, answer, blamed, pressure_max, with};
use crate::random::Random;

/// Results of the trials of one kind of damage, or of all.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    /// Positions with sound profiles, and how many of them were blamed.
    pub sound: usize,
    pub sound_blamed: usize,
    /// Damaged profiles, and how many of them had no answer.
    pub damaged: usize,
    pub refused: usize,
    /// Answers that are wrong by more than 10 % in the largest pressure or 3 % of μN in a force, and how many have a remark.
    pub wrong: usize,
    pub wrong_told: usize,
    /// Answers that are right within 3 % and 1 %, and how many still have a remark.
    pub right: usize,
    pub right_told: usize,
    /// Answers whose error of pressure or of forces is within the uncertainty.
    pub pressure_covered: usize,
    pub force_covered: usize,
}

impl Counts {
    /// Returns the sum of both.
    pub fn and(mut self, other: &Counts) -> Counts {
        self.sound += other.sound;
        self.sound_blamed += other.sound_blamed;
        self.damaged += other.damaged;
        self.refused += other.refused;
        self.wrong += other.wrong;
        self.wrong_told += other.wrong_told;
        self.right += other.right;
        self.right_told += other.right_told;
        self.pressure_covered += other.pressure_covered;
        self.force_covered += other.force_covered;
        self
    }

    fn plus(&mut self, found: &Trial) {
        self.damaged += 1;
        let Trial::Answered {
            pressure,
            force,
            open,
            told,
        } = found
        else {
            self.refused += 1;
            return;
        };
        let (wrong, right) = (
            *pressure > 0.1 || *force > 0.03,
            *pressure < 0.03 && *force < 0.01,
        );
        self.wrong += usize::from(wrong);
        self.wrong_told += usize::from(wrong && *told);
        self.right += usize::from(right);
        self.right_told += usize::from(right && *told);
        self.pressure_covered += usize::from(*pressure <= open[0]);
        self.force_covered += usize::from(*force <= open[1]);
    }
}

/// Result of one damaged case: errors of the largest pressure (relative) and of the force (relative to μN), and whether the answer remarks on them.
enum Trial {
    Refused,
    Answered {
        pressure: f64,
        force: f64,
        open: [f64; 2],
        told: bool,
    },
}

/// Counts by kind of damage, or for one kind, over the pairs at `places` positions each. Returns the counts of the sound positions.
pub fn rows_of(
    pairs: &[Pair],
    seed: u64,
    places: usize,
    kind: Option<usize>,
    smoothing: &Value,
    rows: &mut [Counts; Damage::KINDS],
) -> Counts {
    let mut random = Random(seed);
    let mut sound = Counts::default();
    for pair in pairs {
        for _ in 0..places {
            let Some(place) = pair.place(&mut random) else {
                continue;
            };
            sound.sound += 1;
            sound.sound_blamed += usize::from(!blamed(&place.sound).is_empty());
            for (k, row) in rows.iter_mut().enumerate() {
                if kind.is_none_or(|only| only == k) {
                    row.plus(&place.trial(
                        pair,
                        Damage::random(k, &mut random),
                        smoothing,
                        &mut random,
                    ));
                }
            }
        }
    }
    sound
}

impl Place {
    fn trial(&self, pair: &Pair, damage: Damage, smoothing: &Value, random: &mut Random) -> Trial {
        let single = matches!(
            damage,
            Damage::Hole(_) | Damage::Outlier(_) | Damage::Step(_)
        );
        let only = random.below(2);
        let [rail, wheel] = [(0, &pair.rail), (1, &pair.wheel)].map(|(body, points)| {
            if single && only != body {
                points.clone()
            } else {
                damage.done_to(points, self.at[body], random)
            }
        });
        let mut case = with(&self.case, &rail, &wheel, smoothing.clone());
        case["contact"]["accept_rough_profiles"] = json!(true);
        let Some(found) = answer(&case) else {
            return Trial::Refused;
        };
        let normal: f64 = self
            .sound
            .patches
            .iter()
            .map(|patch| patch.normal_force_n)
            .sum();
        let limit = 0.3 * normal;
        let (own, sound) = (found.total[0], self.sound.total[0]);
        let difference = |a: f64, b: f64| (a - b).abs() / limit;
        let open = own.profile_uncertainty.expect("an uncertainty");
        let pressure = pressure_max(&self.sound);
        Trial::Answered {
            pressure: (pressure_max(&found) / pressure - 1.0).abs(),
            force: difference(own.force_x_n, sound.force_x_n)
                .max(difference(own.force_y_n, sound.force_y_n)),
            open: [
                open.pressure_max_mpa / pressure,
                open.force_x_n.max(open.force_y_n) / limit,
            ],
            told: !blamed(&found).is_empty(),
        }
    }
}
