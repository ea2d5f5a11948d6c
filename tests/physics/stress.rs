//! A small part of the stability stress test: random cases end in an answer that obeys the laws, or in a reason.

#[path = "../../benches/stress/contacts.rs"]
mod contacts;
#[path = "../../benches/stress/laws.rs"]
mod laws;
use crate::random;
#[path = "../../benches/stress/trial.rs"]
mod trial;

use contacts::samples;
use trial::{End, trial};

use crate::reference::assert_none;

#[test]
fn random_cases_obey_the_laws_or_say_why_not() {
    let mut failures = Vec::new();
    let (mut refused, mut covered, mut compared) = (0, 0, 0);
    let count = 400;
    for sample in samples(count, 7) {
        let found = trial(&sample);
        let name = |what: &str| format!("{} ({}): {what}", sample.number, sample.kind);
        failures.extend(found.broken.iter().map(|law| name(law)));
        if let Some((error, estimate)) = found.error {
            compared += 1;
            covered += usize::from(error <= estimate);
        }
        if let Some(apart) = found.from_liu_hsu
            && apart > 1e-4
        {
            failures.push(name(&format!("{apart:.1e} from liu_hsu")));
        }
        match found.end {
            End::Solved => {}
            End::Refused(_) => refused += 1,
            End::NotConverged(reason) | End::Failed(reason) => failures.push(name(&reason)),
        }
    }
    assert_none("of 400 random cases", &failures);
    assert!(refused < count / 20, "{refused} refused");
    assert!(
        10 * covered >= 9 * compared,
        "{covered} of {compared} covered"
    );
}
