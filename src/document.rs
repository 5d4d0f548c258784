//! A world file as read, before it has types: a tree of values that knows its line numbers.
//!
//! `serde` stops at the first thing that does not fit. To report all faults of a file at once, the text is parsed into this
//! tree, the tree is compared with the schema (`world::structure`), and only then turned into a
//! [`WorldSpec`](crate::world::spec::WorldSpec).

use std::path::Path;

use serde::de::value::{Error as ValueError, MapAccessDeserializer, MapDeserializer, SeqDeserializer};
use serde::de::{Deserializer, IntoDeserializer, Visitor};
use toml::de::{DeTable, DeValue};

use crate::error::{Error, Result};

/// A value and where it begins.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    /// Line, from 1, where the format tells.
    pub line: Option<usize>,
    pub value: Value,
}

/// What a file can hold.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Null,
    Bool(bool),
    Integer(i128),
    Float(f64),
    Text(String),
    /// A TOML date or time; no field takes one.
    Date(String),
    List(Vec<Node>),
    Table(Vec<(String, Node)>),
}

impl Node {
    /// Parses TOML.
    pub(crate) fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let (table, errors) = DeTable::parse_recoverable(text);
        if !errors.is_empty() {
            let message = errors.iter().map(|e| e.to_string().trim_end().to_owned()).collect::<Vec<_>>().join("\n");
            return Err(Error::Parse { path: path.to_owned(), message });
        }
        let line_starts: Vec<usize> =
            std::iter::once(0).chain(text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(k, _)| k + 1)).collect();
        let line_of = |offset: usize| line_starts.partition_point(|&start| start <= offset);
        Ok(Self { line: None, value: Value::Table(toml_table(table.get_ref(), &line_of)) })
    }

    /// Parses JSON. Values don't know their lines.
    pub(crate) fn from_json(text: &str, path: &Path) -> Result<Self> {
        let value: serde_json::Value =
            serde_json::from_str(text).map_err(|e| Error::Parse { path: path.to_owned(), message: e.to_string() })?;
        Ok(Self::from_json_value(value))
    }

    /// A tree from anything that serialises; non-finite numbers survive, which JSON has no way to write.
    pub(crate) fn from_spec(spec: &impl serde::Serialize) -> std::result::Result<Self, toml::ser::Error> {
        fn convert(value: toml::Value) -> Node {
            let value = match value {
                toml::Value::String(s) => Value::Text(s),
                toml::Value::Integer(i) => Value::Integer(i.into()),
                toml::Value::Float(f) => Value::Float(f),
                toml::Value::Boolean(b) => Value::Bool(b),
                toml::Value::Datetime(d) => Value::Date(d.to_string()),
                toml::Value::Array(list) => Value::List(list.into_iter().map(convert).collect()),
                toml::Value::Table(table) => Value::Table(table.into_iter().map(|(k, v)| (k, convert(v))).collect()),
            };
            Node { line: None, value }
        }
        toml::Value::try_from(spec).map(convert)
    }

    fn from_json_value(value: serde_json::Value) -> Self {
        use serde_json::Value as Json;
        let value = match value {
            Json::Null => Value::Null,
            Json::Bool(b) => Value::Bool(b),
            Json::Number(n) => match (n.as_i128(), n.as_f64()) {
                (Some(i), _) => Value::Integer(i),
                (None, f) => Value::Float(f.unwrap_or(f64::NAN)),
            },
            Json::String(s) => Value::Text(s),
            Json::Array(list) => Value::List(list.into_iter().map(Self::from_json_value).collect()),
            Json::Object(table) => Value::Table(table.into_iter().map(|(k, v)| (k, Self::from_json_value(v))).collect()),
        };
        Self { line: None, value }
    }

    /// Line and owner of a field given as `landmarks[2].shape.disc`: the line of the nearest node on the way that has one, and
    /// the `name` of the innermost list entry on the way that has one.
    pub(crate) fn locate(&self, place: &str) -> (Option<usize>, Option<String>) {
        let (mut node, mut line, mut owner) = (self, None, None);
        for step in place.split(['.', '[']) {
            let next = match (&node.value, step.strip_suffix(']').and_then(|index| index.parse::<usize>().ok())) {
                (Value::List(items), Some(index)) => items.get(index),
                (Value::Table(entries), None) => entries.iter().find(|(key, _)| key == step).map(|(_, node)| node),
                _ => None,
            };
            let Some(next) = next else { break };
            node = next;
            line = node.line.or(line);
            if step.ends_with(']') {
                owner = node.get("name").and_then(Node::text).filter(|name| !name.is_empty()).or(owner);
            }
        }
        (line, owner.map(str::to_owned))
    }

    /// Entry of a table.
    pub(crate) fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|(k, _)| k == key).map(|(_, node)| node),
            _ => None,
        }
    }

    /// Adds to the table at `path`, which is made where it is missing, the entries of `defaults` that it does not have.
    pub(crate) fn fill(&mut self, path: &[&str], defaults: Self) {
        let Value::Table(entries) = &mut self.value else { return };
        let Some((key, rest)) = path.split_first() else {
            if let Value::Table(defaults) = defaults.value {
                for (key, value) in defaults {
                    if !entries.iter().any(|(k, _)| *k == key) {
                        entries.push((key, value));
                    }
                }
            }
            return;
        };
        if !entries.iter().any(|(k, _)| k == key) {
            entries.push(((*key).to_owned(), Self { line: None, value: Value::Table(Vec::new()) }));
        }
        if let Some((_, node)) = entries.iter_mut().find(|(k, _)| k == key) {
            node.fill(rest, defaults);
        }
    }

    pub(crate) fn text(&self) -> Option<&str> {
        match &self.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The value in a few words, for a message.
    pub(crate) fn describe(&self) -> String {
        match &self.value {
            Value::Null => "null".to_owned(),
            Value::Bool(b) => b.to_string(),
            Value::Integer(i) => i.to_string(),
            Value::Float(f) => f.to_string(),
            Value::Text(text) => format!("\"{text}\""),
            Value::Date(date) => format!("the date {date}"),
            Value::List(items) if items.len() == 1 => "a list of 1 item".to_owned(),
            Value::List(items) => format!("a list of {} items", items.len()),
            Value::Table(entries) if entries.is_empty() => "an empty table".to_owned(),
            Value::Table(entries) => {
                format!("a table of {}", entries.iter().map(|(key, _)| key.as_str()).collect::<Vec<_>>().join(", "))
            }
        }
    }
}

fn toml_table(table: &DeTable<'_>, line_of: &impl Fn(usize) -> usize) -> Vec<(String, Node)> {
    table
        .iter()
        .map(|(key, value)| {
            let mut node = toml_value(value.get_ref(), line_of);
            // The key's line is the one that a person looks for; a list's items have their own.
            node.line = Some(line_of(key.span().start));
            (key.get_ref().to_string(), node)
        })
        .collect()
}

fn toml_value(value: &DeValue<'_>, line_of: &impl Fn(usize) -> usize) -> Node {
    let value = match value {
        DeValue::String(s) => Value::Text(s.to_string()),
        DeValue::Integer(i) => match i128::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) => Value::Integer(i),
            Err(_) => Value::Text(i.as_str().to_owned()), // beyond 128 bits: no field takes it, and the message shows it
        },
        DeValue::Float(f) => f.as_str().parse().map_or_else(|_| Value::Text(f.as_str().to_owned()), Value::Float),
        DeValue::Boolean(b) => Value::Bool(*b),
        DeValue::Datetime(d) => Value::Date(d.to_string()),
        DeValue::Array(list) => Value::List(
            list.iter()
                .map(|item| Node { line: Some(line_of(item.span().start)), ..toml_value(item.get_ref(), line_of) })
                .collect(),
        ),
        DeValue::Table(table) => Value::Table(toml_table(table, line_of)),
    };
    Node { line: None, value }
}

impl IntoDeserializer<'_, ValueError> for Node {
    type Deserializer = Self;
    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Node {
    type Error = ValueError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> std::result::Result<V::Value, ValueError> {
        match self.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(b) => visitor.visit_bool(b),
            Value::Integer(i) => match (i64::try_from(i), u64::try_from(i)) {
                (Ok(i), _) => visitor.visit_i64(i),
                (_, Ok(i)) => visitor.visit_u64(i),
                _ => visitor.visit_i128(i),
            },
            Value::Float(f) => visitor.visit_f64(f),
            Value::Text(text) | Value::Date(text) => visitor.visit_string(text),
            Value::List(items) => visitor.visit_seq(SeqDeserializer::new(items.into_iter())),
            Value::Table(entries) => visitor.visit_map(MapDeserializer::new(entries.into_iter())),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> std::result::Result<V::Value, ValueError> {
        if matches!(self.value, Value::Null) { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> std::result::Result<V::Value, ValueError> {
        match self.value {
            Value::Text(text) => visitor.visit_enum(text.into_deserializer()),
            Value::Table(entries) => visitor.visit_enum(MapAccessDeserializer::new(MapDeserializer::new(entries.into_iter()))),
            _ => self.deserialize_any(visitor),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct newtype_struct
        seq tuple tuple_struct map struct identifier ignored_any
    }
}
