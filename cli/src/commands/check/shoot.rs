//! What `biscale check` says of a shoot file.

use biscale::error::Result;
use biscale_capture::shoot::{ROLES, Registration, Role, Shape, Shoot, WIDE_DEG};
use serde::Serialize;
use std::fmt;

/// What a good shoot file means.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    kind: &'static str,
    name: String,
    sample: String,
    registered_by: &'static str,
    camera: &'static str,
    /// Files of each role.
    photographs: Vec<(String, usize)>,
    lights: Vec<String>,
    notes: Vec<String>,
    doubtful: bool,
}

impl Report {
    /// Describes a shoot, whose files are opened.
    ///
    /// # Errors
    /// A file that cannot be read, or was taken through a lens or at a size that no board view was.
    pub fn of(shoot: &Shoot) -> Result<Self> {
        let files = shoot.open()?;
        shoot.check_lenses(&files)?;
        let count = |role| shoot.of_role(role).map(|p| p.files.len()).sum::<usize>();
        let photographs: Vec<(String, usize)> =
            ROLES.iter().map(|(name, role)| ((*name).to_owned(), count(*role))).filter(|c| c.1 > 0).collect();
        let calibrated = is_calibrated(shoot, &photographs);
        let mut lights: Vec<String> = shoot.photos.iter().filter(|p| p.role.is_sample()).map(|p| p.light.clone()).collect();
        lights.sort();
        lights.dedup();
        let mut notes = what_is_missing(shoot, &photographs, &lights);
        let encoded = shoot.encoded(&files);
        if let Some(first) = encoded.first() {
            let name = first.file_name().unwrap_or_default().to_string_lossy();
            notes.push(format!("{} photographs have a tone curve, such as {name}: `biscale capture` takes them with --assume-srgb only, which loses accuracy", encoded.len()));
        }
        let field_of_view = shoot.given_field_of_view(&files);
        let doubtful = field_of_view.is_some_and(|deg| deg > WIDE_DEG);
        if let Some(deg) = field_of_view.filter(|_| doubtful) {
            notes.push(format!("the given focal length means a field of view of {deg:.0} degrees, which few lenses have: is it in pixels of these photographs?"));
        }
        Ok(Self {
            doubtful,
            kind: "shoot",
            name: shoot.name.clone(),
            sample: match shoot.sample.shape {
                Shape::Plane(size) => format!("plane of {} x {} mm", size.x, size.y),
                Shape::Cylinder { radius, height, .. } => format!("cylinder of radius {radius} mm, {height} mm high"),
            },
            registered_by: match shoot.sample.on {
                Registration::Sheet(_) => "the markers of its sheet",
                Registration::Board(_) => "the board that it lies on",
                Registration::None => "nothing but what each photograph says",
            },
            camera: if calibrated {
                "calibrated from the board views"
            } else if shoot.camera.given.is_some() {
                "as given"
            } else {
                "not known"
            },
            photographs,
            lights,
            notes,
        })
    }

    /// Whether something in it is hardly meant.
    pub fn is_doubtful(&self) -> bool {
        self.doubtful
    }
}

fn has(photographs: &[(String, usize)], role: &str) -> bool {
    photographs.iter().any(|p| p.0 == role)
}

/// Whether board views tell what the camera is.
fn is_calibrated(shoot: &Shoot, photographs: &[(String, usize)]) -> bool {
    has(photographs, "board") && shoot.board.is_some()
}

/// What a shoot lacks, and what comes of it.
fn what_is_missing(shoot: &Shoot, photographs: &[(String, usize)], lights: &[String]) -> Vec<String> {
    let has = |role| has(photographs, role);
    let mut notes = Vec::new();
    let mut note = |missing: bool, text: &str| {
        if missing {
            notes.push(text.to_owned());
        }
    };
    note(!is_calibrated(shoot, photographs) && shoot.camera.given.is_none(), "no board views and no focal_px: nothing can be placed");
    note(has("board") && shoot.board.is_none(), "there are board views, but no [board] says what they show");
    note(!has("flat"), "no flat field: corners come out darker than the middle");
    note(!has("checker"), "no colour checker: colours are the camera's own");
    note(!has("close-up"), "no close-up: nothing will be known of the small scale");
    note(!has("distant"), "no distant photograph: there is nothing to fit");
    note(!has("validation"), "no validation photograph: a fit cannot be tested");
    let missing =
        |l: &&String| !shoot.lights.iter().any(|g| g.name == **l) && !shoot.photos.iter().any(|p| p.role == Role::Light && p.light == **l);
    for light in lights.iter().filter(missing) {
        notes.push(format!("nothing tells the direction of light \"{light}\""));
    }
    notes
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  name      {}", self.name)?;
        writeln!(f, "  sample    {}, found by {}", self.sample, self.registered_by)?;
        writeln!(f, "  camera    {}", self.camera)?;
        let photos: Vec<String> = self.photographs.iter().map(|(role, n)| format!("{n} {role}")).collect();
        writeln!(f, "  photos    {}", photos.join(", "))?;
        writeln!(f, "  lights    {}", self.lights.join(", "))?;
        for note in &self.notes {
            writeln!(f, "  note      {note}")?;
        }
        Ok(())
    }
}
