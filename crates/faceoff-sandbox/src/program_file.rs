//! The first bytes of the bundle's program: what kind of program it is, and what else its start needs.

use faceoff_types::escape_unprintable;
use rustix::{
    fs::{FileType, Mode, OFlags, ResolveFlags, fstat, open, openat2},
    io::Errno,
};
use std::{fs::File, io, os::unix::fs::FileExt, path::Path};

/// Bytes that are read. The kernel reads 256 of a script, and the header of an ELF file is at its beginning.
const HEAD_BYTES: usize = 4096;
/// Longest path of an interpreter or loader that is quoted, in characters.
const MAX_QUOTED_CHARS: usize = 200;

/// The processor of this host in the header of an ELF file.
#[cfg(target_arch = "x86_64")]
const HOST_MACHINE: u16 = 62;
#[cfg(target_arch = "aarch64")]
const HOST_MACHINE: u16 = 183;

/// A program of the bundle.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum ProgramFile {
    /// It cannot run on this host; the text says why, as a predicate: "is a program for Windows; build it for Linux".
    Unusable(String),
    /// It may start. The text, a sentence, names the interpreter or loader that it needs, if any, and what to do if that is missing.
    MayStart(Option<String>),
}

impl ProgramFile {
    /// Reads the program at a path in the bundle. Never resolves outside of the bundle. `None` if it cannot be read.
    pub(crate) fn read(bundle_dir: &Path, path: &str) -> Option<Self> {
        let head = read_head(bundle_dir, path).ok()?;
        Some(Self::from_head(&head))
    }

    fn from_head(head: &[u8]) -> Self {
        let unusable = |text: &str| Self::Unusable(text.to_owned());
        match head {
            [b'#', b'!', line @ ..] => script(line),
            [0x7f, b'E', b'L', b'F', ..] => elf(head),
            [b'M', b'Z', b'q', b'F', b'p', b'D', ..] => unusable(
                "is an Actually Portable Executable (Cosmopolitan), which Linux only starts through a shell; convert it for Linux with `assimilate`",
            ),
            [b'M', b'Z', ..] => unusable("is a program for Windows; build it for Linux"),
            [0xcf, 0xfa, 0xed, 0xfe, ..] | [0xca, 0xfe, 0xba, 0xbe, ..] => {
                unusable("is a program for macOS (or a Java class); build it for Linux")
            }
            [0xef, 0xbb, 0xbf, b'#', b'!', ..] => unusable(
                "begins with a byte order mark, so its line `#!` is not recognised; save it as UTF-8 without a byte order mark",
            ),
            _ => Self::MayStart(None),
        }
    }
}

fn quoted(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text);
    let head: String = text.chars().take(MAX_QUOTED_CHARS).collect();
    escape_unprintable(&head).into_owned()
}

/// A script; `line` is its first line without `#!`, and what follows.
fn script(line: &[u8]) -> ProgramFile {
    let line = line.split(|byte| *byte == b'\n').next().unwrap_or(line);
    if line.ends_with(b"\r") {
        return ProgramFile::Unusable(
            "has line ends of Windows, so its interpreter is not found; save it with line ends of Unix (LF)"
                .to_owned(),
        );
    }
    let mut words = line
        .split(|byte| matches!(byte, b' ' | b'\t'))
        .filter(|word| !word.is_empty());
    ProgramFile::MayStart(words.next().map(|interpreter| {
        let interpreter = quoted(interpreter);
        format!(
            "it is a script for {interpreter}, which must exist where the agent runs; name an interpreter of the runtime in `command`, such \
             as [\"python3\", \"agent.py\"]"
        )
    }))
}

/// A little-endian number of `N` bytes at an offset.
fn number<const N: usize>(bytes: &[u8], offset: usize) -> Option<u64> {
    let field: [u8; N] = bytes.get(offset..)?.get(..N)?.try_into().ok()?;
    let mut wide = [0; 8];
    wide[..N].copy_from_slice(&field);
    Some(u64::from_le_bytes(wide))
}

/// An ELF file (man 5 elf).
fn elf(head: &[u8]) -> ProgramFile {
    let is_64_bit_little_endian = head.get(4) == Some(&2) && head.get(5) == Some(&1);
    let machine = number::<2>(head, 18).unwrap_or(0);
    if !is_64_bit_little_endian || machine != u64::from(HOST_MACHINE) {
        let built_for = match machine {
            3 => "32-bit x86".to_owned(),
            40 => "32-bit ARM".to_owned(),
            62 => "x86-64".to_owned(),
            183 => "64-bit ARM (aarch64)".to_owned(),
            243 => "RISC-V".to_owned(),
            other => format!("another processor (ELF machine {other})"),
        };
        return ProgramFile::Unusable(format!(
            "is built for {built_for}, and this host is {}; build it for that",
            std::env::consts::ARCH
        ));
    }
    ProgramFile::MayStart(loader(head).map(|loader| {
        let loader = quoted(loader);
        let library = if loader.contains("musl") {
            "musl, another C library than the runtime's"
        } else {
            "the C library of the system where it was built"
        };
        format!(
            "it is linked with {library}, and needs its loader {loader} where the agent runs; link it statically, or build it on Debian"
        )
    }))
}

/// The path of the loader that an ELF file names (`PT_INTERP`); `None` if it is linked statically.
fn loader(head: &[u8]) -> Option<&[u8]> {
    const PT_INTERP: u64 = 3;
    let table = usize::try_from(number::<8>(head, 32)?).ok()?;
    let entry_bytes = usize::try_from(number::<2>(head, 54)?).ok()?;
    let entries = usize::try_from(number::<2>(head, 56)?).ok()?;
    for index in 0..entries {
        let entry = table.checked_add(index.checked_mul(entry_bytes)?)?;
        if number::<4>(head, entry)? == PT_INTERP {
            let start = usize::try_from(number::<8>(head, entry.checked_add(8)?)?).ok()?;
            let length = usize::try_from(number::<8>(head, entry.checked_add(32)?)?).ok()?;
            let path = head.get(start..)?.get(..length)?;
            return path.split(|byte| *byte == 0).next();
        }
    }
    None
}

fn read_head(bundle_dir: &Path, path: &str) -> io::Result<Vec<u8>> {
    let folder = open(
        bundle_dir,
        OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC,
        Mode::empty(),
    )?;
    // A pipe would block.
    let file = openat2(
        folder,
        path,
        OFlags::RDONLY | OFlags::NONBLOCK | OFlags::CLOEXEC,
        Mode::empty(),
        ResolveFlags::BENEATH | ResolveFlags::NO_MAGICLINKS,
    )?;
    if FileType::from_raw_mode(fstat(&file)?.st_mode) != FileType::RegularFile {
        return Err(Errno::INVAL.into());
    }
    let file = File::from(file);
    let mut head = vec![0; HEAD_BYTES];
    let read = file.read_at(&mut head, 0)?;
    head.truncate(read);
    Ok(head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn expect_unusable(head: &[u8], words: &str) {
        match ProgramFile::from_head(head) {
            ProgramFile::Unusable(text) => assert!(text.contains(words), "{text}"),
            other => panic!("{head:?}: {other:?}"),
        }
    }

    fn expect_needs(head: &[u8], words: &str) {
        match ProgramFile::from_head(head) {
            ProgramFile::MayStart(Some(text)) => assert!(text.contains(words), "{text}"),
            other => panic!("{head:?}: {other:?}"),
        }
    }

    /// The head of an ELF file for a processor, with a loader.
    fn elf_file(machine: u16, loader: &[u8]) -> Vec<u8> {
        let mut head = vec![0; 120];
        head[..6].copy_from_slice(b"\x7fELF\x02\x01");
        head[18..20].copy_from_slice(&machine.to_le_bytes());
        head[32..40].copy_from_slice(&64_u64.to_le_bytes());
        head[54..56].copy_from_slice(&56_u16.to_le_bytes());
        head[56..58].copy_from_slice(&1_u16.to_le_bytes());
        head[64..68].copy_from_slice(&3_u32.to_le_bytes());
        head[72..80].copy_from_slice(&120_u64.to_le_bytes());
        head[96..104].copy_from_slice(&(loader.len() as u64).to_le_bytes());
        head.extend_from_slice(loader);
        head
    }

    #[test]
    fn programs_of_other_systems_are_recognised() {
        expect_unusable(b"MZ\x90\0", "Windows");
        expect_unusable(b"MZqFpD='\n", "assimilate");
        expect_unusable(b"\xcf\xfa\xed\xfe\x07", "macOS");
        expect_unusable(b"#!/usr/bin/env python3\r\nimport os\r\n", "line ends");
        expect_unusable(b"\xef\xbb\xbf#!/bin/sh\n", "byte order mark");
        let other_machine = if HOST_MACHINE == 62 { 183 } else { 62 };
        expect_unusable(&elf_file(other_machine, b"/lib/ld.so\0"), "is built for");
        expect_unusable(b"\x7fELF\x01\x01", "is built for");
    }

    #[test]
    fn interpreter_or_loader_is_named() {
        expect_needs(b"#! /opt/conda/bin/python -u\n", "/opt/conda/bin/python,");
        expect_needs(b"#!/bin/sh", "/bin/sh");
        expect_needs(
            &elf_file(HOST_MACHINE, b"/lib/ld-musl-x86_64.so.1\0"),
            "musl, another",
        );
        expect_needs(
            &elf_file(HOST_MACHINE, b"/nix/store/ld.so\0"),
            "/nix/store/ld.so",
        );
        let mut without_loader = elf_file(HOST_MACHINE, b"");
        without_loader[56] = 0;
        for head in [&without_loader as &[u8], b"", b"#!", b"#!\n", b"hello"] {
            assert_eq!(ProgramFile::from_head(head), ProgramFile::MayStart(None));
        }
    }

    #[test]
    fn any_bytes_are_read_without_panic() {
        let file = elf_file(HOST_MACHINE, b"/lib/ld.so\0");
        for length in 0..file.len() {
            let _ = ProgramFile::from_head(&file[..length]);
            for value in [0x7f, 0xff] {
                let mut changed = file.clone();
                changed[length] = value;
                let _ = ProgramFile::from_head(&changed);
            }
        }
    }

    #[test]
    fn program_outside_of_the_bundle_is_not_read() {
        let host = tempfile::tempdir().unwrap();
        let bundle = host.path().join("bundle");
        fs::create_dir(&bundle).unwrap();
        fs::write(host.path().join("secret"), "#!/secret\n").unwrap();
        fs::write(bundle.join("agent"), "#!/bin/agent\n").unwrap();
        std::os::unix::fs::symlink("../secret", bundle.join("link")).unwrap();
        std::os::unix::fs::symlink("agent", bundle.join("inner")).unwrap();
        for path in ["../secret", "link", ".", "missing"] {
            assert_eq!(ProgramFile::read(&bundle, path), None, "{path}");
        }
        for path in ["agent", "inner"] {
            let read = ProgramFile::read(&bundle, path);
            assert!(
                matches!(read, Some(ProgramFile::MayStart(Some(_)))),
                "{path}"
            );
        }
    }
}
