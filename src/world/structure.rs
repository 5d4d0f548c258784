//! Does a world file have the right form? Compares the file's tree with the JSON Schema of the world format.
//!
//! The schema is derived from the same types that the file is later turned into, so there is one source of truth. Only the
//! keywords that occur in it are understood; a test guards that.

use serde_json::{Map, Value as Json};

use crate::document::{Node, Value};
use crate::fault::Fault;

/// The keywords that [`check`] acts on; `format` and notes are read over.
#[cfg(test)]
const KEYWORDS: &[&str] = &[
    "$ref",
    "anyOf",
    "oneOf",
    "type",
    "const",
    "properties",
    "required",
    "additionalProperties",
    "items",
    "minItems",
    "maxItems",
    "minimum",
    "maximum",
];

/// What the comparison found.
#[derive(Debug, Default)]
pub(super) struct Findings {
    /// Fields that the format does not have.
    pub unknown: Vec<Fault>,
    /// Numbers that are not finite.
    pub not_finite: Vec<Fault>,
    /// Values of the wrong type, and missing ones: with them the tree cannot be turned into a spec.
    pub unreadable: Vec<Fault>,
}

/// Compares a file with the schema and removes unknown fields from it.
pub(super) fn check(file: &mut Node, schema: &Json) -> Findings {
    let mut walk = Walk { definitions: schema.get("$defs"), findings: Findings::default() };
    walk.node(file, schema, "");
    walk.findings
}

/// A field of a format, as its JSON Schema has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its place: `floor.friction`, `obstacles[].height_m`.
    pub place: String,
    /// What it is without a value; empty where it must be given.
    pub default: String,
    /// What it means: the first sentence of its description.
    pub meaning: String,
}

/// All fields of a format, in the order of its schema; `[]` stands for an entry of a list.
#[must_use]
pub fn fields(schema: &Json) -> Vec<Field> {
    fn walk(schema: &Json, definitions: Option<&Json>, place: &str, found: &mut Vec<Field>) {
        let named = schema.get("$ref").and_then(Json::as_str).and_then(|r| r.strip_prefix("#/$defs/"));
        let schema = named.and_then(|name| definitions?.get(name)).unwrap_or(schema);
        for alternative in ["oneOf", "anyOf"].iter().filter_map(|key| schema.get(key)?.as_array()).flatten() {
            walk(alternative, definitions, place, found);
        }
        for (key, field) in schema.get("properties").and_then(Json::as_object).into_iter().flatten() {
            let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
            let description = field.get("description").and_then(Json::as_str).unwrap_or_default().replace('\n', " ");
            let meaning = description.split(". ").next().unwrap_or_default().trim_end_matches('.').to_owned();
            let default = field.get("default").map(plain).unwrap_or_default();
            found.push(Field { place: place.clone(), default, meaning });
            walk(field, definitions, &place, found);
        }
        if let Some(item) = schema.get("items") {
            walk(item, definitions, &format!("{place}[]"), found);
        }
    }
    let mut found = Vec::new();
    walk(schema, schema.get("$defs"), "", &mut found);
    found
}

/// A value as people write it: a text without quotes, a number of single precision without the digits of double precision.
fn plain(value: &Json) -> String {
    match value {
        Json::String(text) => text.clone(),
        Json::Array(items) => format!("[{}]", items.iter().map(plain).collect::<Vec<_>>().join(", ")),
        other => match other.as_f64() {
            Some(number) if f64::from(number as f32) == number => (number as f32).to_string(),
            _ => other.to_string(),
        },
    }
}

struct Walk<'s> {
    definitions: Option<&'s Json>,
    findings: Findings,
}

impl<'s> Walk<'s> {
    fn unreadable(&mut self, place: &str, found: String, allowed: String) {
        let place = if place.is_empty() { "the file" } else { place };
        self.findings.unreadable.push(fault(place, found, allowed));
    }

    fn resolve(&self, schema: &'s Json) -> &'s Json {
        let name = schema.get("$ref").and_then(Json::as_str).and_then(|r| r.strip_prefix("#/$defs/"));
        name.and_then(|name| self.definitions?.get(name)).unwrap_or(schema)
    }

    fn node(&mut self, node: &mut Node, schema: &'s Json, place: &str) {
        let schema = self.resolve(schema);
        if let Some(alternatives) = schema.get("oneOf").or_else(|| schema.get("anyOf")).and_then(Json::as_array) {
            return self.alternatives(node, alternatives, place);
        }
        let types = types_of(schema);
        let fits = types.is_empty() || types.iter().any(|t| has_type(&node.value, t));
        if !fits {
            let found = node.describe();
            return self.unreadable(place, found, describe(schema));
        }
        match &mut node.value {
            Value::Table(entries) => self.table(entries, schema, place),
            Value::List(items) => self.list(items, schema, place),
            Value::Integer(i) => {
                let bound = |key| schema.get(key).and_then(Json::as_i64).map(i128::from);
                // A whole number may stand for any number; an integer field has the limits of its type.
                if types.contains(&"integer") {
                    let high = bound("maximum").unwrap_or_else(|| largest_of_format(schema));
                    if *i < bound("minimum").unwrap_or(i128::MIN) || *i > high {
                        let found = i.to_string();
                        self.unreadable(place, found, describe(schema));
                    }
                }
            }
            Value::Float(f) if !f.is_finite() => {
                let found = f.to_string();
                self.findings.not_finite.push(fault(place, found, "a finite number".to_owned()));
            }
            _ => {}
        }
    }

    fn table(&mut self, entries: &mut Vec<(String, Node)>, schema: &'s Json, place: &str) {
        let Some(properties) = schema.get("properties").and_then(Json::as_object) else { return };
        entries.retain_mut(|(key, node)| {
            let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
            if let Some(schema) = properties.get(key) {
                self.node(node, schema, &place);
                return true;
            }
            let allowed = format!("one of {}", field_names(properties));
            self.findings.unknown.push(fault(&place, "an unknown field".to_owned(), allowed));
            false
        });
        let required = schema.get("required").and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str);
        for key in required {
            if !entries.iter().any(|(k, _)| k == key) {
                let place = if place.is_empty() { key.to_owned() } else { format!("{place}.{key}") };
                let wanted = properties.get(key).map_or_else(String::new, |s| describe(self.resolve(s)));
                self.unreadable(&place, "nothing".to_owned(), format!("{wanted}, which must be given"));
            }
        }
    }

    fn list(&mut self, items: &mut [Node], schema: &'s Json, place: &str) {
        let limit = |key| schema.get(key).and_then(Json::as_u64).map(|n| n as usize);
        let wrong_length =
            limit("minItems").is_some_and(|n| items.len() < n) || limit("maxItems").is_some_and(|n| items.len() > n);
        if wrong_length {
            let found = format!("a list of {}", items.len());
            return self.unreadable(place, found, describe(schema));
        }
        let Some(item_schema) = schema.get("items") else { return };
        for (k, item) in items.iter_mut().enumerate() {
            self.node(item, item_schema, &format!("{place}[{k}]"));
        }
    }

    /// One of several forms: a named choice (`"brick"`), a tagged one (`{ disc = … }`), or an optional value.
    fn alternatives(&mut self, node: &mut Node, alternatives: &'s [Json], place: &str) {
        let resolved: Vec<&Json> = alternatives.iter().map(|a| self.resolve(a)).collect();
        for schema in &resolved {
            let chosen = match (&node.value, schema.get("const")) {
                (Value::Text(text), Some(Json::String(name))) => text == name,
                (_, Some(_)) => false,
                // A tagged choice is chosen by its tag, so that faults inside are told as such.
                (Value::Table(entries), None) => match tag_of(schema) {
                    Some(tag) => entries.iter().any(|(key, _)| key == tag),
                    None => true,
                },
                // An optional named choice; a wrong name is told by those that exist.
                (Value::Text(_), None) if schema.get("oneOf").is_some() => true,
                (value, None) => types_of(schema).iter().any(|t| has_type(value, t)),
            };
            if chosen {
                return self.node(node, schema, place);
            }
        }
        let allowed: Vec<String> = resolved.iter().filter(|s| types_of(s) != ["null"]).map(|s| describe(s)).collect();
        let found = node.describe();
        let separator = if resolved.iter().all(|s| s.get("const").is_some()) { ", " } else { " or " };
        self.unreadable(place, found, allowed.join(separator));
    }
}

fn fault(place: &str, found: String, allowed: String) -> Fault {
    Fault { place: place.to_owned(), found, allowed, owner: None, line: None }
}

/// The one key of a tagged choice's table.
fn tag_of(schema: &Json) -> Option<&str> {
    let required = schema.get("required")?.as_array()?;
    let properties = schema.get("properties")?.as_object()?;
    if required.len() == 1 && properties.len() == 1 { required[0].as_str() } else { None }
}

fn types_of(schema: &Json) -> Vec<&str> {
    match schema.get("type") {
        Some(Json::String(name)) => vec![name],
        Some(Json::Array(names)) => names.iter().filter_map(Json::as_str).collect(),
        _ => Vec::new(),
    }
}

fn has_type(value: &Value, name: &str) -> bool {
    match value {
        Value::Null => name == "null",
        Value::Bool(_) => name == "boolean",
        Value::Integer(_) => name == "integer" || name == "number",
        Value::Float(_) => name == "number",
        Value::Text(_) => name == "string",
        Value::Date(_) => false,
        Value::List(_) => name == "array",
        Value::Table(_) => name == "object",
    }
}

fn largest_of_format(schema: &Json) -> i128 {
    match schema.get("format").and_then(Json::as_str) {
        Some("uint32") => u32::MAX.into(),
        _ => u64::MAX.into(),
    }
}

fn field_names(properties: &Map<String, Json>) -> String {
    properties.keys().map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// What a schema allows, in words.
fn describe(schema: &Json) -> String {
    if let Some(name) = schema.get("const") {
        return name.to_string();
    }
    if let Some(tag) = tag_of(schema) {
        return format!("{{ {tag} = … }}");
    }
    if let Some(alternatives) = schema.get("oneOf").and_then(Json::as_array) {
        return alternatives.iter().map(describe).collect::<Vec<_>>().join(" or ");
    }
    let items = || schema.get("items").map_or("items", plural_of);
    match types_of(schema).iter().find(|t| **t != "null").copied() {
        Some("string") => "a text in quotes".to_owned(),
        Some("number") => "a number".to_owned(),
        Some("integer") => {
            let low = schema.get("minimum").and_then(Json::as_i64).unwrap_or_default();
            let high = schema.get("maximum").and_then(Json::as_i64).map_or_else(|| largest_of_format(schema), i128::from);
            format!("a whole number from {low} to {high}")
        }
        Some("boolean") => "true or false".to_owned(),
        Some("array") => match schema.get("maxItems").and_then(Json::as_u64) {
            Some(n) => format!("a list of {n} {}", items()),
            None => format!("a list of {}", items()),
        },
        _ => schema
            .get("properties")
            .and_then(Json::as_object)
            .map_or_else(|| "a table".to_owned(), |properties| format!("a table of {}", field_names(properties))),
    }
}

fn plural_of(schema: &Json) -> &'static str {
    match types_of(schema).first() {
        Some(&"number") => "numbers",
        Some(&"integer") => "whole numbers",
        Some(&"array") => "points [x, y]",
        _ => "tables",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every keyword in a place where a schema stands.
    fn keywords(schema: &Json, found: &mut std::collections::BTreeSet<String>) {
        let Some(object) = schema.as_object() else { return };
        for (key, value) in object {
            match key.as_str() {
                "properties" | "$defs" => value.as_object().into_iter().flatten().for_each(|(_, s)| keywords(s, found)),
                "oneOf" | "anyOf" => value.as_array().into_iter().flatten().for_each(|s| keywords(s, found)),
                "items" => keywords(value, found),
                _ => {}
            }
            found.insert(key.clone());
        }
    }

    #[test]
    fn the_schema_uses_no_keyword_that_is_not_understood() {
        let mut found = std::collections::BTreeSet::new();
        keywords(&super::super::World::json_schema(), &mut found);
        for key in found {
            let note = ["$schema", "$defs", "title", "description", "default", "format"].contains(&key.as_str());
            assert!(note || KEYWORDS.contains(&key.as_str()), "{key}");
        }
    }
}
