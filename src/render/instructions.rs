//! Instruction sets that the CPU renderer is compiled for.

use std::fmt;

use crate::error::{Error, Result};

/// An instruction set. Pictures are the same bytes on all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// What every processor of the architecture has.
    Portable,
    /// AVX2, on x86-64.
    Avx2,
    /// AVX-512 as of Ice Lake and Zen 4, on x86-64.
    Avx512,
}

impl InstructionSet {
    /// All of them, the widest last.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The widest that this processor has.
    #[must_use]
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|set| set.is_available()).unwrap_or(Self::Portable)
    }

    /// Whether this processor has it.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            Self::Avx2 => has_avx2(),
            Self::Avx512 => has_avx512(),
        }
    }

    /// Itself, if this processor has it.
    pub(super) fn available(self) -> Result<Self> {
        let allowed = || {
            let names: Vec<String> = Self::ALL.iter().filter(|set| set.is_available()).map(ToString::to_string).collect();
            names.join(", ")
        };
        let lacking = || Error::Lacking { what: "instruction set".into(), found: self.to_string(), needed: allowed() };
        self.is_available().then_some(self).ok_or_else(lacking)
    }
}

impl fmt::Display for InstructionSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Portable => "portable",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        })
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    macro_rules! all { ($($feature:tt),*) => { true $( && is_x86_feature_detected!($feature) )* } }
    all!("avx2", "bmi1", "bmi2", "lzcnt", "popcnt")
}

/// What the `multiversion` crate asks of a processor before it takes AVX-512 for fast.
#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    macro_rules! all { ($($feature:tt),*) => { true $( && is_x86_feature_detected!($feature) )* } }
    has_avx2()
        && all!("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl", "avx512bitalg", "avx512ifma", "avx512vbmi")
        && all!("avx512vbmi2", "avx512vnni", "avx512vpopcntdq", "gfni", "vaes", "vpclmulqdq")
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx2() -> bool {
    false
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx512() -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_is_available_and_the_others_are_refused_by_name() {
        assert!(InstructionSet::best().is_available());
        for set in InstructionSet::ALL {
            match set.available() {
                Ok(same) => assert_eq!(same, set),
                Err(error) => assert!(error.to_string().contains("portable"), "{error}"),
            }
        }
    }
}
