//! Imports between the files of a crate, found in their source text. Paths are resolved as the compiler does it, through
//! re-exports and `*`, but without macros.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};
use syn::{
    Attribute, Item, UseTree,
    visit::{self, Visit},
};

/// Imported modules that are followed for the start of one path; more are a loop.
const MAX_IMPORTED_MODULES: usize = 8;
/// Re-exports that are followed for one item; more are a loop.
const MAX_RE_EXPORTS: usize = 16;

/// A module's path from the crate's root.
type Module = Vec<String>;

/// One file of a crate.
struct SourceFile {
    path: PathBuf,
    syntax: syn::File,
    scope: Scope,
}

/// The names that a file defines or imports.
#[derive(Default)]
struct Scope {
    /// Names of the items that the file defines.
    definitions: BTreeSet<String>,
    /// Names that it imports or re-exports, with the path as written.
    imports: BTreeMap<String, Vec<String>>,
    /// Modules imported with `*`.
    globs: Vec<Vec<String>>,
}

/// The files of a crate, by module.
pub struct Crate {
    files: BTreeMap<Module, SourceFile>,
}

impl Crate {
    /// Reads every file except tests, from the crate whose root is in `folder`.
    pub fn read(folder: &Path) -> Self {
        let mut modules = Vec::new();
        collect_modules(folder, &mut Vec::new(), &mut modules);
        let files = modules
            .into_iter()
            .map(|(module, path)| {
                let text = fs::read_to_string(&path).expect("a source file can be read");
                let syntax = syn::parse_file(&text)
                    .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
                let mut scope = Scope::default();
                scope.add_items(&syntax.items);
                let source = SourceFile {
                    path,
                    syntax,
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
                let mut visitor = PathVisitor::default();
                visitor.visit_file(&source.syntax);
                let mut targets = BTreeMap::new();
                for path in visitor.paths {
                    if let Some(file) = self.defining_file(module, &path, 0)
                        && file != source.path
                    {
                        targets.entry(file).or_insert_with(|| path.join("::"));
                    }
                }
                for path in &source.scope.globs {
                    if let Some(target) = self.resolve_module(module, path)
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

    /// The module that a path in the module `from` means.
    fn resolve_module(&self, from: &Module, path: &[String]) -> Option<Module> {
        let (start, rest) = self.resolve_start(from, path, 0)?;
        self.submodule(start, rest)
    }

    /// The module below `module` with this relative path, if the crate has it.
    fn submodule(&self, mut module: Module, path: &[String]) -> Option<Module> {
        for segment in path {
            module.push(segment.clone());
            if !self.files.contains_key(&module) {
                return None;
            }
        }
        Some(module)
    }

    /// The module that the first segment of a path in the module `from` means, and the rest of the path. `depth` counts the
    /// imported modules on the way.
    fn resolve_start<'a>(
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
                let mut parent = from.clone();
                parent.pop()?;
                let mut rest = rest;
                while let Some((next, after)) = rest.split_first()
                    && next == "super"
                {
                    parent.pop()?;
                    rest = after;
                }
                Some((parent, rest))
            }
            name => {
                let mut child = from.clone();
                child.push(name.to_owned());
                if self.files.contains_key(&child) {
                    return Some((child, rest));
                }
                // The first segment may be the name of an imported module.
                let import = self.files.get(from)?.scope.imports.get(name)?;
                if depth > MAX_IMPORTED_MODULES || import.first().is_some_and(|first| first == name)
                {
                    return None;
                }
                let (start, import_rest) = self.resolve_start(from, import, depth + 1)?;
                Some((self.submodule(start, import_rest)?, rest))
            }
        }
    }

    /// The file that defines the item of a path in the module `from`; `None` for a module or an item of another crate. `depth`
    /// counts the re-exports on the way.
    fn defining_file(&self, from: &Module, path: &[String], depth: usize) -> Option<PathBuf> {
        if depth > MAX_RE_EXPORTS {
            return None;
        }
        let (mut module, rest) = self.resolve_start(from, path, 0)?;
        for segment in rest {
            let mut child = module.clone();
            child.push(segment.clone());
            if self.files.contains_key(&child) {
                module = child;
                continue;
            }
            let source = self.files.get(&module)?;
            if source.scope.definitions.contains(segment) {
                return Some(source.path.clone());
            }
            if let Some(import) = source.scope.imports.get(segment) {
                return self.defining_file(&module, import, depth + 1);
            }
            return source.scope.globs.iter().find_map(|glob| {
                let mut path = glob.clone();
                path.push(segment.clone());
                self.defining_file(&module, &path, depth + 1)
            });
        }
        None
    }
}

/// Adds the modules in `folder`, which belongs to the module `parent`, with their files; tests are left out.
fn collect_modules(folder: &Path, parent: &mut Module, modules: &mut Vec<(Module, PathBuf)>) {
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
            parent.push(stem);
            collect_modules(&path, parent, modules);
            parent.pop();
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let mut module = parent.clone();
            let is_root = parent.is_empty() && (stem == "lib" || stem == "main");
            if !is_root && stem != "mod" {
                module.push(stem);
            }
            modules.push((module, path));
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
                    add_use_tree(&item.tree, &mut Vec::new(), self);
                    continue;
                }
                _ => continue,
            };
            self.definitions.insert(name.to_string());
        }
    }
}

/// Adds the names that a `use` imports, or a part of its braces; `path` is the path before the part.
fn add_use_tree(tree: &UseTree, path: &mut Vec<String>, scope: &mut Scope) {
    match tree {
        UseTree::Path(part) => {
            path.push(part.ident.to_string());
            add_use_tree(&part.tree, path, scope);
            path.pop();
        }
        UseTree::Group(group) => {
            for tree in &group.items {
                add_use_tree(tree, path, scope);
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

/// Adds the import of `name` in `path`, under the name `alias` if there is one.
fn add_import(name: &str, alias: Option<String>, path: &[String], scope: &mut Scope) {
    let mut full_path = path.to_vec();
    if name != "self" {
        full_path.push(name.to_owned());
    }
    let local_name = alias.or_else(|| full_path.last().cloned());
    if let Some(local_name) = local_name {
        scope.imports.insert(local_name, full_path);
    }
}

/// Whether an item has `#[test]` or `#[cfg(test)]`.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || (attribute.path().is_ident("cfg")
                && attribute
                    .parse_args::<syn::Path>()
                    .is_ok_and(|path| path.is_ident("test")))
    })
}

/// Whether an item is a test, or a module or import of tests.
pub fn is_test_item(item: &Item) -> bool {
    match item {
        Item::Mod(item) => is_test(&item.attrs),
        Item::Fn(item) => is_test(&item.attrs),
        Item::Use(item) => is_test(&item.attrs),
        Item::Impl(item) => is_test(&item.attrs),
        _ => false,
    }
}

/// Collects the paths in a file, except those of its tests: imports and inline paths.
#[derive(Default)]
struct PathVisitor {
    paths: Vec<Vec<String>>,
    /// The path before the present part of a `use`.
    prefix: Vec<String>,
}

impl<'ast> Visit<'ast> for PathVisitor {
    fn visit_item(&mut self, item: &'ast Item) {
        if !is_test_item(item) {
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
