//! Bundles that are container images: accepted formats, and attacks that must fail.

use crate::{
    archives::{MANIFEST, MODIFIED_S, Tar, write, zip},
    image_archives::{
        IMAGE_MANIFEST, Packing, TestImage, agent_layer, digest, empty_layout, host_folder,
        json_bytes, with_index,
    },
    unpacking::{DEFAULT_TIME_S, assert_refused, refusal, time_of, try_unpack},
};
use faceoff_runner::bundle::{Bundle, BundleError, BundleLimits, Image, open, unpack};
use flate2::{Compression, write::GzEncoder};
use serde_json::json;
use std::{
    fs,
    io::Write,
    os::unix::fs::{MetadataExt, PermissionsExt, symlink},
    path::Path,
};
use tar::EntryType;
use tempfile::TempDir;

/// Unpacks a valid image.
#[track_caller]
fn unpack_valid(bytes: &[u8]) -> (TempDir, Bundle, Image) {
    let (dir, result) = try_unpack(bytes, BundleLimits::default());
    let bundle = result.unwrap();
    let image = bundle.image.clone().unwrap();
    assert_eq!(
        bundle.dir,
        fs::canonicalize(&image.root).unwrap().join("agent")
    );
    (dir, bundle, image)
}

/// Asserts that an archive is refused with exactly this message.
#[track_caller]
fn assert_refusal_is(bytes: &[u8], expected: &str) {
    assert_eq!(refusal(bytes, BundleLimits::default()), expected);
}

/// Asserts that an image with an agent's layer and these layers is refused because of the last one.
#[track_caller]
fn assert_layer_refused(layers: impl IntoIterator<Item = Tar>, expected: &str) {
    let layers: Vec<Tar> = layers.into_iter().collect();
    let count = layers.len() + 1;
    assert_refusal_is(
        &TestImage::agent(layers).docker().bytes(),
        &format!("layer {count} of the image's {count}: {expected}"),
    );
}

/// Unpacks an image with an agent's layer and these layers.
#[track_caller]
fn unpack_layers(layers: impl IntoIterator<Item = Tar>) -> (TempDir, Image) {
    let (dir, _, image) = unpack_valid(&TestImage::agent(layers).docker().bytes());
    (dir, image)
}

impl ImageFiles for Image {
    fn path_of(&self, path: &str) -> std::path::PathBuf {
        self.root.join(path)
    }
}

/// Reading of files in an image's root.
trait ImageFiles {
    fn path_of(&self, path: &str) -> std::path::PathBuf;

    fn text(&self, path: &str) -> String {
        assert!(
            self.path_of(path).symlink_metadata().unwrap().is_file(),
            "{path}"
        );
        fs::read_to_string(self.path_of(path)).unwrap()
    }

    fn link(&self, path: &str) -> String {
        let target = fs::read_link(self.path_of(path)).unwrap();
        target.to_str().unwrap().to_owned()
    }

    fn exists(&self, path: &str) -> bool {
        self.path_of(path).symlink_metadata().is_ok()
    }

    fn mode(&self, path: &str) -> u32 {
        mode(&self.path_of(path))
    }
}

fn mode(path: &Path) -> u32 {
    path.symlink_metadata().unwrap().permissions().mode() & 0o7777
}

/// A layer with a few files, a set-user-id program and a link.
fn base() -> Tar {
    Tar::new()
        .folder("./")
        .folder("usr/bin/")
        .file("usr/bin/tool", 0o4755, b"tool")
        .symlink("bin", "usr/bin")
        .file("lib/deep/one", 0o600, b"one")
        .file("lib/deep/two", 0o644, b"two")
}

#[test]
fn image_formats_of_engines_are_accepted() {
    for packing in [Packing::Plain, Packing::Gzip, Packing::Zstd] {
        let image = || TestImage::new([base(), agent_layer()]).packed(packing);
        for tar in [TestImage::docker, TestImage::layout] {
            for bytes in [
                tar(&image()).bytes(),
                tar(&image()).gz(),
                tar(&image()).zst(),
            ] {
                let (dir, bundle, image) = unpack_valid(&bytes);
                assert_eq!(bundle.manifest.name, "boxed");
                assert_eq!(image.env["MODE"], "fast");
                assert_eq!(image.path(), "/opt/bin:/bin");
                assert_eq!(image.text("agent/agent"), "program");
                assert_eq!(image.link("bin"), "usr/bin");
                // The files of the archive have been removed.
                let left: Vec<_> = fs::read_dir(dir.path().join("out")).unwrap().collect();
                assert_eq!(left.len(), 1, "{left:?}");
            }
        }
    }
}

#[test]
fn docker_list_and_oci_layout_together_are_one_image() {
    let image = TestImage::new([base(), agent_layer()]).packed(Packing::Gzip);
    let (tar, descriptor) = image.blobs(empty_layout());
    let names: Vec<String> = image
        .packed_layers()
        .iter()
        .map(|layer| format!("blobs/{}", digest(layer).replace(':', "/")))
        .collect();
    let config = format!("blobs/{}", digest(&image.config_bytes()).replace(':', "/"));
    let docker = json!([{"Config": config, "Layers": names, "RepoTags": null}]);
    let tar = with_index(tar, &[descriptor]).file("manifest.json", 0o644, &json_bytes(&docker));
    let (_dir, _, image) = unpack_valid(&tar.gz());
    assert_eq!(image.text("lib/deep/two"), "two");
}

#[test]
fn modes_are_normalised_and_set_id_bits_dropped() {
    let (_dir, image) = unpack_layers([base()
        .entry(EntryType::Directory, "closed/", 0o2700, "", b"")
        .file("closed/secret", 0o400, b"x")]);
    assert_eq!(image.mode("usr/bin/tool"), 0o755);
    assert_eq!(image.mode("lib/deep/one"), 0o644);
    assert_eq!(image.mode("closed"), 0o755);
    assert_eq!(image.mode("closed/secret"), 0o644);
    assert_eq!(mode(&image.root), 0o755);
}

#[test]
fn files_keep_the_times_of_their_layers() {
    let (_dir, image) = unpack_layers([base()]);
    for path in ["usr/bin/tool", "lib/deep/one"] {
        assert_eq!(time_of(&image.path_of(path)), MODIFIED_S, "{path}");
    }
    // Nothing shows when the image was unpacked.
    for path in ["", "lib/deep", "tmp", "bin", "etc/hosts"] {
        assert_eq!(time_of(&image.path_of(path)), DEFAULT_TIME_S, "{path}");
    }
}

#[test]
fn sandbox_files_exist_and_sandbox_folders_are_empty() {
    let (_dir, image) = unpack_layers([Tar::new()
        .file("tmp/x", 0o644, b"x")
        .symlink("dev", "/somewhere")
        .file("proc", 0o644, b"x")
        .file("run/lock/x", 0o644, b"x")
        .symlink("var/run", "/run")
        .file("var/run/y", 0o644, b"y")
        .symlink("etc/resolv.conf", "../run/x")
        .folder("etc/passwd/")
        .file("etc/passwd/x", 0o644, b"x")
        .file("etc/hosts", 0o600, b"1.2.3.4 elsewhere\n")
        .file("etc/group", 0o644, b"root:x:0:\n")
        .file("etc/own.conf", 0o644, b"own")]);
    for folder in ["dev", "proc", "run", "sys", "tmp"] {
        let entries = fs::read_dir(image.path_of(folder)).unwrap().count();
        assert!(image.path_of(folder).symlink_metadata().unwrap().is_dir());
        assert_eq!(entries, 0, "{folder}");
    }
    assert_eq!(image.text("etc/own.conf"), "own");
    assert_eq!(image.text("etc/resolv.conf"), "");
    assert_eq!(image.text("etc/passwd"), "");
    assert_eq!(image.text("etc/group"), "");
    assert_eq!(image.text("etc/hostname"), "agent\n");
    assert!(image.text("etc/hosts").starts_with("127.0.0.1 localhost"));
    let (_dir, image) = unpack_layers([]);
    assert_eq!(
        image.text("etc/passwd"),
        "",
        "an image without /etc has one"
    );
}

/// A whiteout, the empty file `.wh.NAME` of a layer, removes NAME of the layers below. `.wh..wh..opq` removes everything of them in
/// its folder.
#[test]
fn whiteouts_hide_only_lower_layers() {
    let (_dir, image) = unpack_layers([
        base(),
        Tar::new()
            .file("lib/deep/.wh.one", 0o644, b"")
            .file("usr/bin/.wh.none", 0o644, b"")
            .file("gone/.wh.x", 0o644, b"")
            .file(".wh.bin", 0o644, b"")
            .file(".wh.tmp", 0o644, b"")
            .file("lib/.wh..wh.plnk", 0o644, b""),
    ]);
    assert!(!image.exists("lib/deep/one"));
    assert!(!image.exists("bin"));
    assert!(!image.exists("gone"));
    assert!(!image.exists("lib/.wh..wh.plnk"));
    assert_eq!(image.text("lib/deep/two"), "two");
    assert_eq!(image.text("usr/bin/tool"), "tool");
    assert!(image.exists("tmp"));
    let assert_lib_is_hidden = |layer: Tar| {
        let (_dir, image) = unpack_layers([base(), layer]);
        assert!(!image.exists("lib/deep/one"));
        assert_eq!(image.text("lib/new"), "new");
        assert_eq!(image.text("usr/bin/tool"), "tool");
    };
    // The whiteout is before or after other entries of the same layer.
    let new = || Tar::new().folder("lib/").file("lib/new", 0o644, b"new");
    assert_lib_is_hidden(
        Tar::new()
            .file(".wh.lib", 0o644, b"")
            .folder("lib/")
            .file("lib/new", 0o644, b"new"),
    );
    assert_lib_is_hidden(new().file(".wh.lib", 0o644, b""));
    assert_lib_is_hidden(new().file("lib/.wh..wh..opq", 0o644, b""));
    assert_lib_is_hidden(
        Tar::new()
            .file("lib/.wh..wh..opq", 0o644, b"")
            .file("lib/new", 0o644, b"new"),
    );
    assert_lib_is_hidden(
        Tar::new()
            .file("lib/new", 0o644, b"new")
            .file(".wh.lib", 0o644, b""),
    );
}

#[test]
fn empty_folders_exist_unless_hidden_or_replaced() {
    let (_dir, image) = unpack_layers([
        Tar::new()
            .entry(EntryType::Directory, "var/empty/", 0o700, "", b"")
            .folder("var/hidden/deep/")
            .folder("var/file/deep/")
            .folder("var/filled/deep/")
            .folder("opaque/deep/")
            .folder("tmp/deep/")
            .symlink("only/a/link", "../../var"),
        Tar::new()
            .file("var/.wh.hidden", 0o644, b"")
            .file("opaque/.wh..wh..opq", 0o644, b"")
            .file("var/file", 0o644, b"now a file")
            .file("var/filled/deep/x", 0o644, b"x")
            .folder("var/filled/more/"),
    ]);
    for folder in [
        "var",
        "var/empty",
        "var/filled/deep",
        "var/filled/more",
        "only/a",
    ] {
        assert!(
            image.path_of(folder).symlink_metadata().unwrap().is_dir(),
            "{folder}"
        );
        assert_eq!(image.mode(folder), 0o755, "{folder}");
    }
    for gone in ["var/hidden", "opaque/deep", "tmp/deep"] {
        assert!(!image.exists(gone), "{gone}");
    }
    assert_eq!(image.text("var/file"), "now a file");
    assert_eq!(image.text("var/filled/deep/x"), "x");
    assert_eq!(image.link("only/a/link"), "../../var");
}

#[test]
fn layer_folders_beyond_the_limit_are_not_created() {
    let limits = BundleLimits {
        files: 20,
        ..BundleLimits::default()
    };
    let folders = (0..21).fold(Tar::new(), |tar, index| tar.folder(&format!("d{index}/")));
    let (dir, result) = try_unpack(&TestImage::new([folders]).docker().gz(), limits);
    let Err(BundleError::Invalid(message)) = result else {
        panic!("{result:?}");
    };
    assert_eq!(
        message,
        "layer 1 of the image's 1 (COPY . /agent): the container image has more than 20 folders in all layers"
    );
    let made: Vec<_> = fs::read_dir(dir.path().join("out/root0"))
        .unwrap()
        .collect();
    assert!(made.is_empty(), "{made:?}");
}

#[test]
fn opaque_root_hides_all_lower_layers() {
    let (_dir, image) = unpack_layers([
        base(),
        Tar::new()
            .file("agent/agent.toml", 0o644, IMAGE_MANIFEST.as_bytes())
            .file(".wh..wh..opq", 0o644, b""),
    ]);
    assert!(!image.exists("usr") && !image.exists("agent/agent"));
}

#[test]
fn whiteouts_without_a_name_are_refused() {
    for name in [".wh.", "lib/.wh..", "lib/.wh..."] {
        assert_layer_refused(
            [base(), Tar::new().file(name, 0o644, b"")],
            &format!("entry {name:?} is a whiteout of no possible name"),
        );
    }
}

#[test]
fn later_layers_replace_earlier_entries() {
    let (_dir, image) = unpack_layers([
        base(),
        Tar::new()
            .file("lib", 0o644, b"a file now")
            .symlink("usr/bin/tool", "/elsewhere")
            .folder("bin/")
            .file("bin/own", 0o755, b"own"),
        Tar::new().folder("usr/bin/tool/").folder("bin/"),
        Tar::new()
            .file("usr/bin/tool/x", 0o644, b"x")
            .file("bin/own", 0o755, b"newer"),
    ]);
    assert_eq!(image.text("lib"), "a file now");
    assert_eq!(image.text("usr/bin/tool/x"), "x");
    assert_eq!(
        image.text("bin/own"),
        "newer",
        "a repeated folder is the same folder"
    );
    assert!(
        !image.exists("usr/bin/own"),
        "the link was replaced, not followed"
    );
}

#[test]
fn hard_links_keep_a_file_that_is_replaced() {
    let hard_link =
        |tar: Tar, name: &str, target: &str| tar.entry(EntryType::Link, name, 0o644, target, b"");
    let (_dir, image) = unpack_layers([
        base(),
        // Through a link of the image: to a file of a lower layer, and to a link, which is not followed.
        hard_link(hard_link(Tar::new(), "kept", "bin/tool"), "alias", "bin"),
        Tar::new().file("usr/bin/tool", 0o755, b"newer"),
        Tar::new().file("usr/bin/.wh.tool", 0o644, b""),
    ]);
    assert_eq!(image.text("kept"), "tool");
    assert_eq!(image.link("alias"), "usr/bin");
    assert!(!image.exists("usr/bin/tool"));
    // Archivers write a link to itself for a repeated file; some builders write absolute paths.
    let twice = hard_link(Tar::new(), "lib/deep/two", "./lib/deep/two");
    let (_dir, image) = unpack_layers([
        base(),
        twice,
        hard_link(Tar::new(), "same", "/lib/deep/two"),
    ]);
    assert_eq!(image.text("lib/deep/two"), "two");
    let inode = |path: &str| image.path_of(path).metadata().unwrap().ino();
    assert_eq!(inode("same"), inode("lib/deep/two"));
    for (layers, name, target, problem) in [
        (
            vec![base(), Tar::new().file("lib/deep/.wh.one", 0o644, b"")],
            "x",
            "lib/deep/one",
            "is a hard link to \"lib/deep/one\", which is no file of this layer or one below",
        ),
        (
            vec![base()],
            "x",
            "lib/deep",
            "is a hard link to \"lib/deep\", which is no file of this layer or one below",
        ),
        (
            vec![Tar::new().symlink("host", "/etc")],
            "x",
            "host/passwd",
            "is a hard link to \"host/passwd\", which is no file of this layer or one below",
        ),
        (
            vec![base()],
            "lib",
            "lib/deep/one",
            "is a hard link to what it replaces: \"lib/deep/one\"",
        ),
    ] {
        let last = hard_link(Tar::new(), name, target);
        assert_layer_refused(
            layers.into_iter().chain([last]),
            &format!("entry {name:?} {problem}"),
        );
    }
    assert_layer_refused(
        [hard_link(Tar::new(), "x", "../../secret")],
        "entry \"../../secret\" has '..' in its path",
    );
}

#[test]
fn image_links_never_lead_to_the_host() {
    let host = host_folder();
    fs::write(host.path().join("mine"), "mine").unwrap();
    let host_path = host.path().to_str().unwrap();
    let relative_path = format!("../../../../../../../../..{host_path}");
    for target in [host_path, &relative_path] {
        let (_dir, image) = unpack_layers([
            Tar::new().symlink("a", target).symlink("b", "a"),
            Tar::new()
                .file("a/mine", 0o755, b"theirs")
                .file("b/new", 0o644, b"new"),
            Tar::new()
                .file("a/.wh.mine", 0o644, b"")
                .file("b/kept", 0o644, b"kept"),
            Tar::new()
                .folder("a/folder/")
                .file("b/.wh..wh..opq", 0o644, b""),
        ]);
        // The links were resolved inside of the root, as in the sandbox.
        let inside = |name: &str| image.root.join(&host_path[1..]).join(name);
        assert!(inside("folder").is_dir());
        assert!(!inside("kept").exists() && !inside("mine").exists());
        assert_eq!(image.link("a"), target);
        let left: Vec<_> = fs::read_dir(host.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "{left:?}");
        assert_eq!(
            fs::read_to_string(host.path().join("mine")).unwrap(),
            "mine"
        );
    }
}

#[test]
fn link_cycles_and_endless_paths_are_refused() {
    assert_layer_refused(
        [Tar::new()
            .symlink("a", "b")
            .symlink("b", "a")
            .file("a/x", 0o644, b"")],
        "entry \"a/x\" goes through more than 40 links",
    );
    let deep = "d/".repeat(45);
    let far_links = (0..30).fold(Tar::new().symlink("l0", &deep), |tar, index| {
        tar.symlink(&format!("l{}", index + 1), &format!("l{index}/{deep}"))
    });
    assert_layer_refused(
        [far_links.file("l30/x", 0o644, b"")],
        "entry \"l30/x\" leads to too long a path: at most 1024 bytes",
    );
    assert_layer_refused(
        [Tar::new().file("a", 0o644, b"").file("a/b", 0o644, b"")],
        "entry \"a/b\" needs \"a\" to be a folder, but it is a file",
    );
    // A small archive with far more lookups than an honest image.
    let detour = "a/../".repeat(17);
    let links = (0..38).fold(Tar::new().folder("a/").symlink("l0", "a"), |tar, index| {
        tar.symlink(&format!("l{}", index + 1), &format!("{detour}l{index}"))
    });
    let walks = (0..20_000).fold(links, |tar, _| tar.folder("l38/x/"));
    assert_refusal_is(
        &TestImage::agent([walks]).docker().gz(),
        "layer 2 of the image's 2: the image's paths lead through too many folders and links",
    );
}

#[test]
fn names_outside_the_image_are_refused() {
    // In a layer a leading slash means the image's root, as some builders write it; in the archive it is refused.
    let slashes = Tar::new()
        .folder("/")
        .folder("//opt/")
        .file("/opt/x", 0o644, b"x");
    let (_dir, image) = unpack_layers([slashes]);
    assert_eq!(image.text("opt/x"), "x");
    let absolute = TestImage::agent([])
        .docker()
        .file("/etc/passwd", 0o644, b"x");
    assert_refusal_is(
        &absolute.bytes(),
        "entry \"/etc/passwd\" has an absolute path",
    );
    for (name, problem) in [
        ("../x", "has '..' in its path"),
        ("a/../../x", "has '..' in its path"),
        ("", "has no name"),
    ] {
        assert_layer_refused(
            [Tar::new().file(name, 0o644, b"x")],
            &format!("entry {name:?} {problem}"),
        );
        if !name.is_empty() {
            assert_refusal_is(
                &TestImage::agent([])
                    .docker()
                    .file(name, 0o644, b"x")
                    .bytes(),
                &format!("entry {name:?} {problem}"),
            );
        }
    }
}

#[test]
fn devices_are_skipped_and_overlayfs_whiteouts_refused() {
    let mut device = Tar::new();
    for (kind, name) in [
        (EntryType::Block, "disk"),
        (EntryType::Fifo, "pipe"),
        (EntryType::Char, "dev/null"),
    ] {
        device = device.entry(kind, name, 0o666, "", b"");
    }
    let (_dir, image) = unpack_layers([device]);
    assert!(!image.exists("disk") && !image.exists("pipe"));
    assert_layer_refused(
        [Tar::new().entry(EntryType::Char, "lib/gone", 0o666, "", b"")],
        "entry \"lib/gone\" is a whiteout of overlayfs (a device 0/0), which layers do not have: expected what \
         `docker save` writes",
    );
}

#[test]
fn agent_folder_and_manifest_must_not_be_links() {
    const HINT: &str = "an image contains the agent's folder as /agent, with its agent.toml (runtime = \"image\"): put \
                        `COPY . /agent` into the Dockerfile in that folder";
    let host = tempfile::tempdir().unwrap();
    fs::write(host.path().join("agent.toml"), IMAGE_MANIFEST).unwrap();
    let host_path = host.path().to_str().unwrap();
    let archive_of = |layer: Tar| TestImage::new([layer]).docker().bytes();
    assert_refusal_is(
        &archive_of(base()),
        &format!("the container image has no /agent; {HINT}"),
    );
    assert_refusal_is(
        &archive_of(Tar::new().folder("agent/")),
        &format!("the container image has no /agent/agent.toml; {HINT}"),
    );
    assert_refusal_is(
        &archive_of(Tar::new().symlink("agent", host_path)),
        &format!("the container image has something other than a folder as /agent; {HINT}"),
    );
    for layer in [
        Tar::new().symlink("agent/agent.toml", &format!("{host_path}/agent.toml")),
        Tar::new().folder("agent/agent.toml/"),
    ] {
        assert_refusal_is(
            &archive_of(layer),
            "the container image has something other than a file as /agent/agent.toml",
        );
    }
    for etc in [
        Tar::new().symlink("etc", host_path),
        Tar::new().file("etc", 0o644, b""),
    ] {
        assert_refusal_is(
            &TestImage::agent([etc]).docker().bytes(),
            "the container image has something other than a folder as /etc",
        );
    }
    assert_eq!(fs::read_dir(host.path()).unwrap().count(), 1);
}

#[test]
fn runtime_must_match_the_bundle() {
    let python_agent = Tar::new().file("agent/agent.toml", 0o644, MANIFEST.as_bytes());
    assert_refusal_is(
        &TestImage::new([python_agent]).docker().bytes(),
        "agent.toml: runtime is \"python3\", and the bundle is a container image, which brings its own: expected \
         \"image\"",
    );
    let no_image = "agent.toml: runtime is \"image\", and the bundle is no container image: build one and send what \
                    `docker save` writes, or name a runtime that the server offers";
    let tar = || Tar::new().file("agent.toml", 0o644, IMAGE_MANIFEST.as_bytes());
    assert_refusal_is(&tar().gz(), no_image);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("agent.toml"), IMAGE_MANIFEST).unwrap();
    match open(folder.path(), folder.path(), &BundleLimits::default()) {
        Err(BundleError::Invalid(message)) => assert_eq!(message, no_image),
        other => panic!("{other:?}"),
    }
    // With an agent.toml at its root, an archive is a bundle, even if it has other files of an image.
    let (_dir, result) = try_unpack(
        &Tar::with_manifest()
            .file("manifest.json", 0o644, b"{}")
            .gz(),
        BundleLimits::default(),
    );
    assert_eq!(result.unwrap().image, None);
}

#[test]
fn plain_tar_is_an_image_or_refused() {
    assert_refusal_is(
        &Tar::with_manifest().bytes(),
        "a plain .tar is accepted of a container image only: compress the bundle to .tar.gz",
    );
    assert_refused(
        &Tar::new().file("x", 0o644, b"").bytes(),
        "there is no agent.toml",
    );
    let image = zip(&[("manifest.json", 0o644, b"[]")]);
    assert_refused(&image, "there is no agent.toml");
}

#[test]
fn archive_must_hold_one_image() {
    let one = TestImage::agent([]);
    let entry = json!({"Config": "config.json", "Layers": ["layer0/layer.tar"]});
    let other = json!({"Config": "other.json", "Layers": ["layer0/layer.tar"]});
    let docker = |images: &serde_json::Value| {
        let layer = &one.packed_layers()[0];
        Tar::new()
            .file("manifest.json", 0o644, &json_bytes(images))
            .file("config.json", 0o644, &one.config_bytes())
            .file("layer0/layer.tar", 0o644, layer)
            .bytes()
    };
    unpack_valid(&docker(&json!([entry])));
    unpack_valid(&docker(&json!([entry, entry])));
    let several = |tags: &str| {
        format!(
            "the archive contains 2 container images{tags}: expected one; save the agent's alone, by its name and its tag: \
             `docker save -o ours.tar ours:latest`"
        )
    };
    assert_refusal_is(&docker(&json!([entry, other])), &several(""));
    // Docker saves all tags if none is given.
    let (mut first, mut second) = (entry.clone(), other);
    first["RepoTags"] = json!(["ours:v2", "ours:latest"]);
    second["RepoTags"] = json!(["ours:v1"]);
    assert_refusal_is(
        &docker(&json!([first, second])),
        &several(" (ours:latest, ours:v1, ours:v2)"),
    );
    assert_refused(&docker(&json!([])), "is missing: manifest.json names none");
    let (tar, first) = TestImage::agent([]).blobs(empty_layout());
    let (tar, second) = TestImage::new([base()]).blobs(tar);
    assert_refusal_is(&with_index(tar, &[first, second]).bytes(), &several(""));
    assert_refused(&docker(&json!(null)), "cannot be read: manifest.json");
    let none = empty_layout().file("index.json", 0o644, b"{\"manifests\":null}");
    assert_refused(&none.bytes(), "is missing: index.json names none");
    let entry = |number: usize| json!({"digest": digest(&number.to_le_bytes())});
    let many: Vec<_> = (0..257).map(entry).collect();
    assert_refused(
        &with_index(empty_layout(), &many).bytes(),
        "is one of more than 256 in the archive's lists",
    );
}

#[test]
fn image_of_the_hosts_platform_is_chosen() {
    let platform = |architecture: &str, os: &str| json!({"architecture": architecture, "os": os});
    let host_image = TestImage::agent([base()]);
    let host = if cfg!(target_arch = "x86_64") {
        "amd64"
    } else {
        "arm64"
    };
    let (tar, mut for_host) = host_image.blobs(empty_layout());
    for_host["platform"] = platform(host, "linux");
    let (tar, mut for_riscv) = TestImage::new([Tar::new()]).blobs(tar);
    for_riscv["platform"] = platform("riscv64", "linux");
    let attestation = json!({
        "mediaType": "application/vnd.oci.image.manifest.v1+json",
        "digest": digest(b"attestation"),
        "platform": platform("unknown", "unknown"),
        "annotations": {"vnd.docker.reference.type": "attestation-manifest"},
    });
    // An OCI layout whose index names another list, which has these images.
    let nested = |tar: Tar, images: serde_json::Value| {
        let inner = json_bytes(&json!({"schemaVersion": 2, "manifests": images}));
        let name = digest(&inner);
        let tar = tar.file(&format!("blobs/{}", name.replace(':', "/")), 0o644, &inner);
        let entry = json!({"mediaType": "application/vnd.oci.image.index.v1+json", "digest": name});
        with_index(tar, &[entry]).bytes()
    };
    let (_dir, _, image) = unpack_valid(&nested(
        tar.clone(),
        json!([for_riscv, for_host, attestation]),
    ));
    assert_eq!(image.text("usr/bin/tool"), "tool");
    let mut for_windows = for_host.clone();
    for_windows["platform"] = platform(host, "windows");
    assert_refusal_is(
        &nested(tar.clone(), json!([for_riscv, for_windows])),
        &format!(
            "the container image is for linux/riscv64, windows/{host}, and this server runs linux/{host}: build it \
             with --platform linux/{host}, and save that one"
        ),
    );
    for (key, value) in [("architecture", "riscv64"), ("os", "windows")] {
        let image = TestImage::agent([]).config(|config| config[key] = value.into());
        assert_refused(
            &image.docker().bytes(),
            &format!("and this server runs linux/{host}"),
        );
        assert_refused(&image.docker().bytes(), value);
    }
    // Docker's list has the image of the machine that saved it; the layout has all.
    let for_riscv =
        TestImage::new([Tar::new()]).config(|config| config["architecture"] = "riscv64".into());
    let (tar, mut riscv) = for_riscv.blobs(empty_layout());
    let (tar, mut for_host) = host_image.blobs(tar);
    riscv["platform"] = platform("riscv64", "linux");
    for_host["platform"] = platform(host, "linux");
    let docker_list = |image: &TestImage| {
        let blob = |bytes: &[u8]| format!("blobs/{}", digest(bytes).replace(':', "/"));
        let layers: Vec<String> = image
            .packed_layers()
            .iter()
            .map(|layer| blob(layer))
            .collect();
        json_bytes(&json!([{"Config": blob(&image.config_bytes()), "Layers": layers}]))
    };
    // Docker's list has only the image for riscv64, and the layout has these.
    let both = |images: &[serde_json::Value]| {
        let tar = with_index(tar.clone(), images);
        tar.file("manifest.json", 0o644, &docker_list(&for_riscv))
            .bytes()
    };
    let (_dir, _, image) = unpack_valid(&both(&[riscv.clone(), for_host.clone()]));
    assert_eq!(image.text("usr/bin/tool"), "tool");
    assert_refused(
        &both(&[riscv]),
        &format!("is for linux/riscv64, and this server runs linux/{host}"),
    );
    // One image needs a newer CPU, and one entry has no platform.
    let (tar, mut newer) = TestImage::new([Tar::new().folder("newer/")]).blobs(tar.clone());
    newer["platform"] = json!({"architecture": host, "os": "linux", "variant": "v3"});
    let (tar, signature) = TestImage::new([Tar::new().folder("signed/")]).blobs(tar);
    unpack_valid(&with_index(tar, &[newer, for_host, signature]).bytes());
    let without_os =
        TestImage::agent([]).config(|config| drop(config.as_object_mut().unwrap().remove("os")));
    assert_refused(
        &without_os.docker().bytes(),
        "cannot be read: config.json: missing field `os`",
    );
}

#[test]
fn invalid_documents_are_named() {
    let docker = |text: &[u8]| {
        Tar::new()
            .file("config.json", 0o644, &TestImage::agent([]).config_bytes())
            .file("manifest.json", 0o644, text)
            .bytes()
    };
    for text in [
        &b"{}"[..],
        b"",
        b"[1]",
        b"[{}]",
        b"\xff",
        b"[{\"Config\":\"a\",\"Config\":\"b\",\"Layers\":[]}]",
    ] {
        assert_refused(
            &docker(text),
            "the container image cannot be read: manifest.json: ",
        );
        assert_refused(
            &docker(text),
            "there is no agent.toml at the archive's root",
        );
    }
    assert_refused(&docker(&[b'['; 200_000]), "cannot be read: manifest.json");
    assert_refused(
        &docker(&vec![b' '; (1 << 20) + 1]),
        "has the document \"manifest.json\" of more than 1048576 bytes",
    );
    for outside in ["../secret", "/etc/passwd", "missing", "", "config.json/x"] {
        let named = json_bytes(&json!([{"Config": "config.json", "Layers": [outside]}]));
        let one = TestImage::new([Tar::new()]);
        let tar = Tar::new().file("config.json", 0o644, &one.config_bytes());
        assert_refusal_is(
            &tar.file("manifest.json", 0o644, &named).bytes(),
            &format!(
                "layer 1 of the image's 1 (COPY . /agent): the container image names {outside:?}, which is no file of \
                 the archive"
            ),
        );
    }
    let linked = |target: &str| {
        let one = TestImage::agent([]);
        Tar::new()
            .file("config.json", 0o644, &one.config_bytes())
            .file("real/layer.tar", 0o644, &one.packed_layers()[0])
            .symlink("linked/layer.tar", target)
            .file(
                "manifest.json",
                0o644,
                &json_bytes(&json!([{"Config": "config.json", "Layers": ["linked/layer.tar"]}])),
            )
            .bytes()
    };
    unpack_valid(&linked("../real/layer.tar"));
    for target in ["../../secret", "/etc/passwd", "layer.tar", "nothing"] {
        assert_refused(
            &linked(target),
            "names \"linked/layer.tar\", which is no file of the archive",
        );
    }
    let sha512 = with_index(empty_layout(), &[json!({"digest": "sha512:00"})]).bytes();
    assert_refusal_is(
        &sha512,
        "the container image names something by the digest \"sha512:00\": expected sha256: and 64 digits of 0-9a-f",
    );
    let wrong = TestImage::agent([]).config(|config| config["rootfs"]["diff_ids"] = json!([]));
    assert_refusal_is(
        &wrong.docker().bytes(),
        "the container image has 1 layers, and its configuration lists 0",
    );
    let wrong = TestImage::agent([]).config(|config| config["config"]["Env"] = json!(["a"]));
    assert_refusal_is(
        &wrong.docker().bytes(),
        "the container image sets the variable \"a\" (ENV): expected NAME=VALUE",
    );
    let without_settings = TestImage::agent([]).config(|config| config["config"] = json!(null));
    let (_dir, _, image) = unpack_valid(&without_settings.docker().bytes());
    assert!(image.env.is_empty() && image.path().ends_with("/bin"));
}

#[test]
fn nested_lists_are_bounded() {
    let mut tar = empty_layout();
    let mut entry = json!({"digest": digest(b"nothing")});
    for _ in 0..70 {
        let inner = json_bytes(&json!({"manifests": [entry]}));
        entry = json!({"mediaType": "application/vnd.oci.image.index.v1+json", "digest": digest(&inner)});
        tar = tar.file(
            &format!("blobs/{}", digest(&inner).replace(':', "/")),
            0o644,
            &inner,
        );
    }
    assert_refusal_is(
        &with_index(tar, &[entry]).bytes(),
        "the container image is described by more than 64 documents",
    );
}

#[test]
fn content_that_differs_from_its_digest_is_refused() {
    let image = TestImage::agent([base()]);
    let wrong_digest = digest(b"else");
    let other =
        image.config(|config| config["rootfs"]["diff_ids"][1] = wrong_digest.clone().into());
    assert_refused(
        &other.docker().bytes(),
        "layer 2 of the image's 2: its uncompressed content differs from the image's digest: expected SHA-256",
    );
    // A blob of a layout whose content differs from its name.
    let image = TestImage::agent([]).packed(Packing::Gzip);
    let real = image.packed_layers().remove(0);
    let (tar, descriptor) = image.blobs(empty_layout());
    let mut bytes = with_index(tar, &[descriptor]).bytes();
    let start = bytes
        .windows(real.len())
        .position(|window| window == real)
        .unwrap();
    bytes[start + real.len() - 1] ^= 1;
    assert_refused(
        &bytes,
        &format!(
            "blobs/{} differs from the image's digest",
            digest(&real).replace(':', "/")
        ),
    );
}

#[test]
fn padding_of_a_layer_is_part_of_its_digest() {
    let image = TestImage::agent([]);
    let layer = image.packed_layers().remove(0);
    let mut bytes = image.layout().bytes();
    let start = bytes
        .windows(layer.len())
        .position(|window| window == layer)
        .unwrap();
    bytes[start + layer.len() - 1] = 1;
    assert_refused(
        &bytes,
        "layer 1 of the image's 1 (COPY . /agent): its uncompressed content differs from the image's digest: ",
    );
}

#[test]
fn repeated_layer_counts_each_time() {
    // An empty layer that takes long to read.
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&Tar::new().bytes()).unwrap();
    let mut layer = encoder.finish().unwrap();
    // Successive empty streams, which a reader treats as one.
    let empty = GzEncoder::new(Vec::new(), Compression::fast());
    let empty = empty.finish().unwrap();
    layer.extend(empty.repeat(20_000 / empty.len()));
    let repetitions = 50;
    let one = TestImage::new((0..repetitions).map(|_| Tar::new()));
    let archive = |names: Vec<&str>| {
        let named = json!([{"Config": "config.json", "Layers": names}]);
        Tar::new()
            .file("config.json", 0o644, &one.config_bytes())
            .file("layer", 0o644, &layer)
            .file("manifest.json", 0o644, &json_bytes(&named))
            .gz()
    };
    let limits = BundleLimits {
        unpacked_bytes: 200_000,
        ..BundleLimits::default()
    };
    assert_eq!(
        refusal(&archive(vec!["layer"; repetitions]), limits),
        "layer 10 of the image's 50: the image's layers have more than 200000 bytes, counting a layer each time that it \
         is named"
    );
}

#[test]
fn layer_may_be_repeated_or_empty() {
    let image = TestImage::agent([base(), Tar::new(), base(), Tar::new()]);
    let (_dir, _, image) = unpack_valid(&image.layout().bytes());
    assert_eq!(image.text("usr/bin/tool"), "tool");
    // Named twice in Docker's list, the layer is a single file.
    let one = TestImage::new([agent_layer(), agent_layer()]);
    let twice = Tar::new()
        .file("config.json", 0o644, &one.config_bytes())
        .file("layer.tar", 0o644, &one.packed_layers()[0])
        .file(
            "manifest.json",
            0o644,
            &json_bytes(&json!([{"Config": "config.json", "Layers": ["layer.tar", "layer.tar"]}])),
        );
    unpack_valid(&twice.bytes());
}

/// Docker before version 25 saves equal layers as one file and links to it.
#[test]
fn equal_layers_may_be_links() {
    for order in [[0, 0, 1], [0, 1, 0], [1, 0, 0]] {
        let layers = order.map(|kind| [Tar::new, base][kind]());
        let image = TestImage::agent(layers);
        let packed = image.packed_layers();
        let names = ["0/layer.tar", "1/layer.tar", "2/layer.tar", "3/layer.tar"];
        let tar = Tar::new().file("config.json", 0o644, &image.config_bytes());
        let tar = (0..4).fold(tar, |tar, index| {
            match (0..index).find(|&earlier| packed[earlier] == packed[index]) {
                Some(earlier) => tar.symlink(names[index], &format!("../{}", names[earlier])),
                None => tar.file(names[index], 0o644, &packed[index]),
            }
        });
        let named = json!([{"Config": "config.json", "RepoTags": null, "Layers": names}]);
        let (_dir, _, image) = unpack_valid(
            &tar.file("manifest.json", 0o644, &json_bytes(&named))
                .bytes(),
        );
        assert_eq!(image.text("usr/bin/tool"), "tool");
    }
}

/// An image's `/tmp` is emptied, and its named pipes are skipped. A second name of a removed file keeps the content; that of a pipe
/// is skipped, too.
#[test]
fn hard_links_to_removed_files_are_kept() {
    let hard_link =
        |tar: Tar, name: &str, target: &str| tar.entry(EntryType::Link, name, 0o644, target, b"");
    let layer = Tar::new().file("tmp/cache/a", 0o644, b"wheel").entry(
        EntryType::Fifo,
        "opt/pipe",
        0o644,
        "",
        b"",
    );
    let (_dir, image) = unpack_layers([hard_link(
        hard_link(layer, "usr/b", "tmp/cache/a"),
        "opt/another",
        "opt/pipe",
    )]);
    assert_eq!(image.text("usr/b"), "wheel");
    assert!(!image.exists("tmp/cache") && !image.exists("opt/another"));
}

#[test]
fn root_folder_avoids_names_of_the_archive() {
    // Names of all lengths up to the longest that a file can have.
    let mut tar = TestImage::agent([base()]).docker();
    for length in 4..=255 {
        let name = format!("root{}", "_".repeat(length - 4));
        let long = tar.entry(EntryType::GNULongName, "n", 0o644, "", name.as_bytes());
        tar = long.file("short", 0o644, b"");
    }
    for number in 0..20 {
        tar = tar.file(&format!("root{number}"), 0o644, b"");
    }
    let (_dir, _, image) = unpack_valid(&tar.gz());
    assert!(image.root.ends_with("root20"), "{}", image.root.display());
}

#[test]
fn image_may_be_packed_with_its_folder() {
    for tar in [TestImage::docker, TestImage::layout] {
        let image = tar(&TestImage::agent([base()])).bytes();
        let mut archive = tar::Archive::new(&image[..]);
        let around = archive
            .entries()
            .unwrap()
            .fold(Tar::new().folder("ours/"), |tar, entry| {
                let mut entry = entry.unwrap();
                let name = format!("ours/{}", entry.path().unwrap().display());
                let mut content = Vec::new();
                std::io::Read::read_to_end(&mut entry, &mut content).unwrap();
                let name_first = tar.entry(EntryType::GNULongName, "n", 0o644, "", name.as_bytes());
                name_first.file("short", 0o644, &content)
            });
        let (dir, _, image) = unpack_valid(&around.gz());
        assert_eq!(image.text("usr/bin/tool"), "tool");
        assert_eq!(
            fs::read_dir(dir.path().join("out/ours")).unwrap().count(),
            1
        );
    }
}

#[test]
fn empty_archive_folders_are_removed() {
    let tar = TestImage::agent([base()]).docker();
    // Folders of the archive, not of the image.
    let bytes = tar.folder("empty/deep/").folder("layer0/empty/").gz();
    let (dir, _, image) = unpack_valid(&bytes);
    assert_eq!(image.text("usr/bin/tool"), "tool");
    let unpacked = fs::read_dir(dir.path().join("out")).unwrap();
    let names: Vec<_> = unpacked.map(|entry| entry.unwrap().file_name()).collect();
    let root = image.root.file_name().unwrap();
    assert_eq!(names, [root], "only the root of the image remains");
}

#[test]
fn refusal_hints_at_the_probable_mistake() {
    let exported = "This looks like the file system of a container (`docker export`): send its image, as `docker save` \
                    writes it";
    let system = || Tar::new().folder("etc/").folder("usr/");
    assert_refused(&system().gz(), exported);
    assert_refused(&system().file("usr/su", 0o4755, b"").gz(), exported);
    let device = Tar::new().file(".dockerenv", 0o755, b"");
    assert_refused(
        &device
            .entry(EntryType::Char, "dev/x", 0o644, "", b"")
            .bytes(),
        exported,
    );
    let image = TestImage::agent([]).docker().bytes();
    assert_refused(
        &zip(&[("ours.tar", 0o644, &image)]),
        "There is only \"ours.tar\", itself an archive: if it is a container image, send that",
    );
    assert_refused(b"\xff\xfem\0a\0n\0", "docker save -o ours.tar ours:latest");
    for (packed, how) in [(&b"\xfd7zXZ\0..."[..], "xz"), (b"BZh91AY&SY", "bzip2")] {
        let image = TestImage::agent([]);
        let named = json!([{"Config": "config.json", "Layers": ["layer"]}]);
        let tar = Tar::new()
            .file("config.json", 0o644, &image.config_bytes())
            .file("layer", 0o644, packed)
            .file("manifest.json", 0o644, &json_bytes(&named));
        assert_refused(
            &tar.bytes(),
            &format!(
                "it is compressed by {how}: expected a tar, plain or compressed by gzip or zstd"
            ),
        );
    }
    // The index lists an image whose blobs are not in the archive.
    let (tar, _) = TestImage::agent([]).blobs(empty_layout());
    let absent_image = TestImage::new([Tar::new().folder("absent/")]);
    let (_, absent) = absent_image.blobs(empty_layout());
    assert_refused(
        &with_index(tar, &[absent]).bytes(),
        "which is no file of the archive: pull or build the image again, and save it again",
    );
}

#[test]
fn limits_hold_over_all_layers() {
    let many = TestImage::agent((0..127).map(|_| Tar::new()));
    assert_refusal_is(
        &many.docker().bytes(),
        "the container image has 128 layers; at most 127 are allowed: build it with fewer steps",
    );
    let limits = BundleLimits {
        packed_bytes: 1 << 20,
        unpacked_bytes: 100_000,
        files: 20,
        ..BundleLimits::default()
    };
    let archive = |layers: Vec<Tar>| TestImage::agent(layers).packed(Packing::Gzip).docker().gz();
    // A file that is repeated in several layers is written each time, and counts each time.
    let big = || Tar::new().file("big", 0o644, &[0; 40_000]);
    assert!(try_unpack(&archive(vec![big(), big()]), limits).1.is_ok());
    let too_much = |layer: usize, count: usize, entry: &str| {
        format!(
            "layer {layer} of the image's {count}: the image's layers contain more than 100000 bytes (stopped at entry \
             {entry:?}): start from a smaller image, and install and clean up in one step"
        )
    };
    assert_eq!(
        refusal(&archive(vec![big(), big(), big()]), limits),
        too_much(4, 4, "big")
    );
    // A bomb in a layer is stopped at the limit.
    let bomb = Tar::new().file("bomb", 0o644, &vec![0; 30 << 20]);
    let bomb = TestImage::agent([bomb]).packed(Packing::Zstd).docker();
    assert_eq!(refusal(&bomb.gz(), limits), too_much(2, 2, "bomb"));
    // The limit holds in any folder, even if the file is left out.
    for name in [
        "tmp/bomb",
        "dev/bomb",
        "proc/bomb",
        "run/bomb",
        "sys/bomb",
        "lib/.wh.bomb",
        ".wh..wh..opq",
        "lib/.wh..wh.bomb",
        ".",
        "/",
    ] {
        let bomb = Tar::new().file(name, 0o644, &vec![0; 30 << 20]);
        let bomb = TestImage::agent([base(), bomb]).packed(Packing::Zstd);
        let message = refusal(&bomb.docker().gz(), limits);
        let expected = match name {
            "/" => "more bytes than its files explain".to_owned(),
            _ => too_much(3, 3, name),
        };
        assert!(message.contains(&expected), "{name}: {message}");
    }
    let padded = Tar::new().entry(EntryType::Directory, "x", 0o755, "", &vec![0; 30 << 20]);
    let padded = TestImage::agent([padded]).packed(Packing::Zstd).docker();
    let message = refusal(&padded.gz(), limits);
    assert!(
        message.contains("more bytes than its files explain"),
        "{message}"
    );
    let files = |count: usize, of_layer: usize| {
        (0..count).fold(Tar::new(), |tar, index| {
            tar.file(&format!("f{of_layer}-{index}"), 0o644, b"")
        })
    };
    assert_eq!(
        refusal(&archive(vec![files(10, 1), files(10, 2)]), limits),
        "layer 3 of the image's 3: the container image has more than 20 files in all layers"
    );
    let folders = (0..21).fold(Tar::new(), |tar, index| tar.folder(&format!("d{index}/")));
    assert_eq!(
        refusal(&archive(vec![folders]), limits),
        "layer 2 of the image's 2: the container image has more than 20 folders in all layers"
    );
    let again = (0..100).fold(Tar::new(), |tar, _| tar.folder("d/"));
    assert_eq!(
        refusal(&archive(vec![again]), limits),
        "layer 2 of the image's 2: the archive has more than 80 entries of all kinds"
    );
}

#[test]
fn cancelled_image_stops() {
    let dir = tempfile::tempdir().unwrap();
    let archive = write(
        dir.path(),
        "upload",
        &TestImage::agent([base()]).docker().gz(),
    );
    // Cancels at each call of the cancellation check, until there are no more.
    for checks_before in 0..400 {
        let into = dir.path().join(format!("out{checks_before}"));
        let checks = std::cell::Cell::new(0);
        let cancelled = || {
            checks.set(checks.get() + 1);
            checks.get() > checks_before
        };
        match unpack(&archive, &into, &BundleLimits::default(), &cancelled) {
            Err(BundleError::Cancelled) => {}
            Ok(_) => return assert!(checks_before > 20, "only {checks_before} checks"),
            other => panic!("{other:?}"),
        }
    }
    panic!("more than 400 checks");
}

#[test]
fn target_folder_may_be_behind_a_link() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("real")).unwrap();
    symlink("real", dir.path().join("way")).unwrap();
    let archive = write(dir.path(), "upload", &TestImage::agent([]).docker().gz());
    let into = dir.path().join("way/out");
    let bundle = unpack(&archive, &into, &BundleLimits::default(), &|| false).unwrap();
    assert!(
        bundle
            .dir
            .starts_with(fs::canonicalize(dir.path()).unwrap().join("real"))
    );
}
