//! What the columns of rows are called: a JSON pointer or a short name varies the case, any other name is carried along to the answers.

use crate::http::extract::batch::table::short_pointer;
use crate::jobs::run::head::RunColumn;

/// The column of this title.
pub(super) fn column(title: &str, text: bool) -> RunColumn {
    let pointer = match title.starts_with('/') {
        true => Some(title.to_owned()),
        false => short_pointer(title).map(str::to_owned),
    };
    RunColumn {
        name: title.to_owned(),
        pointer,
        text,
    }
}
