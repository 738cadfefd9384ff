//! The import graph of the modules of each package has no cycles. Cargo itself rejects cycles of packages.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{Attribute, File, Item, ItemMacro, ItemMod, ItemUse, Macro, UseTree, Visibility};

use crate::sources;

/// Folders of the checked modules, each with the path of its parent module.
const FOLDERS: [(&str, &[&str]); 7] = [
    ("crates/image/src", &[]),
    ("crates/scene/src", &[]),
    ("crates/trace/src", &[]),
    ("crates/render/src", &[]),
    ("crates/dev/src", &[]),
    ("src", &[]),
    ("src/cli", &["cli"]),
];

#[test]
fn module_imports_have_no_cycles() {
    for (folder, parent) in FOLDERS {
        let mut files = Vec::new();
        read(&sources::path(folder), &strings(parent), &mut files);
        let found = cycles(&imports(&files, &strings(parent)));
        assert!(found.is_empty(), "{folder}: {found:?}");
    }
}

#[test]
fn cycles_are_detected() {
    let cycles_in = |texts: &[(&str, &str)]| {
        let file = |(name, text): &(&str, &str)| {
            let module = if *name == "lib" { Vec::new() } else { strings(&[name]) };
            (module, syn::parse_file(text).unwrap())
        };
        cycles(&imports(&texts.iter().map(file).collect::<Vec<_>>(), &[]))
    };
    let no_cycles: Vec<Vec<String>> = Vec::new();
    assert_eq!(
        cycles_in(&[("a", "use crate::b::B;"), ("b", "pub struct B;")]),
        no_cycles
    );
    let cycle = [strings(&["a", "b"])];
    assert_eq!(
        cycles_in(&[("a", "use crate::b::B;"), ("b", "fn f() { super::a::g() }")]),
        cycle
    );
    // A cycle through names that the root module exports.
    let root = ("lib", "mod a; mod b; pub use b::B; pub use a::*;");
    assert_eq!(
        cycles_in(&[
            root,
            ("a", "use super::{B}; pub struct A;"),
            ("b", "type T = crate::A;")
        ]),
        cycle
    );
    // A cycle through a macro and a third module.
    let third = [
        ("a", "macro_rules! m { () => { crate::b::B } }"),
        ("b", "use crate::c;"),
        ("c", "use crate::a;"),
    ];
    assert_eq!(cycles_in(&third), [strings(&["a", "b", "c"])]);
    // Test modules do not count.
    assert_eq!(
        cycles_in(&[
            ("a", "use crate::b::B;"),
            ("b", "#[cfg(test)] mod tests { use crate::a; }")
        ]),
        no_cycles
    );
}

type Module = Vec<String>;

fn strings(names: &[&str]) -> Module {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// Reads the files with their module paths, except test modules.
fn read(folder: &Path, module: &[String], files: &mut Vec<(Module, File)>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let child_module = [module, &strings(&[stem])].concat();
        if path.is_dir() {
            read(&path, &child_module, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let file = syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap();
            let is_root = matches!(stem, "lib" | "main" | "mod");
            files.push((if is_root { module.to_vec() } else { child_module }, file));
        }
    }
    let test_modules: BTreeSet<Module> = (files.iter())
        .flat_map(|(module, file)| {
            test_module_names(file)
                .map(|name| [module.as_slice(), &[name]].concat())
                .collect::<Vec<_>>()
        })
        .collect();
    files.retain(|(module, _)| !test_modules.iter().any(|test_module| module.starts_with(test_module)));
}

fn test_module_names(file: &File) -> impl Iterator<Item = String> {
    file.items.iter().filter_map(|item| match item {
        Item::Mod(module) if is_test(&module.attrs) => Some(module.ident.to_string()),
        _ => None,
    })
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let list = attribute.meta.require_list();
        list.is_ok_and(|list| list.path.is_ident("cfg") && list.tokens.to_string().contains("test"))
    })
}

fn imports(files: &[(Module, File)], parent: &[String]) -> BTreeMap<String, BTreeSet<String>> {
    let child = |module: &[String]| module.strip_prefix(parent)?.first().cloned();
    let modules: BTreeSet<String> = files.iter().filter_map(|(module, _)| child(module)).collect();
    let exports = exports(files, parent, &modules);
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, file) in files {
        let Some(importer) = child(module) else { continue };
        let mut paths = Paths {
            module: module.clone(),
            found: Vec::new(),
        };
        paths.visit_file(file);
        let imported =
            paths
                .found
                .iter()
                .filter_map(|path| child(path))
                .filter_map(|name| match modules.contains(&name) {
                    true => Some(name),
                    false => exports.get(&name).cloned(),
                });
        let other_modules = imported.filter(|imported| *imported != importer);
        all.entry(importer.clone()).or_default().extend(other_modules);
    }
    all
}

/// Returns the re-exported names, each with its child module.
fn exports(files: &[(Module, File)], parent: &[String], modules: &BTreeSet<String>) -> BTreeMap<String, String> {
    let mut exports = BTreeMap::new();
    let roots = files.iter().filter(|(module, _)| module == parent);
    for item in roots.flat_map(|(_, file)| &file.items) {
        let Item::Use(item) = item else { continue };
        for path in use_paths(&item.tree) {
            let path: Vec<_> = path
                .into_iter()
                .filter(|name| name != "self" && name != "crate")
                .collect();
            let (Some(first), Some(last)) = (path.first(), path.last()) else {
                continue;
            };
            if !modules.contains(first) {
                continue;
            }
            match last.as_str() {
                "*" => {
                    let is_in_child =
                        |module: &Module| module.strip_prefix(parent).is_some_and(|m| m.first() == Some(first));
                    let names = files
                        .iter()
                        .filter(|(module, _)| is_in_child(module))
                        .flat_map(|(_, file)| public_names(file));
                    exports.extend(names.map(|name| (name, first.clone())));
                }
                name => {
                    exports.insert(name.to_owned(), first.clone());
                }
            }
        }
    }
    exports
}

fn public_names(file: &File) -> impl Iterator<Item = String> {
    file.items.iter().filter_map(|item| {
        let (visibility, name) = match item {
            Item::Const(item) => (&item.vis, &item.ident),
            Item::Enum(item) => (&item.vis, &item.ident),
            Item::Fn(item) => (&item.vis, &item.sig.ident),
            Item::Static(item) => (&item.vis, &item.ident),
            Item::Struct(item) => (&item.vis, &item.ident),
            Item::Trait(item) => (&item.vis, &item.ident),
            Item::Type(item) => (&item.vis, &item.ident),
            _ => return None,
        };
        matches!(visibility, Visibility::Public(_)).then(|| name.to_string())
    })
}

/// Collects the paths from `crate`, `self` or `super`, relative to the root of the package.
struct Paths {
    module: Module,
    found: Vec<Module>,
}

impl Paths {
    fn add(&mut self, path: &[String]) {
        let mut base = match path[0].as_str() {
            "crate" => Vec::new(),
            "self" | "super" => self.module.clone(),
            _ => return,
        };
        let super_count = path.iter().take_while(|name| *name == "super").count();
        base.truncate(base.len().saturating_sub(super_count));
        let rest = path
            .iter()
            .skip_while(|name| matches!(name.as_str(), "crate" | "self" | "super"));
        self.found.push(base.into_iter().chain(rest.cloned()).collect());
    }

    /// Adds the paths in the text of tokens, separated by spaces.
    fn add_tokens(&mut self, tokens: &str) {
        let tokens = tokens.replace(" :: ", "::");
        let paths = tokens.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
        for path in paths.filter(|path| path.starts_with("crate::") || path.starts_with("super::")) {
            self.add(&path.split("::").map(str::to_owned).collect::<Vec<_>>());
        }
    }
}

impl Visit<'_> for Paths {
    fn visit_item_mod(&mut self, module: &ItemMod) {
        if is_test(&module.attrs) {
            return;
        }
        self.module.push(module.ident.to_string());
        visit::visit_item_mod(self, module);
        self.module.pop();
    }

    fn visit_item_use(&mut self, item: &ItemUse) {
        if !is_test(&item.attrs) {
            use_paths(&item.tree).iter().for_each(|path| self.add(path));
        }
    }

    fn visit_path(&mut self, path: &syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.add(&names);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &Macro) {
        self.add_tokens(&item.tokens.to_string());
    }

    fn visit_item_macro(&mut self, item: &ItemMacro) {
        self.add_tokens(&item.mac.tokens.to_string());
    }
}

fn use_paths(tree: &UseTree) -> Vec<Module> {
    match tree {
        UseTree::Path(path) => {
            let first = path.ident.to_string();
            let rest = use_paths(&path.tree).into_iter();
            rest.map(|rest| [vec![first.clone()], rest].concat()).collect()
        }
        UseTree::Name(name) => vec![vec![name.ident.to_string()]],
        UseTree::Rename(rename) => vec![vec![rename.ident.to_string()]],
        UseTree::Glob(_) => vec![strings(&["*"])],
        UseTree::Group(group) => group.items.iter().flat_map(use_paths).collect(),
    }
}

fn cycles(imports: &BTreeMap<String, BTreeSet<String>>) -> Vec<Vec<String>> {
    let reachable = |start: &String| {
        let mut reachable = BTreeSet::new();
        let mut pending = vec![start];
        while let Some(module) = pending.pop() {
            for next in imports.get(module).into_iter().flatten() {
                if reachable.insert(next.clone()) {
                    pending.push(next);
                }
            }
        }
        reachable
    };
    let reachable_modules: BTreeMap<&String, BTreeSet<String>> =
        imports.keys().map(|module| (module, reachable(module))).collect();
    let is_same_cycle = |a: &String, b: &String| {
        reachable_modules[a].contains(b)
            && reachable_modules
                .get(b)
                .is_some_and(|reachable_from_b| reachable_from_b.contains(a))
    };
    let groups: BTreeSet<Vec<String>> = (imports.keys())
        .map(|module| {
            imports
                .keys()
                .filter(|other| is_same_cycle(module, other))
                .cloned()
                .collect()
        })
        .filter(|group: &Vec<String>| !group.is_empty())
        .collect();
    groups.into_iter().collect()
}
