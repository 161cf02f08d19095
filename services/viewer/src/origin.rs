//! The web pages that may connect.

/// Viewers on the web.
const KNOWN: [&str; 1] = ["https://app.foxglove.dev"];
/// The names of this machine in a browser.
const LOOPBACK: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];

/// The origins of web pages that are admitted beside those of this machine and the known viewers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origins(Vec<String>);

impl Origins {
    /// Admits these too, such as `https://viewer.example`.
    #[must_use]
    pub fn with(origins: impl IntoIterator<Item = String>) -> Self {
        Self(origins.into_iter().map(|origin| origin.trim_end_matches('/').to_lowercase()).collect())
    }

    /// Whether a client may connect that names this origin. A browser names the origin of every page that connects.
    pub(crate) fn admit(&self, origin: Option<&str>) -> bool {
        // Programs that are no browsers could name any origin, so one that names none is admitted.
        let Some(origin) = origin.map(str::to_lowercase) else { return true };
        if KNOWN.contains(&origin.as_str()) || self.0.contains(&origin) {
            return true;
        }
        match origin.split_once("://") {
            Some(("http" | "https", host)) => {
                let name = match host.rsplit_once(':') {
                    Some((name, port)) if port.bytes().all(|digit| digit.is_ascii_digit()) => name,
                    _ => host,
                };
                LOOPBACK.contains(&name)
            }
            // The pages of a desktop program, such as `file://`.
            Some(_) => true,
            // `null`: any page can have this origin.
            None => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pages_of_this_machine_and_of_known_viewers_are_admitted() {
        let origins = Origins::with(["https://Viewer.example/".to_owned()]);
        let admitted = [
            None,
            Some("file://"),
            Some("app://lichtblick"),
            Some("http://localhost:8080"),
            Some("https://127.0.0.1"),
            Some("http://[::1]"),
            Some("http://[::1]:80"),
            Some("https://app.foxglove.dev"),
            Some("https://viewer.example"),
        ];
        for origin in admitted {
            assert!(origins.admit(origin), "{origin:?}");
        }
        let refused = [
            "",
            "null",
            "https://evil.example",
            "http://localhost.evil.example",
            "http://localhost:80.evil.example",
            "http://app.foxglove.dev",
            "https://app.foxglove.dev.evil.example",
            "https://viewer.example:444",
        ];
        for origin in refused {
            assert!(!origins.admit(Some(origin)), "{origin}");
        }
    }
}
