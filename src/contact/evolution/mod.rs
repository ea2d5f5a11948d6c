//! Profiles that wear under a traffic, step by step.
//!
//! An [`Evolution`](task::Evolution) is a case of a wheel on a rail, a traffic of many states of it, and a plan. Its
//! [`step`](task::Evolution::step) takes a serialisable [state](crate::contact::solution::words::evolution::EvolutionState) to the next one and
//! depends on nothing else, so that an evolution can be left after any step and continued elsewhere to the same bits.
//!
//! The first step condenses the [`traffic`]. Every other one solves all states on the present sections by the stages that every case passes,
//! adds up their wear along the [`section`]s ([`pass`]), and moves these ([`step`]). [`record`] has what is answered.

pub mod pass;
pub mod record;
pub mod section;
pub mod step;
pub mod task;
pub mod traffic;

#[cfg(test)]
mod tests;
