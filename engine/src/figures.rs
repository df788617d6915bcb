//! The figures of a sentence beside it, so that it can be said in another language.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A figure of a sentence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
#[cfg_attr(feature = "schema", schemars(rename = "SentenceFigure"))]
pub enum Figure {
    /// A number in the unit that ends its name.
    Number(f64),
    /// A name, such as a channel's or a marker's: the same in every language.
    Name(String),
}

impl From<f64> for Figure {
    fn from(number: f64) -> Self {
        Figure::Number(number)
    }
}

impl From<&str> for Figure {
    fn from(name: &str) -> Self {
        Figure::Name(name.to_owned())
    }
}

/// The figures of a sentence by their names. Together with what the sentence is about, the names say which sentence it
/// is, so that it can be made again in another language.
pub type Figures = BTreeMap<String, Figure>;

/// The figures of these names.
pub fn figures<const N: usize>(named: [(&str, Figure); N]) -> Figures {
    named.into_iter().map(|(name, figure)| (name.to_owned(), figure)).collect()
}
