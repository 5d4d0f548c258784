//! Which points of the space of settings a study visits.

use rand::RngExt;

use crate::random::Seed;

/// Axes that a Sobol sequence of this module can serve.
pub const SOBOL_AXES: usize = 10;

/// How points are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, strum::Display, strum::EnumString, strum::VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Design {
    /// Every combination of the levels of all axes.
    Grid,
    /// Every level of each axis by itself; all other axes are left as the study's settings and its world have them. Only the compared
    /// axis goes through its levels in all of these cells.
    OneAtATime,
    /// Points drawn at random, independent of one another.
    Random,
    /// Points of Sobol's sequence (1967), shifted at random: they fill the space more evenly than random ones.
    Sobol,
}

/// The point `index` in [0, 1) on each of `axes` axes; designs of listed levels have none.
///
/// Every point depends on the seed and its own index alone, so that a longer study begins with the points of a shorter one.
pub fn point(design: Design, seed: Seed, index: u64, axes: usize) -> Vec<f64> {
    match design {
        Design::Grid | Design::OneAtATime => Vec::new(),
        Design::Random => {
            let mut stream = seed.stream(&format!("point {index}"));
            (0..axes).map(|_| stream.random()).collect()
        }
        Design::Sobol => (0..axes)
            .map(|axis| {
                // A digital shift keeps the sequence's evenness and makes its points draws from the whole space.
                let shift: u32 = seed.stream(&format!("sobol shift {axis}")).random();
                f64::from(sobol(axis, index as u32) ^ shift) * (0.5_f64 / f64::from(1_u32 << 31))
            })
            .collect(),
    }
}

/// Primitive polynomials and first direction numbers of the axes after the first: degree, coefficients between the outer ones as
/// bits, and as many odd numbers as the degree (Joe and Kuo 2008, new-joe-kuo-6).
const DIRECTIONS: [(u32, u32, &[u32]); SOBOL_AXES - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
];

/// Coordinate `axis` of the point `index` of Sobol's sequence, as a share of 2^32, in the order of Gray codes.
fn sobol(axis: usize, index: u32) -> u32 {
    let directions = directions(axis);
    let gray = index ^ (index >> 1);
    (0..32).filter(|bit| gray >> bit & 1 == 1).fold(0, |sum, bit| sum ^ directions[bit as usize])
}

fn directions(axis: usize) -> [u32; 32] {
    let mut v = [0_u32; 32];
    let Some((degree, coefficients, first)) = axis.checked_sub(1).map(|k| DIRECTIONS[k]) else {
        // The first axis is van der Corput's sequence.
        return std::array::from_fn(|k| 1 << (31 - k));
    };
    let s = degree as usize;
    for k in 0..32 {
        v[k] = match first.get(k) {
            Some(m) => m << (31 - k),
            None => {
                let start = v[k - s] ^ (v[k - s] >> s);
                (1..s).filter(|i| coefficients >> (s - 1 - i) & 1 == 1).fold(start, |sum, i| sum ^ v[k - i])
            }
        };
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sobol_points_are_those_of_another_implementation() {
        // scipy 1.17.1: scipy.stats.qmc.Sobol(10, scramble=False).random(64)[[5, 37, 63]], in sixty-fourths.
        for (index, row) in [
            (5, [56, 56, 8, 24, 56, 40, 56, 24, 24, 8]),
            (37, [59, 41, 37, 59, 49, 19, 11, 51, 39, 11]),
            (63, [1, 51, 23, 29, 55, 9, 37, 9, 53, 37]),
        ] {
            assert_eq!(std::array::from_fn(|axis| sobol(axis, index) >> 26), row, "point {index}");
        }
    }

    #[test]
    fn shifted_points_stay_even_and_longer_studies_begin_with_shorter_ones() {
        for axis in 0..SOBOL_AXES {
            // Of 64 points one lies in each of 64 equal cells of every axis, before and after the shift.
            let mut cells: Vec<u32> =
                (0..64).map(|k| (64.0 * point(Design::Sobol, Seed(5), k, SOBOL_AXES)[axis]) as u32).collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..64).collect::<Vec<_>>(), "axis {axis}");
        }
        let random = point(Design::Random, Seed(5), 3, 2);
        assert_eq!(random, point(Design::Random, Seed(5), 3, 2));
        assert!(random != point(Design::Random, Seed(6), 3, 2) && random.iter().all(|x| (0.0..1.0).contains(x)));
        assert!(point(Design::Grid, Seed(5), 3, 2).is_empty());
    }
}
