//! Imports between the files of a crate.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};
use syn::{
    Attribute, Item, UseTree,
    visit::{self, Visit},
};

/// A module's path from the crate's root.
type Module = Vec<String>;

/// One file of a crate.
struct Source {
    path: PathBuf,
    parsed: syn::File,
    scope: Scope,
}

/// The names of a file.
#[derive(Default)]
struct Scope {
    /// Names of the items that the file defines.
    defines: BTreeSet<String>,
    /// Names that it imports or re-exports, with the path as written.
    imports: BTreeMap<String, Vec<String>>,
    /// Modules imported with `*`.
    globs: Vec<Vec<String>>,
}

/// The files of a crate, by module.
pub struct Crate {
    files: BTreeMap<Module, Source>,
}

impl Crate {
    /// Reads every file except tests, from the crate whose root is in `folder`.
    pub fn read(folder: &Path) -> Self {
        let mut found = Vec::new();
        collect(folder, &mut Vec::new(), &mut found);
        let files = found
            .into_iter()
            .map(|(module, path)| {
                let text = fs::read_to_string(&path).expect("a source file can be read");
                let parsed = syn::parse_file(&text)
                    .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
                let mut scope = Scope::default();
                scope.add_items(&parsed.items);
                let source = Source {
                    path,
                    parsed,
                    scope,
                };
                (module, source)
            })
            .collect();
        Self { files }
    }

    /// Each file with the files whose items it names, and one name for each.
    pub fn imports(&self) -> BTreeMap<PathBuf, BTreeMap<PathBuf, String>> {
        self.files
            .iter()
            .map(|(module, source)| {
                let mut walk = PathVisitor::default();
                walk.visit_file(&source.parsed);
                let mut targets = BTreeMap::new();
                for path in walk.paths {
                    if let Some(file) = self.owner(module, &path, 0)
                        && file != source.path
                    {
                        targets.entry(file).or_insert_with(|| path.join("::"));
                    }
                }
                for path in &source.scope.globs {
                    if let Some(target) = self.module(module, path)
                        && let Some(target) = self.files.get(&target)
                        && target.path != source.path
                    {
                        targets
                            .entry(target.path.clone())
                            .or_insert_with(|| format!("{}::*", path.join("::")));
                    }
                }
                (source.path.clone(), targets)
            })
            .collect()
    }

    /// The module that a path in another module means.
    fn module(&self, from: &Module, path: &[String]) -> Option<Module> {
        let (mut at, rest) = self.start(from, path, 0)?;
        for segment in rest {
            at.push(segment.clone());
            if !self.files.contains_key(&at) {
                return None;
            }
        }
        Some(at)
    }

    /// The module where a path begins, and the rest of the path.
    fn start<'a>(
        &self,
        from: &Module,
        path: &'a [String],
        depth: usize,
    ) -> Option<(Module, &'a [String])> {
        let (first, rest) = path.split_first()?;
        match first.as_str() {
            "crate" => Some((Vec::new(), rest)),
            "self" => Some((from.clone(), rest)),
            "super" => {
                let mut at = from.clone();
                at.pop()?;
                let mut rest = rest;
                while let Some((next, after)) = rest.split_first()
                    && next == "super"
                {
                    at.pop()?;
                    rest = after;
                }
                Some((at, rest))
            }
            name => {
                let mut child = from.clone();
                child.push(name.to_owned());
                if self.files.contains_key(&child) {
                    return Some((child, rest));
                }
                // an imported module, by its name
                let import = self.files.get(from)?.scope.imports.get(name)?;
                if depth > 8 || import.first().is_some_and(|first| first == name) {
                    return None;
                }
                let (mut at, remaining) = self.start(from, import, depth + 1)?;
                for segment in remaining {
                    at.push(segment.clone());
                    if !self.files.contains_key(&at) {
                        return None;
                    }
                }
                Some((at, rest))
            }
        }
    }

    /// The file that defines the item of a path, through re-exports; `None` for a module or an item of another crate.
    fn owner(&self, from: &Module, path: &[String], depth: usize) -> Option<PathBuf> {
        if depth > 16 {
            return None;
        }
        let (mut at, rest) = self.start(from, path, 0)?;
        for segment in rest {
            let mut deeper = at.clone();
            deeper.push(segment.clone());
            if self.files.contains_key(&deeper) {
                at = deeper;
                continue;
            }
            let source = self.files.get(&at)?;
            if source.scope.defines.contains(segment) {
                return Some(source.path.clone());
            }
            if let Some(import) = source.scope.imports.get(segment) {
                return self.owner(&at, import, depth + 1);
            }
            return source.scope.globs.iter().find_map(|glob| {
                let mut through = glob.clone();
                through.push(segment.clone());
                self.owner(&at, &through, depth + 1)
            });
        }
        None
    }
}

/// Collects the modules below a folder, without tests.
fn collect(folder: &Path, module: &mut Module, found: &mut Vec<(Module, PathBuf)>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .map(|entries| {
            entries
                .map(|entry| entry.expect("a folder's entry").path())
                .collect()
        })
        .unwrap_or_default();
    entries.sort();
    for path in entries {
        let stem = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .unwrap_or_default()
            .to_owned();
        if stem == "tests" {
            continue;
        }
        if path.is_dir() {
            module.push(stem);
            collect(&path, module, found);
            module.pop();
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let mut own = module.clone();
            let is_root = module.is_empty() && (stem == "lib" || stem == "main");
            if !is_root && stem != "mod" {
                own.push(stem);
            }
            found.push((own, path));
        }
    }
}

impl Scope {
    fn add_items(&mut self, items: &[Item]) {
        for item in items {
            let name = match item {
                Item::Const(item) => &item.ident,
                Item::Enum(item) => &item.ident,
                Item::Fn(item) => &item.sig.ident,
                Item::Static(item) => &item.ident,
                Item::Struct(item) => &item.ident,
                Item::Trait(item) => &item.ident,
                Item::Type(item) => &item.ident,
                Item::Union(item) => &item.ident,
                Item::Macro(item) => match &item.ident {
                    Some(name) => name,
                    None => continue,
                },
                Item::Use(item) if !is_test(&item.attrs) => {
                    flatten(&item.tree, &mut Vec::new(), self);
                    continue;
                }
                _ => continue,
            };
            self.defines.insert(name.to_string());
        }
    }
}

/// Adds the names that a `use` imports.
fn flatten(tree: &UseTree, path: &mut Vec<String>, scope: &mut Scope) {
    match tree {
        UseTree::Path(part) => {
            path.push(part.ident.to_string());
            flatten(&part.tree, path, scope);
            path.pop();
        }
        UseTree::Group(group) => {
            for tree in &group.items {
                flatten(tree, path, scope);
            }
        }
        UseTree::Glob(_) => scope.globs.push(path.clone()),
        UseTree::Name(name) => add_import(&name.ident.to_string(), None, path, scope),
        UseTree::Rename(renamed) => add_import(
            &renamed.ident.to_string(),
            Some(renamed.rename.to_string()),
            path,
            scope,
        ),
    }
}

fn add_import(name: &str, renamed: Option<String>, path: &[String], scope: &mut Scope) {
    let mut whole = path.to_vec();
    if name != "self" {
        whole.push(name.to_owned());
    }
    let as_name = renamed.or_else(|| whole.last().cloned());
    if let Some(as_name) = as_name {
        scope.imports.insert(as_name, whole);
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || (attribute.path().is_ident("cfg")
                && attribute
                    .parse_args::<syn::Path>()
                    .is_ok_and(|path| path.is_ident("test")))
    })
}

/// Every path in a file except those of its tests: imports and inline paths.
#[derive(Default)]
struct PathVisitor {
    paths: Vec<Vec<String>>,
    prefix: Vec<String>,
}

impl<'ast> Visit<'ast> for PathVisitor {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            _ => &Vec::new(),
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        // A re-export is not an import; the file that uses the name imports it.
        if matches!(item.vis, syn::Visibility::Inherited) {
            visit::visit_item_use(self, item);
        }
    }

    fn visit_use_path(&mut self, part: &'ast syn::UsePath) {
        self.prefix.push(part.ident.to_string());
        visit::visit_use_path(self, part);
        self.prefix.pop();
    }

    fn visit_use_name(&mut self, name: &'ast syn::UseName) {
        let mut path = self.prefix.clone();
        path.push(name.ident.to_string());
        self.paths.push(path);
    }

    fn visit_use_rename(&mut self, renamed: &'ast syn::UseRename) {
        let mut path = self.prefix.clone();
        path.push(renamed.ident.to_string());
        self.paths.push(path);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.push(
            path.segments
                .iter()
                .map(|segment| segment.ident.to_string())
                .collect(),
        );
        visit::visit_path(self, path);
    }
}
