//! The ending of an output's name, which says its format.

use biscale::error::{BadInput, Error};
use std::path::Path;

/// The ending in lower case, empty where there is none.
pub fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// The mistake of an output whose ending is no format of the command.
pub fn unknown_ending(path: &Path, remedy: &str) -> Error {
    let ending = ending(path);
    let problem = if ending.is_empty() {
        "the name has no ending, which says the format".to_owned()
    } else {
        format!("the ending .{ending} is not known")
    };
    BadInput::new(problem, remedy).in_file(path).at_field("output").into()
}
