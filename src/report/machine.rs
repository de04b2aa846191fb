//! What times were measured on.

use serde::{Deserialize, Serialize};

/// The processor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Its model as the system calls it; the architecture where it does not.
    pub cpu: String,
    /// Vector instructions that it has.
    pub instruction_sets: Vec<String>,
}

impl Machine {
    /// The one that this runs on.
    pub fn detect() -> Self {
        let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = cpuinfo
            .lines()
            .filter_map(|line| line.split_once(':'))
            .find(|(key, _)| key.trim() == "model name");
        Self {
            cpu: model
                .map_or(std::env::consts::ARCH, |(_, name)| name.trim())
                .to_owned(),
            instruction_sets: instruction_sets(),
        }
    }
}

/// The names among those given that the processor has.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! detected {
    ($is_detected:path, $($name:tt)+) => {{
        use $is_detected as is_detected;
        [$(($name, is_detected!($name))),+]
            .into_iter()
            .filter(|(_, is_there)| *is_there)
            .map(|(name, _)| name.to_owned())
            .collect()
    }};
}

#[cfg(target_arch = "x86_64")]
fn instruction_sets() -> Vec<String> {
    detected!(std::arch::is_x86_feature_detected, "sse2" "sse4.1" "avx" "f16c" "fma" "avx2" "avx512f" "avx512vl" "avx512fp16")
}

#[cfg(target_arch = "aarch64")]
fn instruction_sets() -> Vec<String> {
    detected!(std::arch::is_aarch64_feature_detected, "neon" "fp16" "sve" "sve2")
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn instruction_sets() -> Vec<String> {
    Vec::new()
}
