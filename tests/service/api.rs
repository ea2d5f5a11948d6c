//! What clients do: submit, wait, list, look, fetch, cancel, delete.
