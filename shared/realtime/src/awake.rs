use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::path::Path;

/// Where the kernel is told how soon a core must wake: PM QoS, Documentation/power/pm_qos_interface.rst
/// of the kernel.
const CPU_LATENCY: &str = "/dev/cpu_dma_latency";

/// Keeps all cores from sleeping as long as it lives: one that sleeps wakes late, by 2 to 200 µs on most
/// machines and by 50 and more in a virtual one. It costs power.
#[derive(Debug)]
pub struct Awake {
    /// The request goes when the file is closed, however the process ends.
    _request: File,
}

impl Awake {
    /// Asks the kernel for it.
    ///
    /// # Errors
    ///
    /// This user may not ask (by default only root may), or the kernel knows no such request: then
    /// [`io::ErrorKind::NotFound`].
    pub fn ask() -> io::Result<Self> {
        Self::ask_at(Path::new(CPU_LATENCY))
    }

    fn ask_at(path: &Path) -> io::Result<Self> {
        let mut request = OpenOptions::new().write(true).open(path)?;
        // The latency in microseconds that is borne.
        request.write_all(&0_i32.to_ne_bytes())?;
        Ok(Self { _request: request })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latency_of_zero_is_asked_for_in_the_kernels_form_and_nowhere_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("latency");
        assert_eq!(Awake::ask_at(&file).unwrap_err().kind(), io::ErrorKind::NotFound);
        std::fs::write(&file, []).unwrap();
        let _awake = Awake::ask_at(&file).unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), [0; 4]);
    }
}
