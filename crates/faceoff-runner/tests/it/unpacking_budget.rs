//! Malicious archives that are small and take long to read, unless the cost of reading is counted.

use crate::{
    archives::{MANIFEST, Tar},
    unpacking::{assert_refused, try_unpack, unpack_unless},
};
use faceoff_runner::bundle::{BundleError, BundleLimits};
use flate2::{Compression, Crc, write::GzEncoder};
use std::{
    cell::Cell,
    io::{Cursor, Write},
};
use tar::EntryType;
use zip::{ZipWriter, write::FullFileOptions};

const MIB: usize = 1 << 20;
/// Part of the refusal of archives with too much overhead.
const OVERHEAD_REFUSAL: &str = "more bytes than its files explain";

/// The result of unpacking an archive.
fn verdict(bytes: &[u8]) -> Result<(), BundleError> {
    try_unpack(bytes, BundleLimits::default()).1.map(drop)
}

/// A comment of about a MiB in the format of an extension header.
fn pax_comment() -> Vec<u8> {
    let length = MIB - 8;
    let mut record = format!("{length} comment=").into_bytes();
    record.resize(length - 1, b'x');
    record.push(b'\n');
    record
}

/// An archive that repeats this entry.
fn repeated(kind: EntryType, content: &[u8], times: usize) -> Tar {
    (0..times).fold(Tar::with_manifest(), |tar, _| {
        tar.entry(kind, "repeated", 0o644, "agent.toml", content)
    })
}

#[test]
fn headers_without_entries_are_counted() {
    let comment = pax_comment();
    for kind in [EntryType::XHeader, EntryType::XGlobalHeader] {
        let bomb = repeated(kind, &comment, 20).gz();
        assert!(bomb.len() < MIB, "{} bytes", bomb.len());
        assert_refused(&bomb, OVERHEAD_REFUSAL);
    }
    for kind in [EntryType::GNULongName, EntryType::GNULongLink] {
        assert_refused(&repeated(kind, &vec![b'n'; MIB], 20).gz(), OVERHEAD_REFUSAL);
        assert_refused(
            &repeated(kind, &vec![b'n'; MIB], 20).zst(),
            OVERHEAD_REFUSAL,
        );
    }
}

#[test]
fn skipped_content_is_counted() {
    // The tar library skips this content by reading it.
    for kind in [EntryType::Directory, EntryType::Symlink] {
        assert_refused(
            &repeated(kind, &vec![0; 30 * MIB], 1).gz(),
            OVERHEAD_REFUSAL,
        );
    }
    // Sparse files are refused by their header, before their content is read.
    let sparse = repeated(EntryType::GNUSparse, &[0; 512], 1).gz();
    assert_refused(&sparse, "sparse");
    let sparse = Tar::with_manifest()
        .entry(
            EntryType::XHeader,
            "x",
            0o644,
            "",
            b"22 GNU.sparse.major=1\n",
        )
        .file("x", 0o644, b"");
    assert_refused(&sparse.gz(), "sparse");
    // GNU tar gives the content another name, and the real one in the extension.
    let named = Tar::with_manifest()
        .entry(
            EntryType::XHeader,
            "x",
            0o644,
            "",
            b"22 GNU.sparse.major=1\n31 GNU.sparse.name=weights.bin\n",
        )
        .file("GNUSparseFile.7/weights.bin", 0o644, b"");
    assert_refused(&named.gz(), "entry \"weights.bin\" is a sparse file");
}

#[test]
fn entries_without_effect_are_counted() {
    // Entries for the archive's root are not refused as duplicates.
    let roots = (0..200_001).fold(Tar::with_manifest(), |tar, _| tar.folder("./"));
    assert_refused(&roots.gz(), "more than 200000 entries");
}

#[test]
fn empty_streams_are_counted() {
    let empty_gzip = GzEncoder::new(Vec::new(), Compression::fast())
        .finish()
        .unwrap();
    let empty_zstd = zstd::encode_all(&b""[..], 1).unwrap();
    let tar = || Tar::with_manifest().file("agent.py", 0o644, b"print()");
    for (empty, whole) in [(empty_gzip, tar().gz()), (empty_zstd, tar().zst())] {
        let mut bomb = empty.repeat(200_001);
        bomb.extend_from_slice(&whole);
        assert_refused(&bomb, "more than 200000 compressed streams");
        let mut accepted = empty.repeat(100);
        accepted.extend_from_slice(&whole);
        verdict(&accepted).unwrap();
    }
}

#[test]
fn empty_blocks_are_counted() {
    // A gzip stream: its header, empty stored blocks, the last block, checksum and length.
    let stream = |blocks: usize| {
        let mut stream = b"\x1f\x8b\x08\0\0\0\0\0\0\xff".to_vec();
        stream.extend(b"\0\0\0\xff\xff".repeat(blocks));
        stream.extend_from_slice(b"\x01\0\0\xff\xff\0\0\0\0\0\0\0\0");
        stream
    };
    let whole = || {
        Tar::with_manifest()
            .file("agent.py", 0o644, b"print()")
            .gz()
    };
    let archive_with_empty_blocks = |blocks: usize| [stream(blocks), whole()].concat();
    verdict(&archive_with_empty_blocks(1 << 20)).unwrap();
    assert_refused(
        &archive_with_empty_blocks(4 << 20),
        "larger than its content",
    );
    // Incompressible content is accepted, and so is the padding of a tape block.
    let mut state = 1_u32;
    let random_bytes: Vec<u8> = (0..20 * MIB)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        })
        .collect();
    let random_tar = || Tar::with_manifest().file("noise", 0o644, &random_bytes);
    verdict(&random_tar().gz()).unwrap();
    verdict(&random_tar().zst()).unwrap();
    verdict(&[whole(), vec![0; 10_240]].concat()).unwrap();
    // A skippable frame of Zstandard.
    let skipped = b"\x50\x2a\x4d\x18\x04\0\0\0size".to_vec();
    let tar = Tar::with_manifest().file("agent.py", 0o644, b"print()");
    verdict(&[skipped, tar.zst()].concat()).unwrap();
}

#[test]
fn multi_stream_archive_with_padding_is_accepted() {
    let whole = Tar::with_manifest()
        .file("weights", 0o644, &vec![7; MIB])
        .bytes();
    let gzip = |piece: &[u8]| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(piece).unwrap();
        encoder.finish().unwrap()
    };
    let pieces: Vec<u8> = whole.chunks(10_000).flat_map(gzip).collect();
    verdict(&pieces).unwrap();
    let pieces: Vec<u8> = whole
        .chunks(10_000)
        .flat_map(|piece| zstd::encode_all(piece, 1).unwrap())
        .collect();
    verdict(&pieces).unwrap();
    let mut padded = whole;
    padded.resize(100 * MIB, 0);
    verdict(&gzip(&padded)).unwrap();
}

#[test]
fn many_files_with_extension_headers_are_accepted() {
    let described = (0..3000).fold(Tar::with_manifest(), |tar, i| {
        let name = format!("{}/{i}", "long".repeat(40));
        let record = format!(" path={name}\n");
        let length = record.len() + 3;
        let record = format!("{length}{record}");
        assert_eq!(record.len(), length);
        tar.entry(EntryType::XHeader, "x", 0o644, "", record.as_bytes())
            .file("short", 0o644, &[7; 700])
    });
    verdict(&described.gz()).unwrap();
}

#[test]
fn cancellation_stops_unpacking_at_any_point() {
    let large = || Tar::with_manifest().file("large", 0o644, &vec![7; 3 * MIB]);
    let headers = repeated(EntryType::XHeader, &pax_comment(), 10).gz();
    let shared = shared_zip(50, MIB);
    for bytes in [large().gz(), large().zst(), headers, shared] {
        for checks_before in [0, 3, 20] {
            let checks = Cell::new(0);
            let cancelled = || {
                checks.set(checks.get() + 1);
                checks.get() > checks_before
            };
            let result = unpack_unless(&bytes, &BundleLimits::default(), &cancelled).1;
            assert!(matches!(result, Err(BundleError::Cancelled)), "{result:?}");
            let message = "unpacking continues after the cancellation";
            assert_eq!(checks.get(), checks_before + 1, "{message}");
        }
    }
}

/// A zip whose files share their bytes. Each file's data is a literal copy of the next file's header, followed by that
/// file's data. The last file has `tail` bytes that decompress to nothing. Reading any file reads the tail again.
fn shared_zip(files: usize, tail: usize) -> Vec<u8> {
    // A block of uncompressed data in a deflate stream; `last` ends the stream.
    let stored_block = |last: bool, bytes: &[u8]| {
        let length = u16::try_from(bytes.len()).unwrap();
        let mut block = vec![u8::from(last)];
        block.extend_from_slice(&length.to_le_bytes());
        block.extend_from_slice(&(!length).to_le_bytes());
        block.extend_from_slice(bytes);
        block
    };
    let name = |file: usize| {
        if file == 0 {
            "agent.toml".to_owned()
        } else {
            format!("f{file:08}")
        }
    };
    // Version, flags, method, time, date, CRC, sizes, lengths: as in both kinds of header.
    let fields = |file: usize, crc: u32, packed: usize, unpacked: usize| {
        let mut fields = vec![20, 0, 0, 0, 8, 0, 0, 0, 0x21, 0];
        fields.extend_from_slice(&crc.to_le_bytes());
        fields.extend_from_slice(&u32::try_from(packed).unwrap().to_le_bytes());
        fields.extend_from_slice(&u32::try_from(unpacked).unwrap().to_le_bytes());
        fields.extend_from_slice(&u16::try_from(name(file).len()).unwrap().to_le_bytes());
        fields.extend_from_slice(&[0, 0]);
        fields
    };
    // From the last file to the first; `data` is the compressed data of a file.
    let mut data = stored_block(false, b"").repeat(tail / 5);
    data.extend_from_slice(&stored_block(true, b""));
    let mut contents: Vec<u8> = Vec::new();
    let mut directory = Vec::new();
    // By file: the fields of its header, and the distance of the header from the end of all files.
    let mut headers = Vec::new();
    for file in (0..files).rev() {
        let mut crc = Crc::new();
        crc.update(&contents);
        let fields = fields(file, crc.sum(), data.len(), contents.len());
        let mut header = b"PK\x03\x04".to_vec();
        header.extend_from_slice(&fields);
        header.extend_from_slice(name(file).as_bytes());
        headers.push((file, fields, header.len() + data.len()));
        if file == 0 {
            header.extend_from_slice(&data);
            data = header;
        } else {
            let mut literal = stored_block(false, &header);
            literal.extend_from_slice(&data);
            data = literal;
            header.extend_from_slice(&contents);
            contents = header;
        }
    }
    for (file, fields, from_end) in headers.iter().rev() {
        directory.extend_from_slice(b"PK\x01\x02\x14\x03");
        directory.extend_from_slice(fields);
        // Comment and disk, attributes, offset.
        directory.extend_from_slice(&[0; 6]);
        directory.extend_from_slice(&(0o100_644_u32 << 16).to_le_bytes());
        let offset = u32::try_from(data.len() - from_end).unwrap();
        directory.extend_from_slice(&offset.to_le_bytes());
        directory.extend_from_slice(name(*file).as_bytes());
    }
    let mut zip = data;
    let offset = u32::try_from(zip.len()).unwrap();
    let (files, length) = (
        u16::try_from(files).unwrap(),
        u32::try_from(directory.len()).unwrap(),
    );
    zip.extend_from_slice(&directory);
    zip.extend_from_slice(b"PK\x05\x06\0\0\0\0");
    zip.extend_from_slice(&files.to_le_bytes());
    zip.extend_from_slice(&files.to_le_bytes());
    zip.extend_from_slice(&length.to_le_bytes());
    zip.extend_from_slice(&offset.to_le_bytes());
    zip.extend_from_slice(&[0, 0]);
    zip
}

#[test]
fn zip_with_shared_bytes_is_refused() {
    // With three files the archive is valid, except for its manifest.
    assert_refused(&shared_zip(3, 1000), "agent.toml: ");
    let bomb = shared_zip(200, MIB);
    assert!(bomb.len() < MIB + MIB / 8, "{} bytes", bomb.len());
    assert_refused(&bomb, OVERHEAD_REFUSAL);
}

#[test]
fn zip_with_a_large_directory_is_accepted() {
    let comment = "c".repeat(60_000);
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for index in 0..400 {
        let name = match index {
            0 => "agent.toml".to_owned(),
            _ => format!("f{index}"),
        };
        let options = FullFileOptions::default().with_file_comment(comment.as_str());
        zip.start_file(name, options).unwrap();
        if index == 0 {
            zip.write_all(MANIFEST.as_bytes()).unwrap();
        }
    }
    verdict(&zip.finish().unwrap().into_inner()).unwrap();
}

#[test]
fn link_chains_are_counted() {
    let target = "a/".repeat(500);
    let links = |count: usize| {
        (0..count).fold(Tar::with_manifest(), |tar, link| {
            tar.entry(EntryType::GNULongLink, "l", 0o644, "", target.as_bytes())
                .symlink(&format!("l{link}"), "")
        })
    };
    verdict(&links(20).gz()).unwrap();
    assert_refused(&links(1000).gz(), "lead through too many others");
}
