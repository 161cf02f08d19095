//! The live view: redraws the screen every second and after every key.

use std::io;
use std::time::Duration;

use process::{Terminal, TerminalEvent};
use ratatui::backend::CrosstermBackend;

use super::Top;
use crate::view::draw::draw;
use crate::view::keys::Keys;
use crate::view::screen::Screen;

/// Polling interval of the counters.
const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// Interval of attempts to draw while the terminal has not taken the previous frame.
const BUSY_INTERVAL: Duration = Duration::from_millis(20);

/// Shows the live table until the user quits, a signal ends it, or the terminal is gone. Restores the terminal
/// afterwards.
pub(super) fn show(top: &mut Top) -> io::Result<()> {
    let mut terminal = Terminal::open()?;
    let outcome = watch(top, &mut terminal);
    // A terminal that is gone has no size and takes no output: that is no error.
    let has_ended = terminal.wait(Duration::ZERO, &mut Vec::new())? == TerminalEvent::End;
    if has_ended { Ok(()) } else { outcome }
}

fn watch(top: &mut Top, terminal: &mut Terminal) -> io::Result<()> {
    let output = terminal.output();
    let mut frames = ratatui::Terminal::new(CrosstermBackend::new(terminal.output()))?;
    let mut screen = Screen::default();
    let (mut keys, mut bytes) = (Keys::default(), Vec::new());
    let mut next = clock::now();
    loop {
        let now = clock::now();
        if now >= next {
            let (readings, rows) = top.look();
            screen.update(readings, rows);
            screen.is_running = top.is_running();
            // Skip missed seconds instead of catching up.
            next = (next + POLL_INTERVAL).max(now);
        }
        let is_busy = output.is_busy();
        if !is_busy {
            frames.draw(|frame| draw(frame, &screen))?;
        }
        let rest = next.since(clock::now());
        bytes.clear();
        match terminal.wait(if is_busy { rest.min(BUSY_INTERVAL) } else { rest }, &mut bytes)? {
            TerminalEvent::End => return Ok(()),
            TerminalEvent::Redraw => {}
            TerminalEvent::Keys => {
                for key in keys.decode(&bytes) {
                    if !screen.press(key) {
                        return Ok(());
                    }
                }
            }
        }
    }
}
