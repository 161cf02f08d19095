//! What the commands print.

use std::io::Write as _;

use account::Account;
use config::Names;

use super::failure::Failed;

/// Prints what Leo learned in each lesson: its file, its title and the account.
pub(crate) fn print_accounts(
    accounts: &[(String, String, Account)],
    names: &Names,
    json: bool,
) -> Result<(), Failed> {
    let mut text = String::new();
    if json {
        let lessons: Vec<serde_json::Value> = accounts
            .iter()
            .map(|(file, title, account)| serde_json::json!({ "lesson": file, "title": title, "account": account }))
            .collect();
        text = to_json(&lessons)?;
    } else {
        for (file, title, account) in accounts {
            text += &format!("{title} ({file})\n\n{}", account.to_text(names));
        }
    }
    print(&text)
}

/// Prints one JSON document.
pub(crate) fn print_json(value: &(impl serde::Serialize + ?Sized)) -> Result<(), Failed> {
    print(&to_json(value)?)
}

fn to_json(value: &(impl serde::Serialize + ?Sized)) -> Result<String, Failed> {
    let text = serde_json::to_string_pretty(value).map_err(Failed::because)?;
    Ok(text + "\n")
}

/// Prints text as it is.
pub(crate) fn print(text: &str) -> Result<(), Failed> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|error| Failed::because(format!("cannot write to standard output: {error}")))
}
