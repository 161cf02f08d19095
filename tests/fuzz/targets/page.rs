//! Fuzzes the page's server with HTTP requests, WebSocket frames and messages.
#![no_main]

#[path = "../fed.rs"]
mod fed;

use std::cell::OnceCell;

use console_process::fed::FedPage;

thread_local! {
    static PAGE: OnceCell<FedPage> = const { OnceCell::new() };
}

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    PAGE.with(|page| {
        let _fed = page.get_or_init(|| FedPage::new().expect("a server")).play(script);
    });
});
