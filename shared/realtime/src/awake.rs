use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::path::Path;

/// The kernel's interface for the maximum wake-up latency of cores: PM QoS, Documentation/power/pm_qos_interface.rst
/// of the kernel.
const CPU_LATENCY: &str = "/dev/cpu_dma_latency";

/// Keeps all cores out of idle states while it lives. Leaving an idle state takes 2 to 200 µs on most machines, and
/// 50 µs and more in a virtual machine. It increases power consumption.
#[derive(Debug)]
pub struct IdleStateGuard {
    /// The kernel drops the request when the file is closed, however the process ends.
    _request: File,
}

impl IdleStateGuard {
    /// Requests it from the kernel.
    ///
    /// # Errors
    ///
    /// This user may not request it (by default only root may), or the kernel has no such interface: then
    /// [`io::ErrorKind::NotFound`].
    pub fn ask() -> io::Result<Self> {
        Self::ask_at(Path::new(CPU_LATENCY))
    }

    fn ask_at(path: &Path) -> io::Result<Self> {
        let mut request = OpenOptions::new().write(true).open(path)?;
        // The tolerated latency in microseconds.
        request.write_all(&0_i32.to_ne_bytes())?;
        Ok(Self { _request: request })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latency_of_zero_is_requested_in_the_kernels_format() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("latency");
        assert_eq!(IdleStateGuard::ask_at(&file).unwrap_err().kind(), io::ErrorKind::NotFound);
        std::fs::write(&file, []).unwrap();
        let _awake = IdleStateGuard::ask_at(&file).unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), [0; 4]);
    }
}
