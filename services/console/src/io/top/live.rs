//! The live view: redraws the screen every second and after every key.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};

use super::Top;
use crate::view::draw::draw;
use crate::view::screen::{ESCAPE, Screen};

/// Polling interval.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// Shows the live table until the user quits or the terminal closes. Restores the terminal afterwards.
pub(super) fn show(top: &mut Top) -> io::Result<()> {
    let stop = process::stop_flag().map_err(io::Error::other)?;
    let mut terminal = ratatui::try_init()?;
    let outcome = watch(top, &mut terminal, &stop);
    let restored = ratatui::try_restore();
    // After a hang-up the terminal accepts no output, so errors do not matter.
    if stop.load(Ordering::Relaxed) { Ok(()) } else { outcome.and(restored) }
}

fn watch(top: &mut Top, terminal: &mut DefaultTerminal, stop: &AtomicBool) -> io::Result<()> {
    let mut screen = Screen::default();
    let mut next = clock::now();
    while !stop.load(Ordering::Relaxed) {
        let now = clock::now();
        if now >= next {
            let (readings, rows) = top.look();
            screen.update(readings, rows);
            screen.is_running = top.is_running();
            // Skip missed seconds instead of catching up.
            next = (next + POLL_INTERVAL).max(now);
        }
        terminal.draw(|frame| draw(frame, &screen))?;
        if event::poll(next.since(clock::now()))?
            && let Event::Key(event) = event::read()?
            && let Some(key) = key(event)
            && !screen.press(key)
        {
            return Ok(());
        }
    }
    Ok(())
}

/// A key as a character.
fn key(event: KeyEvent) -> Option<char> {
    #[expect(clippy::wildcard_enum_match_arm, reason = "other keys have no function")]
    match event.code {
        _ if event.is_release() => None,
        KeyCode::Char('c') if event.modifiers.contains(KeyModifiers::CONTROL) => Some('q'),
        KeyCode::Char(key) => Some(key),
        KeyCode::Enter => Some('h'),
        KeyCode::Esc => Some(ESCAPE),
        KeyCode::Up => Some('↑'),
        KeyCode::Down => Some('↓'),
        _ => None,
    }
}
