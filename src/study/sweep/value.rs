//! Values of settings, as a study file has them.

use std::fmt;

use serde::Serialize;

use crate::document::{Node, Value as Read};

/// A value of a setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// None: what the setting is without the axis that this is a value of.
    Unset,
    /// True or false.
    Truth(bool),
    /// A whole number.
    Whole(i64),
    /// A real number.
    Real(f64),
    /// A text.
    Text(String),
    /// A list.
    List(Vec<Value>),
    /// A table: a body, a texture.
    Table(std::collections::BTreeMap<String, Value>),
}

impl Value {
    /// The value that stands in a file; `None` for what no setting takes (a date, a null, a number beyond 64 bits).
    pub(super) fn read(node: &Node) -> Option<Self> {
        Some(match &node.value {
            Read::Bool(b) => Self::Truth(*b),
            Read::Integer(i) => Self::Whole(i64::try_from(*i).ok()?),
            Read::Float(f) => Self::Real(*f),
            Read::Text(text) => Self::Text(text.clone()),
            Read::List(items) => Self::List(items.iter().map(Self::read).collect::<Option<_>>()?),
            Read::Table(entries) => {
                Self::Table(entries.iter().map(|(key, node)| Some((key.clone(), Self::read(node)?))).collect::<Option<_>>()?)
            }
            Read::Null | Read::Date(_) => return None,
        })
    }

    /// The number, whole or not.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Whole(n) => Some(*n as f64),
            Self::Real(x) => Some(*x),
            _ => None,
        }
    }

    /// The text.
    pub fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unset => f.write_str("-"),
            Self::Truth(b) => b.fmt(f),
            Self::Whole(n) => n.fmt(f),
            Self::Real(x) => x.fmt(f),
            Self::Text(text) => text.fmt(f),
            Self::List(_) | Self::Table(_) => f.write_str(&serde_json::to_string(self).unwrap_or_default()),
        }
    }
}
