//! Whether what is said on standard error is coloured.

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};

/// When standard error is coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ColourChoice {
    /// On a terminal, unless `NO_COLOR` is set
    #[default]
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// Whether standard error is coloured.
static COLOURED: AtomicBool = AtomicBool::new(false);

/// Chooses whether an error is coloured; the answer is for clap's own errors.
pub fn choose_colour(choice: ColourChoice) -> clap::ColorChoice {
    let coloured = match choice {
        ColourChoice::Always => true,
        ColourChoice::Never => false,
        ColourChoice::Auto => {
            let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
            io::stderr().is_terminal() && !set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
        }
    };
    COLOURED.store(coloured, Ordering::Relaxed);
    match choice {
        ColourChoice::Auto => clap::ColorChoice::Auto,
        ColourChoice::Always => clap::ColorChoice::Always,
        ColourChoice::Never => clap::ColorChoice::Never,
    }
}

/// What was chosen.
pub fn is_coloured() -> bool {
    COLOURED.load(Ordering::Relaxed)
}
