//! Does the service behave?

mod contract;
