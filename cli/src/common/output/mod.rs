//! What a command leaves behind: files that are whole or not there, JSON and text on standard output, words on standard error.

mod colour;
mod ending;
mod failure;
mod made_folder;
mod mark;
pub mod png;
mod streams;
mod target;
mod unfinished;
mod whole_folder;

pub use colour::{ColourChoice, choose_colour};
pub use ending::{ending, unknown_ending};
pub use failure::{Description, Failure};
pub use made_folder::MadeFolder;
pub use mark::{begins_with, has_creator, has_mark};
pub use streams::{is_broken_pipe, plain, print, print_json, say, say_error, tell};
pub use target::{Target, remove_unfinished};
pub use whole_folder::OutputFolder;
