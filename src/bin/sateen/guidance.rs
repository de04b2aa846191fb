//! What a command line that says the right words in the wrong order seems to mean.

use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use sateen::fabric::Fabric;

use crate::output::Usage;

/// What `sateen render` lays cloth on.
pub(crate) const PLACES: [&str; 5] = ["cylinders", "sphere", "curtain", "trousers", "mesh"];

/// What an argument names, by its looks.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Looks {
    Fabric,
    Table,
    Mesh,
    Picture,
    Pairs,
    /// A fabric, a pattern or a scene.
    Toml,
}

impl Looks {
    pub(crate) fn of(argument: &str) -> Option<Self> {
        if Fabric::from_library(argument).is_some() {
            return Some(Self::Fabric);
        }
        let end = Path::new(argument).extension()?.to_ascii_lowercase();
        match end.to_str()? {
            "sateen" => Some(Self::Table),
            "toml" => Some(Self::Toml),
            "obj" | "gltf" | "glb" => Some(Self::Mesh),
            "png" | "exr" => Some(Self::Picture),
            "csv" => Some(Self::Pairs),
            _ => None,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Fabric => "a fabric of the library",
            Self::Table => "a table",
            Self::Mesh => "a mesh",
            Self::Picture => "a picture",
            Self::Pairs => "a CSV file of pairs",
            Self::Toml => "a TOML file",
        }
    }

    fn is_cloth(self) -> bool {
        matches!(self, Self::Fabric | Self::Table | Self::Toml)
    }

    /// What an argument of such looks is for.
    fn use_of(self, argument: &str) -> String {
        match self {
            Self::Fabric => {
                format!("`sateen bake {argument} -o {argument}.sateen` makes a table of it")
            }
            Self::Table => format!("`sateen info {argument}` says what it is"),
            Self::Mesh => {
                format!("`sateen render mesh {argument} FABRIC -o FILE` lays cloth on it")
            }
            Self::Picture => format!("`sateen compare {argument} TRUTH` compares it"),
            Self::Pairs => format!("`sateen eval FABRIC --pairs {argument}` evaluates them"),
            Self::Toml => format!(
                "`sateen bake {argument}` bakes a fabric or pattern, `sateen scene {argument}` looks at a scene"
            ),
        }
    }
}

/// That an argument looks like something else than what is `wanted`, and what that is for.
///
/// # Errors
/// When it does, and is there.
pub(crate) fn refuse(argument: &Path, others: &[Looks], wanted: &str) -> Result<(), Usage> {
    let name = argument.to_string_lossy();
    let Some(looks) = Looks::of(&name).filter(|looks| others.contains(looks)) else {
        return Ok(());
    };
    if (looks == Looks::Fabric) == argument.exists() {
        return Ok(());
    }
    Err(Usage(format!(
        "{name} is {}, not {wanted}; {}",
        looks.name(),
        looks.use_of(&name)
    )))
}

/// What to say of an error of the command line instead of what clap says, if there is more to say.
pub(crate) fn of(error: &clap::Error) -> Option<String> {
    let words: Vec<String> = std::env::args_os()
        .skip(1)
        .map(|word| word.to_string_lossy().into_owned())
        .filter(|word| !word.starts_with('-'))
        .collect();
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    match error.kind() {
        ErrorKind::InvalidSubcommand => {
            let wrong = context(ContextKind::InvalidSubcommand)?;
            match words.first()?.as_str() {
                "render" => of_render(wrong, &words[1..]),
                first if first == wrong => of_verb(wrong),
                _ => None,
            }
        }
        ErrorKind::InvalidValue if words.first()? == "fit" => {
            let wrong = context(ContextKind::InvalidValue)?;
            let looks = Looks::of(wrong).filter(|looks| looks.is_cloth())?;
            let model = words.iter().skip(1).find(|word| *word != wrong);
            let model = model.map_or("lambert", String::as_str);
            Some(format!(
                "{wrong} is {}, and the model comes first: `sateen fit {model} {wrong}`",
                looks.name()
            ))
        }
        _ => None,
    }
}

/// `sateen denim`
fn of_verb(wrong: &str) -> Option<String> {
    let commands = match Looks::of(wrong)? {
        Looks::Fabric => {
            format!(
                "`sateen bake {wrong}` bakes it, `sateen render sphere {wrong} -o {wrong}.png` shows it"
            )
        }
        looks => looks.use_of(wrong),
    };
    Some(format!("a verb comes first: {commands}"))
}

/// `sateen render denim …`
fn of_render(wrong: &str, words: &[String]) -> Option<String> {
    let looks = Looks::of(wrong)?;
    let place = words.iter().find(|word| PLACES.contains(&word.as_str()));
    let place = place.map_or("sphere", String::as_str);
    let mesh = words
        .iter()
        .find(|word| Looks::of(word) == Some(Looks::Mesh));
    let command = match (looks, mesh) {
        (Looks::Mesh, _) => {
            let cloth = words
                .iter()
                .find(|word| Looks::of(word).is_some_and(Looks::is_cloth));
            let cloth = cloth.map_or("FABRIC", String::as_str);
            format!(
                "`sateen render mesh {wrong} {cloth} -o FILE`, or `sateen render scene {wrong} -o FILE`"
            )
        }
        (Looks::Picture | Looks::Pairs, _) => return None,
        (_, Some(mesh)) => format!("`sateen render mesh {mesh} {wrong} -o FILE`"),
        _ if place == "mesh" => format!("`sateen render mesh MESH {wrong} -o FILE`"),
        (Looks::Toml, None) => {
            format!(
                "`sateen render {place} {wrong} -o FILE`, or of a scene `sateen render scene {wrong} -o FILE`"
            )
        }
        _ => format!("`sateen render {place} {wrong} -o FILE`"),
    };
    Some(format!(
        "{wrong} is {}; what it lies on comes first ({}, scene): {command}",
        looks.name(),
        PLACES.join(", ")
    ))
}
