//! From the library's names of fields to the flags of the running command.
//!
//! The library knows no command line: its errors and notes name a field, as [`BadInput::field`] or in backticks in a text, in the
//! latter case perhaps with a value: `` `tolerance` ``, `` `method reference` ``. What the user can type is `--tolerance` and
//! `--method reference`. The names come from clap: an argument's id is the library's name of the field, its long name the flag.

use biscale::error::{BadInput, Error};
use clap::{ArgAction, Command};
use std::collections::BTreeMap;

/// Flags of a command by the fields that they set.
#[derive(Clone, Debug, Default)]
pub struct Flags(BTreeMap<String, String>);

impl Flags {
    /// The flags of `command`, which clap has built: those of every command are among its arguments then.
    pub fn of(command: &Command) -> Self {
        let mut flags = BTreeMap::new();
        for argument in command.get_arguments() {
            let asks_for_text =
                matches!(argument.get_action(), ArgAction::Help | ArgAction::HelpShort | ArgAction::HelpLong | ArgAction::Version);
            if let (Some(long), false) = (argument.get_long(), asks_for_text) {
                for field in [argument.get_id().to_string(), long.replace('-', "_")] {
                    flags.insert(field, format!("--{long}"));
                }
            }
        }
        Self(flags)
    }

    /// A text with flags in the place of the fields that stand in backticks. A field without a flag here stays as it is.
    pub fn in_text(&self, text: &str) -> String {
        let pieces: Vec<&str> = text.split('`').collect();
        let mut out = String::with_capacity(text.len() + 8);
        for (k, piece) in pieces.iter().enumerate() {
            if k > 0 {
                out.push('`');
            }
            // Every second piece stands between two backticks; one that nothing closes does not.
            let quoted = k % 2 == 1 && k + 1 < pieces.len();
            match self.flag_of(piece).filter(|_| quoted) {
                Some((flag, value)) => out.extend([flag, value]),
                None => out.push_str(piece),
            }
        }
        out
    }

    /// As [`Flags::in_text`], of several texts.
    pub fn in_texts(&self, texts: Vec<String>) -> Vec<String> {
        texts.into_iter().map(|text| self.in_text(&text)).collect()
    }

    /// The flag of `field` or `field value`, and the rest of it.
    fn flag_of<'a>(&'a self, quoted: &'a str) -> Option<(&'a str, &'a str)> {
        let (field, value) = quoted.split_at(quoted.find(' ').unwrap_or(quoted.len()));
        // `key = value` is a line of a file.
        let flag = self.0.get(field).filter(|_| !value.trim_start().starts_with('='))?;
        Some((flag, value))
    }

    /// An error with flags in the place of fields. A mistake in a line of a file is about that file's own keys and stays as it is.
    pub fn in_error(&self, error: Error) -> Error {
        match error {
            Error::BadInput(bad) if bad.line.is_none() => {
                let field = bad.field.map(|field| self.0.get(&field).cloned().unwrap_or(field));
                BadInput { field, problem: self.in_text(&bad.problem), remedy: self.in_text(&bad.remedy), ..bad }.into()
            }
            Error::Unsupported { what, remedy } => Error::Unsupported { what: self.in_text(&what), remedy: self.in_text(&remedy) },
            Error::Numeric(text) => Error::Numeric(self.in_text(&text)),
            Error::BadInput(_) | Error::Io { .. } | Error::Interrupted => error,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;

    fn flags() -> Flags {
        let mut command = Command::new("c").args([
            Arg::new("tolerance").long("tolerance"),
            Arg::new("thickness").long("paper-thickness"),
            Arg::new("method").long("method"),
            Arg::new("file"),
        ]);
        command.build();
        Flags::of(&command)
    }

    #[test]
    fn fields_in_backticks_become_flags_and_other_words_stay() {
        for (text, printed) in [
            ("set the time by `tolerance`", "set the time by `--tolerance`"),
            ("`thickness`, or `paper_thickness`", "`--paper-thickness`, or `--paper-thickness`"),
            ("ask for `method direct`", "ask for `--method direct`"),
            ("add `method = \"direct\"`", "add `method = \"direct\"`"),
            ("the tolerance of `wool` in `file`", "the tolerance of `wool` in `file`"),
            ("a lone ` before tolerance", "a lone ` before tolerance"),
            ("`tolerance` and `tolerance", "`--tolerance` and `tolerance"),
            ("`help` and `version`", "`help` and `version`"),
        ] {
            assert_eq!(flags().in_text(text), printed);
        }
    }

    #[test]
    fn an_error_at_a_field_is_printed_with_its_flag_except_in_a_line_of_a_file() {
        let bad = BadInput::new("7 is too much", "see `method`").at_field("thickness");
        assert_eq!(flags().in_error(bad.clone().into()).to_string(), "--paper-thickness: 7 is too much; see `--method`");
        let placed = bad.in_file("a.toml".as_ref()).at_line(3);
        assert_eq!(flags().in_error(placed.into()).to_string(), "a.toml:3: thickness: 7 is too much; see `method`");
        let unsupported = Error::Unsupported { what: "`method sg`".into(), remedy: "use `method direct`".into() };
        assert_eq!(flags().in_error(unsupported).to_string(), "`--method sg` is not supported: use `--method direct`");
    }
}
