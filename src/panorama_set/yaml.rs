//! As much of YAML as OpenCV's file storage writes: nested mappings by indentation, scalars, and lists in brackets or by dashes.

use std::collections::BTreeMap;

/// The scalars of a document by their path: `metadata.grid.size` holds the items of the list.
pub(super) fn flatten(text: &str) -> BTreeMap<String, Vec<String>> {
    let mut values: BTreeMap<String, Vec<String>> = BTreeMap::new();
    // Open mappings: how far they are indented, and their path.
    let mut open: Vec<(usize, String)> = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let content = line.split(" #").next().unwrap_or_default().trim_end();
        let trimmed = content.trim_start();
        if trimmed.is_empty() || trimmed.starts_with(['%', '#']) || trimmed == "---" || trimmed == "..." {
            continue;
        }
        let indent = content.len() - trimmed.len();
        if let Some(item) = trimmed.strip_prefix("- ") {
            if let Some((_, path)) = open.last() {
                values.entry(path.clone()).or_default().push(bare(item));
            }
            continue;
        }
        let Some((key, value)) = trimmed.split_once(':') else { continue };
        while open.last().is_some_and(|(other, _)| *other >= indent) {
            open.pop();
        }
        let path = open.last().map_or_else(|| bare(key), |(_, path)| format!("{path}.{}", bare(key)));
        let mut value = value.trim().to_owned();
        // A tag such as `!!opencv-matrix` says nothing here.
        if value.starts_with("!!") {
            value = value.split_once(' ').map_or_else(String::new, |(_, rest)| rest.trim().to_owned());
        }
        if value.is_empty() {
            open.push((indent, path));
            continue;
        }
        if value.starts_with('[') {
            // A list may go on over several lines.
            while !value.contains(']') {
                let Some(more) = lines.next() else { break };
                value += more.trim();
            }
            let inside = value.trim_start_matches('[').split(']').next().unwrap_or_default();
            values.insert(path, inside.split(',').map(bare).filter(|s| !s.is_empty()).collect());
        } else {
            values.insert(path, vec![bare(&value)]);
        }
    }
    values
}

/// Without the quotes around it.
fn bare(text: &str) -> String {
    text.trim().trim_matches(['"', '\'']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opencv_and_matlab_write_alike() {
        let text = "%YAML:1.0\n---\nmetadata:\n   time: \"2018-01-01\" # noon\n   type: grid\n   grid:\n      beginAtMM: [ 0., 10.,\n          0. ]\n      \
                    size:\n      - 3\n      - 4\n   camera: \n      name: pixpro\n   needsUnwrapping: 0\nother: !!opencv-matrix\n   rows: 1\n";
        let values = flatten(text);
        let get = |path: &str| values.get(path).map(|v| v.join("|"));
        assert_eq!(get("metadata.time").as_deref(), Some("2018-01-01"));
        assert_eq!(get("metadata.grid.beginAtMM").as_deref(), Some("0.|10.|0."));
        assert_eq!(get("metadata.grid.size").as_deref(), Some("3|4"));
        assert_eq!(get("metadata.camera.name").as_deref(), Some("pixpro"));
        assert_eq!(get("metadata.needsUnwrapping").as_deref(), Some("0"));
        assert_eq!(get("other.rows").as_deref(), Some("1"));
    }
}
