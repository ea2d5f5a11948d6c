//! Does the physics hold?

mod carter;
mod kalker;
mod laws;
mod reference;
mod reference_hertz;
mod robustness;
