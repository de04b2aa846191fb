//! What made a table, and what is recorded of it.

use serde::{Deserialize, Serialize};

use super::{Adapted, Choice, Scope, ScopeNote, Settings};
use crate::fabric::{Fabric, TextError};
use crate::metrics::ErrorReport;
use crate::table::Table;

/// What made a table, as its metadata.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name and version of the tool.
    pub tool: String,
    /// How it was to be baked …
    pub settings: Settings,
    /// … and how else it was, to keep the preset's promise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adapted: Option<Adapted>,
    /// What it was baked for, if not for everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scope: Option<ScopeNote>,
    /// What was baked.
    pub fabric: FabricText,
    /// What that cost in accuracy.
    pub error: ErrorReport,
    /// How threads with segments are evaluated, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Choice>,
}

/// A fabric's parameters as text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FabricText {
    /// The name, with the albedo variant.
    pub name: String,
    /// The albedo variant that was chosen, if there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// The fabric's TOML file.
    pub toml: String,
}

impl Provenance {
    /// Whether a bake makes the same of `fabric`, `settings` and `scope`: the text, the variant, every setting, what is
    /// needed and the tool's version are those of the table.
    pub fn is_of(&self, fabric: &Fabric, settings: &Settings, scope: &Scope<'_>) -> bool {
        self.tool == crate::TOOL
            && self.settings == *settings
            && self.scope == scope.note()
            && self.fabric == FabricText::of(fabric)
    }

    /// Reads a table's metadata.
    ///
    /// # Errors
    /// When they are not what [`bake`](super::bake) writes.
    pub fn of(table: &Table) -> Result<Self, toml::de::Error> {
        toml::from_str(table.metadata())
    }

    pub(super) fn to_text(&self) -> String {
        toml::to_string(self).expect("numbers, strings and arrays are TOML")
    }
}

impl FabricText {
    pub(super) fn of(fabric: &Fabric) -> Self {
        Self {
            name: fabric.name.clone(),
            variant: fabric.variant.clone(),
            toml: fabric.toml.clone(),
        }
    }

    /// The fabric.
    ///
    /// # Errors
    /// When the text is no valid fabric.
    pub fn parse(&self) -> Result<Fabric, TextError> {
        Fabric::from_toml(&self.toml, &self.name, self.variant.as_deref())
    }
}
