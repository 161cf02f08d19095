//! The paths that a source names outside its tests, with the imports resolved.

use std::collections::{BTreeMap, BTreeSet};

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use syn::spanned::Spanned as _;
use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree};

/// Something that a source names, and the line where it does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Named {
    /// A path such as `std::fs::read`, or a method such as `.exists`.
    pub(crate) name: String,
    pub(crate) line: usize,
}

/// What a source holds outside its tests.
#[derive(Debug, Default)]
pub(crate) struct Content {
    /// Every path and every method.
    pub(crate) names: Vec<Named>,
    /// The lines with unsafe code.
    pub(crate) unsafe_lines: Vec<usize>,
    /// The modules without a body that are compiled for tests alone.
    pub(crate) test_modules: Vec<String>,
    /// The types, traits and macros that it declares, and the fields of its structs as `Type::field`.
    pub(crate) declared: BTreeSet<String>,
    /// The path that each imported name stands for.
    imports: BTreeMap<String, String>,
}

impl Content {
    /// Parses a source.
    ///
    /// # Errors
    ///
    /// It is no Rust.
    pub(crate) fn parse(text: &str) -> syn::Result<Self> {
        let file = syn::parse_file(text)?;
        let mut content = Self::default();
        Imports(&mut content).visit_file(&file);
        content.visit_file(&file);
        Ok(content)
    }

    /// Notes a path whose first segment may be an import. A single word that is none is a variable or a type.
    fn add(&mut self, path: &str, line: usize) {
        let (first, rest) = path.split_once("::").map_or((path, None), |(first, rest)| (first, Some(rest)));
        let name = match (self.imports.get(first), rest) {
            (Some(known), Some(rest)) => format!("{known}::{rest}"),
            (Some(known), None) => known.clone(),
            (None, Some(_)) => path.to_owned(),
            (None, None) if path.starts_with('.') => path.to_owned(),
            (None, None) => return,
        };
        self.names.push(Named { name, line });
    }

    /// Notes the paths in the arguments of a macro, which are not parsed yet.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let mut path = String::new();
        let mut line = 0;
        let mut colons = 0;
        let mut after_dot = false;
        for token in tokens {
            match &token {
                TokenTree::Ident(word) if !path.is_empty() && colons == 2 => {
                    path = format!("{path}::{word}");
                    colons = 0;
                }
                TokenTree::Punct(mark) if mark.as_char() == ':' && !path.is_empty() => colons += 1,
                TokenTree::Ident(_) | TokenTree::Punct(_) | TokenTree::Group(_) | TokenTree::Literal(_) => {
                    self.add_word(&mut path, line);
                    colons = 0;
                    match &token {
                        TokenTree::Ident(word) => {
                            path = if after_dot { format!(".{word}") } else { word.to_string() };
                            line = word.span().start().line;
                        }
                        TokenTree::Group(group) => self.add_tokens(group.stream()),
                        TokenTree::Punct(_) | TokenTree::Literal(_) => {}
                    }
                }
            }
            after_dot = matches!(&token, TokenTree::Punct(mark) if mark.as_char() == '.');
            if matches!(&token, TokenTree::Ident(word) if word == "unsafe") {
                self.unsafe_lines.push(token.span().start().line);
            }
        }
        self.add_word(&mut path, line);
    }

    /// Notes what the arguments or the body of a macro declare: `struct Name … { field: … }` and other items, and
    /// outside brackets `Name: u16 { … }` as in `wire_enum!`.
    fn add_declarations(&mut self, tokens: TokenStream, in_brackets: bool) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut item = None;
        for (at, token) in tokens.iter().enumerate() {
            let colon = !in_brackets
                && matches!(tokens.get(at + 1), Some(TokenTree::Punct(mark)) if mark.as_char() == ':');
            let body = matches!(tokens.get(at + 3), Some(TokenTree::Group(_)));
            let after_keyword =
                at.checked_sub(1).and_then(|before| tokens.get(before)).is_some_and(|before| {
                    let keywords = ["enum", "struct", "trait", "type", "union"];
                    matches!(before, TokenTree::Ident(word) if keywords.iter().any(|keyword| word == keyword))
                });
            match token {
                TokenTree::Ident(name) if after_keyword || colon && body => {
                    self.declared.insert(name.to_string());
                    item = Some(name.to_string());
                }
                TokenTree::Group(body) if body.delimiter() == Delimiter::Brace => {
                    if let Some(item) = item.take() {
                        self.add_fields(&item, body.stream());
                    }
                    self.add_declarations(body.stream(), true);
                }
                TokenTree::Group(body) => self.add_declarations(body.stream(), true),
                TokenTree::Ident(_) | TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
        }
    }

    /// Notes each word of a struct's body that a colon follows.
    fn add_fields(&mut self, item: &str, body: TokenStream) {
        let mut word = None;
        for token in body {
            match (&token, word.take()) {
                (TokenTree::Ident(name), _) => word = Some(name.to_string()),
                (TokenTree::Punct(mark), Some(name)) if mark.as_char() == ':' => {
                    self.declared.insert(format!("{item}::{name}"));
                }
                (TokenTree::Punct(_) | TokenTree::Literal(_) | TokenTree::Group(_), _) => {}
            }
        }
    }

    fn add_word(&mut self, path: &mut String, line: usize) {
        if !path.is_empty() {
            self.add(&std::mem::take(path), line);
        }
    }
}

/// Whether an item is compiled for tests alone.
fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let is_cfg_test = attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Path>().is_ok_and(|condition| condition.is_ident("test"));
        is_cfg_test || attribute.path().is_ident("test")
    })
}

#[expect(clippy::wildcard_enum_match_arm, reason = "what is no item that we know has no attributes")]
fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::ExternCrate(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::ForeignMod(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Each import of a tree: the path, and the name that it has here.
fn imports(tree: &UseTree, before: &str, found: &mut Vec<(String, String, usize)>) {
    let joined = |name: &str| if before.is_empty() { name.to_owned() } else { format!("{before}::{name}") };
    match tree {
        UseTree::Path(path) => imports(&path.tree, &joined(&path.ident.to_string()), found),
        UseTree::Name(name) if name.ident == "self" => {
            let last = before.rsplit("::").next().unwrap_or(before);
            found.push((before.to_owned(), last.to_owned(), name.span().start().line));
        }
        UseTree::Name(name) => {
            found.push((joined(&name.ident.to_string()), name.ident.to_string(), name.span().start().line));
        }
        UseTree::Rename(rename) => {
            let path =
                if rename.ident == "self" { before.to_owned() } else { joined(&rename.ident.to_string()) };
            found.push((path, rename.rename.to_string(), rename.span().start().line));
        }
        UseTree::Glob(glob) => found.push((joined("*"), "*".to_owned(), glob.span().start().line)),
        UseTree::Group(group) => group.items.iter().for_each(|item| imports(item, before, found)),
    }
}

/// The first pass: what each imported name stands for.
struct Imports<'a>(&'a mut Content);

impl<'a> Visit<'a> for Imports<'_> {
    fn visit_item(&mut self, item: &'a Item) {
        if !is_for_tests(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        self.0.imports.insert(item.ident.to_string(), format!("self::{}", item.ident));
        visit::visit_item_mod(self, item);
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        let mut found = Vec::new();
        imports(&item.tree, "", &mut found);
        for (path, name, _) in found.into_iter().filter(|(_, name, _)| name != "*" && name != "_") {
            self.0.imports.insert(name, path);
        }
    }
}

impl<'a> Visit<'a> for Content {
    fn visit_item(&mut self, item: &'a Item) {
        if !is_for_tests(attributes(item)) {
            visit::visit_item(self, item);
        } else if let Item::Mod(module) = item
            && module.content.is_none()
        {
            self.test_modules.push(module.ident.to_string());
        }
    }

    fn visit_impl_item(&mut self, item: &'a syn::ImplItem) {
        let is_test = matches!(item, syn::ImplItem::Fn(function) if is_for_tests(&function.attrs));
        if !is_test {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        let mut found = Vec::new();
        imports(&item.tree, "", &mut found);
        for (path, _, line) in found {
            let first = path.split("::").next().unwrap_or(&path);
            // An import of an import is resolved only where that is a module of this file.
            let is_own = self.imports.get(first).is_some_and(|known| known.starts_with("self::"));
            self.names.push(Named { name: if is_own { format!("self::{path}") } else { path }, line });
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.add(&segments.join("::"), path.span().start().line);
        visit::visit_path(self, path);
    }

    fn visit_expr_method_call(&mut self, call: &'a syn::ExprMethodCall) {
        self.add(&format!(".{}", call.method), call.method.span().start().line);
        visit::visit_expr_method_call(self, call);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        self.visit_path(&call.path);
        self.add_tokens(call.tokens.clone());
    }

    fn visit_expr_unsafe(&mut self, block: &'a syn::ExprUnsafe) {
        self.unsafe_lines.push(block.span().start().line);
        visit::visit_expr_unsafe(self, block);
    }

    fn visit_signature(&mut self, signature: &'a syn::Signature) {
        self.unsafe_lines.extend(signature.unsafety.iter().map(|word| word.span().start().line));
        visit::visit_signature(self, signature);
    }

    fn visit_item_struct(&mut self, item: &'a syn::ItemStruct) {
        let fields = item.fields.iter().filter_map(|field| field.ident.as_ref());
        self.declared.extend(fields.map(|field| format!("{}::{field}", item.ident)));
        self.declared.insert(item.ident.to_string());
        visit::visit_item_struct(self, item);
    }

    fn visit_item_enum(&mut self, item: &'a syn::ItemEnum) {
        self.declared.insert(item.ident.to_string());
        visit::visit_item_enum(self, item);
    }

    fn visit_item_type(&mut self, item: &'a syn::ItemType) {
        self.declared.insert(item.ident.to_string());
        visit::visit_item_type(self, item);
    }

    fn visit_item_macro(&mut self, item: &'a syn::ItemMacro) {
        self.declared.extend(item.ident.as_ref().map(|name| format!("{name}!")));
        self.add_declarations(item.mac.tokens.clone(), false);
        visit::visit_item_macro(self, item);
    }

    fn visit_item_impl(&mut self, item: &'a syn::ItemImpl) {
        self.unsafe_lines.extend(item.unsafety.iter().map(|word| word.span().start().line));
        visit::visit_item_impl(self, item);
    }

    fn visit_item_trait(&mut self, item: &'a syn::ItemTrait) {
        self.declared.insert(item.ident.to_string());
        self.unsafe_lines.extend(item.unsafety.iter().map(|word| word.span().start().line));
        visit::visit_item_trait(self, item);
    }

    fn visit_attribute(&mut self, attribute: &'a Attribute) {
        if let syn::Meta::List(list) = &attribute.meta
            && list.tokens.to_string().contains("unsafe_code")
        {
            self.unsafe_lines.push(attribute.span().start().line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<(String, usize)> {
        let names = Content::parse(text).expect("Rust").names;
        names.into_iter().map(|named| (named.name, named.line)).collect()
    }

    #[test]
    fn code_below_the_tests_is_seen_and_the_tests_are_not() {
        let text = "#[cfg(test)]\nmod tests;\n#[cfg(test)]\nfn tried() { std::fs::read(\"x\"); }\nfn real() {\n    \
                    std::net::lookup();\n}\n";
        let content = Content::parse(text).expect("Rust");
        assert_eq!(content.test_modules, ["tests"]);
        let found: Vec<_> = content.names.iter().filter(|named| named.name.starts_with("std::")).collect();
        assert_eq!(found, [&Named { name: "std::net::lookup".to_owned(), line: 6 }]);
    }

    #[test]
    fn an_import_is_resolved_wherever_it_is_used() {
        let text = "use std::{self as s, fs as files, net::{self, TcpStream}};\nfn f() { s::env::var(\"x\"); \
                    files::read(\"x\"); println!(\"{}\", net::lookup(a.exists())); }\n";
        let found = names(text);
        for name in [
            "std::fs",
            "std::env::var",
            "std::fs::read",
            "std::net::lookup",
            "std::net::TcpStream",
            ".exists",
        ] {
            assert!(found.iter().any(|(found, _)| found == name), "{name} in {found:?}");
        }
    }

    #[test]
    fn declarations_are_seen_in_items_and_in_the_arguments_of_macros() {
        let text = "struct A { b: u8 }\nenum C { D }\ntrait E {}\ntype F = A;\nmacro_rules! g { () => { enum O { \
                    P(Q) } } }\nmessage! { #[derive(H)] pub struct I as \"i\" { pub j: [u8; 2], k: u8, } }\nwire_enum! { L: u16 { M = 1, } \
                    }\n#[cfg(test)]\nstruct N;\n";
        let declared = Content::parse(text).expect("Rust").declared;
        let expected = ["A", "A::b", "C", "E", "F", "I", "I::j", "I::k", "L", "O", "g!"];
        assert_eq!(declared.into_iter().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn unsafe_code_is_seen_in_blocks_items_attributes_and_macros() {
        let text = "unsafe fn a() {}\nunsafe impl B for C {}\nfn d() { unsafe { e() } }\nfn g() { vec![unsafe { f() }]; \
                    }\n#[expect(unsafe_code)]\nfn h() {}\n";
        let lines = Content::parse(text).expect("Rust").unsafe_lines;
        assert_eq!(lines, [1, 2, 3, 4, 5]);
    }
}
