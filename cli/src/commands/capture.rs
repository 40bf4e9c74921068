//! `biscale capture`: photographs to calibrated measurements.

use crate::common::options::CommonArgs;
use biscale::error::Result;
use biscale::geometry::weave::Draft;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `biscale capture`.
#[derive(Args, Debug)]
#[command(
    after_help = "Writes capture.json, linear photographs with masks, and report.html. Exit status 1 if a check failed: the report says which."
)]
pub struct CaptureArgs {
    /// Shoot file: the list of photographs; `biscale new shoot` writes an example
    pub(crate) shoot: PathBuf,
    /// Folder to write
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// Take 8-bit values, and those of a file that names a tone curve, as sRGB; loses accuracy
    #[arg(long)]
    assume_srgb: bool,
    /// Draft of the close-up's weave, where it is known: plain, twill:OVER/UNDER, satin:ENDS/STEP, or rows such as 100/010/001, the highest first
    #[arg(long, value_name = "DRAFT", value_parser = draft, conflicts_with = "wif")]
    weave: Option<Draft>,
    /// The same from a WIF file
    #[arg(long, value_name = "FILE")]
    wif: Option<PathBuf>,
    /// Write into a folder that exists and was not made by this command
    #[arg(long)]
    force: bool,
}

/// Reads `--weave`.
fn draft(text: &str) -> Result<Draft, String> {
    let remedy = "write plain, twill:2/1, satin:5/2, or rows such as 100/010/001";
    let pair = |rest: &str| -> Result<[u32; 2], String> {
        let (a, b) = rest.split_once('/').ok_or_else(|| format!("two numbers are needed; {remedy}"))?;
        let number = |t: &str| {
            t.trim().parse::<u32>().ok().filter(|n| (1..=100).contains(n)).ok_or_else(|| format!("\"{t}\" is not from 1 to 100; {remedy}"))
        };
        Ok([number(a)?, number(b)?])
    };
    if text == "plain" {
        return Ok(Draft::shifted(1, 1, 1));
    }
    if let Some(rest) = text.strip_prefix("twill:") {
        let [over, under] = pair(rest)?;
        return Ok(Draft::shifted(over, under, 1));
    }
    if let Some(rest) = text.strip_prefix("satin:") {
        let [ends, step] = pair(rest)?;
        if ends < 5 || step < 2 || step + 2 > ends {
            return Err(format!("there is no satin of {ends} ends and step {step}; {remedy}"));
        }
        return Ok(Draft::shifted(ends - 1, 1, step));
    }
    let rows: Vec<Vec<bool>> = text.split('/').rev().map(|row| row.chars().map(|c| c == '1').collect()).collect();
    let columns = rows[0].len();
    if columns == 0 || text.chars().any(|c| !matches!(c, '0' | '1' | '/')) || rows.iter().any(|r| r.len() != columns) {
        return Err(format!("\"{text}\" is no draft; {remedy}"));
    }
    Ok(Draft::from_fn(columns, rows.len(), |i, j| rows[j][i]))
}

/// Runs the command.
///
/// # Errors
/// This build has no `OpenCV`.
#[cfg(not(feature = "capture"))]
pub fn run(args: &CaptureArgs, _common: &CommonArgs) -> Result<u8> {
    use biscale::error::Error;
    let CaptureArgs { shoot, output, assume_srgb: _, weave: _, wif: _, force: _ } = args;
    Err(Error::Unsupported {
        what: format!("`biscale capture {} -o {}`", shoot.display(), output.display()),
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
    use biscale::formats::capture::{CREATOR, Capture, FILE_NAME, Severity};
    use biscale::toml_reader::Source;
    use biscale_capture::run::RunOptions;
    use biscale_capture::shoot::Shoot;

    let made_here = |folder: &std::path::Path| Capture::read(&folder.join(FILE_NAME)).is_ok_and(|c| c.creator.starts_with(CREATOR));
    let folder = OutputFolder::new(&args.output, args.force, made_here)?;
    let shoot = Shoot::parse(&Source::read(&args.shoot)?)?;
    let draft = match &args.wif {
        Some(file) => Some(biscale::geometry::weave::read_wif(file, false)?.draft),
        None => args.weave.clone(),
    };
    let options = RunOptions { assume_srgb: args.assume_srgb, draft, threads: common.threads };
    let capture =
        progress::with_control(common, |control| folder.write(|part| biscale_capture::run::run(&shoot, &options, part, control)))?;
    if common.json {
        output::print_json(&capture)?;
    } else {
        output::tell(common, &summary(&capture, &args.output));
    }
    for check in capture.checks.iter().filter(|c| c.severity == Severity::Fail) {
        let photograph = check.photograph.as_ref().map_or(String::new(), |p| format!("{p}: "));
        // Checks name options by their fields, as they do in `capture.json`.
        let message = check.message.replace("`assume_srgb`", "--assume-srgb");
        output::say_error(&format!("{}: {photograph}{message}{}", check.code, measured(check)));
    }
    Ok(if capture.usable { 0 } else { exit::FAILED })
}

/// What a check measured, for people.
#[cfg(feature = "capture")]
fn measured(check: &biscale::formats::capture::Check) -> String {
    match (check.measured, check.threshold) {
        (Some(m), Some(t)) => format!(" ({m:.4} for {t} {})", check.unit),
        _ => String::new(),
    }
}

/// What was measured, in a few lines.
#[cfg(feature = "capture")]
fn summary(capture: &biscale::formats::capture::Capture, folder: &std::path::Path) -> String {
    use biscale::formats::capture::Severity;
    let mut out = capture.name.clone();
    if let Some(c) = &capture.camera {
        let sigma = |k: usize| c.sigma.map_or(String::new(), |s| format!(" +/- {:.2}", s[k]));
        let rms = c.rms_px.map_or(String::new(), |r| format!(", {} views, {r:.3} px RMS", c.views));
        out.push_str(&format!(
            "\ncamera ({}): f {:.1}{} x {:.1}{}, centre {:.1}{}, {:.1}{} px{rms}",
            c.source,
            c.fx,
            sigma(0),
            c.fy,
            sigma(1),
            c.cx,
            sigma(2),
            c.cy,
            sigma(3)
        ));
        if !c.dropped.is_empty() {
            out.push_str(&format!("\nviews left out: {}", c.dropped.join(", ")));
        }
    }
    if let Some(c) = &capture.colour {
        out.push_str(&format!("\ncolour ({}): mean Delta E 2000 {:.2}", c.source, c.mean_delta_e));
    }
    for l in &capture.lights {
        let [x, y, z] = l.direction;
        out.push_str(&format!("\nlight \"{}\": ({x:.4}, {y:.4}, {z:.4}) +/- {:.2} degrees", l.name, l.sigma_deg));
    }
    if let Some(weave) = capture.close_up.as_ref().and_then(|c| c.weave.as_ref()) {
        let number = |v: &serde_json::Value| v.as_f64().unwrap_or(f64::NAN);
        let unit = weave["unit"].as_str().unwrap_or_default();
        out.push_str(&format!(
            "\nweave: {} (confidence {:.2}), warp {:.4} {unit}, weft {:.4} {unit} from thread to thread",
            weave["class_name"].as_str().unwrap_or_default(),
            number(&weave["confidence"]),
            number(&weave["warp"]["pitch"]["value"]),
            number(&weave["weft"]["pitch"]["value"])
        ));
    }
    for p in &capture.photographs {
        let pose = p.pose.as_ref().map_or("not placed".to_owned(), |pose| {
            let t = glam::DVec3::from(pose.translation_mm).length();
            if pose.points > 0 {
                format!("{t:.1} mm away, {} corners, {:.3} px RMS", pose.points, pose.rms_px)
            } else {
                format!("{t:.1} mm away, as given")
            }
        });
        out.push_str(&format!("\n{} ({}): {pose}", p.file, p.role));
    }
    for check in capture.checks.iter().filter(|c| c.severity == Severity::Warn) {
        let photograph = check.photograph.as_ref().map_or(String::new(), |p| format!("{p}: "));
        out.push_str(&format!("\nwarning: {}: {photograph}{}{}", check.code, check.message, measured(check)));
    }
    out.push_str(&format!("\nwrote {}", folder.join("report.html").display()));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drafts_are_read_as_they_are_written() {
        assert_eq!(draft("plain").unwrap(), Draft::shifted(1, 1, 1));
        assert_eq!(draft("twill:2/1").unwrap(), Draft::shifted(2, 1, 1));
        assert_eq!(draft("satin:5/2").unwrap(), Draft::shifted(4, 1, 2));
        // The highest row first: the lowest is row 0.
        let rows = draft("110/011").unwrap();
        assert_eq!((rows.columns, rows.rows, rows.over(0, 0), rows.over(0, 1)), (3, 2, false, true));
        for text in ["", "linen", "twill", "twill:2", "twill:0/1", "satin:4/2", "satin:5/4", "10/1", "102/010"] {
            assert!(draft(text).unwrap_err().contains("twill:2/1"), "{text}");
        }
    }
}
