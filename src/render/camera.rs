//! What a camera does to a picture: motion, focus, dark rims, dirt, noise and colours.
//!
//! Renderers give the light that falls on the sensor; a [`Camera`] takes the picture. Both renderers share it, and an ideal
//! camera changes nothing and costs nothing. Exposure is not its work: it belongs to the light of a [`Scene`], before bright
//! colours are clipped. In the order of the light's way:
//!
//! 1. Motion: the mean of several pictures from where the robot is while the shutter is open, parallax included.
//! 2. Focus: a Gaussian spot, the same at all distances.
//! 3. Dark rims and dirt: factors that stay with the pixel (`lens`).
//! 4. Noise: shot noise, whose variance grows with the light, and that of reading the sensor.
//! 5. White balance and tone curve.
//!
//! Range and instance ids are those of the middle of the exposure, exact as the renderer found them. Each row of the picture
//! depends on the rows around it alone and each pixel's noise on its place and the frame's seed, so that the bytes are the same
//! on any number of threads.

mod lens;
mod noise;

use rayon::prelude::*;

use super::{Renderer, Scene, View};
use crate::error::Result;
use crate::geometry::{Pose, Twist, direction};
use crate::panorama::{Panorama, Projection};
use crate::random::Seed;
use crate::world::OpticsSpec;
use lens::Lens;
use noise::Noise;

/// Distance at which the blur of moving forward counts when pictures are chosen, m: nearer things are rare.
const NEAR_M: f64 = 0.5;
/// Most pictures that make up one taken in motion.
const MOST_PICTURES: f64 = 16.0;
/// Steps of the tone curve a level.
const FINE: f32 = 16.0;

/// A camera.
#[derive(Debug, Clone)]
pub struct Camera {
    optics: OpticsSpec,
    /// Shares of a spot's light in the pixel itself and in its neighbours on one side, for pixels of `lens`.
    spot: Vec<f32>,
    lens: Option<Lens>,
    /// Level shown for each step of light: red, green, blue.
    tones: Option<Box<[Vec<u8>; 3]>>,
    noise: Option<Noise>,
    /// Copies of what the renderer gave.
    light: Vec<u8>,
    sum: Vec<u16>,
    moment: Option<Panorama>,
}

impl Camera {
    /// A camera with these optics; their exposure is for [`Scene::under`].
    #[must_use]
    pub fn new(optics: OpticsSpec) -> Self {
        let plain = optics.gamma == 1.0 && optics.white_balance == [1.0; 3];
        Self {
            optics,
            spot: Vec::new(),
            lens: None,
            tones: (!plain).then(|| Box::new(optics.white_balance.map(|gain| tones(gain, optics.gamma)))),
            noise: optics.noise.as_ref().map(Noise::new),
            light: Vec::new(),
            sum: Vec::new(),
            moment: None,
        }
    }

    /// Its optics.
    #[must_use]
    pub fn optics(&self) -> &OpticsSpec {
        &self.optics
    }

    /// Renders `view` and takes the picture, while the robot moves with `twist`. The exposure is centred on the view's pose.
    /// `noise` is the seed of this frame's noise.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn take(
        &mut self,
        renderer: &mut dyn Renderer,
        scene: &Scene,
        view: &View<'_>,
        twist: Twist,
        noise: Seed,
        out: &mut Panorama,
    ) -> Result<()> {
        renderer.render(scene, view, out)?;
        self.expose(renderer, scene, view, twist, out)?;
        self.develop(out, noise);
        Ok(())
    }

    /// Replaces the colours by the mean of pictures along the way.
    fn expose(
        &mut self,
        renderer: &mut dyn Renderer,
        scene: &Scene,
        view: &View<'_>,
        twist: Twist,
        out: &mut Panorama,
    ) -> Result<()> {
        let shutter_s = self.optics.shutter_s;
        let moved_px = shutter_s * (twist.omega.abs() + twist.v.abs() / NEAR_M) / view.projection.pixel_rad();
        let pictures = libm::ceil(moved_px).min(MOST_PICTURES);
        if pictures < 2.0 {
            return Ok(()); // moved by less than a pixel
        }
        let moment = self.moment.get_or_insert_with(|| Panorama::black(view.projection));
        self.sum.clear();
        self.sum.resize(out.rgba.len(), 0);
        for k in 0..pictures as usize {
            let time_s = shutter_s * ((k as f64 + 0.5) / pictures - 0.5);
            let robot = after(&view.robot, twist, time_s);
            renderer.render(scene, &View { robot, ..*view }, moment)?;
            for (sum, &light) in self.sum.iter_mut().zip(&moment.rgba) {
                *sum += u16::from(light);
            }
        }
        let count = pictures as u16;
        for (light, &sum) in out.rgba.iter_mut().zip(&self.sum) {
            *light = ((sum + count / 2) / count) as u8;
        }
        Ok(())
    }

    /// Turns the light that a renderer found into the picture that the camera gives; all but motion.
    pub fn develop(&mut self, out: &mut Panorama, noise: Seed) {
        self.ready(&out.projection);
        let unchanged = self.spot.len() == 1 && self.lens.is_none() && self.noise.is_none();
        if unchanged && self.tones.is_none() {
            return;
        }
        self.light.clear();
        self.light.extend_from_slice(&out.rgba);
        let width = out.projection.width as usize;
        let camera = &*self;
        let key = noise::key(noise);
        let row = |buffer: &mut Vec<f32>, (row, out): (usize, &mut [u8])| develop_row(camera, width, row, key, buffer, out);
        if rayon::current_num_threads() == 1 {
            let mut buffer = Vec::new();
            out.rgba.chunks_mut(4 * width).enumerate().for_each(|one| row(&mut buffer, one));
        } else {
            out.rgba.par_chunks_mut(4 * width).enumerate().for_each_init(Vec::new, row);
        }
    }

    /// Fits spot and lens to a projection.
    fn ready(&mut self, projection: &Projection) {
        if self.lens.as_ref().is_some_and(|l| l.projection == *projection) {
            return;
        }
        self.spot = spot(self.optics.focus_blur_deg.to_radians() / projection.pixel_rad());
        self.lens = Lens::new(&self.optics, projection);
    }
}

/// Where a robot is after `time_s`, which may be negative, at constant twist.
fn after(robot: &Pose, twist: Twist, time_s: f64) -> Pose {
    // The chord of the arc lies along the mean heading.
    let turned = twist.omega * time_s;
    let p = robot.position() + direction(robot.heading + 0.5 * turned) * (twist.v * time_s);
    Pose::new(p.x, p.y, robot.heading + turned)
}

/// Shares of the light of a Gaussian spot that fall on its own pixel and the next ones on a side.
fn spot(sd_px: f64) -> Vec<f32> {
    let up_to = |x: f64| 0.5 * (1.0 + libm::erf(x / (sd_px.max(1e-3) * std::f64::consts::SQRT_2)));
    let reach = libm::ceil(3.0 * sd_px - 0.5).max(0.0) as usize;
    let shares: Vec<f64> = (0..=reach).map(|k| up_to(k as f64 + 0.5) - up_to(k as f64 - 0.5)).collect();
    let all = shares[0] + 2.0 * shares[1..].iter().sum::<f64>();
    shares.into_iter().map(|s| (s / all) as f32).collect()
}

/// Levels shown for light in steps of 1/[`FINE`] level.
fn tones(gain: f64, gamma: f64) -> Vec<u8> {
    let steps = 255 * FINE as u32;
    (0..=steps)
        .map(|k| {
            let light = (gain * f64::from(k) / f64::from(steps)).min(1.0);
            (255.0 * libm::pow(light, 1.0 / gamma) + 0.5) as u8
        })
        .collect()
}

/// Develops one row. `buffer` is used as it pleases.
#[multiversion::multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn develop_row(camera: &Camera, width: usize, row: usize, key: [u32; 2], buffer: &mut Vec<f32>, out: &mut [u8]) {
    let reach = camera.spot.len() - 1;
    let height = camera.light.len() / (4 * width);
    // The light of a row, with room on both sides for what comes round the seam.
    let padded = 4 * (width + 2 * reach);
    buffer.clear();
    buffer.resize(padded + 4 * width, 0.0);
    let (across, line) = buffer.split_at_mut(padded);
    let middle = &mut across[4 * reach..][..4 * width];
    for (k, share) in camera.spot.iter().enumerate() {
        // Beyond the first and last row it goes on as there.
        let rows = [row.saturating_sub(k), (row + k).min(height - 1)];
        for &from in &rows[..if k == 0 { 1 } else { 2 }] {
            for (sum, &light) in middle.iter_mut().zip(&camera.light[4 * from * width..][..4 * width]) {
                *sum += share * f32::from(light);
            }
        }
    }
    for side in 0..reach {
        for c in 0..4 {
            across[4 * side + c] = across[4 * (reach + (width - reach % width + side) % width) + c];
            across[4 * (reach + width + side) + c] = across[4 * (reach + side % width) + c];
        }
    }
    for (k, share) in camera.spot.iter().enumerate() {
        for &from in &[reach - k, reach + k][..if k == 0 { 1 } else { 2 }] {
            for (sum, light) in line.iter_mut().zip(&across[4 * from..]) {
                *sum += share * light;
            }
        }
    }
    if let Some(lens) = &camera.lens {
        lens.cover(row, line);
    }
    if let Some(noise) = &camera.noise {
        noise.add(key, (4 * width * row) as u32, line);
    }
    for (out, light) in out.chunks_exact_mut(4).zip(line.chunks_exact(4)) {
        for c in 0..3 {
            let level = if light[c] > 0.0 { light[c] } else { 0.0 };
            let level = if level < 255.0 { level } else { 255.0 };
            out[c] = match &camera.tones {
                Some(tones) => tones[c][(level * FINE + 0.5) as usize],
                None => (level + 0.5) as u8,
            };
        }
        out[3] = 255;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::CameraPreset;
    use crate::world::spec::NoiseSpec;

    fn grey(level: u8, projection: Projection) -> Panorama {
        let mut panorama = Panorama::black(projection);
        panorama.rgba.chunks_exact_mut(4).for_each(|p| p.copy_from_slice(&[level, level, level, 255]));
        panorama
    }

    #[test]
    fn an_ideal_camera_changes_nothing() {
        let mut picture = grey(77, Projection::new(64, 16));
        Camera::new(CameraPreset::Ideal.optics()).develop(&mut picture, Seed(1));
        assert!(picture == grey(77, Projection::new(64, 16)));
    }

    #[test]
    fn a_point_becomes_a_gaussian_spot_also_across_the_seam() {
        let projection = Projection::new(90, 31);
        let optics = OpticsSpec { focus_blur_deg: 6.0, ..OpticsSpec::default() }; // 1.5 px
        for column in [45_usize, 0, 89] {
            let mut picture = grey(0, projection);
            let at = |column: usize, row: usize| 4 * (row * 90 + column % 90);
            picture.rgba[at(column, 15)] = 255;
            Camera::new(optics).develop(&mut picture, Seed(1));
            let middle = 255.0 * 0.2611 * 0.2611; // share of a Gaussian within a third of its deviation, twice
            assert!((f64::from(picture.rgba[at(column, 15)]) - middle).abs() < 1.0);
            for (dc, dr) in [(1, 0), (2, 1), (3, 2)] {
                let right = picture.rgba[at(column + dc, 15 + dr)];
                assert_eq!(right, picture.rgba[at(column + 90 - dc, 15 - dr)], "symmetric");
                assert!(right > 0 && picture.rgba[at(column, 15)] > right);
            }
        }
    }

    #[test]
    fn noise_has_the_deviation_of_its_electrons_and_is_the_frames_own() {
        let noise = NoiseSpec { saturation_electrons: 1000.0, read_electrons: 8.0 };
        let optics = OpticsSpec { noise: Some(noise), ..OpticsSpec::default() };
        let projection = Projection::new(512, 128);
        let develop = |level: u8, seed: u64| {
            let mut picture = grey(level, projection);
            Camera::new(optics).develop(&mut picture, Seed(seed));
            picture
        };
        for level in [40_u8, 128, 200] {
            let picture = develop(level, 3);
            let levels: Vec<f64> = picture.rgba.chunks_exact(4).flat_map(|p| p[..3].to_vec()).map(f64::from).collect();
            let mean = levels.iter().sum::<f64>() / levels.len() as f64;
            let variance = levels.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / levels.len() as f64;
            let electrons = f64::from(level) / 255.0 * 1000.0;
            // Rounding to levels adds 1/12.
            let wanted = (electrons + 64.0) * 0.255 * 0.255 + 1.0 / 12.0;
            assert!((mean - f64::from(level)).abs() < 0.15, "{level}: mean {mean}");
            assert!((variance / wanted - 1.0).abs() < 0.02, "{level}: variance {variance}, {wanted}");
        }
        assert!(develop(128, 3) == develop(128, 3) && develop(128, 3) != develop(128, 4));
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| develop(128, 3));
        assert!(alone == develop(128, 3), "threads do not matter");
    }

    #[test]
    fn tones_follow_their_closed_form() {
        let optics = OpticsSpec { gamma: 2.0, white_balance: [1.0, 0.5, 2.0], ..OpticsSpec::default() };
        let mut picture = grey(64, Projection::new(8, 8));
        Camera::new(optics).develop(&mut picture, Seed(1));
        // 255 sqrt(gain 64/255)
        assert_eq!(picture.rgba[..4], [128, 90, 181, 255]);
    }

    #[test]
    fn rims_darken_with_the_square_of_the_distance_and_dirt_stays() {
        let projection = Projection::new(360, 90);
        let optics = OpticsSpec { vignetting: 0.5, ..OpticsSpec::default() };
        let mut picture = grey(200, projection);
        Camera::new(optics).develop(&mut picture, Seed(1));
        let level = |picture: &Panorama, row: usize| picture.rgba[4 * 360 * row];
        assert!(level(&picture, 0).abs_diff(102) <= 1 && level(&picture, 44) == 200 && level(&picture, 22).abs_diff(176) <= 1);
        let dirty = |seed: u64| {
            let mut picture = grey(200, projection);
            Camera::new(CameraPreset::Dirty.optics()).develop(&mut picture, Seed(seed));
            picture.rgba.chunks_exact(4).map(|p| p[0] < 120).collect::<Vec<_>>()
        };
        let (a, b) = (dirty(1), dirty(2));
        let share = a.iter().filter(|covered| **covered).count() as f64 / a.len() as f64;
        assert!((0.002..0.1).contains(&share), "{share} covered");
        let moved = a.iter().zip(&b).filter(|(a, b)| a != b).count();
        assert!((moved as f64) < 0.1 * share * a.len() as f64, "dirt is the camera's, not the frame's");
    }
}
