//! `biscale capture`: photographs to calibrated measurements; a folder of photographs to a shoot file.

mod args;
mod single;
#[cfg(feature = "capture")]
mod sort;
#[cfg(feature = "capture")]
mod summary;

pub use args::CaptureArgs;

use crate::common::options::CommonArgs;
use biscale::error::Result;

/// Runs the command.
///
/// # Errors
/// This build has no `OpenCV`.
#[cfg(not(feature = "capture"))]
pub fn run(args: &CaptureArgs, common: &CommonArgs) -> Result<u8> {
    use biscale::error::Error;
    if single::is_photograph(&args.shoot) {
        return single::run(args, common);
    }
    let CaptureArgs { shoot, output: _, incomplete: _, assume_srgb: _, weave: _, wif: _, force: _ } = args;
    Err(Error::Unsupported {
        what: format!("`biscale capture {}`", shoot.display()),
        remedy: "this build has no OpenCV; install it (apt-get install libopencv-dev clang libclang-dev, or scripts/setup.sh capture) and build with \
                 `cargo build --release --package biscale-cli --features capture`"
            .into(),
    })
}

/// Runs the command. Returns the exit status: 1 if a check failed, and then all the same the folder is written.
///
/// # Errors
/// Bad input and i/o; nothing is written then.
#[cfg(feature = "capture")]
pub fn run(args: &CaptureArgs, common: &CommonArgs) -> Result<u8> {
    use crate::common::exit;
    use crate::common::output::{self, OutputFolder};
    use crate::common::progress;
    use biscale::error::BadInput;
    use biscale::formats::capture::{CREATOR, Capture, FILE_NAME, Severity};
    use biscale::toml_reader::Source;
    use biscale_capture::run::RunOptions;
    use biscale_capture::shoot::Shoot;

    if args.shoot.is_dir() {
        return sort::run(args, common).map(|()| 0);
    }
    if single::is_photograph(&args.shoot) {
        return single::run(args, common);
    }
    let Some(folder) = &args.output else {
        let remedy = format!("write `biscale capture {} -o captured`", args.shoot.display());
        return Err(BadInput::new("the folder to write is not named", remedy).at_field("output").into());
    };
    let made_here = |folder: &std::path::Path| Capture::read(&folder.join(FILE_NAME)).is_ok_and(|c| c.creator.starts_with(CREATOR));
    let target = OutputFolder::new(folder, args.force, made_here)?;
    let shoot = Shoot::parse(&Source::read(&args.shoot)?)?;
    let draft = match &args.wif {
        Some(file) => Some(biscale::geometry::weave::read_wif(file, false)?.draft),
        None => args.weave.clone(),
    };
    let options = RunOptions { assume_srgb: args.assume_srgb, draft, threads: common.threads };
    let capture =
        progress::with_control(common, |control| target.write(|part| biscale_capture::run::run(&shoot, &options, part, control)))?;
    if common.json {
        output::print_json(&capture)?;
    } else if common.quiet {
        // Who asks for quiet still wants to know how minutes of work ended.
        output::print(&summary::verdict(&capture, folder))?;
    } else {
        output::tell(common, &summary::summary(&capture, folder));
    }
    for check in capture.checks.iter().filter(|c| c.severity == Severity::Fail) {
        let photograph = check.photograph.as_ref().map_or(String::new(), |p| format!("{p}: "));
        // Checks name options by their fields, as they do in `capture.json`.
        let message = check.message.replace("`assume_srgb`", "--assume-srgb");
        output::say_error(&format!("{}: {photograph}{message}{}", check.code, summary::measured(check)));
    }
    Ok(if capture.usable { 0 } else { exit::FAILED })
}
