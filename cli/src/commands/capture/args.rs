//! Arguments of `biscale capture`.

use biscale::error::Result;
use biscale::geometry::weave::Draft;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `biscale capture`.
#[derive(Args, Debug)]
#[command(
    after_help = "Of a shoot file: writes capture.json, linear photographs with masks, and report.html. Exit status 1 if a check failed: the report says which. Of a folder: \
                  sorts its photographs by what they show and writes a shoot file to look over, or says what is missing and how to take it. Of one photograph: what it tells of a cloth by \
                  itself, and what it cannot; exit status 1 if nothing repeats in it."
)]
pub struct CaptureArgs {
    /// Shoot file: the list of photographs (`biscale new shoot` writes an example); a folder of photographs, as a phone leaves it, to sort into one; or one photograph of a cloth or relief, straight on
    #[arg(value_name = "SHOOT|FOLDER|PHOTOGRAPH")]
    pub(crate) shoot: PathBuf,
    /// Folder to write; of a folder of photographs the shoot file, by default shoot.toml in it
    #[arg(long, short, value_name = "FOLDER")]
    pub(super) output: Option<PathBuf>,
    /// Write the shoot file of a folder although photographs are missing
    #[arg(long)]
    pub(super) incomplete: bool,
    /// Take 8-bit values, and those of a file that names a tone curve, as sRGB; loses accuracy
    #[arg(long)]
    pub(super) assume_srgb: bool,
    /// Draft of the close-up's weave, where it is known: plain, twill:OVER/UNDER, satin:ENDS/STEP, or rows such as 100/010/001, the highest first
    #[arg(long, value_name = "DRAFT", value_parser = draft, conflicts_with = "wif")]
    pub(super) weave: Option<Draft>,
    /// The same from a WIF file
    #[arg(long, value_name = "FILE")]
    pub(super) wif: Option<PathBuf>,
    /// Write into a folder that exists and was not made by this command
    #[arg(long)]
    pub(super) force: bool,
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
