//! Does a job that was acknowledged survive the death of the process?
