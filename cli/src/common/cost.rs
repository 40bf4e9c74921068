//! What a piece of work costs: CPU seconds of all threads, wall seconds, memory.

use serde::{Deserialize, Serialize};
use std::time::Instant;

/// What a piece of work took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// CPU seconds of all threads of the process; `None` where the system does not say.
    pub cpu_s: Option<f64>,
    /// Wall seconds.
    pub wall_s: f64,
    /// Largest resident memory of the process meanwhile, MiB: program, material and all; `None` where the system does not say.
    pub peak_mib: Option<f64>,
    /// How much of it came on top of what was resident before.
    pub added_mib: Option<f64>,
}

/// Does `work` and says what it took.
pub fn measure<T>(work: impl FnOnce() -> T) -> (T, Cost) {
    // Forgets the peak so far (Linux). Where that fails the peak is that of the process, larger and never smaller.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let (cpu, resident, wall) = (cpu_seconds(), status_mib("VmRSS:"), Instant::now());
    let result = work();
    let wall_s = wall.elapsed().as_secs_f64();
    let cpu_s = cpu.zip(cpu_seconds()).map(|(before, after)| after - before);
    let peak_mib = status_mib("VmHWM:");
    let added_mib = peak_mib.zip(resident).map(|(peak, before)| (peak - before).max(0.0));
    (result, Cost { cpu_s, wall_s, peak_mib, added_mib })
}

/// CPU seconds of the process so far, all threads together.
#[cfg(unix)]
#[expect(clippy::unnecessary_wraps, reason = "other systems do not say")]
pub fn cpu_seconds() -> Option<f64> {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64)
}

#[cfg(not(unix))]
pub fn cpu_seconds() -> Option<f64> {
    None
}

/// A size in the process's status file (Linux), MiB.
fn status_mib(key: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? / 1024.0)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn work_and_its_memory_are_measured() {
        const BYTES: usize = 64 << 20;
        let (sum, cost) = measure(|| {
            let bytes = vec![1_u8; BYTES];
            std::hint::black_box(&bytes).iter().map(|&b| u64::from(b)).sum::<u64>()
        });
        assert_eq!(sum, BYTES as u64);
        assert!(cost.cpu_s.unwrap() > 1e-4 && cost.wall_s > 1e-4, "{cost:?}");
        let (peak, added) = (cost.peak_mib.unwrap(), cost.added_mib.unwrap());
        // Other tests of this process may give memory back meanwhile.
        assert!((40.0..80.0).contains(&added) && peak > added, "{cost:?}");
    }
}
