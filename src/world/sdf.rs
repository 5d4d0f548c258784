//! A world as SDFormat, for Gazebo: the same walls and bodies as plain coloured shapes.

use std::fmt::Write;

use super::{Body, Footprint, World};
use crate::geometry::{Vector2, angle_of};
use crate::world::polygon::edges;

/// Thickness of the room's walls, which have none here, m; they stand outside the room.
const WALL_M: f64 = 0.1;

impl World {
    /// The world as a file of SDFormat 1.7: floor, walls of the room, inner walls piece by piece, and all bodies where they stand at time 0,
    /// none of which moves. Surfaces have the colours of their textures, without patterns. The frame is the world's.
    #[must_use]
    pub fn to_sdf(&self) -> String {
        let friction = self.spec.floor.friction;
        let mut text = format!(
            "<?xml version=\"1.0\"?>\n<sdf version=\"1.7\">\n<world name=\"{}\">\n<light name=\"sun\" type=\"directional\">\
             <pose>0 0 10 0 0 0</pose><diffuse>0.8 0.8 0.8 1</diffuse><direction>-0.4 0.2 -0.9</direction></light>\n\
             <model name=\"floor\"><static>true</static><link name=\"link\"><collision name=\"collision\"><geometry><plane>\
             <normal>0 0 1</normal></plane></geometry><surface><friction><ode><mu>{friction}</mu><mu2>{friction}</mu2></ode></friction>\
             </surface></collision></link></model>\n",
            escaped(&self.spec.name)
        );
        let height_m = self.spec.room.height_m;
        for (k, (a, b)) in edges(&self.outline).enumerate() {
            let along = b - a;
            let length_m = along.norm();
            // The outline runs anti-clockwise: outside is on the right. Walls overlap at corners that jut out, so that none is open.
            let outward = Vector2::new(along.y, -along.x) / length_m;
            let middle = (a + b) * 0.5 + outward * (0.5 * WALL_M);
            let size = [length_m + 2.0 * WALL_M, WALL_M, height_m];
            let name = format!("room wall {k}");
            model(&mut text, &name, middle, [0.0, angle_of(along)], &cuboid(size), self.wall_textures[k].colour);
        }
        for wall in &self.partitions {
            for (n, piece) in wall.pieces.iter().enumerate() {
                let [from_m, to_m] = piece.along_m;
                let middle = wall.from + wall.along * (0.5 * (from_m + to_m));
                let size = [to_m - from_m, wall.thickness_m, piece.top_m - piece.bottom_m];
                let name = format!("{} {n}", wall.name);
                let place = [piece.bottom_m, angle_of(wall.along)];
                model(&mut text, &name, middle, place, &cuboid(size), wall.texture.colour);
            }
        }
        for body in &self.bodies {
            let place = [body.bottom_m, body.pose.heading];
            model(&mut text, &body.name, body.pose.position(), place, &shape(body), body.texture.colour);
        }
        text += "</world>\n</sdf>\n";
        text
    }
}

/// A shape and how far its own origin is above its underside, m.
type Geometry = (String, f64);

fn cuboid([x, y, z]: [f64; 3]) -> Geometry {
    (format!("<box><size>{x:.4} {y:.4} {z:.4}</size></box>"), 0.5 * z)
}

fn shape(body: &Body) -> Geometry {
    let height_m = body.top_m - body.bottom_m;
    match &body.footprint {
        Footprint::Disc(radius_m) => {
            (format!("<cylinder><radius>{radius_m:.4}</radius><length>{height_m:.4}</length></cylinder>"), 0.5 * height_m)
        }
        Footprint::Polygon(corners) => {
            let points: String = corners.iter().map(|c| format!("<point>{:.4} {:.4}</point>", c.x, c.y)).collect();
            (format!("<polyline>{points}<height>{height_m:.4}</height></polyline>"), 0.0)
        }
    }
}

/// A model that stands still: where its underside's origin is, its height above the floor and its heading.
fn model(
    text: &mut String,
    name: &str,
    at: Vector2<f64>,
    [bottom_m, heading]: [f64; 2],
    (geometry, origin_m): &Geometry,
    colour: [u8; 3],
) {
    let [r, g, b] = colour.map(|c| f64::from(c) / 255.0);
    let (name, z) = (escaped(name), bottom_m + origin_m);
    let _ = writeln!(
        text,
        "<model name=\"{name}\"><static>true</static><pose>{:.4} {:.4} {z:.4} 0 0 {heading:.6}</pose><link name=\"link\">\
         <collision name=\"collision\"><geometry>{geometry}</geometry></collision><visual name=\"visual\"><geometry>{geometry}\
         </geometry><material><ambient>{r:.3} {g:.3} {b:.3} 1</ambient><diffuse>{r:.3} {g:.3} {b:.3} 1</diffuse></material></visual>\
         </link></model>",
        at.x, at.y
    );
}

/// A text as an attribute of XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_stands_is_in_the_file_once() {
        let world = World::from_toml(
            "name = \"a\"\nhome = { x_m = 1, y_m = 1 }\n[room]\noutline_m = [[0, 0], [3, 0], [3, 2], [0, 2]]\nheight_m = 2\n\
             [[walls]]\nname = \"mid\"\nfrom_m = [2, 0]\nto_m = [2, 2]\nopenings = [{ kind = \"door\", from_start_m = 0.5, width_m = 0.9, top_m = 1.8 }]\n\
             [[obstacles]]\nname = \"a < b\"\nshape = { disc = { radius_m = 0.1 } }\nposition_m = [0.3, 0.4]\nelevation_m = 0.7\n\
             height_m = 0.5\ntexture = { family = \"plain\", colour = [255, 0, 51] }\n",
            "a.toml",
        )
        .unwrap();
        let text = world.to_sdf();
        assert_eq!(text.matches("<model ").count(), 1 + 4 + 3 + 1, "floor, four walls, three pieces, one body");
        // Wall 1 stands outside x = 3, and the lintel above the door.
        assert!(
            text.contains("<model name=\"room wall 1\"><static>true</static><pose>3.0500 1.0000 1.0000 0 0 1.570796</pose>"),
            "{text}"
        );
        assert!(
            text.contains("<pose>2.0000 0.9500 1.9000 0 0 1.570796</pose>")
                && text.contains("<size>0.9000 0.1000 0.2000</size>")
        );
        assert!(text.contains("<model name=\"a &lt; b\">") && text.contains("<pose>0.3000 0.4000 0.9500 0 0 0.000000</pose>"));
        assert!(text.contains("<diffuse>1.000 0.000 0.200 1</diffuse>"));
    }
}
