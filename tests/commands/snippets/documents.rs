//! The documents, and the blocks of programs, data and commands in them.

use std::fs;
use std::path::{Path, PathBuf};

use crate::harness::read;

/// The folders with documents, beside the root of the repository.
const FOLDERS: [&str; 5] = ["docs", "package", "config", "shared", "services"];
/// What begins a line of a block of commands.
const INDENT: &str = "    ";

pub(super) struct Document {
    pub(super) path: String,
    pub(super) blocks: Vec<Block>,
}

/// A fenced block, or an indented one, which holds commands.
pub(super) struct Block {
    /// The word behind the fence; `sh` for an indented block.
    pub(super) language: String,
    pub(super) text: String,
    /// The number of its first line.
    pub(super) line: usize,
    /// The file whose name stands before the block.
    pub(super) name: Option<String>,
}

impl Block {
    /// The commands without their comments, and their line numbers. A line that is indented further belongs to the
    /// command before it, and so does the end of a loop.
    fn commands(&self) -> Vec<(usize, String)> {
        let mut commands: Vec<(usize, String)> = Vec::new();
        for (number, line) in (self.line..).zip(self.text.lines()) {
            let command = line.split_once(" #").map_or(line, |(command, _comment)| command).trim();
            match commands.last_mut() {
                Some((_, before)) if line.starts_with(' ') || line == "done" => {
                    before.push('\n');
                    before.push_str(command);
                }
                _ => commands.push((number, command.to_owned())),
            }
        }
        commands
    }
}

impl Document {
    /// The shell commands, and their line numbers.
    pub(super) fn commands(&self) -> Vec<(usize, String)> {
        self.blocks.iter().filter(|block| block.language == "sh").flat_map(Block::commands).collect()
    }
}

/// Every document of the repository that people read.
pub(super) fn all() -> Vec<Document> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<PathBuf> = files(root).into_iter().filter(|path| path.is_file()).collect();
    let mut folders: Vec<PathBuf> = FOLDERS.iter().map(|folder| root.join(folder)).collect();
    while let Some(folder) = folders.pop() {
        for path in files(&folder) {
            if path.is_dir() && !path.ends_with("node_modules") {
                folders.push(path);
            } else {
                paths.push(path);
            }
        }
    }
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    paths.sort();
    let document = |path: PathBuf| {
        let path = path.strip_prefix(root).expect("is in it").display().to_string();
        let blocks = blocks(&read(&path));
        Document { path, blocks }
    };
    paths.into_iter().map(document).collect()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("a file").path()).collect()
}

pub(super) fn blocks(text: &str) -> Vec<Block> {
    let (mut blocks, mut before) = (Vec::new(), String::new());
    let mut lines = (1_usize..).zip(text.lines()).peekable();
    while let Some((number, line)) = lines.next() {
        let indent = line.len() - line.trim_start().len();
        let begins = before.lines().next_back().is_none_or(|last| last.trim().is_empty());
        if let Some(language) = line.trim().strip_prefix("```") {
            let content = lines.by_ref().take_while(|(_, line)| line.trim() != "```");
            let text = content.map(|(_, line)| format!("{}\n", line.get(indent..).unwrap_or(""))).collect();
            let name = file_name(&before, language);
            blocks.push(Block { language: language.to_owned(), text, line: number + 1, name });
            before.clear();
        } else if begins && let Some(first) = line.strip_prefix(INDENT) {
            let mut text = format!("{first}\n");
            while let Some((_, line)) = lines.next_if(|(_, line)| line.starts_with(INDENT)) {
                text.push_str(line.get(INDENT.len()..).unwrap_or(""));
                text.push('\n');
            }
            blocks.push(Block { language: "sh".to_owned(), text, line: number, name: None });
            before.clear();
        } else {
            before.push_str(line);
            before.push('\n');
        }
    }
    blocks
}

/// The last file name in the paragraph before a block that has the ending of its language.
fn file_name(before: &str, language: &str) -> Option<String> {
    let endings: &[&str] = match language {
        "python" => &[".py"],
        "json" => &[".json", ".jsonl"],
        "toml" => &[".toml"],
        "csv" => &[".csv"],
        _ => &[],
    };
    let paragraph = before.trim_end().rsplit("\n\n").next().unwrap_or_default();
    let quoted = paragraph.split('`').skip(1).step_by(2);
    let is_name =
        |name: &&str| endings.iter().any(|ending| name.ends_with(*ending)) && !name.contains(['/', ' ']);
    quoted.filter(is_name).last().map(str::to_owned)
}
