//! `biscale plot`: pictures of a material or of a baked table.

mod bodies;
mod polar;
mod view;

use crate::common::bounces::Bounces;
use crate::common::figure;
use crate::common::options::{CommonArgs, QualityArgs};
use crate::common::output::{self, MadeFolder, Target};
use crate::common::progress;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::{self, Control, Quality, Value};
use biscale::material::Material;
use biscale::table::EffectiveTable;
use biscale::table::is_openexr;
use clap::Args;
use polar::{MOST_MATERIALS, Plotted, Quantity, Slices};
use rayon::prelude::*;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `biscale plot`.
#[derive(Args, Debug)]
pub struct PlotArgs {
    /// Material file, or a table that `bake` wrote (which has no geometry to view); several, up to four, are drawn into one polar plot
    #[arg(required = true, num_args = 1..=MOST_MATERIALS, value_name = "MATERIAL")]
    pub(crate) inputs: Vec<PathBuf>,
    /// Folder for the pictures, made if it is not there: `NAME-polar` and `NAME-view`, each as .svg and .png
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// Angles of incidence of the polar plots, degrees from the normal, with commas between them
    #[arg(long, value_name = "DEGREES", value_delimiter = ',', default_value = "0,30,60", value_parser = incidence, allow_negative_numbers = true)]
    incidence: Vec<f64>,
    /// Azimuth of the light in the polar plots, degrees from x towards y
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = azimuth, allow_negative_numbers = true)]
    azimuth: f64,
    /// What the polar plots show
    #[arg(long, value_enum, default_value_t = Quantity::Fhat)]
    quantity: Quantity,
    /// Periods of the surface along the longer side of its view; fewer by default where a period holds many details
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100), allow_negative_numbers = true)]
    periods: Option<u32>,
    /// Leave the view of the surface out
    #[arg(long)]
    no_view: bool,
    /// Replace pictures that exist and were not made by this command
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    quality: QualityArgs,
}

/// Most panels in a row.
const MOST_INCIDENCES: usize = 6;
/// Pixels of a PNG for one of the polar plot.
const POLAR_SCALE: f32 = 2.0;
/// Share of the progress that the values take; the view takes the rest.
const VALUES: f64 = 0.5;

fn incidence(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|v| (0.0..=89.9).contains(v)).ok_or_else(|| "write degrees from 0 to 89.9, such as 0,30,60".to_owned())
}

fn azimuth(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v| (-360.0..=360.0).contains(v)).ok_or_else(|| "write degrees from -360 to 360".to_owned())
}

/// Runs the command.
///
/// # Errors
/// Bad input, those of the filter, and i/o. Pictures are written when all are made.
pub fn run(args: &PlotArgs, common: &CommonArgs) -> Result<()> {
    let quality = args.quality.quality()?;
    if args.incidence.len() > MOST_INCIDENCES {
        let problem = format!("{} angles of incidence do not fit into one picture", args.incidence.len());
        return Err(BadInput::new(problem, format!("name at most {MOST_INCIDENCES}")).at_field("incidence").into());
    }
    let slices = Slices { incidences_deg: args.incidence.clone(), azimuth_deg: args.azimuth, quantity: args.quantity };
    let sources = args.inputs.iter().map(|input| Source::load(input, &quality)).collect::<Result<Vec<_>>>()?;
    let with_view = !args.no_view && matches!(sources[..], [Source::Material(..)]);
    let wanted = Wanted { slices, with_view, periods: args.periods };
    let folder = Folder::new(args, with_view)?;
    let bounces = sources.iter().map(|source| source.bounces(&quality)).max().unwrap_or(0);
    let pictures = progress::with_advice(common, args.quality.advice(bounces), |control| pictures(&sources, &wanted, &quality, control))?;
    let mut notes = args.quality.notes();
    notes.extend(pictures.notes);
    if matches!(sources[..], [Source::Table(_)]) && !args.no_view {
        notes.push("a baked table has no geometry: there is no view of the surface".to_owned());
    }
    let notes = common.flags.in_texts(notes);
    folder.write(&pictures.files)?;
    if common.json {
        let (how, relative_rms_error) = (pictures.how.join("\n"), pictures.relative_rms);
        return output::print_json(&Object { files: folder.names(), how, relative_rms_error, notes });
    }
    for how in &pictures.how {
        output::tell(common, how);
    }
    for note in &notes {
        output::tell(common, &format!("note: {note}"));
    }
    for file in folder.names() {
        output::tell(common, &format!("wrote {}", file.display()));
    }
    Ok(())
}

/// The output of `--json`.
#[derive(Serialize)]
struct Object<'a> {
    files: Vec<&'a Path>,
    how: String,
    /// The largest of all materials.
    relative_rms_error: f64,
    notes: Vec<String>,
}

/// What is plotted.
enum Source {
    Material(Box<Material>, Box<biscale::material::SmallScale>),
    Table(Box<EffectiveTable>),
}

impl Source {
    fn load(path: &Path, quality: &Quality) -> Result<Self> {
        if is_openexr(path) {
            return Ok(Self::Table(Box::new(EffectiveTable::load(path)?)));
        }
        let material = Material::load(path)?;
        quality.method_for(&material)?;
        let surface = material.build()?;
        Ok(Self::Material(Box::new(material), Box::new(surface)))
    }

    /// Reflections after the first that its values have to be computed with; a table has its own.
    fn bounces(&self, quality: &Quality) -> u32 {
        match self {
            Self::Material(material, _) => quality.bounces_of(material.bounces),
            Self::Table(_) => 0,
        }
    }
}

/// Pictures, made and not yet written, in the order of [`Folder::endings`].
struct Pictures {
    files: Vec<Vec<u8>>,
    /// How the values of each material were made, in one line.
    how: Vec<String>,
    relative_rms: f64,
    notes: Vec<String>,
}

/// What the pictures show.
struct Wanted {
    slices: Slices,
    with_view: bool,
    periods: Option<u32>,
}

/// The values of one material or table, their relative RMS error, and what the user should know.
fn plotted(source: &Source, slices: &Slices, quality: &Quality, control: &Control<'_>) -> Result<(Plotted, f64, Vec<String>)> {
    let pairs = slices.pairs();
    let percent = |e: f64| format!("{:.2} %", 100.0 * e);
    let (name, values, made, relative_rms, notes): (&str, Vec<Value>, String, f64, Vec<String>) = match source {
        Source::Material(material, surface) => {
            let filter::Effective { values, summary } = filter::effective(surface, &pairs, quality, control)?;
            let rms = percent(summary.relative_rms);
            let bounces = Bounces::of(quality, material.bounces).after_comma();
            let made =
                format!("method {}, {} facets{bounces}, relative RMS error {rms}, seed {}", summary.method, summary.facets, quality.seed);
            let notes = surface.tile.notes.iter().cloned().chain(summary.notes).collect();
            (&material.name, values, made, summary.relative_rms, notes)
        }
        Source::Table(table) => {
            let about = &table.about;
            let values = pairs.par_iter().map(|p| table.eval(p.wi, p.wo)).collect();
            let made = format!(
                "baked table of {} rings, {} facets{}, relative RMS error between the nodes {}, seed {}",
                table.grid().rings(),
                about.facets,
                Bounces::of_table(about.bounces).after_comma(),
                percent(about.error.relative_rms),
                about.seed
            );
            (&about.name, values, made, about.error.relative_rms, about.notes.clone())
        }
    };
    if values.iter().any(|v| v.fhat.iter().chain(&v.se).any(|x| !x.is_finite())) {
        return Err(Error::Numeric("a value is not finite; please report this".to_owned()));
    }
    Ok((Plotted { name: name.to_owned(), made, values }, relative_rms, notes))
}

fn pictures(sources: &[Source], wanted: &Wanted, quality: &Quality, control: &Control<'_>) -> Result<Pictures> {
    let &Wanted { ref slices, with_view, periods } = wanted;
    let share = if with_view { VALUES } else { 1.0 } / sources.len() as f64;
    let (mut materials, mut notes, mut relative_rms) = (Vec::new(), Vec::new(), 0.0_f64);
    for (k, source) in sources.iter().enumerate() {
        let of_source = share * k as f64..share * (k + 1) as f64;
        let (material, rms, said) = control.part(of_source, |control| plotted(source, slices, quality, control))?;
        let place = |note: String| if sources.len() > 1 { format!("{}: {note}", material.name) } else { note };
        notes.extend(said.into_iter().map(place));
        relative_rms = relative_rms.max(rms);
        materials.push(material);
    }
    let polar = slices.draw(&materials);
    let mut files = vec![polar.finish(None).into_bytes(), figure::png(&polar.rasterise(POLAR_SCALE, None)?)?];
    if let ([Source::Material(material, surface)], true) = (sources, with_view) {
        let view = control.part(VALUES..1.0, |control| view::view(material, surface, periods, control))?;
        files.push(view.strip.finish(Some((&figure::png(&view.pixels)?, view.height))).into_bytes());
        files.push(figure::png(&view.strip.rasterise(f32::from(view::SCALE), Some(&view.pixels))?)?);
    }
    let how = materials.into_iter().map(|m| if sources.len() > 1 { format!("{}: {}", m.name, m.made) } else { m.made }).collect();
    Ok(Pictures { files, how, relative_rms, notes })
}

/// The files to be written.
struct Folder {
    files: Vec<(PathBuf, Target)>,
    _folder: MadeFolder,
}

impl Folder {
    /// Makes the folder and checks that its files can be written.
    fn new(args: &PlotArgs, with_view: bool) -> Result<Self> {
        let folder = MadeFolder::create(&args.output)?;
        let stems: Vec<_> = args.inputs.iter().map(|input| input.file_stem().unwrap_or_default().to_string_lossy()).collect();
        let stem = stems.join("-and-");
        let inputs: Vec<&Path> = args.inputs.iter().map(PathBuf::as_path).collect();
        let names = if with_view { &ENDINGS[..] } else { &ENDINGS[..2] };
        let target = |ending: &str| {
            let path = folder.path().join(format!("{stem}-{ending}"));
            let target = Target::new(&path, args.force, &inputs, |file| output::has_mark(file, figure::MARK))?;
            Ok((path, target))
        };
        Ok(Self { files: names.iter().map(|ending| target(ending)).collect::<Result<_>>()?, _folder: folder })
    }

    fn write(&self, contents: &[Vec<u8>]) -> Result<()> {
        self.files.iter().zip(contents).try_for_each(|((_, target), bytes)| target.write(|out: &mut dyn Write| out.write_all(bytes)))
    }

    fn names(&self) -> Vec<&Path> {
        self.files.iter().map(|(path, _)| path.as_path()).collect()
    }
}

/// The pictures in their order; those of the view may be missing.
const ENDINGS: [&str; 4] = ["polar.svg", "polar.png", "view.svg", "view.png"];
