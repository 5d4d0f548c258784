//! Reading a world file and resolving it into a [`World`].

use std::path::Path;

use sha2::{Digest, Sha256};

use super::spec::{ShapeSpec, TextureSpec, WorldSpec};
use super::{Body, Footprint, World, Zone};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2};
use crate::panorama::INSTANCE_FIRST_WALL;

impl World {
    /// Loads and checks a world file: TOML, or JSON where the name ends in `.json`.
    ///
    /// # Errors
    /// When the file cannot be read, is not of its format, or has faults; all faults come at once.
    pub fn load(path: &Path) -> Result<Self> {
        let text =
            std::fs::read_to_string(path).map_err(|source| Error::Io { action: "read", path: path.to_owned(), source })?;
        let parse_error = |message: String| Error::Parse { path: path.to_owned(), message };
        let spec: WorldSpec = if path.extension().is_some_and(|e| e == "json") {
            serde_json::from_str(&text).map_err(|e| parse_error(e.to_string()))?
        } else {
            toml::from_str(&text).map_err(|e| parse_error(e.to_string()))?
        };
        let sha256 = Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect();
        Ok(Self::resolve(spec, path, sha256))
    }

    fn resolve(spec: WorldSpec, source: &Path, sha256: String) -> Self {
        let outline = anticlockwise(&spec.room.outline_m);
        let seeded = |texture: &TextureSpec, n: u64| TextureSpec {
            seed: Some(texture.seed.unwrap_or_else(|| spec.seed.wrapping_mul(1000).wrapping_add(n))),
            ..*texture
        };
        let walls = &spec.room.walls;
        let wall_textures: Vec<_> = (0..outline.len()).map(|k| seeded(&walls[k % walls.len()], 10 + k as u64)).collect();
        let first_body = INSTANCE_FIRST_WALL + outline.len() as u16;
        let bodies = spec
            .landmarks
            .iter()
            .chain(&spec.obstacles)
            .enumerate()
            .map(|(k, b)| Body {
                name: b.name.clone(),
                footprint: match &b.shape {
                    ShapeSpec::Disc { radius_m } => Footprint::Disc(*radius_m),
                    ShapeSpec::Box { size_m: [x, y] } => {
                        let (x, y) = (0.5 * x, 0.5 * y);
                        Footprint::Polygon(vec![
                            Vector2::new(-x, -y),
                            Vector2::new(x, -y),
                            Vector2::new(x, y),
                            Vector2::new(-x, y),
                        ])
                    }
                    ShapeSpec::Polygon { corners_m } => Footprint::Polygon(anticlockwise(corners_m)),
                },
                pose: Pose::new(b.position_m[0], b.position_m[1], b.heading_deg.to_radians()),
                bottom_m: b.elevation_m,
                top_m: b.elevation_m + b.height_m,
                texture: seeded(&b.texture, 100 + k as u64),
                motion: b.motion.clone(),
                instance: first_body + k as u16,
            })
            .collect();
        let zones =
            spec.floor.zones.iter().map(|z| Zone { polygon: anticlockwise(&z.polygon_m), friction: z.friction }).collect();
        let home = Pose::new(spec.home.x_m, spec.home.y_m, spec.home.heading_deg.to_radians());
        Self {
            wall_textures,
            floor_texture: seeded(&spec.room.floor, 1),
            ceiling_texture: seeded(&spec.room.ceiling, 2),
            landmark_count: spec.landmarks.len(),
            outline,
            bodies,
            zones,
            home,
            source: source.to_owned(),
            sha256,
            spec,
        }
    }
}

/// The corners in anti-clockwise order, starting with the first as written.
fn anticlockwise(corners: &[[f64; 2]]) -> Vec<Vector2<f64>> {
    let mut corners: Vec<_> = corners.iter().map(|c| Vector2::new(c[0], c[1])).collect();
    let doubled_area: f64 =
        (0..corners.len()).map(|k| crate::geometry::cross(corners[k], corners[(k + 1) % corners.len()])).sum();
    if doubled_area < 0.0 {
        corners[1..].reverse();
    }
    corners
}
